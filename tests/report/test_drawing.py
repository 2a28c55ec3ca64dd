"""Figures as data: their limits, and what the renderers of table and page make of them."""

import base64
import csv
import io
import json

import numpy as np
import pytest

from compressor.report.figures.contours import contour_area, contour_lines
from compressor.report.figures.drawing import (
    ColorScale,
    Drawing,
    Note,
    Panel,
    Scale,
    as_csv,
    make_grid,
    map_cells,
    midway,
    share_scales,
)
from compressor.report.figures.style import LineStyle, fill, mark, palette
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
BLUE, RED = LineStyle("#1f4488", (0, (4, 2)), 1.5), LineStyle("#d0583b")


def numbers(packed):
    """What the page makes of packed numbers."""
    if isinstance(packed, list):
        first, step, count = packed
        return first + step * np.arange(count)
    return np.frombuffer(base64.b64decode(packed), "<f4")


@pytest.fixture
def drawing():
    """Two panels of curves side by side, below them a map and bars."""
    drawing, ((left, right), (low, bars)) = make_grid(2, 2, 4.8)
    for panel, title, ends in ((left, "whole", (0, 360)), (right, "enlarged", (90, 120))):
        panel.plot(X, np.sin(np.radians(X)), BLUE, "sine")
        panel.plot(X, np.cos(np.radians(X)), RED, "cosine")
        panel.notes.append(Note(y=0.0))
        panel.title, panel.x.title, panel.y.title = title, "angle (°)", "$F_x$ (kN)"
        panel.x.span(*ends)
    scale = ColorScale(palette("cividis"), 1.0, 100.0, True, "peak (kN)")
    edges, z = (np.array([1.0, 2, 4]), np.array([0.0, 1, 2])), np.array([[1, 10], [100, np.nan]])
    low.traces.append(map_cells(*edges, z, scale, jobs=("a", "b", "c", "d")))
    ends = np.array([[0.1, 0.2], [0.1, 0.1]])
    bars.plot([0.25, 0.75], [0, 1], fill("#000000"), "main effect", kind="bars", errors=ends,
              across=True, thick=0.5)  # fmt: skip
    bars.y.name(["speed", "clearance"])
    bars.plot([0.1, 0.2], [0.5, 0.6], mark("#000000", "o", 3), "jobs",
              errors=np.array([[0.1, 0.2], [0.3, 0.4]]))  # fmt: skip
    return drawing


def test_limits_follow_what_is_drawn(drawing):
    whole, enlarged, low, bars = drawing.panels
    assert whole.limits("y") == pytest.approx((-1.1, 1.1))  # a twentieth of room
    assert enlarged.limits("x") == (90, 120)
    assert (low.limits("x"), low.limits("y")) == ((1, 4), (0, 2))  # a map has none
    assert bars.limits("x") == (0, 0.75)
    assert bars.limits("y") == pytest.approx((-0.325, 1.325))  # bars are half a unit thick
    whole.notes.append(Note(y=9.0))
    assert whole.limits("y") == pytest.approx((-1.5, 9.5))
    whole.y.span(low=0.0)
    assert whole.limits("y") == pytest.approx((0.0, 9.5))


@pytest.mark.parametrize(
    ("values", "is_log", "ends"),
    [([2, 3], False, (1.95, 3.05)), ([5, 5], False, (4.75 - 0.025, 5.25 + 0.025)),
     ([np.nan, np.inf], False, (-0.05, 1.05)), ([0, 1, 100], True, (10**-0.1, 10**2.1))],
)  # fmt: skip
def test_limits_of_odd_values(values, is_log, ends):
    panel = Panel((0, 1), (0, 1), y=Scale(log=is_log, margin=0.05))
    panel.plot(np.arange(len(values)), values, RED)
    assert panel.limits("y") == pytest.approx(ends)


def test_shared_scales_show_the_whole_and_have_numbers_outside():
    drawing, grid = make_grid(2, 2, 4.0, count=3)
    for number, panel in enumerate(drawing.panels):
        panel.plot([0, 1 + number], [0, 1], RED)
    drawing.panels[0].y.name(["speed", "mass"])
    share_scales(drawing.panels, "x", "y")
    assert {panel.limits("x") for panel in drawing.panels} == {(0, 3)}
    assert [panel.x.bare for panel in drawing.panels] == [True, False, False]
    assert [panel.y.bare for panel in drawing.panels] == [False, True, False]
    words = [panel["y"]["words"] for panel in content(drawing)["panels"]]
    assert words == [[[0.0, "speed"], [1.0, "mass"]]] * 3
    assert grid.shape == (2, 2)


def test_a_csv_has_every_number_once(drawing):
    head, *rows = csv.reader(io.StringIO(as_csv(drawing)))
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


