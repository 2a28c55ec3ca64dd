"""Error bars: what they cover, what they say when they cannot, and accuracy as it is asked for."""

import itertools

import numpy as np
import pytest
from random_cases import strangers

from compressor.cases.case import Case
from compressor.metrics import METRICS, SERIES
from compressor.solve import error_bars
from compressor.solve import run as run_module
from compressor.solve.error_bars import FLOOR, bars
from compressor.solve.simulate import measure, simulate
from compressor.solve.solution import solve

SHORT = {"duration_rev": 1, "settle_rev": 0.5}
BOTH = {"joint": "both", "clearance_mm": 0.2}
EIGHT = strangers(2022, 8)
ERRORS = [f"{name}_error" for name in (*METRICS, *SERIES)]
APART = {name: np.zeros(2) if "joint" in dims else 0.0 for name, (dims, _, _) in SERIES.items()}


def run(values, **solve):
    """A run's numbers, at rtol 2e-5 unless it is given."""
    given = {**SHORT, "rtol": 2e-5, **solve}
    return measure(Case.from_values({**values, "solve": given})).numbers


def within(found, truth, stretch=1.0):
    """Whether each number of each metric lies within its bar of the truth, times `stretch`."""
    return np.concatenate([
        np.ravel(np.abs(found[name] - truth[name]) <= stretch * found[f"{name}_error"])
        for name in METRICS
    ])  # fmt: skip


# ---- from two runs to bars


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


def test_bars_cover_most_true_errors():
    eight = [(run(values), run(values, rtol=1e-11, error_bars=False)) for values in EIGHT]
    assert np.concatenate([within(*pair) for pair in eight]).mean() >= 0.9
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
    assert error_bars.make_comparison_run(case, found, 60.0).rtol == pytest.approx(other)


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


def test_numbers_do_not_depend_on_the_output_grid():
    """To the bit: no step lands on a sample."""
    found = [
        measure(Case.from_values({**BOTH, "solve": {**SHORT, **given}, "output": {"keep": keep}}))
        for given, keep in (({}, "series"), ({"output_step_deg": 7.2}, "series"), ({}, "metrics"))
    ]
    for other in found[1:]:
        for name in (*METRICS, *ERRORS, "steps", "evaluations"):
            np.testing.assert_array_equal(found[0].numbers[name], other.numbers[name])


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


@pytest.mark.compiled
def test_error_bars_hold_with_laws():
    """Of the default promise, by far tighter runs. With six restitutions each, 95 % of 500 do."""
    shares, chaotic = [], 0
    laws = "gonthier", "flores", "lankarani_nikravesh", "hu_guo"
    for law, restitution in itertools.product(laws, (0.3, 0.6)):
        contact = {"law": law, "restitution": restitution}
        values = {"joint": "both", "clearance_mm": 0.2, "contact": contact}
        run, exact = (
            simulate(Case.resolve({**values, "solve": {"duration_rev": 2, **solve}}))
            for solve in ({}, {"rtol": 1e-9, "error_bars": False})
        )
        if run.attrs["regime"] == "chaotic":  # such a motion has no bars
            chaotic += 1
            continue
        assert run.attrs["promise"] == "kept"
        a, b = run["acceleration"].values, exact["acceleration"].values
        assert np.linalg.norm(a - b) < 0.005 * np.linalg.norm(b)
        for name in METRICS:
            if f"{name}_error" in run and name in exact:
                away, bar = abs(run[name] - exact[name]).values, run[f"{name}_error"].values
                known = np.isfinite(bar) & np.isfinite(away)
                shares += (away[known] / np.maximum(bar[known], 1e-300)).tolist()
    assert chaotic <= 1
    assert len(shares) > 150
    assert np.mean(np.array(shares) <= 1.0) > 0.85
