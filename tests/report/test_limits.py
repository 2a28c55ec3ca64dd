"""Zones by limits that a user gives, in tables and curves of a study."""

import math
import re

import numpy as np
import pytest
from conftest import store_cases, without_pictures
from swept_made import grid

from compressor.report.figures.drawing import panels_of
from compressor.report.figures.sweep import draw_sweep
from compressor.report.figures.sweep_data import MEASURES
from compressor.report.figures.sweep_panels import LIMIT
from compressor.report.limits import MORE_IS_BETTER, LimitError, read_limits
from compressor.report.page import measured_cell
from compressor.store.reader import open_study

PEAK = next(one for one in MEASURES if one.variable == "sensor_peak")


@pytest.mark.parametrize(
    ("value", "bar", "name", "number"),
    [
        (1.0, 0.1, "A", 0),
        (2.0, 0.0, "B", 1),  # on a limit: above it
        (2.1, 0.2, "A/B", 1),
        (4.0, math.nan, "B", 1),  # without a bar
        (6.0, 5.0, "A/C", 2),
        (99.0, 1.0, "C", 2),
        (math.nan, 0.1, "", -1),  # what is not known has no zone
        (3.0, math.inf, "", -1),
    ],
)
def test_a_value_and_its_bar_lie_in_a_zone(value, bar, name, number):
    cell = measured_cell(PEAK, value, bar, read_limits(["sensor_peak=2, 5 m/s2"]))
    assert cell.zone == number + 1
    assert cell.text.endswith(f" {name}" if name else ("–", "unknown"))


def test_limits_in_g_are_limits_in_m_per_s2():
    """They were refused on a page in g, which its own documentation said to write."""
    for units, words in (("plant", "A below 0.5 g, B from 0.5 g on, C from 2 g on."),
                         ("usual", "A below 4.90332 m/s², B from 4.90332 m/s² on")):  # fmt: skip
        limits = read_limits(["sensor_peak=0.5,2g"], units)
        assert limits.of(PEAK) == pytest.approx((4.903325, 19.6133))
        assert limits.of(PEAK.read_in("plant")) == pytest.approx((0.5, 2.0))
        assert words in limits.words([PEAK])[0]


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
        ("rod_load_reversal_angle=15 °", "compsim show JOB --reversal 30,25 judges it"),
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
    assert re.findall(r'class="zone-(\d)">[^<]* ([A-D/]+)<', page) == [("1", "A"), ("2", "B")]
    sentence = f"A below {middle} m/s², B from {middle} m/s² on."
    assert page.count(sentence) == 2  # of the table, and in the caption of the curves
    (figure,) = draw_sweep(study, read_limits([f"sensor_peak={middle} m/s2"]))
    lines = {one.title: [rule.y0 for rule in one.rules] for one in panels_of(figure.figure)}
    assert lines["sensor peak"] == [float(middle)]
    assert not lines["sensor rms"]


def of_limit(figure):
    curves = (one for one in panels_of(figure)[0].traces if one.type == "scatter")
    return [one for one in curves if one.line.color == LIMIT.color]


def test_limits_are_lines_in_maps_of_two_numbers():
    """The measure is the product of both axes: along the line it is the limit."""
    axes = {"speed_rpm": np.linspace(1, 3, 9), "clearance_mm": np.linspace(1, 2, 5)}
    data = grid(axes, lambda x, y: x * y)
    limits = read_limits(["peak_acceleration=3.5,99 m/s2"])
    (figure,) = [one for one in draw_sweep(data, limits) if one.name == "map"]
    (line,) = of_limit(figure.figure)
    known = np.isfinite(line.x)
    np.testing.assert_allclose(line.x[known] * line.y[known], 3.5, rtol=0.02)
    assert "A below 3.5 m/s²" in figure.caption
    bare = next(one for one in draw_sweep(data) if one.name == "map")
    assert not of_limit(bare.figure)
