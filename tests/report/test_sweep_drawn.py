"""Sweeps as they are drawn: numbers with bars and jobs, which key matters, and a user's limits."""

import csv
import io
import math
import re

import numpy as np
import pytest
import xarray as xr
from conftest import listed as legend
from conftest import store_cases, without_pictures
from swept_made import grid, listed

from compressor.cases.swept import design
from compressor.metrics import JOINTS
from compressor.report.figures.drawing import as_csv, panels_of
from compressor.report.figures.sweep import draw_sweep
from compressor.report.figures.sweep_data import MEASURES, axis_of, sweep_of
from compressor.report.limits import MORE_IS_BETTER, LimitError, read_limits
from compressor.report.page import measured_cell
from compressor.store.reader import open_study
from compressor.store.studies import coordinate_names, swept_column


def plan(data, *limits):
    return {one.name: one for one in draw_sweep(data, *limits)}


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


def test_keys_that_are_zipped_are_a_curve():
    zipped = {"load": ["gas", "gas", "none"], "big": [0.3, 0.1, 0.2], "small": [0.01, 0.02, 0.01]}
    data = listed(zipped, [300, 100, 200])
    assert "points" in plan(data)
    (drawn,) = draw_sweep(data, is_curve=True)
    (curve,) = panels_of(drawn.figure)[0].traces
    assert (*curve.x, *curve.customdata) == (0.1, 0.2, 0.3, "k1", "k2", "k0")
    assert drawn.sentence.startswith("Every metric against big (load, small with it), a point")
    same = listed({"big": [0.1, 0.1, 0.2]}, [300, 100, 200])
    assert draw_sweep(same, is_curve=True)[0].name != "big"  # two jobs at one place


def test_noise_is_no_trend():
    """An axis from 39.232 to 39.238 mm/s, in the bars' own middle, was a falling line."""
    (drawn,) = draw_sweep(grid({"clearance_mm": CLEARANCES}, lambda c: 39.23 + 0.01 * c))
    peak, rms = (np.ptp(panel.y.range) for panel in panels_of(drawn.figure))
    assert peak == pytest.approx(6 * 0.392, rel=1e-3)  # of its bars of 1 %
    assert rms == pytest.approx(0.01 * 19.617, rel=1e-3)  # of the value: its bars are shorter


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


def test_where_nothing_ran_nothing_is_drawn():
    data = grid({"clearance_mm": CLEARANCES}, lambda c: c, status=["failed"] * 4)
    assert draw_sweep(data) == []
    assert draw_sweep(grid({"clearance_mm": [0.1]}, lambda c: c)) == []


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
    assert found["points"].caption.endswith("for each, a point a job. Jobs: 60.")


def test_words_are_colours():
    load = np.array(["spring", "gas", "a", "b", "c", "d"] * 10)
    values = np.where(load == "spring", SPEED, 5 - SPEED)
    panel = panels_of(plan(listed(COLUMNS | {"load": load}, values))["points"].figure)[0]
    one = by_name(panel)
    assert one["load spring"].y == pytest.approx(values[::6])
    assert len({trace.marker.color for trace in one.values()}) == 6


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


def test_four_axes_are_few_lines_in_few_panels():
    axes = {n: np.linspace(1, 2, 18) for n in ("clearance_mm", "rod_mass_kg", "speed_rpm")}
    axes["load"] = [f"word {n}" for n in range(18)]
    data = grid(axes, lambda c, m, n, load: 100 + c * n + 0.1 * m + load * c)
    found = plan(data)
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
    *_, drawn = draw_sweep(data)  # the ranking is the first
    panel = panels_of(drawn.figure)[0]
    return drawn, panel, by_name(panel)


