"""Sweeps along two axes: cells are the stored numbers."""

import csv
import io
import time

import numpy as np
import pytest
from conftest import listed
from swept_made import grid

from compressor.report.figures.drawing import as_csv, panels_of
from compressor.report.figures.sweep import draw_sweep

AXES = {"clearance_mm": [0.1, 0.2, 0.4, 0.5], "speed_rpm": [300.0, 400.0, 500.0]}


def traces(data):
    _, drawn = draw_sweep(data)  # the ranking is the first
    panel = panels_of(drawn.figure)[0]
    kinds = (
        "map"
        if one.type == "heatmap"
        else "area"
        if one.fill
        else {"lines": "line", "markers": "points"}[one.mode]
        for one in panel.traces
    )
    names = (f"{kind}:{one.name}" for kind, one in zip(kinds, panel.traces, strict=True))
    return drawn, panel, dict(zip(names, panel.traces, strict=True))


def test_cells_are_jobs():
    drawn, panel, found = traces(grid(AXES, lambda c, n: 10 * c + n))
    cells = found["map:peak acceleration"]
    assert cells.z[:, 0] == pytest.approx([301, 401, 501])
    assert cells.z[0] == pytest.approx([301, 302, 304, 305])
    assert cells.x.tolist() == AXES["clearance_mm"]
    of_csv = csv.DictReader(io.StringIO(as_csv(drawn.figure)))
    values = [row["peak acceleration: peak acceleration: clearance (mm)"] for row in of_csv]
    assert values[:4] == ["0.1", "0.2", "0.4", "0.5"]  # not halfway between cells' edges
    assert (*cells.customdata.ravel()[:5],) == (
        "k0",
        "k3",
        "k6",
        "k9",
        "k1",
    )  # in C order of the cells
    assert (panel.x.title.text, panel.y.title.text) == ("clearance (mm)", "speed (rpm)")
    assert cells.colorbar.title.text == "m/s²"
    assert drawn.name == "map"


def test_a_metric_that_a_job_lacks_is_drawn():
    """It was said to be the same at every job."""
    data = grid(AXES, lambda c, n: n + c)
    data["rms_acceleration"] = data["rms_acceleration"] * 0 + 5.0
    drawn, _, _ = traces(data)
    assert ("rms acceleration, at every job", "5 m/s²") in drawn.numbers
    data["rms_acceleration"][0, 0] = np.nan
    drawn, _, _ = traces(data)
    assert "at every job" not in drawn.caption
    assert listed(drawn.figure) == ["the job lacks this metric"]


def test_jobs_that_failed_with_numbers_are_drawn():
    """Such as those whose accuracy was not reached, though no job is ok."""
    data = grid(AXES, lambda c, n: n + c)
    data["status"][:] = "failed"
    assert draw_sweep(data)[-1].name == "map"


def test_failed_and_missing_cells_are_marked():
    status = np.full((4, 3), "ok", dtype="U7")
    status[1, 2], status[3, 0] = "failed", "missing"
    _, _, found = traces(grid(AXES, lambda c, n: 10 * c + n, status=status))
    failed, missing = found["points:a job failed here"], found["points:a job was not run"]
    assert (*failed.x, *failed.y, *failed.customdata) == (0.2, 500, "k5")
    assert (*missing.x, *missing.y, *missing.customdata) == (0.5, 300, "k9")
    assert np.isnan(found["map:peak acceleration"].z).sum() == 2


def test_values_and_axes_over_decades_are_logarithmic():
    axes = {"clearance_mm": [0.01, 0.1, 1.0], "speed_rpm": [300.0, 400.0, 500.0]}
    _, panel, found = traces(grid(axes, lambda c, n: c * n))
    cells = found["map:peak acceleration"]
    assert panel.x.type == "log"
    assert 10.0 ** cells.z[0] == pytest.approx([3, 30, 300])
    assert cells.x.tolist() == axes["clearance_mm"]


def test_words_stand_at_their_cells():
    axes = {"fault": ["big_end", "small_end", "both"], "load": ["spring", "gas", "none"]}
    _, panel, found = traces(grid(axes, lambda joint, load: joint + load))
    assert [*found] == ["area:", "map:peak acceleration"]
    assert panel.x.ticktext == ("big<br>end", "small<br>end", "both<br>joints")


def test_large_grids_are_thinned_with_a_word():
    axes = {"clearance_mm": np.linspace(0.1, 0.9, 400), "speed_rpm": np.linspace(300, 900, 250)}
    data = grid(axes, lambda c, n: c * n)
    start = time.process_time()
    drawn, _, found = traces(data)
    assert time.process_time() - start < 5.0
    assert found["map:peak acceleration"].z.shape == (64, 64)
    assert ("values of clearance drawn", "64 of 400") in drawn.numbers
