"""Integration against an independent reference, a second method, energy and limits."""

import itertools
import time

import numpy as np
import pytest
import reference
from measure_accuracy import apart

from compressor.cases.case import Case
from compressor.cases.groups import METHODS
from compressor.cases.parameter import ACCURACY
from compressor.physics.record import FREEDOMS
from compressor.physics.systems import derivative_with_flows
from compressor.solve import scipy_driver
from compressor.solve.run import CHUNK, COMPILED, split_segments
from compressor.solve.si_record import absolute_tolerances, record, scene
from compressor.solve.simulate import measure, simulate

SOME = [("big_end", 0.3), ("small_end", 0.2), ("both", 0.1)]  # of the paper's faults


def run(joint, clearance, **solve):
    return simulate(Case.from_values({"joint": joint, "clearance_mm": clearance, "solve": solve}))


def residual_bound(found, revolutions=4):
    return 10 * found.attrs["rtol"] * revolutions


@pytest.mark.slow
@pytest.mark.parametrize(("joint", "clearance"), SOME)
def test_paper_cases_against_the_reference_and_a_second_method(joint, clearance):
    """Every promise on fault cases to beyond bottom dead centre, judged by sympy's equations.

    With one joint at 0.2 mm a method of SciPy's is judged, too. `make accuracy` draws 1,000 cases.
    """
    params = reference.paper_params("spring", joint, clearance * 1e-3)
    span = {"duration_rev": 0.6, "settle_rev": 0.2}
    words = {
        word: run(joint, clearance, accuracy=word, **span) for word in ("draft", "standard", "fine")
    }
    times = words["fine"]["time"].values
    truth = reference.reference_solution(params, joint, times, rtol=1e-9, method="LSODA")
    for word, found in words.items():
        assert apart(found["acceleration"].values, truth) <= ACCURACY[word].promise, word
        assert float(found["energy_residual"]) <= residual_bound(found, revolutions=1), word
    if clearance != 0.2 or joint == "both":
        return
    one = run(joint, clearance, rtol=1e-10, method="DOP853", error_bars=False, **span)
    assert apart(one["acceleration"].values, truth) <= ACCURACY["reference"].promise
    peaks = [float(found["peak_acceleration"]) for found in (words["standard"], one)]
    assert peaks[0] == pytest.approx(peaks[1], rel=5e-3)


@pytest.mark.compiled
@pytest.mark.parametrize("method", [name for name in METHODS if name != "auto"])
def test_energy_residual_of_every_method(method):
    span = 0.5 if method in COMPILED else 0.05  # SciPy's methods step in Python
    found = run("both", 0.3, duration_rev=span, settle_rev=0, rtol=1e-5, method=method)
    assert str(found["status"].values) == "ok"
    assert 0 < float(found["energy_residual"]) <= residual_bound(found, revolutions=1)


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("method", "rates", "value"),
    [
        ("DOP853", slice(-2, -1), 0.0),
        *((name, slice(None), np.nan) for name in METHODS if name not in COMPILED),
    ],
)
def test_a_run_that_loses_damping_s_work_or_its_motion_fails(method, rates, value, monkeypatch):
    def lost(t, z, phase, p, out):
        derivative_with_flows(t, z, phase, p, out)
        out[rates] = value

    monkeypatch.setattr(scipy_driver, "derivative_with_flows", lost)
    found = run("big_end", 0.3, duration_rev=0.1, settle_rev=0, rtol=1e-5, method=method)
    if value == 0.0:
        assert found["reason"] == "energy_audit_failed"
        return
    assert found["reason"] in ("non_finite", "step_underflow")
    assert found.attrs["stop_time"] == 0.0
    assert found.attrs["stop_state"].size == 4
    assert np.isfinite(found["acceleration"]).sum() == 1  # where it began