def test_panels_of_the_same_jobs_share_columns_and_name_their_axes():
    drawing, grid = make_grid(2, 2, 4.0)
    for (row, column), panel in np.ndenumerate(grid):
        panel.plot([row, 1], [column, 1], RED, "a job", jobs=("k1", "k2"))
        panel.x.title = f"x{column}" if row == 1 else ""
        panel.y.title = "" if column else f"y{row}"
    share_scales(drawing.panels, "x", "y")
    head, *rows = csv.reader(io.StringIO(as_csv(drawing)))
    assert [title for title in head if title.endswith("job")] == ["1: a job: job"]
    assert [title.rpartition(" ")[2] for title in head] == [
        "x0", "y0", "job", "x1", "y0", "x0", "y1", "x1", "y1"
    ]  # fmt: skip
    assert rows[0] == ["0", "0", "k1", "0", "1", "1", "0", "1", "1"]


def test_the_page_gets_what_was_drawn(drawing):
    found = content(drawing)
    whole, enlarged, low, bars = found["panels"]
    sine, cosine = whole["traces"]
    assert sine["x"] == [0.0, 0.5, 721]
    assert numbers(sine["y"]) == pytest.approx(np.sin(np.radians(X)), abs=1e-7)
    assert (sine["color"], sine["dash"], cosine["dash"]) == ("#1f4488", [6.0, 3.0], [])
    part = numbers(enlarged["traces"][0]["x"])
    assert (part[0], part[-1]) == (89.5, 120.5)  # what the panel shows, and a point on either side
    (cells,) = low["traces"]
    assert numbers(cells["z"]).tolist()[:3] == [0, 1, 2]
    assert [found["jobs"][int(n)] for n in numbers(cells["jobs"])] == ["a", "b", "c", "d"]
    assert cells["limits"] == (0.0, 2.0)
    assert (len(cells["color"]), cells["color"][-1]) == (33, palette("cividis")[-1])
    kinds = [(trace["kind"], trace["across"]) for trace in bars["traces"]]
    assert kinds == [("bars", True), ("points", False)]
    assert bars["y"]["words"] == [[0.0, "speed"], [1.0, "clearance"]]
    assert [panel["x"]["link"] for panel in found["panels"]] == [0, 1, 2, 3]
    assert found["aspect"] == 0.5
    assert not found["unified"]  # a map is no curve
    assert (whole["x"]["unit"], whole["y"]["unit"]) == ("°", "kN")


def test_panels_of_the_same_span_are_zoomed_together():
    drawing, grid = make_grid(3, 1, 4.0)
    for panel in grid.flat:
        panel.plot([0, 1], [0, 1], RED)
    grid[1, 0].x.span(0.2, 0.4)
    assert link_scales(drawing, "x") == [0, 1, 0]


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
    panel = Panel((0, 1), (0, 1))
    panel.plot([0, 1], [0, np.nan], RED, "</script><script>alert(1)</script>")
    text = script("one", Drawing([panel], 3.0))
    assert "<" not in text
    name, _, data = text.removeprefix("compsimFigure(").removesuffix(");\n").partition(",")
    assert json.loads(name) == "one"
    (trace,) = json.loads(data)["panels"][0]["traces"]
    assert trace["name"] == "</script><script>alert(1)</script>"


def test_what_is_seen_is_said_in_words(drawing):
    assert describe_figure(drawing).startswith("4 panels. whole: sine, cosine; enlarged: sine")
    assert describe_figure(Drawing([], 1.0)) == ""


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
    panel = Panel((0, 1), (0, 1))
    panel.x.span(0, 200)
    panel.notes.append(Note("order 12", 12, 1, inside="y", shift=(4, -4)))
    (note,) = content(Drawing([panel], 3.0))["panels"][0]["notes"]
    assert (note["text"], note["inside"]) == ("order 12", True)
    assert (note["x"], note["y"]) == pytest.approx((0.06, 1.0))
    assert (note["shift"], note["side"], note["level"]) == ((4, -4), "left", "baseline")


@pytest.mark.parametrize("is_log", [False, True])
def test_edges_lie_between_values(is_log):
    edges = midway(np.array([1.0, 2.0, 4.0]), is_log)
    assert (edges[:-1] < [1, 2, 4]).all()
    assert (edges[1:] > [1, 2, 4]).all()
    assert midway(np.array([3.0]), is_log).size == 2


def test_lines_of_equal_value_lie_where_a_plane_has_them():
    plane = np.array([[0.0, 1, 2], [0, 1, 2]])
    x, _ = contour_lines(np.arange(3), np.arange(2), plane, [0.5, 1.5])
    assert {*x[np.isfinite(x)]} == {0.5, 1.5}
    x, y = contour_area(np.arange(3), np.arange(2), plane, 0.5, 1.5)
    assert (x.min(), x.max(), y.min(), y.max()) == (0.5, 1.5, 0, 1)


def test_what_has_no_points_has_no_columns():
    drawing, grid = make_grid(1, 1, 4.0)
    grid[0, 0].plot([], [], RED, "none")
    grid[0, 0].plot([0, 1], [2, 3], RED, "two")
    head = as_csv(drawing).splitlines()[0]
    assert "two" in head
    assert "none" not in head
