"""Error bars: what they cover, what they say when they cannot, and accuracy as it is asked for."""

import numpy as np
import pytest
from conftest import keep
from random_cases import random_cases

from compressor.cases.case import Case
from compressor.cases.load import CaseFileError, load_studies
from compressor.cases.parameter import ACCURACY, first_tolerance
from compressor.metrics import METRICS, NUMBERS, SERIES, Bar, Metric
from compressor.solve import error_bars
from compressor.solve import run as run_module
from compressor.solve.error_bars import (
    FLOOR,
    LOOSER,
    TEN,
    TIGHTER_DISTANCE_FACTOR,
    bars,
    closeness,
    ratio_of,
    series_errors,
)
from compressor.solve.si_record import record
from compressor.solve.simulate import measure, simulate
from compressor.solve.solution import solve
from compressor.store.reader import open_study, read_store
from compressor.store.studies import read_studies, write_study

SHORT = {"duration_rev": 1, "settle_rev": 0.5}
BOTH = {"joint": "both", "clearance_mm": 0.2}
EIGHT = random_cases(8)
ERRORS = [f"{name}_error" for name in (*METRICS, *SERIES)]
APART = {name: np.zeros(2) if "joint" in dims else 0.0 for name, (dims, _, _) in SERIES.items()}


def run(values, **solve):
    """A run's numbers, at rtol 2e-5 unless it is given."""
    given = {**SHORT, "rtol": 2e-5, **solve}
    return measure(Case.from_values({**values, "solve": given})).numbers


def exact(values):
    return run(values, rtol=1e-11, error_bars=False)


def within(found, truth, stretch=1.0):
    """Whether each number of each metric lies within its bar of the truth, times `stretch`."""
    return np.concatenate([
        np.ravel(np.abs(found[name] - truth[name]) <= stretch * found[f"{name}_error"])
        for name in METRICS
    ])  # fmt: skip


# ---- from two runs to bars


def test_a_share_of_a_looser_run_s_difference_counts():
    assert closeness(0.5) == 1.0
    assert closeness(TEN) == LOOSER
    assert closeness(1000.0) < closeness(100.0) < LOOSER
    for share in (0.3, 0.1, 0.02):
        assert closeness(ratio_of(share)) == pytest.approx(share)


@pytest.mark.parametrize("ratio", [0.5, 10.0, 300.0])
def test_a_bar_is_made_of_its_own_difference_and_the_series_distance(ratio):
    metrics = {"peak_acceleration": 100.0, "max_penetration": np.array([2e-6, 0.0])}
    others = {"peak_acceleration": 101.0, "max_penetration": np.array([2.5e-6, 0.0])}
    apart = APART | {"acceleration": 0.03, "penetration": np.array([0.2, 0.0])}
    found = bars(metrics, others, ratio, apart, 0.0)
    peak, depth = METRICS["peak_acceleration"].bar, METRICS["max_penetration"].bar
    expected = closeness(ratio) * np.hypot(peak.own * 1.0, peak.path * 0.03 * 100.0)
    assert found["peak_acceleration"] == pytest.approx(expected)
    expected = closeness(ratio) * np.hypot(depth.own * 0.5e-6, depth.path * 0.2 * 2e-6)
    assert found["max_penetration"].tolist() == pytest.approx([expected, 0.0])


def test_runs_that_agree_by_chance_have_bars_by_their_series():
    metrics = {name: np.ones([2] * len(row.dims)) for name, row in METRICS.items()}
    apart = APART | {"acceleration": 0.1, "contact_force": np.array([0.1, 0.0])}
    found = bars(metrics, metrics, 0.5, apart, 0.0)
    for name in ("peak_acceleration", "rms_acceleration"):
        assert found[name] == pytest.approx(METRICS[name].bar.path * 0.1)
    axis = METRICS["peak_contact_force_axis"].bar.path * 0.1
    np.testing.assert_allclose(found["peak_contact_force_axis"], [[axis] * 2, [0, 0]], atol=1e-12)


