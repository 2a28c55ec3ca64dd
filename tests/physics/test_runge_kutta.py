"""The explicit pair: order conditions, order of convergence, dense output."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics.kinematics import crank_direction
from compressor.physics.march import NODE_WEIGHTS, NODES
from compressor.physics.observe import COLUMNS
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
from compressor.solve.si_record import record

# a flight in joints wider than any: a smooth motion without contact
FLIGHT = record(Case.from_values({"joint": "both", "clearance_mm": 9, "load": "gas"}))
FLIGHT.clearance[:] = 1.0
BEGIN, SPAN = 0.05, 0.03
ROW = np.zeros(COLUMNS)


def flow(steps, k=None):
    """State after `steps` equal steps of a free flight in the load's discharge phase."""
    z = np.zeros(8 + FLOWS)
    z[4:8] = 0.1, -0.2, 0.3, 0.5
    k, new = np.zeros((STAGES, z.size)), np.zeros(z.size)
    h = SPAN / steps
    for i in range(steps):
        derivative_with_flows(BEGIN + i * h, z, 3, FLIGHT, k[0])
        take_step(crank_direction(BEGIN + i * h, FLIGHT), h, z, k, 3, FLIGHT, new, ROW)
        z[:] = new
    return z


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


def test_dense_output_ends_at_the_step():
    assert P.sum(axis=1) == pytest.approx(A[-1], abs=1e-13)


def test_the_weights_of_the_nodes_are_stored():
    weights = np.zeros(STAGES)
    for node, stored in zip(NODES, NODE_WEIGHTS, strict=True):
        weights_at(node, weights)
        assert stored == pytest.approx(weights, abs=1e-13)


def test_order_of_convergence():
    exact = flow(512)
    errors = [np.abs(flow(n) - exact)[:8].max() for n in (12, 24, 48)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(5, abs=0.2)


def test_order_of_dense_output():
    errors = []
    for h in (4e-3, 2e-3, 1e-3):
        z = np.zeros(8 + FLOWS)
        z[4:8] = 0.1, -0.2, 0.3, 0.5
        k, new, y = np.zeros((STAGES, z.size)), np.zeros(z.size), np.zeros(8)
        derivative_with_flows(BEGIN, z, 3, FLIGHT, k[0])
        take_step(crank_direction(BEGIN, FLIGHT), h, z, k, 3, FLIGHT, new, ROW)
        dense = np.zeros((5, 8))
        extend(h, z, k, dense)
        interpolate(0.4, dense, y)
        exact = np.zeros(z.size)
        inner = np.zeros_like(k)
        derivative_with_flows(BEGIN, z, 3, FLIGHT, inner[0])
        take_step(crank_direction(BEGIN, FLIGHT), 0.4 * h, z, inner, 3, FLIGHT, exact, ROW)
        errors.append(np.abs(y - exact[:8]).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(5, abs=0.35)  # the local error of an extension of order 4
