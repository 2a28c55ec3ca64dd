"""Periods and distances of sets whose period is known, and which motions are different ones."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.solve.si_record import record
from compressor.studies.follow import motion

RNG = np.random.default_rng(4)


def cycle(period, count, noise=0.0):
    """Places of a motion that repeats itself after `period` revolutions."""
    of = RNG.uniform(-1, 1, (period, 2, 2))
    return of[np.arange(count) % period] + noise * RNG.uniform(-1, 1, (count, 2, 2))


@pytest.mark.parametrize("period", range(1, motion.MAX_PERIOD + 1))
def test_a_period_is_found_once_two_of_it_and_four_revolutions_are_there(period):
    found = cycle(period, 2 * period + motion.MORE, 0.1 * motion.TOLERANCE)
    assert motion.period_of(found, motion.TOLERANCE) == period
    assert motion.period_of(found[1:], motion.TOLERANCE) is None


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
    assert motion.period_of(logistic(r, 64), motion.TOLERANCE) == period


def test_a_slow_drift_is_no_period():
    """Neighbours agree, but not the first and the last."""
    drift = np.zeros((20, 2, 2))
    drift[:, 0, 0] = 0.5 * motion.TOLERANCE * np.arange(20)
    assert motion.period_of(drift, motion.TOLERANCE) is None
    assert motion.period_of(0.1 * drift, motion.TOLERANCE) == 1


def test_the_distance_of_sets_is_hausdorff_s():
    one = cycle(4, 4)
    assert motion.hausdorff_distance(one, np.roll(one, 1, axis=0)) == 0
    more = np.concatenate((one, np.add(one[:1], [[0.3, 0.4], [0, 0]])))
    assert 0 < motion.hausdorff_distance(one, more) <= 0.5 + 1e-12
    assert motion.hausdorff_distance(one, more) == motion.hausdorff_distance(more, one)
    assert motion.hausdorff_distance(np.zeros((1, 2, 2)), np.full((1, 2, 2), [[3, 4], [0, 0]])) == 5


# ---- what makes two motions different ones


CASE = Case.from_values({"joint": "both", "clearance_mm": 0.2})


def row(regime, period=math.nan, places=(), rms=200.0, error=0.0):
    """A row of a motion with these places of the big end, in clearances."""
    found = motion.empty_row(CASE, 64) | {"status": "ok", "regime": regime}
    clearance = record(CASE)["clearance"][0]
    found["section"][: len(places)] = 0.0
    found["section"][: len(places), 0, :2] = clearance * np.reshape(places, (-1, 2))
    known = {"rms_acceleration": rms, "rms_acceleration_standard_error": error, "period": period}
    return found | {name: np.asarray(value) for name, value in known.items()}


def periodic(period=1, at=0.0, step=0.1):
    return row("periodic", float(period), [(at + step * k, 0.0) for k in range(period)])


def chaotic(rms=200.0, error=1.0):
    return row("chaotic", rms=rms, error=error)


UNKNOWN = motion.empty_row(CASE, 64) | {"status": "failed"}
UNDECIDED = row("undecided")
TWO = periodic(2)
TURNED = TWO | {"section": np.concatenate((TWO["section"][1::-1], TWO["section"][2:]))}


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (periodic(), periodic(), False),
        (periodic(), periodic(at=0.9 * motion.APART_TOLERANCES * motion.TOLERANCE), False),
        (periodic(), periodic(at=1.1 * motion.APART_TOLERANCES * motion.TOLERANCE), True),
        (TWO, periodic(1), True),
        (TWO, periodic(2), False),
        (periodic(2, step=motion.TOLERANCE), periodic(), False),
        (TWO, TURNED, False),
        (periodic(), chaotic(), True),
        (chaotic(), chaotic(), False),
        (chaotic(200, 1), chaotic(204, 1), False),
        (chaotic(200, 1), chaotic(205, 1), True),
        (chaotic(), UNDECIDED, False),
        (periodic(), UNDECIDED, False),
        (UNKNOWN, periodic(), False),
        (UNKNOWN, UNKNOWN, False),
    ],
)
def test_what_makes_two_motions_different(one, other, expected):
    assert motion.differ(CASE, one, other) is expected
    assert motion.differ(CASE, other, one) is expected
