"""What makes two motions of a machine different ones."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.solve.si_record import record
from compressor.studies.follow.motion import APART_TOLERANCES, TOLERANCE, differ, empty_row

CASE = Case.from_values({"joint": "both", "clearance_mm": 0.2})


def row(regime, period=math.nan, places=(), rms=200.0, error=0.0):
    """A row of a motion with these places of the big end, in clearances."""
    found = empty_row(CASE, 64) | {"status": "ok", "regime": regime}
    clearance = record(CASE)["clearance"][0]
    found["section"][: len(places)] = 0.0
    found["section"][: len(places), 0, :2] = clearance * np.reshape(places, (-1, 2))
    known = {"rms_acceleration": rms, "rms_acceleration_standard_error": error, "period": period}
    return found | {name: np.asarray(value) for name, value in known.items()}


def periodic(period=1, at=0.0, step=0.1):
    return row("periodic", float(period), [(at + step * k, 0.0) for k in range(period)])


def chaotic(rms=200.0, error=1.0):
    return row("chaotic", rms=rms, error=error)


UNKNOWN = empty_row(CASE, 64) | {"status": "failed"}
UNDECIDED = row("undecided")
TWO = periodic(2)
TURNED = TWO | {"section": np.concatenate((TWO["section"][1::-1], TWO["section"][2:]))}


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (periodic(), periodic(), False),
        (periodic(), periodic(at=0.9 * APART_TOLERANCES * TOLERANCE), False),
        (periodic(), periodic(at=1.1 * APART_TOLERANCES * TOLERANCE), True),
        (TWO, periodic(1), True),
        (TWO, periodic(2), False),
        (periodic(2, step=TOLERANCE), periodic(), False),
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
    assert differ(CASE, one, other) is expected
    assert differ(CASE, other, one) is expected
