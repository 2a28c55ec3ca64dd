"""Figures as plotly's: the limits of panels, tables, what the page gets, and pictures."""

import csv
import io
import json
import multiprocessing
import os
import threading

import numpy as np
import plotly.graph_objects as go
import pytest
from conftest import decoded
from matplotlib import rc_context
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from compressor.report.figures import pictures
from compressor.report.figures.drawing import as_csv, make_grid
from compressor.report.figures.style import LineStyle, fill, mark, palette
from compressor.report.interactive import MAX_POINTS, extremes, script

X = np.linspace(0.0, 360.0, 721)
BLUE, RED = LineStyle("#1f4488", (4, 2), 1.5), LineStyle("#d0583b")


@pytest.fixture
def drawing():
    """Two panels of curves side by side, below them a map and bars."""
    drawing, ((left, right), (low, bars)) = make_grid(2, 2, 4.8)
    for panel, title, ends in ((left, "whole", (0, 360)), (right, "enlarged", (90, 120))):
        panel.label("x", "angle ({})", "°")
        panel.label("y", "F<sub>x</sub> ({})", "kN")
        panel.plot(X, np.sin(np.radians(X)), BLUE, "sine")
        panel.plot(X, np.cos(np.radians(X)), RED, "cosine")
        panel.rule(RED, y=0.0)
        panel.title = title
        panel.span("x", *ends)
    middles, z = (np.array([1.0, 4.0]), np.array([0.0, 1.0])), np.array([[1, 10], [100, np.nan]])
    low.map(*middles, z, palette("cividis"), (1.0, 100.0), "peak ({})", "kN", is_log=True,
            jobs=("a", "b", "c", "d"))  # fmt: skip
    ends = np.array([[0.1, 0.2], [0.1, 0.1]])
    bars.bars([0.25, 0.75], [0, 1], fill("#000000"), "main effect", errors=ends, thick=0.5)
    bars.name_ticks("y", ["speed", "clearance"])
    bars.plot([0.1, 0.2], [0.5, 0.6], mark("#000000", "circle", 3), "jobs",
              errors=np.array([[0.1, 0.2], [0.3, 0.4]]))  # fmt: skip
    return drawing


def test_a_csv_has_every_number_once(drawing):
    head, *rows = csv.reader(io.StringIO(as_csv(drawing.figure())))
    assert head[:2] == ["whole: sine: angle (°)", "whole: sine: F_x (kN)"]
    assert not [title for title in head if title.startswith("enlarged")]  # the same numbers
    columns = dict(zip(head, zip(*rows, strict=True), strict=True))
    cosine = np.array(columns["whole: cosine: F_x (kN)"], float)
    assert cosine == pytest.approx(np.cos(np.radians(X)), abs=1e-7)
    assert columns["3: peak (kN)"][:4] == ("1", "10", "100", "")
    assert columns["3: job"][:5] == ("a", "b", "c", "d", "")
    assert columns["4: main effect"][:2] == ("speed", "clearance")  # not 0.25 and 0.75
    assert columns["4: jobs: below"][:2] == ("0.1", "0.2")
    assert columns["4: jobs: above"][:2] == ("0.3", "0.4")


def test_jobs_at_one_place_all_stand_in_the_csv():
    drawing, grid = make_grid(1, 1, 4.0)
    for key in "ab":
        grid[0, 0].plot([1.0, 2.0], [0.0, 0.0], RED, "failed", jobs=(key, f"{key}2"))
    (_, *rows) = csv.reader(io.StringIO(as_csv(drawing.figure())))
    assert {"a", "b"} < {*rows[0]}


def test_panels_of_the_same_jobs_share_columns_and_name_their_axes():
    drawing, grid = make_grid(2, 2, 4.0, share_x="all", share_y="all")
    for (row, column), panel in np.ndenumerate(grid):
        panel.plot([row, 1], [column, 1], RED, "a job", jobs=("k1", "k2"))
        panel.x.title = f"x{column}" if row == 1 else ""
        panel.y.title = "" if column else f"y{row}"
    head, *rows = csv.reader(io.StringIO(as_csv(drawing.figure())))
    assert [title for title in head if title.endswith("job")] == ["1: a job: job"]
    names = [title.rpartition(" ")[2] for title in head]
    assert names == ["x0", "y0", "job", "x1", "y0", "x0", "y1", "x1", "y1"]
    assert rows[0] == ["0", "0", "k1", "0", "1", "1", "0", "1", "1"]


