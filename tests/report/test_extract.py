"""What is read off a figure: the numbers that were drawn, in CSV and for the page."""

import base64
import csv
import io
import json

import numpy as np
import pytest
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from compressor.report.figures.extract import FigureData, as_csv, extract, with_jobs
from compressor.report.interactive import (
    MAX_POINTS,
    content,
    describe_figure,
    extremes,
    link_scales,
    publish_library,
    script,
)

X = np.linspace(0.0, 360.0, 721)


def numbers(packed):
    """What the page makes of packed numbers."""
    if isinstance(packed, list):
        first, step, count = packed
        return first + step * np.arange(count)
    return np.frombuffer(base64.b64decode(packed), "<f4")


@pytest.fixture
def figure():
    """Two panels of curves side by side, below them a map and bars."""
    figure = Figure(figsize=(8, 4), layout="constrained")
    (left, right), (low, bars) = figure.subplots(2, 2)
    for panel in (left, right):
        panel.plot(X, np.sin(np.radians(X)), color="#1f4488", linestyle=(0, (4, 2)))
        panel.plot(X, np.cos(np.radians(X)), color="#d0583b", label="cosine")
        panel.axhline(0.0, color="#000000")
        panel.set_xlabel("angle (°)")
        panel.set_ylabel("$F_x$ (kN)")
        panel.set_xlim(0, 360)
    right.set_xlim(90, 120)
    left.set_title("whole", loc="left")
    right.set_title("enlarged", loc="left")
    handle = left.plot([], [], color="#1f4488", linestyle=(0, (4, 2)), label="_")[0]
    figure.legend(handles=[handle], labels=["sine"])
    mesh = low.pcolormesh([1, 2, 4], [0, 1, 2], [[1, 10], [100, np.nan]], norm=LogNorm(1, 100))
    with_jobs(mesh, [["a", "b"], ["c", "d"]])
    figure.colorbar(mesh, ax=low, label="peak (kN)")
    bars.barh([0, 1], [0.25, 0.75], xerr=[[0.1, 0.2], [0.1, 0.1]], label="main effect")
    bars.set_yticks([0, 1], ["speed", "clearance"])
    bars.errorbar([0.1, 0.2], [0.5, 0.6], yerr=[[0.1, 0.2], [0.3, 0.4]], marker="o", label="jobs")
    return figure


def test_every_artist_is_read(figure):
    found = extract(figure)
    whole, enlarged, low, bars = found.panels
    assert [panel.title for panel in found.panels] == ["whole", "enlarged", "", ""]
    assert [(p.row, p.column) for p in found.panels] == [
        ((0, 1), (0, 1)), ((0, 1), (1, 2)), ((1, 2), (0, 1)), ((1, 2), (1, 2)),
    ]  # fmt: skip
    sine, cosine = (one for one in whole.traces if one.name)
    assert (sine.name, cosine.name) == ("sine", "cosine")  # by the legend, by its label
    assert np.array_equal(sine.x, X)
    assert np.array_equal(cosine.y, np.cos(np.radians(X)))
    assert (sine.color, len(sine.dash), cosine.dash) == ("#1f4488", 2, ())
    assert whole.y.title == "F_x (kN)"
    assert (enlarged.x.low, enlarged.x.high) == (90, 120)
    assert [note.y for note in whole.notes if not note.text] == [0.0]
    (shown,) = low.traces
    assert (shown.kind, shown.log, shown.scale_name) == ("map", True, "peak (kN)")
    assert np.array_equal(shown.z, [[0, 1], [2, np.nan]], equal_nan=True)
    assert np.array_equal(shown.x, [1, 2, 4])
    assert shown.jobs == ("a", "b", "c", "d")
    assert shown.limits == (0.0, 2.0)
    by_kind = {trace.kind: trace for trace in bars.traces}
    assert by_kind["bars"].name == "main effect"
    assert by_kind["bars"].x.tolist() == [0.25, 0.75]
    assert by_kind["bars"].errors.T.ravel() == pytest.approx([0.1, 0.1, 0.2, 0.1])
    assert not by_kind["line"].across
    assert by_kind["line"].errors.T.ravel() == pytest.approx([0.1, 0.3, 0.2, 0.4])
    assert bars.y.words == {0.0: "speed", 1.0: "clearance"}


def test_lines_of_equal_value_have_no_name():
    figure = Figure()
    figure.subplots().contour([0, 1, 2], [0, 1], [[0, 1, 2], [0, 1, 2]], [0.5, 1.5])
    (lines,) = extract(figure).panels[0].traces
    assert (lines.kind, lines.name) == ("line", "")
    assert {*lines.x[np.isfinite(lines.x)]} == {0.5, 1.5}


def test_bars_across_and_axes_without_numbers_are_read():
    figure = Figure()
    left, right = figure.subplots(1, 2, sharey=True)
    left.set_yticks([0, 1], ["speed", "mass"])
    right.errorbar([0.3, 0.6], [0, 1], xerr=[[0.1, 0.2], [0.3, 0.4]], linestyle="none", marker="o")
    left.errorbar([0.3], [0], xerr=[[0.1], [0.2]], fmt="none")
    found = extract(figure)
    (alone,) = found.panels[0].traces
    assert (alone.kind, alone.x.tolist()) == ("line", pytest.approx([0.2, 0.5]))
    (points,) = found.panels[1].traces
    assert points.across
    assert points.errors.T.ravel() == pytest.approx([0.1, 0.3, 0.2, 0.4])
    assert [panel.y.bare for panel in found.panels] == [False, True]
    words = [panel["y"]["words"] for panel in content(found)["panels"]]
    assert words == [[[0.0, "speed"], [1.0, "mass"]]] * 2


