"""Periods and distances of Poincaré points: of sets whose period is known."""

import numpy as np
import pytest

from compressor.studies.follow.motion import (
    MAX_PERIOD,
    MORE,
    TOLERANCE,
    hausdorff_distance,
    period_of,
)

RNG = np.random.default_rng(4)


def cycle(period, count, noise=0.0):
    """Places of a motion that repeats itself after `period` revolutions."""
    of = RNG.uniform(-1, 1, (period, 2, 2))
    return of[np.arange(count) % period] + noise * RNG.uniform(-1, 1, (count, 2, 2))


@pytest.mark.parametrize("period", range(1, MAX_PERIOD + 1))
def test_a_period_is_found_once_two_of_it_and_four_revolutions_are_there(period):
    found = cycle(period, 2 * period + MORE, 0.1 * TOLERANCE)
    assert period_of(found, TOLERANCE) == period
    assert period_of(found[1:], TOLERANCE) is None


def logistic(r, count):
    """The logistic map after a long transient, as the x of a joint."""
    x, found = 0.3, []
    for _ in range(5000 + count):
        x = r * x * (1 - x)
        found.append(x)
    out = np.zeros((count, 2, 2))
    out[:, 0, 0] = found[-count:]
    return out


@pytest.mark.parametrize(
    ("r", "period"), [(2.9, 1), (3.2, 2), (3.5, 4), (3.55, 8), (3.83, 3), (3.565, 16), (4.0, None)]
)
def test_the_logistic_map_has_the_periods_that_it_is_known_for(r, period):
    assert period_of(logistic(r, 64), TOLERANCE) == period


def test_a_slow_drift_is_no_period():
    """Neighbours agree, but not the first and the last."""
    drift = np.zeros((20, 2, 2))
    drift[:, 0, 0] = 0.5 * TOLERANCE * np.arange(20)
    assert period_of(drift, TOLERANCE) is None
    assert period_of(0.1 * drift, TOLERANCE) == 1


def test_the_distance_of_sets_is_hausdorff_s():
    one = cycle(4, 4)
    assert hausdorff_distance(one, np.roll(one, 1, axis=0)) == 0
    more = np.concatenate((one, np.add(one[:1], [[0.3, 0.4], [0, 0]])))
    assert 0 < hausdorff_distance(one, more) <= 0.5 + 1e-12
    assert hausdorff_distance(one, more) == hausdorff_distance(more, one)
    assert hausdorff_distance(np.zeros((1, 2, 2)), np.full((1, 2, 2), [[3, 4], [0, 0]])) == 5
