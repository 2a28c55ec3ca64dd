"""Where up and down differ, and whether two motions are confirmed."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.solve.si_record import record
from compressor.studies.follow import follow
from compressor.studies.follow.follow import (
    find_doubts,
    has_two,
    load_values,
    machines,
    read_over,
    run_chain,
)
from compressor.studies.follow.motion import (
    APART_TOLERANCES,
    TOLERANCE,
    ValuePlan,
    differ,
    empty_row,
)

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


@pytest.fixture
def two(tmp_path):
    """The machine of a file with two motions, one of one revolution and one of two."""
    path = tmp_path / "two.yaml"
    path.write_text("""
joint: big_end
machine: {rod_mass_kg: 2}
contact: {damping_N_s_per_mm: 60}
solve: {accuracy: draft, output_step_deg: 1}
""")
    along = read_over(
        "clearance_mm=0.7536:1.024:3", log=True, both=True, plan=ValuePlan(exponent=False)
    )
    (machine,) = machines(load_values(path, along), along)
    return machine


def test_a_machine_with_two_motions_is_found_and_confirmed(two, tmp_path, monkeypatch):
    """Going up from a motion of two revolutions, and down from one of one: two of one meet."""
    monkeypatch.setattr(follow, "FURTHER", 20)
    monkeypatch.setattr(follow, "STARTS", 2)
    for chain in two.chains:
        assert run_chain(chain, tmp_path) is None
    rows = [[follow.read_rows(chain, tmp_path) for chain in two.chains]]
    (((_, value), doubt),) = find_doubts([two], rows).items()
    assert value == two.chains[0].values[1]
    assert len(doubt.cases) == 4
    assert run_chain(doubt, tmp_path) is None
    assert has_two(doubt, tmp_path)
