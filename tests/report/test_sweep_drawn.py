"""Sweeps as they are drawn: what is drawn are the stored numbers, with their bars and jobs."""

import csv
import io
import time

import numpy as np
import pytest
import xarray as xr
from conftest import listed as legend
from swept_made import grid, listed

from compressor.report.figures.drawing import as_csv, panels_of
from compressor.report.figures.sweep import draw_sweep
from compressor.report.figures.sweep_data import MEASURES, sweep_of


def plan(data):
    return {one.name: one for one in draw_sweep(data)}


# ---- along one axis

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
    assert {*legend(drawn.figure)} == {*marks} - {"peak acceleration"}


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


# ---- sampled: points are jobs, and thinning is told

RNG = np.random.default_rng(5)
CLEARANCE, SPEED = RNG.random((2, 60)) + 1.0
COLUMNS = {"clearance_mm": CLEARANCE, "speed_rpm": SPEED}


def by_name(panel):
    return {trace.name: trace for trace in panel.traces}


def test_points_are_jobs_over_what_matters_most():
    found = plan(listed(COLUMNS, 2 + SPEED**2))
    assert [*found] == ["ranking", "points"]
    panel = panels_of(found["points"].figure)[0]
    assert panel.x.title.text == "speed (rpm)"  # what matters most
    one = by_name(panel)
    assert one["a job"].x.tolist() == SPEED.tolist()
    assert one["a job"].y == pytest.approx(2 + SPEED**2)
    assert [*one["a job"].customdata] == [f"k{n}" for n in range(60)]
    assert (
        found["points"].caption
        == "Every metric over the key that matters most for each, a point a job. Jobs: 60."
    )


def test_words_are_colours():
    load = np.array(["spring", "gas"] * 30)
    values = np.where(load == "spring", SPEED, 5 - SPEED)
    panel = panels_of(plan(listed(COLUMNS | {"load": load}, values))["points"].figure)[0]
    one = by_name(panel)
    assert one["load spring"].y == pytest.approx(values[::2])
    assert one["load gas"].marker.color != one["load spring"].marker.color


def test_what_is_not_known_is_marked():
    status, regime = (np.full(60, word, dtype="U11") for word in ("ok", "predictable"))
    status[3], regime[7] = "failed", "chaotic"
    values = 2 + SPEED**2
    values[7] = 60.0
    panel = plan(listed(COLUMNS, values, status=status, regime=regime))["points"].figure
    one = by_name(panels_of(panel)[0])
    assert [*one["a job failed here"].customdata] == ["k3"]
    ring = next(trace for name, trace in one.items() if name.startswith("chaotic"))
    assert (*ring.y, *ring.customdata) == (60.0, "k7")
    assert ring.marker.symbol == "circle-open"
    size = ring.marker.size + ring.marker.line.width
    assert size <= one["a job"].marker.size + 1e-2  # it covers no point


def test_many_jobs_are_thinned_with_a_word():
    rng = np.random.default_rng(6)
    columns = {name: rng.random(100_000) for name in ("clearance_mm", "speed_rpm", "rod_mass_kg")}
    data = listed(columns, 1 + columns["clearance_mm"] + 0.1 * rng.random(100_000))
    start = time.process_time()
    found = plan(data)
    assert time.process_time() - start < 5.0
    for panel in panels_of(found["points"].figure):
        assert by_name(panel)["a job"].x.size == 2000
    assert ("jobs drawn", "2,000 of 100,000") in found["points"].numbers


# ---- by a second axis: lines are stored jobs, or means

THREE = {"clearance_mm": [0.1, 0.2, 0.3], "speed_rpm": [300.0, 400.0],
         "fault": ["big_end", "both"]}  # fmt: skip


def peak(c, n, joint):
    return 1000 + 1000 * c + 10 * n * c + 3 * joint


def test_the_overview_shows_means_of_what_is_known():
    status, regime = (np.full((3, 2, 2), word, dtype="U11") for word in ("ok", "predictable"))
    status[0, 0, 0], regime[1, 1, 1] = "failed", "chaotic"
    drawn = plan(grid(THREE, peak, status=status, regime=regime))["overview"]
    slow, fast = panels_of(drawn.figure)[0].traces
    c = np.array([0.1, 0.2, 0.3])
    expected = peak(c, 300, 0.5)
    expected[0] = peak(0.1, 300, 1)
    assert slow.y == pytest.approx(expected)
    expected = peak(c, 400, 0.5)
    expected[1] = peak(0.2, 400, 0)
    assert fast.y == pytest.approx(expected)
    assert slow.customdata is None
    assert drawn.sentence.endswith("a point is the mean over joint.")
    assert drawn.numbers[:3] == [("jobs", "12"), ("failed", "1"), ("chaotic", "1")]


def test_two_axes_with_words_are_lines_of_jobs():
    axes = {"clearance_mm": THREE["clearance_mm"], "fault": THREE["fault"]}
    drawn = plan(grid(axes, lambda c, joint: 10 * c + joint))
    assert [*drawn] == ["ranking", "overview"]
    first, second = panels_of(drawn["overview"].figure)[0].traces
    assert (first.name, second.name) == ("joint big end", "both joints")
    assert second.y == pytest.approx([2, 3, 4])
    assert [*second.customdata] == ["k1", "k3", "k5"]