def test_cells_are_jobs():
    drawn, panel, found = traces(grid(AXES, lambda c, n: 10 * c + n))
    cells = found["peak acceleration"]
    assert cells.z[:, 0] == pytest.approx([301, 401, 501])
    assert cells.z[0] == pytest.approx([301, 302, 304, 305])
    assert cells.x.tolist() == AXES["clearance_mm"]
    of_csv = csv.DictReader(io.StringIO(as_csv(drawn.figure)))
    values = [row["peak acceleration: peak acceleration: clearance (mm)"] for row in of_csv]
    assert values[:4] == ["0.1", "0.2", "0.4", "0.5"]  # not halfway between cells' edges
    assert [*cells.customdata.ravel()[:5]] == ["k0", "k3", "k6", "k9", "k1"]  # row by row
    assert (panel.x.title.text, panel.y.title.text) == ("clearance (mm)", "speed (rpm)")
    assert cells.colorbar.title.text == "m/s²"
    assert (drawn.name, cells.zmin, cells.zmax) == ("map", 301, 505)
    noise = grid(AXES, lambda c, n: 500 + 1e-4 * n)
    noise["peak_acceleration_error"][:] = 200
    nearly = traces(noise)[2]["peak acceleration"]  # over 6 bars, so that noise is no pattern
    assert (nearly.zmin, nearly.zmax) == (0, 1200)  # and nothing is below 0


def test_a_metric_that_a_job_lacks_is_drawn():
    """It was said to be the same at every job."""
    data = grid(AXES, lambda c, n: n + c)
    data["rms_acceleration"] = data["rms_acceleration"] * 0 + 5.0
    drawn, _, _ = traces(data)
    assert ("rms acceleration, at every job", "5 m/s²") in drawn.numbers
    drawn, panel, _ = traces(data.assign(peak_acceleration=0 * data["peak_acceleration"]))
    assert panel.title == "rms acceleration"  # and no map of 0, on a scale from -0.5 to 0.5
    data["rms_acceleration"][0, 0] = np.nan
    drawn, _, _ = traces(data)
    assert "at every job" not in drawn.caption
    assert "one without colour lacks the metric" in drawn.caption
    drawn, _, _ = traces(data.assign(rms_acceleration=0 * data["rms_acceleration"]))
    assert ("rms acceleration, at every job that has it", "0 m/s²") in drawn.numbers
    data["status"][:] = "failed"  # as of jobs whose accuracy was not reached
    assert draw_sweep(data)[-1].name == "map"


def test_failed_and_missing_cells_are_marked():
    status = np.full((4, 3), "ok", dtype="U7")
    status[1, 2], status[3, 0] = "failed", "missing"
    _, _, found = traces(grid(AXES, lambda c, n: 10 * c + n, status=status))
    failed, missing = found["a job failed here"], found["a job was not run"]
    assert (*failed.x, *failed.y, *failed.customdata) == (0.2, 500, "k5")
    assert (*missing.x, *missing.y, *missing.customdata) == (0.5, 300, "k9")
    assert np.isnan(found["peak acceleration"].z).sum() == 2


def test_values_and_axes_over_decades_are_logarithmic():
    axes = {"clearance_mm": [0.01, 0.1, 1.0], "speed_rpm": [300.0, 400.0, 500.0]}
    _, panel, found = traces(grid(axes, lambda c, n: c * n))
    cells = found["peak acceleration"]
    assert panel.x.type == "log"
    assert 10.0 ** cells.z[0] == pytest.approx([3, 30, 300])
    assert cells.x.tolist() == axes["clearance_mm"]


def test_words_stand_at_their_cells():
    axes = {"fault": ["big_end", "small_end", "both"], "load": ["spring", "gas", "none"]}
    _, panel, _ = traces(grid(axes, lambda joint, load: joint + load))
    assert panel.x.ticktext == ("big<br>end", "small<br>end", "both<br>joints")


RANDOM = np.random.default_rng(6).random((3, 100_000))
WIDE = {"clearance_mm": np.linspace(0.1, 0.9, 4000), "speed_rpm": np.linspace(300, 900, 25)}


