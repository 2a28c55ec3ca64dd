"""Both methods: order conditions and orders of convergence, linear algebra, when `auto` changes."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics import Column, rosenbrock
from compressor.physics.kinematics import crank_direction
from compressor.physics.march import NODE_WEIGHTS, NODES
from compressor.physics.mechanism import factorize_positive, substitute_positive
from compressor.physics.observe import COLUMNS
from compressor.physics.rosenbrock import factorize, substitute
from compressor.physics.runge_kutta import (
    FLOWS,
    STAGES,
    A,
    C,
    E,
    P,
    extend,
    interpolate,
    take_step,
    weights_at,
)
from compressor.physics.systems import derivative_with_flows
from compressor.solve.run import run_at_tolerance
from compressor.solve.series import rows_of
from compressor.solve.si_record import record
from compressor.solve.simulate import simulate

# a flight in joints wider than any: a smooth motion without contact
FLIGHT = record(Case.from_values({"joint": "both", "clearance_mm": 9, "load": "gas"}))
FLIGHT.clearance[:] = 1.0
SPAN, PHASE = 0.03, 3  # the load's discharge


def start():
    z = np.zeros(8 + FLOWS)
    z[4:8] = 0.1, -0.2, 0.3, 0.5
    return z


def explicit(t, h, z):
    """The state after a step of the explicit pair, and its interpolant."""
    k, new, dense = np.zeros((STAGES, z.size)), np.zeros(z.size), np.zeros((5, 8))
    derivative_with_flows(t, z, PHASE, FLIGHT, k[0])
    take_step(crank_direction(t, FLIGHT), h, z, k, PHASE, FLIGHT, new, np.zeros(COLUMNS))
    extend(h, z, k, dense)
    return new, dense


def stiff(t, h, z):
    """The same of the stiff partner."""
    rates, work, new = (np.zeros(z.size) for _ in range(3))
    u, jacobian, dense = np.zeros((6, 12)), np.zeros((12, 8)), np.zeros((5, 8))
    derivative_with_flows(t, z, PHASE, FLIGHT, rates)
    size = np.full(8, 1e-3)
    assert rosenbrock.take_step(t, h, z, rates, size, PHASE, FLIGHT, work, new, u, jacobian)
    rosenbrock.extend(z, new, u, dense)
    return new, dense


METHODS = {explicit: (0.05, 5), stiff: (0.07, 4)}  # where the flight begins, and the order


def orders(errors):
    return np.log2(np.array(errors[:-1]) / errors[1:])


@pytest.mark.parametrize(
    ("method", "steps", "part", "within"),
    [(explicit, (12, 24, 48), slice(8), 0.2), (stiff, (8, 16, 32), slice(8), 0.2),
     (stiff, (4, 8, 16, 32), slice(8, None), 0.4)],
    ids=["explicit", "stiff", "the stiff one's flows"],
)  # fmt: skip
def test_order_of_convergence(method, steps, part, within):
    begin, order = METHODS[method]

    def flow(count):
        z = start()
        for i in range(count):
            z, _ = method(begin + i * SPAN / count, SPAN / count, z)
        return z[part]

    exact = flow(192)
    errors = [np.abs(flow(count) - exact).max() for count in steps]
    assert orders(errors) == pytest.approx(order, abs=within)


@pytest.mark.parametrize(("method", "local"), [(explicit, 5), (stiff, 4)])
def test_dense_output_ends_at_the_step_and_has_its_order(method, local):
    begin, errors = METHODS[method][0], []
    for h in (4e-3, 2e-3, 1e-3):
        new, dense = method(begin, h, start())
        assert dense.sum(axis=0) == pytest.approx(new[:8], abs=1e-13)
        y = np.zeros(8)
        interpolate(0.4, dense, y)
        exact, _ = method(begin, 0.4 * h, start())
        errors.append(np.abs(y - exact[:8]).max())
    assert orders(errors) == pytest.approx(local, abs=0.35)


def test_order_conditions():
    """All eight up to order 4 and the quadrature conditions of order 5; the estimate's to 4."""
    a, b, c = A, A[-1], C
    for weights, target in ((b, 1.0), (b - E, 1.0)):
        assert weights.sum() == pytest.approx(target)
        for power in range(1, 4):
            assert weights @ c**power == pytest.approx(1 / (power + 1), abs=2e-14)
        assert weights @ a @ c == pytest.approx(1 / 6, abs=2e-14)
        assert weights @ (c * (a @ c)) == pytest.approx(1 / 8, abs=2e-14)
        assert weights @ a @ c**2 == pytest.approx(1 / 12, abs=2e-14)
        assert weights @ a @ a @ c == pytest.approx(1 / 24, abs=2e-14)
    assert b @ c**4 == pytest.approx(1 / 5)
    assert (b - E) @ c**4 != pytest.approx(1 / 5, abs=1e-4)  # the estimate is of order 4
    assert P.sum(axis=1) == pytest.approx(b, abs=1e-13)