@pytest.mark.parametrize(("sizes", "limit"), [((7, 4, 5, 3), 2.0), ((18, 18, 18, 18), 5.0)])
def test_four_axes_are_few_lines_in_few_panels(sizes, limit):
    names = ("clearance_mm", "rod_mass_kg", "speed_rpm")
    axes = {n: np.linspace(1, 2, size) for n, size in zip(names, sizes, strict=False)}
    axes["load"] = [f"word {n}" for n in range(sizes[3])]
    data = grid(axes, lambda c, m, n, load: 100 + c * n + 0.1 * m + load * c)
    start = time.process_time()
    found = plan(data)
    assert time.process_time() - start < limit
    assert [*found] == ["ranking", "overview"]
    for drawn in found.values():
        panels = panels_of(drawn.figure)
        assert len(panels) <= 12
        for panel in panels:
            names = [trace.name for trace in panel.traces]
            assert all(names)
            assert len(names) == len({*names}) <= 12


def test_a_study_of_words_alone_is_points():
    axes = {"fault": ["big_end", "both"], "load": ["spring", "gas"], "law": ["one", "two"]}
    drawn = plan(grid(axes, lambda a, b, c: 1 + 4 * a + 2 * b + c))["overview"]
    panel = panels_of(drawn.figure)[0]
    assert panel.x.ticktext == ("big<br>end", "both<br>joints")
    assert all(trace.mode == "markers" for trace in panel.traces)


# ---- along two axes: cells are jobs

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
    assert legend(drawn.figure) == ["the job lacks this metric"]


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
    axes = {"clearance_mm": np.linspace(0.1, 0.9, 4000), "speed_rpm": np.linspace(300, 900, 25)}
    data = grid(axes, lambda c, n: c * n)
    data["peak_acceleration"][7, 3] = np.nan  # which is filled for the ranking
    start = time.process_time()
    drawn, _, found = traces(data)
    assert time.process_time() - start < 5.0
    assert found["map:peak acceleration"].z.shape == (25, 64)
    assert ("values of clearance drawn", "64 of 4,000") in drawn.numbers


# ---- grids in order, and lists

PEAK = next(m for m in MEASURES if m.variable == "peak_acceleration")
RMS = next(m for m in MEASURES if m.variable == "rms_acceleration")


def test_numbers_of_a_grid_are_sorted_and_words_are_not():
    axes = {"clearance_mm": [0.3, 0.1, 0.2], "load": ["gas", "spring"], "rod_mass_kg": [4.0]}
    sweep = sweep_of(grid(axes, lambda c, load, m: 100 * c + load))
    assert [axis.name for axis in sweep.axes] == ["clearance_mm", "load"]  # what has two values
    assert sweep.axes[0].values.tolist() == [0.1, 0.2, 0.3]
    assert sweep.axes[1].words == ["gas", "spring"]
    assert PEAK.of(sweep.data) == pytest.approx(np.array([[10, 11], [20, 21], [30, 31]]))
    assert sweep.keys.tolist() == [["k2", "k3"], ["k4", "k5"], ["k0", "k1"]]
    assert sweep.axes[0].title == "clearance (mm)"
    assert sweep.axes[0].value_text(1) == "clearance 0.2 mm"


def test_a_list_of_jobs_is_no_grid_even_where_it_fills_one():
    columns = {"clearance_mm": [0.1, 0.1, 0.2, 0.2], "speed_rpm": [400.0, 500.0] * 2}
    sweep = sweep_of(listed(columns, range(4)))
    assert not sweep.is_grid
    assert sweep.status.shape == (4,)


def test_what_is_rounding_beside_the_other_axis_is_0():
    """It was told as 9.764e-14 mm/s, and a worn machine's as 1.6e+11 times that."""
    values = xr.DataArray([[9.79e-3, 9.764e-17], [9.79e-3, 1.6e-5]], dims=("job", "axis"))
    data = xr.Dataset(
        {"body_velocity_rms": values, "body_velocity_rms_error": 0.8 * values}, {"axis": ["x", "y"]}
    )
    x, y = (m for m in MEASURES if m.variable == "body_velocity_rms")
    assert y.of(data) == pytest.approx([0.0, 0.016])
    assert y.of(data)[0] == y.bar(data)[0] == 0.0
    assert x.of(data) == pytest.approx([9.79, 9.79])


def test_what_a_bar_does_not_vouch_for_is_not_known():
    regime = ["predictable", "chaotic"]
    sweep = sweep_of(grid({"clearance_mm": [0.1, 0.2]}, lambda c: 100 * c, regime=regime))
    assert np.isnan(sweep.known(PEAK)).tolist() == [False, True]
    assert np.isnan(sweep.known(RMS)).tolist() == [False, False]
    assert sweep.chaotic.tolist() == [False, True]