@pytest.mark.parametrize(
    ("name", "made", "shape", "words"),
    [
        ("clearance_mm", lambda: grid({"clearance_mm": RANDOM[0]}, lambda c: c), (1000,),
         ("values of clearance drawn", "1,000 of 100,000")),
        ("points", lambda: listed(dict(zip(COLUMNS, RANDOM, strict=False)), RANDOM[0] + RANDOM[2]),
         (2000,), ("jobs drawn", "2,000 of 100,000")),
        ("map", lambda: grid(WIDE, lambda c, n: c * n), (25, 64),
         ("values of clearance drawn", "64 of 4,000")),
    ],
)  # fmt: skip
def test_many_jobs_are_thinned_with_a_word(name, made, shape, words):
    data = made()
    data["peak_acceleration"].values.flat[7] = np.nan  # which is filled for the ranking
    drawn = plan(data)[name]
    of = by_name(panels_of(drawn.figure)[0])
    trace = of["a job" if name == "points" else "peak acceleration"]
    assert (trace.z if name == "map" else trace.x).shape == shape
    assert words in drawn.numbers


# ---- grids in order, and lists

PEAK = next(m for m in MEASURES if m.variable == "peak_acceleration")


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


def test_both_joints_keys_have_one_form():
    """A figure had "clearance, small end" beside "radial clearance of the big end"."""
    keys = [f"clearance_mm.{joint}" for joint in JOINTS]
    names = coordinate_names(keys)
    columns = {names[key]: ("job", *swept_column(key, [0.1, 0.2])) for key in keys}
    phrases = [axis_of(xr.Dataset(coords=columns), name).phrase for name in columns]
    assert phrases == ["clearance, big end", "clearance, small end"]


def test_a_list_of_jobs_is_no_grid_even_where_it_fills_one():
    columns = {"clearance_mm": [0.1, 0.1, 0.2, 0.2], "speed_rpm": [400.0, 500.0] * 2}
    assert [*plan(listed(columns, range(4)))] == ["points"]


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


# ---- which key matters: bars and sentences say what the effects are

MIXED = {"clearance_mm": [1.0, 2.0, 3.0], "speed_rpm": [1.0, 2.0, 3.0, 4.0],
         "load": ["spring", "gas"]}  # fmt: skip


def bars(drawn):
    return {
        panel.title: {trace.name.partition("(")[2].rstrip(")"): trace.x for trace in panel.traces}
        for panel in panels_of(drawn.figure)
    }


def test_bars_and_caption_are_the_exact_shares():
    """Of c + 2 n + 0 load: V = 2/3 + 5, without interactions. rms is half of it, thus the same."""
    drawn = plan(grid(MIXED, lambda c, n, load: 10 + c + 2 * n + 0 * load))["ranking"]
    found = bars(drawn)
    share = 500 / (2 / 3 + 5)
    assert [*found] == ["speed", "clearance", "load"]  # the strongest first
    for kind in ("main effect", "total effect"):
        assert found["speed"][kind] == pytest.approx([share] * 2)
        assert found["clearance"][kind] == pytest.approx([100 - share] * 2)
        assert found["load"][kind] == pytest.approx([0, 0])
    words = f"Peak acceleration: speed {share:.0f} %, clearance {100 - share:.0f} %; rms"
    assert words in drawn.caption
    panel = panels_of(drawn.figure)[0]
    assert panel.y.ticktext == ("peak acceleration", "rms acceleration")
    assert panel.x.title.text == "share of variance (%)"
    noise = plan(grid(MIXED, lambda c, n, load: 500 + c + n + load))["ranking"]  # in bars of 1 %
    why = "too few values are known or all are the same within their error bars"
    assert (f"not ranked, as {why}", "peak acceleration") in noise.numbers


def test_jobs_without_a_value_are_told():
    status = np.full((3, 4, 2), "ok", dtype="U7")
    status[1, 1, 0] = "failed"
    drawn = plan(grid(MIXED, lambda c, n, load: 10 + c + 2 * n + 0 * load, status=status))
    assert bars(drawn["ranking"])["load"]["total effect"] == pytest.approx([0, 0], abs=1e-6)
    (label,) = (label for label, value in drawn["ranking"].numbers if value == "up to 1")
    assert label.endswith("count with the sum of their axes' main effects")


