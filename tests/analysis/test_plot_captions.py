"""What is said under plots of a study: rows that are drawn, of one kind of signal."""

import numpy as np

from compressor.analysis.cycle import Cycle
from compressor.analysis.plot_captions import PLOT_CAPTIONS, SweptRow
from compressor.report.figures.job import draw_cycles
from compressor.report.plots import keep_sensed

CYCLES = PLOT_CAPTIONS["study"]["cycles"]
ANGLES = np.arange(360.0)


def row(value, peak, is_sensed=True, **more):
    vibration = np.where(ANGLES == 90, peak, 1.0)
    cycle = Cycle(ANGLES, vibration, is_sensed, ANGLES, vibration, (10.0, 200.0), (), {})
    return SweptRow(value, cycle=cycle, **more)


def test_a_sensor_and_a_crosshead_are_not_compared():
    """The greatest "of the sensor's record" was the acceleration of a crosshead."""
    rows = [row("0.1", 40.0), row("0.2", 642.0, is_sensed=False), row("0.3", 50.0)]
    kept = keep_sensed(rows)
    assert [bool(one.cycle) for one in kept] == [True, False, True]
    said = CYCLES(kept, "clearance_mm")
    assert "greatest, 50 m/s² (5.1 g), at 0.3, where it comes at 90°" in said
    assert said.endswith("Not drawn: 1 job of 3 (no sensor).")
    alone = [row("0.1", 40.0, is_sensed=False), row("0.2", 642.0, is_sensed=False)]
    assert keep_sensed(alone) == alone
    assert "greatest magnitude of the acceleration of the crosshead" in CYCLES(alone, "joint")


def test_a_map_names_the_marks_that_it_has():
    def names(events, reversals):
        vibration = np.ones(360)
        cycle = Cycle(ANGLES, vibration, True, ANGLES, vibration, reversals, events, {})
        panel = draw_cycles([SweptRow("0.1", cycle=cycle)], "clearance").panels[0]
        return [trace.name for trace in panel.traces if trace.style.marker]

    assert names(((9.0, "suction opens"),), ()) == ["a valve opens or closes"]
    cam = names(((9.0, "cam: dwell ends"),), (40.0,))
    assert cam == ["corner of the load", "rod load changes its side"]
    assert names((), ()) == []


def test_one_row_has_no_least():
    said = CYCLES([row("0.1", 40.0)], "clearance_mm")
    assert "Over the revolution it is greatest, 40 m/s²" in said
    assert "a row for each value of clearance_mm" in said


def test_rows_are_jobs_where_values_repeat():
    rows = [row("0.1", 40.0), row("0.1", 50.0), SweptRow("0.2", problem="failed")]
    said = CYCLES(rows, "clearance_mm")
    assert "a row for each job, in the order of clearance_mm" in said
    assert said.endswith("Not drawn: 1 job of 3 (failed).")
