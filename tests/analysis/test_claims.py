"""Relations, claims and margins: by hand, with errors that are known, and on the paper's cases."""

import math

import numpy as np
import pytest
import xarray as xr

from compressor.analysis import CLEARANCES, claims, margins
from compressor.analysis.claims import RULES, Claim
from compressor.analysis.margins import BarredNumber, Margin
from compressor.analysis.runs import FAULT_LABELS
from compressor.cases.case import Case
from compressor.metrics import JOINTS
from compressor.solve.simulate import simulate


def judged(runs, number):
    margins, rows = RULES[number - 1].judge(runs)
    return Claim(number, "", "", rows, "", margins)


def test_claims_without_runs_are_not_judged():
    for claim, rule in zip(claims({}), RULES, strict=True):
        assert claim.held is None
        assert claim.measured == [("missing", ", ".join(rule.needs))]


def altered(runs, label, name, change):
    old = runs[label][name]
    return {**runs, label: runs[label].assign({name: old.copy(data=change(old.values))})}


@pytest.mark.parametrize(
    ("number", "label", "name", "change"),
    [
        (1, "typical", "acceleration", lambda a: a * (1 + 1e-9)),
        (2, "design", "piston_force", lambda f: 0.9 * f),
        (3, "both 0.3", "displacement", lambda x: 0.6 + 1.02 * (x - 0.6)),
        (6, "small_end 0.1", "acceleration", lambda a: a[::-1] ** 2),
    ],
)
def test_a_claim_that_holds_can_fail(paper_runs, number, label, name, change):
    assert judged(paper_runs, number).held
    assert not judged(altered(paper_runs, label, name, change), number).held


def with_metric(runs, name, value):
    """The fault runs with a scalar metric that depends on (fault, clearance)."""
    for label in FAULT_LABELS:
        fault, clearance = label.split()
        of = value(fault, float(clearance))
        runs = altered(runs, label, name, lambda v, of=of: np.full_like(v, of))
    return runs


def test_growing_peaks_hold_exactly_when_all_grow(paper_runs):
    """By a tenth from clearance to clearance, of which a hundredth is asked for."""
    growing = paper_runs
    for name in ("peak_acceleration", "peak_contact_force"):
        growing = with_metric(growing, name, lambda _, c: 100 * 1.1 ** (10 * c))
    assert judged(growing, 4).held
    assert 1.0 + judged(growing, 4).margin.value == pytest.approx(1.1 / 1.01)
    stalled = altered(growing, "both 0.3", "peak_acceleration", lambda v: 0 * v + 100)
    assert not judged(stalled, 4).held


def test_horizontal_force_needs_a_ratio_of_three(paper_runs):
    """By forces of a known ratio, whose size changes over the samples, up for half of them."""
    for ratio, held in ((3.1, True), (2.9, False)):
        runs = paper_runs
        for label in FAULT_LABELS:
            force = np.ones(runs[label]["contact_force"].shape)
            force[..., 0] *= ratio
            force *= np.linspace(-1.0, 2.0, len(force))[:, None, None]
            runs = altered(runs, label, "contact_force", lambda _, f=force: f)
        claim = judged(runs, 5)
        assert claim.held is held
        assert claim.margin.value == pytest.approx(ratio / 3.0 - 1.0)


def test_two_clearances_must_exceed_both_single_ones(paper_runs):
    worse = {"big_end": 1.0, "small_end": 2.0, "both": 3.0}
    runs = paper_runs
    for name in ("peak_acceleration", "rms_acceleration_deviation"):
        runs = with_metric(runs, name, lambda f, _: worse[f])
    assert judged(runs, 8).held
    assert not judged(altered(runs, "both 0.2", "peak_acceleration", lambda v: 0 * v + 2), 8).held


# ---- margins: by hand, with errors that are known


def test_margins_by_hand():
    assert margins.at_least(BarredNumber(3.3, 0.3), 3.0) == pytest.approx((0.1, 0.1))
    assert margins.at_least(BarredNumber(2.4, 0.3), 3.0) == pytest.approx((-0.2, 0.1))
    assert margins.at_most(BarredNumber(0.02, 0.01), 0.05) == pytest.approx((0.6, 0.2))
    assert margins.above(BarredNumber(2.0), 2.0).value < 0.0
    assert margins.at_least(BarredNumber(2.0), 2.0).value == 0.0
    big, small = (BarredNumber(0.2, 0.02), BarredNumber(0.1, 0.01))  # whose errors add
    assert margins.exceeds(big, small, 0.05) == pytest.approx((0.05, 0.03))
    assert margins.exceeds(small, big, 0.05) == pytest.approx((-0.15, 0.03))
    assert big.over(small) == pytest.approx((2.0, 2.0 * (0.1 + 0.1)))  # and of a ratio relative
    assert big.over(BarredNumber(0.0)).value == math.inf


def test_the_least_margin_reaches_as_low_as_any_may_be():
    assert margins.least([Margin(0.1, 0.01), Margin(0.3, 0.05)]) == pytest.approx((0.1, 0.01))
    assert margins.least([Margin(0.1, 0.01), Margin(0.3, 0.5)]) == pytest.approx((0.1, 0.3))
    unknown = margins.least([Margin(0.1, 0.01), Margin(0.3, math.nan)])
    assert unknown.value == 0.1
    assert math.isnan(unknown.error)