@pytest.mark.parametrize(("apart", "known"), [(0.33, True), (0.34, False)])
def test_of_a_series_that_may_be_all_wrong_no_metric_is_known(apart, known):
    metrics = {"max_penetration": np.ones(2), "impact_count": np.ones(2)}
    distances = APART | {"penetration": np.array([0.0, apart])}
    found = bars(metrics, metrics, 0.5, distances, 0.0)
    assert np.isfinite(found["max_penetration"]).tolist() == [True, known]
    assert np.isfinite(found["impact_count"]).all()  # a count has no unit: a bar of its own


def test_where_the_acceleration_is_all_wrong_no_metric_with_a_unit_is_known():
    metrics = {"peak_contact_force": np.ones(2), "impact_count": np.ones(2)}
    found = bars(metrics, metrics, 0.5, APART | {"acceleration": 0.34}, 0.0)
    assert np.isinf(found["peak_contact_force"]).all()
    assert np.isfinite(found["impact_count"]).all()


def test_a_peak_is_known_no_closer_than_it_is_found():
    """Between the nodes of a step; the parabola's error does not fall with the tolerance."""
    metrics = {"peak_acceleration": 100.0, "rms_acceleration": 100.0}
    found = bars(metrics, metrics, 0.5, APART | {"acceleration": 0.0}, 0.0)
    assert found["peak_acceleration"] == pytest.approx(
        100.0 * METRICS["peak_acceleration"].bar.least
    )
    assert 1e-9 < found["peak_acceleration"] / 100.0 < 1e-8
    assert found["rms_acceleration"] < 1e-10


def test_the_energy_residual_is_a_floor():
    metrics = {"rms_acceleration": 100.0, "impact_count": np.array([3.0, 0.0])}
    found = bars(metrics, metrics, 0.5, APART, 1e-3)
    assert found["rms_acceleration"] == pytest.approx(FLOOR * 1e-3 * 100.0)
    assert found["impact_count"].tolist() == [0.0, 0.0]


def test_an_error_of_each_series_follows_from_its_distance():
    apart = APART | {"acceleration": 1e-3, "contact_force": np.array([2e-3, 4e-3])}
    tighter, looser = (series_errors(ratio, apart) for ratio in (0.5, 10.0))
    assert tighter["acceleration"] == pytest.approx(TIGHTER_DISTANCE_FACTOR * 1e-3)
    assert tighter["contact_force"].tolist() == pytest.approx(
        [TIGHTER_DISTANCE_FACTOR * 2e-3, TIGHTER_DISTANCE_FACTOR * 4e-3]
    )
    assert looser["acceleration"] == pytest.approx(TIGHTER_DISTANCE_FACTOR * LOOSER * 1e-3)


def test_without_another_run_nothing_is_known():
    case = Case.from_values({**BOTH, "solve": SHORT})
    found = run_module.run_at_tolerance(case, 1e-5, 60.0, False)
    error_bars.estimate_errors(found)
    assert found.bars.keys() == found.metrics.keys()
    assert all(np.isinf(bar).all() for bar in found.bars.values())
    for name, value in found.series_errors.items():
        assert np.shape(value) == np.shape(APART[name])
        assert np.isinf(value).all()


# ---- of whole runs


def test_metrics_are_bit_equal_with_and_without_bars():
    how = {"duration_rev": 0.5, "settle_rev": 0.2}
    plain, barred = (run(BOTH, error_bars=bars, **how) for bars in (False, True))
    for name in METRICS:
        np.testing.assert_array_equal(plain[name], barred[name])
    for name in ERRORS:
        assert np.isnan(plain[name]).all()
        assert np.isfinite(barred[name]).all()
    assert barred["peak_acceleration_error"] > 0
    assert barred["acceleration_error"] > 0


