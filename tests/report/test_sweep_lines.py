"""Sweeps along one axis: what is drawn are the stored numbers, with their bars and jobs."""

import numpy as np
import pytest
from conftest import listed
from swept_made import grid

from compressor.report.figures.drawing import panels_of
from compressor.report.figures.sweep import draw_sweep

CLEARANCES = [0.1, 0.2, 0.3, 0.4]


def test_a_point_a_job_with_its_bar_and_key():
    data = grid({"clearance_mm": CLEARANCES}, lambda c: 1000 * c)
    (drawn,) = draw_sweep(data)
    peak, rms = panels_of(drawn.figure)
    (curve,) = peak.traces
    assert (peak.title, peak.y.title.text) == ("peak acceleration", "m/s²")
    assert peak.x.title.text == "clearance (mm)"
    assert curve.name == "peak acceleration"
    assert curve.x.tolist() == CLEARANCES
    assert curve.y == pytest.approx([100, 200, 300, 400])
    assert curve.error_y.array == pytest.approx([1, 2, 3, 4])
    assert curve.error_y.arrayminus == pytest.approx([1, 2, 3, 4])
    assert [*curve.customdata] == ["k0", "k1", "k2", "k3"]
    assert rms.traces[0].error_y.array is None  # its bars of 0.01 % are not seen


def test_failed_missing_and_chaotic_jobs_are_marked():
    status = ["ok", "failed", "missing", "ok"]
    regime = ["predictable", "", "", "chaotic"]
    data = grid({"clearance_mm": CLEARANCES}, lambda c: 1000 * c, status=status, regime=regime)
    (drawn,) = draw_sweep(data)
    panel = panels_of(drawn.figure)[0]
    marks = {trace.name: trace for trace in panel.traces}
    assert marks["a job failed here"].x == 0.2
    assert [*marks["a job failed here"].customdata] == ["k1"]
    assert marks["a job was not run"].x == 0.3
    ring = marks["chaotic: a greatest value holds for this run only"]
    assert (*ring.x, *ring.y, *ring.customdata) == (0.4, 400, "k3")
    assert panel.y.range[0] < marks["a job failed here"].y < 100
    assert ("failed", "1") in drawn.numbers
    assert {*listed(drawn.figure)} == {*marks} - {"peak acceleration"}


def test_words_are_points_above_their_ticks():
    (drawn,) = draw_sweep(grid({"load": ["spring", "gas"]}, lambda load: 5 + load))
    panel = panels_of(drawn.figure)[0]
    assert panel.x.ticktext == ("spring", "gas")
    assert panel.traces[0].mode == "markers"


def test_what_is_the_same_at_every_job_is_said():
    data = grid({"clearance_mm": CLEARANCES}, lambda c: 1000 * c)
    data["rms_acceleration"] = 0 * data["rms_acceleration"] + 7.5
    (drawn,) = draw_sweep(data)
    assert [panel.title for panel in panels_of(drawn.figure)] == ["peak acceleration"]
    assert ("rms acceleration, at every job", "7.5 m/s²") in drawn.numbers


def test_where_nothing_ran_nothing_is_drawn():
    data = grid({"clearance_mm": CLEARANCES}, lambda c: c, status=["failed"] * 4)
    assert draw_sweep(data) == []
    assert draw_sweep(grid({"clearance_mm": [0.1]}, lambda c: c)) == []


def test_of_very_many_values_some_are_drawn():
    (drawn,) = draw_sweep(grid({"clearance_mm": np.linspace(0.1, 1, 100_000)}, lambda c: c))
    (curve,) = panels_of(drawn.figure)[0].traces
    assert curve.x.size == 1000
    assert (curve.x[0], curve.x[-1]) == (0.1, 1.0)
    assert ("values of clearance drawn", "1,000 of 100,000") in drawn.numbers