def test_methods_agree_beyond_a_corner():
    """With a follower that dwells for 1 mm only, so that the first corner comes after 6 degrees."""
    values = {"joint": "big_end", "clearance_mm": 0.2, "spring": {"stroke_mm": 1}}
    solve = {"duration_rev": 0.03, "settle_rev": 0, "rtol": 1e-6, "error_bars": False}
    one, other = (
        simulate(Case.from_values({**values, "solve": {**solve, "method": name}}))
        for name in ("TSIT5", "DOP853")
    )
    for name in ("acceleration", "piston_force", "penetration"):
        assert apart(one[name].values, other[name].values) < 1e-4
    for name in ("peak_acceleration", "rms_acceleration_deviation", "max_penetration",
                 "crank_work", "contact_damping_loss"):  # fmt: skip
        assert one[name].values == pytest.approx(other[name].values, rel=1e-4, abs=1e-12)


@pytest.mark.parametrize("joint", ["big_end", "both"])
def test_tolerances_scale_with_the_clearance(joint):
    small, large = (
        absolute_tolerances(record(Case.from_values({"joint": joint, "clearance_mm": c})), 1e-8)
        for c in (0.001, 0.002)
    )
    n = FREEDOMS[scene(Case.from_values({"joint": joint, "clearance_mm": 0.1}))]
    assert small.size == 2 * n + 4
    assert large[: 2 * n] / small[: 2 * n] == pytest.approx(2)
    assert small[0] == pytest.approx(1e-8 * 1e-6, abs=0)


def test_settling_at_a_corner_makes_no_segment_of_rounding():
    edges, phases = np.array([0.0, 0.1, 0.2, 0.4]), np.array([0, 1, 2])
    assert split_segments(edges, phases, [0.1 + 1e-17])[2] == [0.1]
    for at in (0.1, np.nextafter(0.1, 1), 0.0, 0.4, 0.9):
        assert split_segments(edges, phases, [at])[0] is edges
    found = split_segments(edges, phases, [0.3])
    assert [part.tolist() for part in found[:2]] == [[0, 0.1, 0.2, 0.3, 0.4], [0, 1, 2, 2]]


EXTREMES = {
    "stiff contact": {"contact": {"stiffness_N_per_mm15": 3.36e11}},
    "sticking": {"friction": {"stiction_velocity_mm_per_s": 1e-3}},
    "fast": {"machine": {"speed_rpm": 2e4}, "contact": {"stiffness_N_per_mm15": 3.36e9}},
    "light": {"machine": {"rod_mass_kg": 1e-3, "reciprocating_mass_kg": 1e-3}},
}
LOOKS = 6  # at the clock, a second each, the first before anything is done


@pytest.mark.compiled
@pytest.mark.parametrize("method", ["auto", "RODAS", "LSODA"])
@pytest.mark.parametrize("extreme", EXTREMES)
def test_the_clock_is_looked_at_however_hard_the_case(extreme, method, monkeypatch):
    """Every method stops at the first look past its time, with little done between two looks."""
    monkeypatch.setattr(time, "monotonic", itertools.count(1.0).__next__)  # a second a look
    solve = {"rtol": 1e-9, "method": method, "timeout_s": LOOKS - 0.5, "error_bars": False,
             "duration_rev": 40, "settle_rev": 0, "output_step_deg": 3.6}  # fmt: skip
    values = {"joint": "both", "clearance_mm": 0.2, "output": {"keep": "metrics"}}
    found = measure(Case.from_values({**values, **EXTREMES[extreme], "solve": solve}))
    assert found.detail == f"more than {LOOKS - 0.5} s of wall time in all"
    between = CHUNK if method in COMPILED else 256
    assert 0 < (found.numbers["steps"] + found.numbers["rejected"]) <= LOOKS * between
    assert found.numbers["evaluations"] <= LOOKS * between * (26 if method in COMPILED else 1)


def test_the_ideal_machine_keeps_its_time_too(monkeypatch):
    monkeypatch.setattr(time, "monotonic", itertools.count(1.0).__next__)
    solve = {"duration_rev": 200, "settle_rev": 0, "timeout_s": 2.5, "output_step_deg": 3.6}
    found = simulate(Case.from_values({"solve": solve}))
    assert found["reason"].item() == "budget_seconds"
    assert found.attrs["detail"] == "more than 2.5 s of wall time in all"  # not of what was left
    stop = found.attrs["stop_time"]
    assert 0 < stop < 24
    assert (
        np.isfinite(found["acceleration"].values).tolist() == (found["time"] < stop).values.tolist()
    )
