"""Pictures of figures by two processes: the same bytes, and none lost with a process."""

import io
import os
import threading

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from compressor.report.figures import pictures as module
from compressor.report.figures.drawing import make_grid
from compressor.report.figures.pictures import draw_all, paint, render
from compressor.report.figures.style import LineStyle, fill


@pytest.fixture
def figures():
    made = []
    for number in range(5):
        drawing, grid = make_grid(1, 1, 2.0)
        grid[0, 0].plot([0, 1], [number, 2], LineStyle("#000000"))
        made.append(drawing.figure())
    return [lambda one=one: module.render(one) for one in made]


@pytest.fixture
def alone(figures):
    return [draw() for draw in figures]


@pytest.fixture
def two(monkeypatch):
    """Two processes draw, whatever threads another test has left here, which are idle."""
    monkeypatch.setattr(threading, "active_count", lambda: 1)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1}, raising=False)


def elsewhere(monkeypatch, act):
    """Do this first in each picture that another process draws."""
    here, draw = os.getpid(), module.render

    def first(figure):
        if os.getpid() != here:
            act()
        return draw(figure)

    monkeypatch.setattr(module, "render", first)


def test_panels_that_share_decades_draw_them_alike():
    """All but the first had the ticks of a log scale on a linear one."""
    drawing, grid = make_grid(1, 2, 2.0, share_x="all")
    for panel in grid.flat:
        panel.plot([1, 10, 100], [1, 2, 3], LineStyle("#000000"))
    grid[0, 0].x.type = "log"
    for axes in paint(drawing.figure()).axes:
        x, _ = axes.transData.transform([(1, 2), (10, 2), (100, 2)]).T
        assert x[1] - x[0] == pytest.approx(x[2] - x[1])


def test_two_processes_draw_what_one_does(figures, alone, two, monkeypatch, tmp_path, capfd):
    elsewhere(monkeypatch, lambda: (tmp_path / str(os.getpid())).touch())
    assert draw_all(figures) == alone
    assert capfd.readouterr().err == "drawing 5 figures\n"
    assert 1 <= len([*tmp_path.iterdir()]) <= 2


def test_a_process_that_dies_costs_nothing(figures, alone, two, monkeypatch):
    elsewhere(monkeypatch, lambda: os._exit(9))
    assert draw_all(figures) == alone


def test_beside_threads_no_process_is_copied(figures, alone, monkeypatch):
    monkeypatch.setattr(module, "ProcessPoolExecutor", pytest.fail)
    monkeypatch.setattr(threading, "active_count", lambda: 2)
    assert draw_all(figures) == alone
    assert draw_all([]) == []


def test_a_picture_shows_what_the_figure_has():
    """Each kind of trace is drawn in its colour: a curve, an area, bars and a map."""
    drawing, (curve, area, bars, cells) = (made := make_grid(1, 4, 3.0))[0], made[1].flat
    colors = {"curve": "#ff0000", "area": "#00ff00", "bars": "#0000ff", "map": "#ff00ff"}
    curve.plot([0, 1], [0, 1], LineStyle(colors["curve"], linewidth=4))
    area.fill([0, 1, 1], [0, 0, 1], fill(colors["area"]))
    bars.bars([1.0, 2.0], [0.0, 1.0], fill(colors["bars"]))
    cells.map(np.zeros(1), np.zeros(1), np.array([[0.0]]), [colors["map"], "#ffffff"], (0.0, 1.0))
    seen = imread(io.BytesIO(render(drawing.figure())))[..., :3]
    for name, color in colors.items():
        share = np.isclose(seen, to_rgb(color)).all(axis=2).mean()
        assert share > 0.001, name