@pytest.fixture(scope="module")
def eight():
    """Runs of eight random cases, and the exact ones."""
    return [(run(values), exact(values)) for values in EIGHT]


def test_bars_cover_most_true_errors(eight):
    covered = np.concatenate([within(*pair) for pair in eight])
    assert covered.mean() >= 0.9
    # and no more than needed: they do not cover when they are ten times shorter
    assert np.concatenate([within(*pair, stretch=0.1) for pair in eight]).mean() < 0.7


@pytest.mark.parametrize("values", EIGHT[:4])
def test_errors_of_series_bound_the_true_ones(values):
    found, truth = (
        simulate(Case.from_values({**values, "solve": {**SHORT, **solve}}))
        for solve in ({"rtol": 2e-6}, {"rtol": 1e-11, "error_bars": False})
    )
    settled, long = found["time"].values >= found.attrs["settle"], []
    for name, (dims, _, _) in SERIES.items():
        one, sure = found[name].values[settled], truth[name].values[settled]
        axes = (0, 2) if "axis" in dims else (0,)
        size = np.sqrt((sure**2).sum(axes))
        error = np.sqrt(((one - sure) ** 2).sum(axes)) / np.where(size > 0, size, 1.0)
        told = found[f"{name}_error"].values
        assert (error <= 1.5 * told).all(), name  # a bar holds in 97 of 100
        long.append(np.mean(told > 20 * error + 1e-12))
    assert np.mean(long) <= 0.25  # an error is small by luck, too


@pytest.mark.parametrize(
    ("rtol", "other"), [(1e-3, 1e-4), (1e-5, 4e-6), (1e-8, 4e-9), (1e-12, 1e-11)]
)
def test_the_run_that_errors_are_estimated_by(rtol, other):
    """A tighter one; by the stiff method where explicit steps may mislead; looser at the end."""
    given = {"duration_rev": 0.25, "settle_rev": 0, "rtol": rtol}
    case = Case.from_values({**BOTH, "solve": given})
    found = run_module.run_at_tolerance(case, rtol, 60.0, False)
    assert error_bars.comparison_run(case, found, 60.0).rtol == pytest.approx(other)


LOOSE = {
    "joint": "both", "clearance_mm": {"big_end": 0.023235, "small_end": 0.00067005},
    "machine": {"speed_rpm": 10636, "rod_mass_kg": 0.021709, "reciprocating_mass_kg": 0.11307,
                "pin_radius_mm": 11.146},
    "contact": {"stiffness_N_per_mm15": 527880, "exponent": 1.4911, "damping_N_s_per_mm": 59.029},
    "friction": {"static": 0.86904, "dynamic": 0.43905, "stiction_velocity_mm_per_s": 0.089756,
                 "friction_velocity_mm_per_s": 0.89756},
}  # fmt: skip


@pytest.mark.parametrize(("rtol", "other"), [(2.5e-4, 2.5e-3), (1.5e-4, 6e-5)])
def test_where_explicit_steps_overrun_friction_the_stiff_partner_estimates_the_error(rtol, other):
    """At another tolerance as well: two explicit runs agree on what neither has."""
    given = {"duration_rev": 0.03125, "settle_rev": 0, "output_step_deg": 0.0625}
    case, sure = (
        Case.from_values({**LOOSE, "solve": {**given, **how}})
        for how in ({"rtol": rtol}, {"rtol": 1e-7, "method": "RODAS"})
    )
    found, truth = solve(case), solve(sure)
    assert error_bars.overruns_friction(found.p, rtol)
    again = run_module.run_at_tolerance(case, rtol, 60.0, False)
    error_bars.estimate_errors(again, run_module.run_at_tolerance(case, other, 60.0, False))
    name = "rms_acceleration_deviation"
    error = abs(found.metrics[name] - truth.metrics[name])
    assert error > 10 * again.bars[name]
    assert error <= found.bars[name]