def test_correlations_are_told_with_their_intervals():
    points = design("lhs", 40, 2, 1)
    columns = {"clearance_mm": points[:, 0], "speed_rpm": points[:, 1]}
    drawn = plan(listed(columns, 1 + points[:, 0] + points[:, 1]))["ranking"]
    words = r"Peak acceleration: \w+ (\S+) \((\S+) to (\S+)\), \w+ (\S+) \("
    told = re.search(words, drawn.caption)
    first, low, high, second = map(float, told.groups())
    assert low < second <= first < high
    drawn = plan(listed(columns, 1 - 0.9 * points[:, 0] + 0.02 * points[:, 1]))["ranking"]
    assert "Peak acceleration: clearance −1.00 (−1.00 to −1.00), speed" in drawn.caption
    panel = panels_of(drawn.figure)[0]
    (found,) = (trace for trace in panel.traces if trace.type == "bar")
    assert found.x[0] == pytest.approx(-1.0, abs=0.01)
    assert found.error_x.array is not None


def test_keys_that_go_together_are_told():
    """Where joints wear one at a time, the other's clearance seemed to lessen its knock."""
    columns = {"clearance_mm": SPEED - 0.5 * CLEARANCE, "speed_rpm": SPEED}
    told = plan(listed(columns, 1 + CLEARANCE + SPEED))["ranking"].sentence
    assert re.search(
        r"one's effect may be the other's: clearance and speed \(0\.[6-9]\d\)\.$", told
    )
    assert "other's" not in plan(listed(COLUMNS, 1 + CLEARANCE))["ranking"].sentence


def test_blocks_of_a_design_with_a_failed_job_are_left_out():
    """y = 1 + x1 + 3 x2, of 64 blocks six with a failed job: the first 32 whole ones count."""
    points = design("saltelli", 64, 2, 1)
    columns = {"clearance_mm": points[:, 0], "speed_rpm": points[:, 1]}
    status = np.full(256, "ok", dtype="U7")
    status[[3, 9, 64 + 20, 128 + 30, 192 + 30, 192 + 40, 192 + 50]] = "failed"  # 30 twice
    drawn = plan(listed(columns, 1 + points[:, 0] + 3 * points[:, 1], status=status))["ranking"]
    (high,) = re.search(r"Sobol's indices .*: speed \d+ \(\d+ to (\d+)\) %", drawn.caption).groups()
    assert panels_of(drawn.figure)[0].x.range[1] > int(high) > 100  # as it is estimated
    assert ("first whole blocks of the design", "32") in drawn.numbers
    left_out = [value for label, value in drawn.numbers if label.endswith("are left out")]
    assert left_out == ["up to 7"]


def test_of_a_grid_with_large_gaps_nothing_is_ranked():
    status = np.full((3, 4, 2), "ok", dtype="U7")
    status[0] = "missing"
    status[1, :2] = "failed"
    data = grid(MIXED, lambda c, n, load: 10 + c + 2 * n + 0 * load, status=status)
    assert [*plan(data)] == ["overview"]


# ---- zones by limits that a user gives, in tables and curves


SENSOR = next(one for one in MEASURES if one.variable == "sensor_peak")


@pytest.mark.parametrize(
    ("value", "bar", "name"),
    [
        (1.0, 0.1, "A"),
        (2.0, 0.0, "B"),  # on a limit: above it
        (2.1, 0.2, "A/B"),
        (4.0, math.nan, "B"),  # without a bar
        (6.0, 5.0, "A/C"),
        (99.0, 1.0, "C"),
        (math.nan, 0.1, ""),  # what is not known has no zone
        (3.0, math.inf, ""),
    ],
)
def test_a_value_and_its_bar_lie_in_a_zone(value, bar, name):
    cell = measured_cell(SENSOR, value, bar, read_limits(["sensor_peak=2, 5 m/s2"]))
    assert cell.zone == name[-1:]
    assert cell.text.endswith(f" {name}" if name else ("–", "unknown"))