def test_a_chaotic_peak_is_its_mean_over_revolutions():
    """With Student's t of twelve revolutions, 2.201, for the standard error."""
    run = xr.Dataset(
        {"peak_acceleration": 130.0, "peak_acceleration_mean": 120.0, "revolutions": 12.0,
         "peak_acceleration_mean_standard_error": 2.0, "peak_acceleration_error": np.inf},
        attrs={"regime": "chaotic"},
    )  # fmt: skip
    assert margins.peak(run, "peak_acceleration") == pytest.approx((120.0, 4.402), rel=1e-3)
    run.attrs["regime"] = "periodic"
    assert margins.peak(run, "peak_acceleration") == (130.0, math.inf)


def test_the_scatter_of_revolutions_is_a_chaotic_value_s_error():
    """Of 1, 2 and 6 over twelve revolutions: mean 3, standard deviation 2.256."""
    angle = np.linspace(0.0, 26.0 * np.pi, 1301)
    level = np.repeat([50.0, *([1.0, 2.0, 6.0] * 4)], 100)
    run = xr.Dataset(
        {"a": ("time", np.append(level, 6.0)), "crank_angle": ("time", angle)},
        {"time": angle / (2.0 * np.pi)}, attrs={"settle": 1.0, "regime": "chaotic"},
    )  # fmt: skip

    def middle(part):
        return float(part["a"].median())

    assert len([*margins.revolutions(run)]) == 12
    found = margins.measure(run, middle, 0.1)
    assert found == pytest.approx((2.0, 2.201 * 2.256 / math.sqrt(12)), rel=1e-3)
    run.attrs["regime"] = "periodic"
    assert margins.measure(run, middle, 0.1) == (2.0, 0.1)


def test_error_bars_are_carried_through(paper_runs):
    """Claim 4's error is that of the two peaks beside its smallest ratio, or of a larger one."""
    known = paper_runs
    for label in FAULT_LABELS:
        for name in ("peak_acceleration", "peak_contact_force"):
            bar = 0.01 * np.abs(known[label][name].values)
            known = altered(known, label, f"{name}_error", lambda _, bar=bar: bar)
    margin = judged(known, 4).margin
    assert margin.error >= 0.0199 * (1.0 + margin.value)
    unknown = with_metric(known, "peak_acceleration_error", lambda *_: math.nan)
    assert math.isnan(judged(unknown, 4).margin.error)


def test_runs_without_bars_have_margins_without_error(paper_runs):
    runs = paper_runs
    for name in ("velocity", "acceleration", "contact_force", "contact_loss_fraction"):
        runs = with_metric(runs, f"{name}_error", lambda *_: math.nan)
    for number in (3, 5, 6, 7):
        claim = judged(runs, number)
        assert math.isnan(claim.margin.error), number
        assert claim.held in (True, False)


# ---- how continuously joints hit


def test_flight_and_impacts_of_a_machine_that_rattles():
    """More than the time without contact, and the claim's margin."""
    loose = {"joint": "both", "clearance_mm": 0.3, "machine": {"speed_rpm": 1200}}
    loose |= {"contact": {"damping_N_s_per_mm": 1}}
    solve = {"accuracy": "draft", "error_bars": False}
    run = simulate(Case.from_values({**loose, "solve": solve}))
    found = [margins.share_apart(run, joint) for joint in JOINTS]
    for share, lost in zip(found, run["contact_loss_fraction"].values, strict=True):
        assert lost < share.value < 0.5
    runs = dict.fromkeys((f"{joint} {c:g}" for joint in JOINTS for c in CLEARANCES), run)
    assert claims(runs)[6].margin.value == pytest.approx(found[0].value - found[1].value - 0.05)


def test_a_share_s_error_is_that_of_time_without_contact(paper_runs):
    """And of impacts, where there are any."""
    run = paper_runs["small_end 0.2"].copy(deep=True)
    run["contact_loss_fraction_error"].loc[{"joint": "small_end"}] = 0.01
    assert margins.share_apart(run, "small_end") == (0.0, 0.01)


def test_a_chaotic_share_has_the_scatter_of_its_revolutions(paper_runs):
    """Of one, two and three quarters of a revolution in flight, and impacts after them."""
    run = paper_runs["big_end 0.2"].copy(deep=True)
    turn = np.floor(run["crank_angle"].values / (2.0 * np.pi) + 1e-9)
    flies = (np.degrees(run["crank_angle"].values) % 360) < 90.0 * turn
    run["penetration"].loc[{"joint": "big_end"}] = np.where(flies, -1e-4, 1e-4)
    run["contact_force"].loc[{"joint": "big_end"}] = np.where(flies, 0.0, 1.0)[:, None]
    run.attrs["regime"] = "chaotic"
    found = margins.share_apart(run, "big_end")
    assert 0.5 < found.value < 0.75
    assert found.error == np.inf  # by three revolutions