def test_friction_is_overrun_by_a_tolerance_of_speeds_or_a_loose_one():
    usual, slow = (
        record(Case.from_values({**BOTH, "friction": {"stiction_velocity_mm_per_s": speed}}))
        for speed in (10, 0.1)
    )
    free = record(Case.from_values({**BOTH, "friction": False}))
    assert [error_bars.overruns_friction(p, 1e-5) for p in (usual, slow, free)] == [0, 1, 0]
    assert [error_bars.overruns_friction(p, 1e-7) for p in (usual, slow, free)] == [0, 0, 0]
    assert [error_bars.overruns_friction(p, 3e-4) for p in (usual, slow, free)] == [1, 1, 1]


def test_a_metric_added_to_the_table_has_error_bars(monkeypatch):
    """Without shares of its own it gets the default ones."""
    given = run_module.metrics
    monkeypatch.setitem(NUMBERS, "loss", Metric("loss", (), "J", "a toy metric", "velocity"))
    monkeypatch.setattr(
        run_module, "metrics", lambda p, tally: given(p, tally) | {"loss": tally["contact_work"]}
    )
    how = {"duration_rev": 0.5, "settle_rev": 0, "rtol": 1e-5}
    case = Case.from_values({**BOTH, "solve": how})
    found = solve(case)
    tighter = error_bars.comparison_run(case, found, 60.0)
    apart = abs(found.metrics["loss"] - tighter.metrics["loss"])
    assert 0 < Bar().own * apart <= found.bars["loss"] < 0.5 * found.metrics["loss"]


def test_errors_do_not_depend_on_the_output_grid():
    found = [
        measure(Case.from_values({**BOTH, "solve": {**SHORT, **given}, "output": {"keep": keep}}))
        for given, keep in (({}, "series"), ({"output_step_deg": 7.2}, "series"), ({}, "metrics"))
    ]
    for other in found[1:]:
        for name in ERRORS:
            np.testing.assert_array_equal(found[0].numbers[name], other.numbers[name])


def test_a_failed_run_has_no_bars():
    found = run(BOTH, max_steps=50)
    for name in ERRORS:
        assert np.isnan(found[name]).all()


@pytest.mark.parametrize("load", ["gas", "none"])
def test_bars_of_the_ideal_machine_cover_its_quadrature(load):
    found = measure(Case.from_values({"load": load, "solve": SHORT}))
    truth = run_module.run_at_tolerance(
        Case.from_values({"load": load, "solve": SHORT}), 1e-12, 60.0, True
    ).metrics
    # means of both signs may come to nothing: sums of the forces are rounded as the BLAS likes
    rounding = 1e-15 * found.numbers["peak_contact_force"].max()
    for name in METRICS:
        error = np.abs(found.numbers[name] - truth[name])
        slack = rounding if name.startswith("mean_") else 0.0
        assert (error <= found.numbers[f"{name}_error"] + slack).all(), name
    assert found.numbers["peak_acceleration_error"] < 1e-5 * found.numbers["peak_acceleration"]


def test_a_long_ideal_run_is_cut_by_revolutions():
    """Without load corners the whole run is one stretch."""
    solve = {"duration_rev": 50, "settle_rev": 0, "output_step_deg": 10}
    long = measure(Case.from_values({"load": "none", "solve": solve})).numbers
    short = measure(Case.from_values({"load": "none", "solve": SHORT | {"settle_rev": 0}})).numbers
    assert long["rms_acceleration"] == pytest.approx(short["rms_acceleration"], rel=1e-9)
    assert long["peak_contact_force"] == pytest.approx(short["peak_contact_force"], rel=1e-4)