def test_the_weights_of_the_nodes_are_stored():
    weights = np.zeros(STAGES)
    for node, stored in zip(NODES, NODE_WEIGHTS, strict=True):
        weights_at(node, weights)
        assert stored == pytest.approx(weights, abs=1e-13)


# ---- systems of linear equations


@pytest.mark.parametrize("n", [4, 8])
def test_factors_solve_the_system(n):
    rng = np.random.default_rng(n)
    for _ in range(20):
        matrix, b = rng.normal(size=(n, n)), rng.normal(size=n)
        factors, pivots, x = matrix.copy(), np.zeros(n, dtype=np.int64), b.copy()
        assert factorize(factors, pivots)
        substitute(factors, pivots, x)
        assert matrix @ x == pytest.approx(b, abs=1e-10)
    assert not factorize(np.zeros((n, n)), pivots)


@pytest.mark.parametrize("n", [0, 1, 4, 11])
def test_factors_solve_a_positive_system_of_any_scale(n):
    """As masses and inertias have: rows and columns of sizes that differ by many decades."""
    rng = np.random.default_rng(n)
    for _ in range(20):
        root, scale = rng.normal(size=(n, n)), 10.0 ** rng.uniform(-6, 6, n)
        matrix = scale[:, None] * (root @ root.T + np.eye(n)) * scale
        x = rng.normal(size=n) / scale
        factors, found = np.full((11, 11), np.nan), matrix @ x
        factors[:n, :n] = np.tril(matrix) + np.triu(np.full((n, n), np.nan), 1)
        assert factorize_positive(factors, n)
        substitute_positive(factors, found)
        assert found * scale == pytest.approx(x * scale, abs=1e-9)


@pytest.mark.parametrize("matrix", [[[0.0]], [[1.0, 2.0], [2.0, 1.0]], [[np.nan]]])
def test_a_system_that_is_not_positive_is_told(matrix):
    assert not factorize_positive(np.array(matrix), len(matrix))


# ---- when `auto` calls the stiff partner

STIFF = {
    "viscous contact": {"contact": {"damping_N_s_per_mm": 336e3}},
    "tiny stiction velocity": {"friction": {"stiction_velocity_mm_per_s": 0.001}},
}


@pytest.mark.slow
@pytest.mark.parametrize("values", STIFF.values(), ids=STIFF)
def test_auto_turns_to_the_stiff_partner(values):
    solve = {"duration_rev": 0.25, "settle_rev": 0, "rtol": 1e-6, "error_bars": False}
    case = {"joint": "small_end", "clearance_mm": 0.2, **values}
    evaluations, a = {}, {}
    for method in ("auto", "TSIT5", "RODAS"):
        one = Case.from_values({**case, "solve": {**solve, "method": method}})
        # without the audit, which may repeat a run at a tighter tolerance
        run = run_at_tolerance(one, one.rtol, math.inf, sampled=True)
        assert run.reason == ""
        evaluations[method] = run.trajectory.evaluations
        a[method] = rows_of(run.p, run.trajectory)[:, Column.ACCELERATION]
    assert evaluations["auto"] < 0.4 * evaluations["TSIT5"]
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