def test_a_csv_has_every_number_once(figure):
    head, *rows = csv.reader(io.StringIO(as_csv(extract(figure))))
    assert head[:3] == [
        "whole: sine: angle (°)",
        "whole: sine: F_x (kN)",
        "whole: cosine: F_x (kN)",
    ]
    assert not [title for title in head if title.startswith("enlarged")]  # the same numbers
    columns = dict(zip(head, zip(*rows, strict=True), strict=True))
    assert [float(v) for v in columns["whole: cosine: F_x (kN)"]] == pytest.approx(
        np.cos(np.radians(X)), abs=1e-7
    )
    assert columns["3: peak (kN)"][:4] == ("1", "10", "100", "")
    assert columns["3: job"][:5] == ("a", "b", "c", "d", "")
    assert [columns[f"4: jobs: {end}"][:2] for end in ("below", "above")] == [
        ("0.1", "0.2"), ("0.3", "0.4"),
    ]  # fmt: skip


def test_the_page_gets_what_was_drawn(figure):
    found = content(extract(figure))
    whole, enlarged, low, _ = found["panels"]
    (sine, _) = (one for one in whole["traces"] if one["name"])
    assert sine["x"] == [0.0, 0.5, 721]
    assert numbers(sine["y"]) == pytest.approx(np.sin(np.radians(X)), abs=1e-7)
    (sine, _) = (one for one in enlarged["traces"] if one["name"])
    part = numbers(sine["x"])
    assert (part[0], part[-1]) == (89.5, 120.5)  # what the panel shows, and a point on either side
    assert numbers(sine["y"]) == pytest.approx(np.sin(np.radians(part)), abs=1e-7)
    assert numbers(low["traces"][0]["z"]).tolist()[:3] == [0, 1, 2]
    assert low["traces"][0]["jobs"] == ["a", "b", "c", "d"]
    assert [panel["x"]["link"] for panel in found["panels"]] == [0, 1, 2, 3]
    assert found["aspect"] == 0.5
    assert not found["unified"]  # a map is no curve
    assert (whole["x"]["unit"], whole["y"]["unit"]) == ("°", "kN")


def test_panels_of_the_same_span_are_zoomed_together():
    figure = Figure()
    for panel in figure.subplots(3, 1):
        panel.plot([0, 1], [0, 1])
    figure.axes[1].set_xlim(0.2, 0.4)
    panels = extract(figure).panels
    assert link_scales([panel.x for panel in panels]) == [0, 1, 0]


def test_long_curves_keep_their_extremes():
    """A peak of a single sample among 100,000 is drawn."""
    y = np.sin(np.linspace(0, 20, 100_000))
    y[[31_234, 77_777]] = 9.0, -9.0
    places = extremes(y, MAX_POINTS // 2)
    assert places.size <= 2 * MAX_POINTS
    assert {31_234, 77_777, 0, 99_999} <= {*places.tolist()}
    assert (np.diff(places) > 0).all()
    flat = extremes(np.zeros(100_000), 100)
    assert flat.size <= 400


def test_a_script_breaks_out_of_nothing():
    figure = Figure()
    figure.subplots().plot([0, 1], [0, np.nan], label="</script><script>alert(1)</script>")
    text = script("one", extract(figure))
    assert "<" not in text
    name, _, data = text.removeprefix("compsimFigure(").removesuffix(");\n").partition(",")
    assert json.loads(name) == "one"
    (trace,) = json.loads(data)["panels"][0]["traces"]
    assert trace["name"] == "</script><script>alert(1)</script>"


def test_what_is_seen_is_said_in_words(figure):
    assert describe_figure(extract(figure)).startswith(
        "4 panels. whole: sine, cosine; enlarged: sine"
    )
    assert describe_figure(FigureData((), (1.0,), (1.0,), (1.0, 1.0))) == ""


def test_the_library_lies_beside_the_page(tmp_path):
    publish_library(tmp_path)
    path = tmp_path / "plotly.min.js"
    assert b"plotly.js v" in path.read_bytes()[:200]
    before = path.stat().st_mtime_ns
    publish_library(tmp_path)
    assert path.stat().st_mtime_ns == before
    path.write_bytes(b"of another version")
    publish_library(tmp_path)
    assert path.stat().st_size > 1e6


def test_a_word_beside_a_line_stands_where_the_line_does():
    figure = Figure()
    panel = figure.subplots()
    panel.set_xlim(0, 200)
    panel.annotate(
        "order 12", (12, 1), (4, -4), xycoords=panel.get_xaxis_transform(),
        textcoords="offset points",
    )  # fmt: skip
    (note,) = extract(figure).panels[0].notes
    assert (note.text, note.inside) == ("order 12", True)
    assert (note.x, note.y) == pytest.approx((0.06, 1.0))