def test_a_stored_job_without_bars_does_not_serve_a_case_that_wants_them(tmp_path):
    solve = SHORT | {"duration_rev": 0.25, "settle_rev": 0}
    plain, barred, by_number = (
        Case.from_values({"solve": solve | more, "output": {"keep": "metrics"}})
        for more in ({"error_bars": False}, {}, {"accuracy": {"rms_acceleration": 0.1}})
    )
    keep(tmp_path, simulate(plain))
    stored = read_store(tmp_path).status(plain.key)
    assert stored.satisfies(plain)
    assert not stored.satisfies(barred)
    keep(tmp_path, simulate(barred))
    stored = read_store(tmp_path).status(plain.key)
    assert stored.satisfies(plain)
    assert stored.satisfies(barred)
    keep(tmp_path, simulate(by_number))
    assert read_store(tmp_path).status(by_number.key).satisfies(by_number)


# Accuracy as it is asked for


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("{peak_accelaration: 0.01}", "2:21", "solve.accuracy.peak_accelaration: unknown metric; "
         "did you mean peak_acceleration or "),
        ("{loudness: 0.01}", "2:21", "solve.accuracy.loudness: unknown metric; metrics are "
         "peak_acceleration, "),
        ("{peak_acceleration: 0.6}", "2:40",
         "solve.accuracy.peak_acceleration: 0.6 is outside (1e-09, 0.5]"),
        ("{peak_acceleration: [0.1, 0.2]}", "2:40",
         "solve.accuracy.peak_acceleration: needs a number in (1e-09, 0.5], not [0.1, 0.2]"),
        ("{}", "2:20", "solve.accuracy: needs a metric, such as {peak_acceleration: 0.01}"),
        ("finest", "2:20", "solve.accuracy: needs draft, standard, fine or reference"),
        ("[fine, {impact: 0.1}]", "2:28", "solve.accuracy.impact: unknown metric"),
        ("{peak_acceleration: 0.1}\n  rtol: 1e-5", "3:9", "solve.rtol: stands in place of"),
    ],
)  # fmt: skip
def test_mistakes_are_told_with_their_place(tmp_path, text, place, message):
    path = tmp_path / "case.yaml"
    path.write_text(f"solve:\n         accuracy: {text}\n".replace("\n  rtol", "\n         rtol"))
    with pytest.raises(CaseFileError) as caught:
        load_studies(path)
    (problem,) = caught.value.problems
    assert message in str(problem)
    assert problem.place.line == int(place.partition(":")[0])


def test_accuracy_by_number_is_an_axis_too(tmp_path):
    path = tmp_path / "trade.yaml"
    path.write_text(
        "solve:\n  accuracy:\n    - fine\n    - {peak_acceleration: 0.01}\n"
        "    - rms_acceleration: 1e-3\n      max_penetration: 0.02\n"
    )
    (study,) = load_studies(path)
    assert [case.targets for case in study.cases] == [
        (),
        (("peak_acceleration", 0.01),),
        (("max_penetration", 0.02), ("rms_acceleration", 1e-3)),
    ]
    assert len({case.key for case in study.cases}) == 3
    for case in study.cases:
        assert Case.from_values(case.values()) == case
        keep(tmp_path, simulate(case))
    for _ in range(2):  # written once, though JSON knows no tuples
        write_study(tmp_path, study, "once")
        (stored,) = read_studies(tmp_path)
        assert stored.axes[0].values == study.axes[0].values
    with open_study(tmp_path) as data:
        assert data.accuracy.values.tolist() == [
            "fine",
            "peak_acceleration, 0.01",
            "max_penetration, 0.02, rms_acceleration, 0.001",
        ]
        assert data.peak_acceleration_error.dims == ("accuracy",)
        assert np.isfinite(data.peak_acceleration_error).all()


def test_tiers_promise_more_for_tighter_tolerances():
    tiers = list(ACCURACY.values())
    assert [tier.rtol for tier in tiers] == sorted((t.rtol for t in tiers), reverse=True)
    assert [tier.promise for tier in tiers] == sorted((t.promise for t in tiers), reverse=True)
    assert first_tolerance((("peak_acceleration", 0.5),)) > ACCURACY["draft"].rtol