def test_the_page_gets_what_was_drawn(drawing):
    text = script("one", drawing.figure())
    found = json.loads(text.removeprefix('compsimFigure("one",').removesuffix(");\n"))
    figure = go.Figure(found)  # plotly itself takes it
    sine, cosine, part, _, cells, bars, jobs = found["data"]
    assert (sine["x0"], sine["dx"]) == (0.0, 0.5)
    assert decoded(sine["y"]) == pytest.approx(np.sin(np.radians(X)), abs=1e-7)
    assert (sine["line"]["color"], sine["line"]["dash"]) == ("#1f4488", "8.0px,4.0px")
    assert cosine["line"]["dash"] == "solid"
    assert (sine["showlegend"], part["showlegend"], part["legendgroup"]) == (True, False, "sine")
    assert part["x0"] == 89.5  # what the panel shows, and a point on either side
    assert decoded(part["y"]).size == 63
    assert decoded(cells["z"]).ravel().tolist()[:3] == [0, 1, 2]
    assert np.ravel(cells["customdata"]).tolist() == ["a", "b", "c", "d"]
    assert (cells["zmin"], cells["zmax"]) == (0.0, 2.0)
    assert cells["colorbar"]["ticktext"] == ["1", "3", "10", "30", "100"]
    assert (bars["type"], bars["orientation"], jobs["mode"]) == ("bar", "h", "markers")
    assert figure.layout.yaxis4.ticktext == ("speed", "clearance")
    assert figure.layout.hovermode == "closest"  # a map is no curve
    assert "layout" not in found["layout"]["template"]  # plotly's own has 7 kB


def test_axes_read_in_the_unit_that_is_wanted():
    """Values, error bars, spans, rules and notes follow; what is no quantity stays."""
    drawing, (panel, image) = (made := make_grid(1, 2, 3.0, units="plant"))[0], made[1].flat
    panel.label("x", "crank angle ({})", "°")
    panel.label("y", "a ({})", "m/s²")
    panel.plot([0.0, 90.0], [9.80665, -19.6133], RED, "a", errors=np.full((2, 2), 9.80665))
    panel.span("y", -29.41995, 29.41995)
    panel.rule(RED, y=9.80665)
    panel.write("here", 45.0, 9.80665)
    image.map(np.arange(2.0), np.arange(1.0), np.array([[1.0, 4.0]]), palette("cividis"),
              (1.0, 4.0), "force ({})", "N")  # fmt: skip
    figure = drawing.figure()
    curve, cells = figure.data
    assert figure.layout.yaxis.title.text == "a (g)"
    assert figure.layout.xaxis.title.text == "crank angle (°)"
    assert curve.x.tolist() == [0.0, 90.0]
    assert curve.y == pytest.approx([1.0, -2.0])
    assert curve.error_y.array == pytest.approx([1.0, 1.0])
    assert figure.layout.yaxis.range == pytest.approx((-3.0, 3.0))
    assert figure.layout.shapes[0].y0 == pytest.approx(1.0)
    assert (figure.layout.annotations[0].x, figure.layout.annotations[0].y) == (45.0, 1.0)
    assert (cells.z.tolist(), cells.colorbar.title.text) == ([[1e-3, 4e-3]], "force (kN)")


