"""The largest Lyapunov exponent: of maps and oscillators in closed form, and of real machines."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics.record import FREEDOMS
from compressor.physics.systems import start
from compressor.solve import Request, integrate, natural_sizes, record
from compressor.solve.search import PARTED_DISTANCE, SHIFT, predictability_horizon
from compressor.solve.si_record import offsets, scene
from compressor.studies.follow import lyapunov

LIGHT = {"joint": "big_end", "clearance_mm": 0.2, "contact": {"damping_N_s_per_mm": 0.336}}


def at_rest(made):
    y = np.zeros(2 * FREEDOMS[scene(made)])
    start(offsets(made), y, record(made))
    return y


def settled(made, revolutions=12, rtol=1e-10, begin=None):
    y = at_rest(made) if begin is None else begin
    times = np.array([0.0, revolutions * made.turn])
    return integrate(Request(record(made), y, times, 0.0, rtol)).states[-1]


def logistic(x):
    """The logistic map at r = 4, whose exponent is ln 2."""

    def follow(difference):
        nonlocal x
        other, x = 4 * (x + difference) * (1 - x - difference), 4 * x * (1 - x)
        return (other - x)[np.newaxis]

    return follow


def rates(found):
    return np.array([one.growth for one in found])


def test_the_logistic_map_has_ln_2():
    found = lyapunov.growths(logistic(np.array([0.3])), np.array([1e-9]), 8000)
    value, error = lyapunov.mean_with_error(rates(found))
    assert abs(value - math.log(2)) < error < 0.03


@pytest.mark.parametrize(("damping", "expected"), [(0.1, -0.2), (1.25, -1.0), (-0.05, 0.1)])
def test_a_linear_oscillator_has_its_slowest_decay(damping, expected):
    """-zeta omega where it rings, -omega (zeta - sqrt(zeta^2 - 1)) where it creeps; omega = 2."""
    matrix = np.array([[0.0, 1.0], [-4.0, -4.0 * damping]])
    values, vectors = np.linalg.eig(matrix)
    period = 0.05 * math.pi / 2.0 / math.sqrt(abs(1 - damping**2))
    map_ = (vectors @ np.diag(np.exp(values * period)) @ np.linalg.inv(vectors)).real
    push = np.array([1e-6, 1e-6])
    found = lyapunov.growths(lambda difference: (map_ @ difference)[np.newaxis], push, 4000)
    assert not any(one.lost for one in found)
    value, error = lyapunov.mean_with_error(rates(found)[400:] / period)
    assert value == pytest.approx(expected, abs=1e-6)
    assert abs(value - expected) <= error + 1e-9


@pytest.mark.parametrize("factor", [1e-9, 0.0])
def test_a_difference_that_errors_swallow_gives_a_bound(factor):
    found = lyapunov.growths(lambda push: factor * push[np.newaxis], np.array([1e-7]), 5)
    assert all(one.lost for one in found)
    assert rates(found) == pytest.approx(math.log(lyapunov.LOST_DISTANCE / 1e-7))


def test_errors_hold_as_often_as_they_say():
    draws = np.random.default_rng(4).normal(size=(400, 64))
    hits = [abs(value) <= error for value, error in map(lyapunov.mean_with_error, draws)]
    assert 0.91 < np.mean(hits) < 0.985


@pytest.mark.parametrize("joint", ["big_end", "small_end"])
def test_of_a_periodic_motion_it_is_the_largest_floquet_multiplier(joint):
    """By central differences of separate runs over one revolution, each with its own steps."""
    made = Case.from_values({"joint": joint, "clearance_mm": 0.2})
    y, size = settled(made), natural_sizes(record(made))
    ends = [
        [settled(made, 1, 1e-12, y + way * 1e-4 * size * unit) for unit in np.eye(y.size)]
        for way in (1, -1)
    ]
    multipliers = np.linalg.eigvals((np.subtract(*ends) / size / 2e-4).T)
    expected = math.log(np.abs(multipliers).max())
    found = lyapunov.largest_exponent(made, y, 16, math.inf)
    # from other revolutions on it is 0.004 or, rarely, 0.013 off: by rounding, as steps fall
    assert found.value == pytest.approx(expected, abs=2 * lyapunov.OF_STEPS)
    # of four batches of revolutions, whose scatter Student's t takes times 3.2
    assert abs(found.value - expected) < found.error < 0.1
    assert not found.at_most


def test_of_a_chaotic_motion_it_is_the_rate_at_which_motions_part():
    made = Case.from_values(LIGHT)
    found = lyapunov.largest_exponent(made, settled(made, 4, 1e-8), 8, math.inf)
    rate = math.log(PARTED_DISTANCE / SHIFT) / (predictability_horizon(made) / made.turn)
    assert found.value - found.error > 0.0
    assert 0.5 * rate < found.value < 2.0 * rate


def test_explicit_steps_that_stability_holds_do_not_part_motions(monkeypatch):
    """Of a motion with heavy damping, by the shifted run's own steps."""
    monkeypatch.setattr(lyapunov, "MIN_TURNING_REV", 1)
    heavy = {"damping_N_s_per_mm": 336e2}
    made = Case.from_values({"joint": "small_end", "clearance_mm": 0.2, "contact": heavy})
    found = lyapunov.largest_exponent(made, settled(made, 1, 1e-6), 1, math.inf)
    assert -1.1 < found.value < -0.8
