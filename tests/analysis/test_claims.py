"""Relations and claims: on data whose answer is known, and on the paper's cases as data."""

import numpy as np
import pytest

from compressor.analysis.claims import RULES, claim_margins, claims
from compressor.analysis.margins import Shares, least
from compressor.analysis.runs import (
    CLEARANCES,
    FAULT_LABELS,
    force_relation,
    ideal_motion,
    settled_part,
)


@pytest.fixture
def run(paper_runs):
    """A copy of one run whose series may be changed."""
    return paper_runs["big_end 0.2"].copy(deep=True)


def judged(runs, number):
    return claims(runs)[number - 1]


def test_settled_leaves_out_the_first_revolution(run):
    kept = settled_part(run)
    assert kept["time"].values[0] == pytest.approx(0.12)
    assert kept.sizes["time"] == 3601


def test_force_relation_of_a_line(run):
    force = 3.5 * run["acceleration"].values + 7
    run["contact_force"].loc[{"joint": "big_end", "axis": "x"}] = force
    relation = force_relation(run, "big_end")
    assert (relation.slope, relation.intercept, relation.r2) == pytest.approx((3.5, 7, 1))


def test_ideal_motion_is_the_ideal_machine_s(paper_runs):
    _, _, a = ideal_motion(paper_runs["design"])
    assert a == pytest.approx(paper_runs["design"]["acceleration"].values, abs=1e-9)


def test_claims_without_runs_are_not_judged():
    for claim, rule in zip(claims({}), RULES, strict=True):
        assert claim.held is None
        assert claim.measured == [("missing", ", ".join(rule.needs))]


def altered(runs, label, name, change):
    """The runs with one variable of one run changed."""
    other = runs[label].copy(deep=True)
    other[name] = other[name].copy(data=change(other[name].values))
    return {**runs, label: other}


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
    changed = dict(runs)
    for label in FAULT_LABELS:
        fault, clearance = label.split()
        changed = altered(
            changed,
            label,
            name,
            lambda v, f=fault, c=clearance: np.full_like(v, value(f, float(c))),
        )
    return changed


def test_growing_peaks_hold_exactly_when_all_grow(paper_runs):
    def grows(_, c):
        return 1000 * c

    growing = with_metric(with_metric(paper_runs, "peak_acceleration", grows),
                          "peak_contact_force", grows)  # fmt: skip
    assert judged(growing, 4).held
    stalled = altered(growing, "both 0.3", "peak_acceleration", lambda v: 0 * v + 200)
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
    even = altered(runs, "both 0.2", "peak_acceleration", lambda v: 0 * v + 2)
    assert not judged(even, 8).held


def test_continuous_ringing_at_the_big_end_alone_is_seen(paper_runs):
    """Forces that ring all around at the big end and a tenth of the turn at the small end."""
    runs = dict(paper_runs)
    for clearance in CLEARANCES:
        for joint, share in (("big_end", 1.0), ("small_end", 0.1)):
            run = runs[f"{joint} {clearance:g}"].copy(deep=True)
            angle = np.degrees(run["crank_angle"].values) % 360
            ringing = 1000 * np.cos(np.radians(60 * angle)) * (angle < 360 * share)
            run["contact_force"].loc[{"joint": joint, "axis": "x"}] = ringing
            _, _, ideal = ideal_motion(run)
            run["acceleration"] = run["acceleration"].copy(data=ideal + ringing)
            runs[f"{joint} {clearance:g}"] = run
    before, after = (
        {name: least(claims(one)[6].margins[n :: len(Shares._fields)])
         for n, name in enumerate(Shares._fields)}
        for one in (paper_runs, runs)
    )  # fmt: skip
    assert before["energy_angle"].value < 0.0 < 0.4 < after["energy_angle"].value
    # flight and impacts come from eccentricities, which are as before
    assert claim_margins(runs)[6].value == before["apart"].value == after["apart"].value


def test_margins_of_claims_are_those_of_the_page(paper_runs):
    each = claim_margins(paper_runs)
    for number, (margin, claim) in enumerate(zip(each, claims(paper_runs), strict=True), 1):
        assert margin == pytest.approx(claim.margin)
        assert claim.number == number
        assert claim.held is (margin.value >= 0.0)
        assert margin.error >= 0.0
        assert claim.measured
