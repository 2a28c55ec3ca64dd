"""Steps of a solution that is known at all times: changes and tops between their nodes."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics import COLUMNS, Column, new_tally
from compressor.solve.dense_tally import find_tops, tally_steps
from compressor.solve.si_record import record


def test_the_top_of_several_is_found_wherever_nodes_lie():
    """Of two that are alike to 1e-4, at whose sides the nodes lie unlike."""

    def look(times):
        two = np.exp(-(((times - 0.301) / 0.04) ** 2)), np.exp(-(((times - 0.75) / 0.04) ** 2))
        return np.stack([0.9999 * two[1] + two[0], -times], axis=1)

    times = np.linspace(0.0, 1.0, 101)
    top = find_tops(look, times, look(times), np.array([0.5, 2.0]))
    assert top.tolist() == [pytest.approx(1.0, abs=1e-9), 2.0]
    assert find_tops(look, times, look(times), np.zeros(2))[1] == 0.0


def rows_of(times):
    """Rows of a contact at the small end for half of 0.1 s, and a rod load that goes with it."""
    rows = np.zeros((times.size, COLUMNS))
    rows[:, Column.NEARNESS + 1] = np.sin(20.0 * math.pi * times)
    rows[:, Column.NORMAL + 1] = np.maximum(rows[:, Column.NEARNESS + 1], 0.0)
    rows[:, Column.FORCE + 2] = -100.0 * rows[:, Column.NORMAL + 1]
    rows[:, Column.PACE] = 1.0
    return rows


@pytest.mark.parametrize("method_steps", [3, 40])
def test_a_tally_of_known_rows(method_steps):
    case = Case.from_values({"joint": "small_end", "clearance_mm": 0.2})
    p, tally = record(case), new_tally(has_rod_load=True)

    def observe(times, moved=0.0):
        rows = rows_of(times)
        # each number of the state moves the nearness by a tenth of itself
        rows[:, Column.NEARNESS + 1] += 0.1 * np.sum(moved, axis=0)
        return rows

    steps = np.linspace(0.0, 0.1, method_steps + 1)
    rows = tally_steps(p, tally, steps, observe, True)
    assert rows.shape == (method_steps, 9, COLUMNS)
    assert tally["loss_seconds"][1] == pytest.approx(0.05, rel=1e-7)
    np.testing.assert_allclose(tally["side_seconds"], (0.0, 0.05), rtol=1e-7)
    np.testing.assert_allclose(tally["side_peak"], (0.0, 100.0), rtol=1e-9)
    assert tally["peak"][3] == pytest.approx(100.0, rel=1e-9)
    assert tally["switch_shift"][1] > 0.0
    fresh = new_tally()
    tally_steps(p, fresh, steps, observe, False)
    assert fresh["seconds"] == fresh["loss_seconds"][1] == fresh["peak"][3] == 0.0
