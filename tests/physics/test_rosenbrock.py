"""The stiff partner: its Jacobian, linear algebra and orders; and when `auto` calls it."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics import Column, rosenbrock
from compressor.physics.runge_kutta import FLOWS, interpolate
from compressor.physics.systems import derivative_with_flows
from compressor.solve.run import run_at_tolerance
from compressor.solve.series import rows_of
from compressor.solve.si_record import record
from compressor.solve.simulate import simulate

FLIGHT = record(Case.from_values({"joint": "both", "clearance_mm": 9, "load": "gas"}))
FLIGHT.clearance[:] = 1.0
BEGIN, SPAN, PHASE = 0.07, 0.03, 3
SIZE = np.full(8, 1e-3)


def start():
    z = np.zeros(8 + FLOWS)
    z[4:8] = 0.1, -0.2, 0.3, 0.5
    return z


def step(z, t, h, u, jacobian):
    rates, work, new = (np.zeros(z.size) for _ in range(3))
    derivative_with_flows(t, z, PHASE, FLIGHT, rates)
    assert rosenbrock.take_step(t, h, z, rates, SIZE, PHASE, FLIGHT, work, new, u, jacobian)
    return new


def flow(steps):
    z, u, jacobian = start(), np.zeros((6, 12)), np.zeros((12, 8))
    for i in range(steps):
        z = step(z, BEGIN + i * SPAN / steps, SPAN / steps, u, jacobian)
    return z


def test_order_of_convergence():
    exact = flow(512)
    errors = [np.abs(flow(n) - exact)[:8].max() for n in (8, 16, 32)]
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4, abs=0.2)


def test_flows_converge_with_the_motion():
    exact = flow(512)
    errors = [np.abs(flow(n) - exact)[8:].max() for n in (4, 8, 16, 32)]
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4, abs=0.4)


def test_dense_output_joins_the_ends_and_is_of_order_three():
    errors = []
    for h in (4e-3, 2e-3, 1e-3):
        u, jacobian, dense, y = np.zeros((6, 12)), np.zeros((12, 8)), np.zeros((5, 8)), np.zeros(8)
        new = step(start(), BEGIN, h, u, jacobian)
        rosenbrock.extend(start(), new, u, dense)
        assert dense.sum(axis=0) == pytest.approx(new[:8], abs=1e-15)
        interpolate(0.4, dense, y)
        exact = step(start(), BEGIN, 0.4 * h, u, jacobian)
        errors.append(np.abs(y - exact[:8]).max())
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4, abs=0.35)


STIFF = {
    "viscous contact": {"contact": {"damping_N_s_per_mm": 336e3}},
    "tiny stiction velocity": {"friction": {"stiction_velocity_mm_per_s": 0.001}},
}


@pytest.mark.slow
@pytest.mark.parametrize("values", STIFF.values(), ids=STIFF)
def test_auto_turns_to_the_stiff_partner(values):
    solve = {"duration_rev": 0.5, "settle_rev": 0, "rtol": 1e-6, "error_bars": False}
    case = {"joint": "small_end", "clearance_mm": 0.2, **values}
    cases = {
        method: Case.from_values({**case, "solve": {**solve, "method": method}})
        for method in ("auto", "TSIT5", "RODAS")
    }
    runs = {  # without the audit, which may repeat a run at a tighter tolerance
        method: run_at_tolerance(one, one.rtol, math.inf, sampled=True)
        for method, one in cases.items()
    }
    assert {run.reason for run in runs.values()} == {""}
    evaluations = {method: run.trajectory.evaluations for method, run in runs.items()}
    assert evaluations["auto"] < 0.4 * evaluations["TSIT5"]
    a = {name: rows_of(one.p, one.trajectory)[:, Column.ACCELERATION] for name, one in runs.items()}
    assert np.linalg.norm(a["auto"] - a["RODAS"]) < 5e-3 * np.linalg.norm(a["RODAS"])


@pytest.mark.compiled
@pytest.mark.parametrize("joint", ["big_end", "small_end", "both"])
def test_auto_stays_explicit_where_that_is_cheaper(joint):
    solve = {"duration_rev": 1, "settle_rev": 0, "rtol": 1e-5}
    case = {"joint": joint, "clearance_mm": 0.2}
    auto, explicit = (
        int(simulate(Case.from_values({**case, "solve": {**solve, "method": method}})).evaluations)
        for method in ("auto", "TSIT5")
    )
    assert auto <= 1.1 * explicit
