"""Zones by limits that a user gives, in tables and curves of a study."""

import json
import math
import re

import numpy as np
import pytest
import xarray as xr
from compsim import cli
from conftest import store, without_pictures

from compressor.report.figures.drawing import panels_of
from compressor.report.figures.sweep import draw_sweep
from compressor.report.figures.sweep_data import MEASURES, measures
from compressor.report.figures.sweep_maps import LIMIT
from compressor.report.limits import MORE_IS_BETTER, LimitError, read_limits
from compressor.report.page import measured_cell
from compressor.store.reader import open_study

PEAK = next(one for one in MEASURES if one.variable == "sensor_peak")
VELOCITY = [one for one in MEASURES if one.variable == "body_velocity_rms"]


@pytest.mark.parametrize(
    ("value", "bar", "name", "number"),
    [
        (1.0, 0.1, "A", 0),
        (2.0, 0.0, "B", 1),  # on a limit: above it
        (2.1, 0.2, "A/B", 1),
        (4.0, math.nan, "B", 1),  # without a bar
        (6.0, 5.0, "A/C", 2),
        (99.0, 1.0, "C", 2),
    ],
)
def test_a_value_and_its_bar_lie_in_a_zone(value, bar, name, number):
    zone = read_limits(["sensor_peak=2, 5 m/s2"]).zone(PEAK, value, bar)
    assert (zone.name, zone.number) == (name, number)


def test_what_is_not_known_has_no_zone():
    limits = read_limits(["sensor_peak=2 m/s²"])
    assert limits.zone(PEAK, math.nan, 0.1) is None
    assert limits.zone(PEAK, 3.0, math.inf) is None
    assert limits.zone(VELOCITY[0], 3.0, 0.1) is None
    assert read_limits([]).zone(PEAK, 3.0, 0.1) is None
    assert measured_cell(PEAK, 3.0, math.inf, limits).zone == 0


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


def test_the_page_and_the_curves_show_the_zones(tmp_path, capsys):
    values = {
        "joint": "big_end", "clearance_mm": [0.05, 0.2], "sensor": True,
        "body": {"frequency_x_Hz": 4.0, "frequency_y_Hz": 30.0},
        "solve": {"duration_rev": 2, "settle_rev": 1, "accuracy": "draft"},
    }  # fmt: skip
    (tmp_path / "sensed.yaml").write_text(json.dumps(values))
    store(tmp_path / "results", tmp_path / "sensed.yaml")
    study = open_study(tmp_path / "results")
    low, high = study["sensor_peak"].values
    assert high > 1.2 * low
    middle = f"{(low + high) / 2:.6g}"
    report = ["report", "-r", str(tmp_path / "results"), "-o", str(tmp_path / "out")]
    with without_pictures():
        assert cli.main([*report, "--limit", f"sensor_peak={middle} m/s2"]) == 0
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert re.findall(r'class="zone-(\d)">[^<]* ([A-D/]+)<', page) == [("1", "A"), ("2", "B")]
    sentence = f"A below {middle} m/s², B from {middle} m/s² on."
    assert page.count(sentence) == 2  # of the table, and in the caption of the curves
    (figure,) = draw_sweep(study, read_limits([f"sensor_peak={middle} m/s2"]))
    lines = {one.title: [rule.y0 for rule in one.rules] for one in panels_of(figure.figure)}
    assert lines["sensor peak"] == [float(middle)]
    assert not lines["sensor rms"]
    capsys.readouterr()
    has = {one.variable for one in measures(study)} | {*MORE_IS_BETTER}
    lacking = next(one for one in MEASURES if one.variable not in has)
    with without_pictures():
        assert cli.main([*report, "--limit", f"{lacking.variable}=3 {lacking.unit}"]) == 0
    told = f"no study of this report has {lacking.variable}: its limits are shown nowhere"
    assert told in " ".join(capsys.readouterr().err.split())
    assert cli.main([*report, "--limit", "sensor_peak=3"]) == 2
    assert "write 'sensor_peak=3 m/s²'" in capsys.readouterr().err
    with without_pictures():
        assert cli.main(report) == 0
    assert "zone-" not in re.sub("<style>.*?</style>", "", (
        tmp_path / "out" / "index.html").read_text(encoding="utf-8"), flags=re.DOTALL)  # fmt: skip


def of_limit(figure):
    curves = (one for one in panels_of(figure)[0].traces if one.type == "scatter")
    return [one for one in curves if one.line.color == LIMIT.color]


def test_limits_are_lines_in_maps_of_two_numbers():
    """The measure is the product of both axes: along the line it is the limit."""
    x, y = np.linspace(1.0, 3.0, 9), np.linspace(1.0, 2.0, 5)
    values = x[:, None] * y
    shape = ("speed_rpm", "clearance_mm")
    data = xr.Dataset(
        {
            "sensor_peak": (shape, values, {"units": "m/s2"}),
            "status": (shape, np.full(values.shape, "ok")),
            "regime": (shape, np.full(values.shape, "")),
            "key": (shape, np.array([[f"{i}{j}" for j in range(5)] for i in range(9)])),
        },
        {"speed_rpm": x, "clearance_mm": y},
    )
    (figure,) = [one for one in draw_sweep(data, read_limits(["sensor_peak=3.5,99 m/s2"]))
                 if one.name == "map"]  # fmt: skip
    (line,) = of_limit(figure.figure)
    known = np.isfinite(line.x)
    np.testing.assert_allclose(line.x[known] * line.y[known], 3.5, rtol=0.02)
    assert "A below 3.5 m/s²" in figure.caption
    bare = next(one for one in draw_sweep(data) if one.name == "map")
    assert not of_limit(bare.figure)