def test_limits_in_g_are_limits_in_m_per_s2():
    """They were refused on a page in g, which its own documentation said to write."""
    for units, words in (("plant", "A below 0.5 g, B from 0.5 g on, C from 2 g on."),
                         ("usual", "A below 4.90332 m/s², B from 4.90332 m/s² on")):  # fmt: skip
        limits = read_limits(["sensor_peak=0.5,2g"], units)
        assert limits.of(SENSOR) == pytest.approx((4.903325, 19.6133))
        assert limits.of(SENSOR.read_in("plant")) == pytest.approx((0.5, 2.0))
        assert words in limits.words([SENSOR])[0]


@pytest.mark.parametrize("units", ["usual", "plant", "si"])
@pytest.mark.parametrize(
    "metric",
    [*dict.fromkeys(one.variable for one in MEASURES if one.variable not in MORE_IS_BETTER)],
)
def test_every_metric_of_the_page_takes_a_limit_in_its_unit(metric, units):
    """What is refused without a unit is told with it, and that is taken."""
    one = next(one for one in MEASURES if one.variable == metric).read_in(units)
    text = f"{metric}=3,7"
    if one.unit not in ("", "per rev"):
        with pytest.raises(LimitError, match=f"write '{metric}=3,7 {re.escape(one.unit)}'"):
            read_limits([text], units)
        text += f" {one.unit}"
    assert read_limits([text], units).of(one) == pytest.approx((3.0, 7.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("body_velocity_rms_mm_per_s=2", "did you mean body_velocity_rms"),
        ("sensor_peak", "write METRIC=VALUE"),
        ("sensor_peak=2 mm/s", "'mm/s' is no unit of it; there are m/s2, m/s², g"),
        ("sensor_peak=2,x g", "limits are numbers"),
        ("sensor_peak=3,2 g", "each above the last"),
        ("sensor_peak=1,2,3,4 g", "one to 3 numbers"),
        ("sensor_peak=nan g", "limits are numbers"),
        ("rod_load_reversal_angle=15 °", "compsim show JOB judges it"),
    ],
)
def test_what_is_no_limit_is_refused(text, message):
    with pytest.raises(LimitError, match=re.escape(message)):
        read_limits([text])
    with pytest.raises(LimitError, match="has limits already"):
        read_limits(["sensor_peak=1g", "sensor_peak=2g"])


def test_the_page_and_the_curves_show_the_zones(tmp_path, compsim):
    values = {
        "joint": "big_end", "clearance_mm": [0.05, 0.2], "sensor": True,
        "body": {"frequency_x_Hz": 4.0, "frequency_y_Hz": 30.0},
        "solve": {"duration_rev": 2, "settle_rev": 1, "accuracy": "draft"},
    }  # fmt: skip
    store_cases(tmp_path, sensed=values)
    study = open_study(tmp_path / "results")
    low, high = study["sensor_peak"].values
    assert high > 1.2 * low
    middle = f"{(low + high) / 2:.6g}"
    report = ["report", "-r", tmp_path / "results", "-o", tmp_path / "out", "--limit"]
    assert "write 'sensor_peak=3 m/s²'" in compsim(*report, "sensor_peak=3", code=2).err
    limits = [f"sensor_peak={middle} m/s2", "--limit", "peak_rod_load_tension=3 kN"]
    with without_pictures():
        err = compsim(*report, *limits).err
    told = "no study of this report has peak_rod_load_tension: its limits are shown nowhere"
    assert told in " ".join(err.split())
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert re.findall(r'class="zone-(\w)">[^<]* ([A-D/]+)<', page) == [("A", "A"), ("B", "B")]
    sentence = f"A below {middle} m/s², B from {middle} m/s² on."
    assert page.count(sentence) == 2  # of the table, and in the caption of the curves
    (figure,) = draw_sweep(study, read_limits([f"sensor_peak={middle} m/s2"]))
    lines = {one.title: [rule.y0 for rule in one.rules] for one in panels_of(figure.figure)}
    assert lines["sensor peak"] == [float(middle)]
    assert not lines["sensor rms"]