def test_long_curves_keep_their_extremes():
    y = np.sin(np.linspace(0, 20, 100_000))
    y[[31_234, 77_777]] = 9.0, -9.0
    places = extremes(y, MAX_POINTS // 2)
    assert places.size <= 2 * MAX_POINTS
    assert {31_234, 77_777, 0, 99_999} <= {*places.tolist()}
    assert (np.diff(places) > 0).all()
    assert extremes(np.zeros(100_000), 100).size <= 400


def test_a_script_breaks_out_of_nothing():
    drawing, grid = make_grid(1, 1, 3.0)
    grid[0, 0].plot([0, 1], [0, np.nan], RED, "</script><script>alert(1)</script>")
    text = script("one", drawing.figure())
    assert "<" not in text
    name, _, data = text.removeprefix("compsimFigure(").removesuffix(");\n").partition(",")
    assert json.loads(name) == "one"
    (trace,) = json.loads(data)["data"]
    assert trace["name"] == "</script><script>alert(1)</script>"


def test_a_word_that_is_a_number_stands_in_the_table():
    """Of `solve.settle_rev: [auto, 3]` the second was 1, its place on the axis."""
    drawing, grid = make_grid(1, 1, 3.0)
    panel = grid[0, 0]
    panel.plot([0.0, 1.0], [5.0, 6.0], RED, "a job")
    panel.name_ticks("x", ["auto", "3"])
    _, *rows = csv.reader(io.StringIO(as_csv(drawing.figure())))
    assert [row[0] for row in rows] == ["auto", "3"]
    panel.name_ticks("x", ["0", "1"], [0.0, 1.0])
    _, *rows = csv.reader(io.StringIO(as_csv(drawing.figure())))
    assert [row[0] for row in rows] == ["0", "1"]


# ---- pictures, by two processes: the same bytes, and none lost with a process


@pytest.fixture(scope="module")
def figures():
    made = []
    for number in range(3):
        drawing, grid = make_grid(1, 1, 2.0)
        grid[0, 0].plot([0, 1], [number, 2], LineStyle("#000000"))
        made.append(drawing.figure())
    return [lambda one=one: pictures.render(one) for one in made]


def elsewhere(monkeypatch, act):
    """Do this first in each picture that another process draws."""
    here, draw = os.getpid(), pictures.render

    def first(figure):
        if os.getpid() != here:
            act()
        return draw(figure)

    monkeypatch.setattr(pictures, "render", first)


def test_panels_that_share_decades_draw_them_alike():
    """All but the first had the ticks of a log scale on a linear one."""
    drawing, grid = make_grid(1, 2, 2.0, share_x="all")
    for panel in grid.flat:
        panel.plot([1, 10, 100], [1, 2, 3], LineStyle("#000000"))
    grid[0, 0].x.type = "log"
    for axes in pictures.paint(drawing.figure()).axes:
        x, _ = axes.transData.transform([(1, 2), (10, 2), (100, 2)]).T
        assert x[1] - x[0] == pytest.approx(x[2] - x[1])


@pytest.mark.parametrize("top", [39.238, 3e7, 3e-7])
def test_ticks_are_whole_numbers(top):
    """The offset +3.923e1 stood over a title; 0.000000225 beside a map reached into the next."""
    drawing, grid = make_grid(1, 2, 2.0)
    grid[0, 0].plot([0, 1], [0.9999 * top, top], LineStyle("#000000"))
    grid[0, 1].map(np.zeros(1), np.zeros(1), np.array([[top]]), palette("cividis"), (0.0, top))
    with rc_context(pictures.STYLE):
        painted = pictures.paint(drawing.figure())
        painted.draw_without_rendering()
    assert painted.axes[0].yaxis.get_offset_text().get_text() == ""
    assert max(len(tick.get_text()) for tick in painted.axes[2].get_yticklabels()) < 9


def test_two_processes_draw_what_one_does(figures, two_cores, monkeypatch, tmp_path, capfd):
    alone = [draw() for draw in figures]
    elsewhere(monkeypatch, lambda: (tmp_path / str(os.getpid())).touch())
    assert pictures.draw_all(figures) == alone
    assert capfd.readouterr().err == "drawing 3 figures\n"
    assert len([*tmp_path.iterdir()]) == 1
    elsewhere(monkeypatch, lambda: os._exit(9))  # a process that dies costs nothing
    assert pictures.draw_all(figures) == alone
    monkeypatch.setattr(multiprocessing, "get_context", pytest.fail)
    monkeypatch.setattr(threading, "active_count", lambda: 2)  # whose locks a copy would have
    assert pictures.draw_all(figures) == alone
    assert pictures.draw_all([]) == []


def test_a_picture_shows_what_the_figure_has():
    """Each kind of trace is drawn in its colour: a curve, an area, bars and a map."""
    drawing, (curve, area, bars, cells) = (made := make_grid(1, 4, 3.0))[0], made[1].flat
    colors = {"curve": "#ff0000", "area": "#00ff00", "bars": "#0000ff", "map": "#ff00ff"}
    curve.plot([0, 1], [0, 1], LineStyle(colors["curve"], linewidth=4))
    curve.plot([0.5], [0.5], mark("#000000", "circle", 4.0), errors=np.full((2, 1), 0.4))
    area.fill([0, 1, 1], [0, 0, 1], fill(colors["area"]))
    bars.bars([1.0, 2.0], [0.0, 1.0], fill(colors["bars"]))
    cells.map(np.zeros(1), np.zeros(1), np.array([[0.0]]), [colors["map"], "#ffffff"], (0.0, 1.0))
    seen = imread(io.BytesIO(pictures.render(drawing.figure())))[..., :3]
    for name, color in colors.items():
        share = np.isclose(seen, to_rgb(color)).all(axis=2).mean()
        assert share > 0.001, name
    assert not np.isclose(seen, to_rgb("C0")).all(axis=2).any(), "error bars in matplotlib's colour"
