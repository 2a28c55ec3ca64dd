"""Periods and distances of Poincaré points: of sets whose period is known."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.studies.follow.motion import (
    MAX_PERIOD,
    MORE,
    TOLERANCE,
    hausdorff_distance,
    period_of,
    places,
    tolerance,
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


def test_what_went_before_does_not_count():
    found = np.concatenate((RNG.uniform(-1, 1, (30, 2, 2)), cycle(3, 10)))
    assert period_of(found, TOLERANCE) == 3
    assert period_of(found[::-1], TOLERANCE) is None


def test_no_period_longer_than_the_longest_is_looked_for():
    assert period_of(cycle(MAX_PERIOD + 1, 100), TOLERANCE) is None


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


def test_either_joint_counts():
    for joint in (0, 1):
        found = np.zeros((12, 2, 2))
        found[::2, joint, 1] = 2 * TOLERANCE
        assert period_of(found, TOLERANCE) == 2


def test_the_distance_of_sets_is_hausdorff_s():
    one = cycle(4, 4)
    assert hausdorff_distance(one, np.roll(one, 1, axis=0)) == 0
    more = np.concatenate((one, np.add(one[:1], [[0.3, 0.4], [0, 0]])))
    assert 0 < hausdorff_distance(one, more) <= 0.5 + 1e-12
    assert hausdorff_distance(one, more) == hausdorff_distance(more, one)
    assert hausdorff_distance(np.zeros((1, 2, 2)), np.full((1, 2, 2), [[3, 4], [0, 0]])) == 5


def test_places_are_in_clearances_and_an_ideal_joint_has_none():
    found = places(np.full((3, 2, 4), 1e-4), np.array([2e-4, 0.0]))
    assert found.shape == (3, 2, 2)
    assert (found[:, 0] == 0.5).all()
    assert (found[:, 1] == 0).all()


def test_the_tolerance_is_that_of_the_accuracy():
    def of(**solve):
        return tolerance(Case.from_values({"solve": solve}))

    assert of() == of(accuracy="fine") == of(rtol=1e-8) == TOLERANCE
    assert of(accuracy="draft") == 4 * TOLERANCE
