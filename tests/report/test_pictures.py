"""Pictures of figures by two processes: the same bytes, and none lost with a process."""

import io
import os
import subprocess
import sys
import threading
from functools import cache

import numpy as np
import pytest
from matplotlib import style
from matplotlib.image import imread

from compressor.report.figures import pictures as module
from compressor.report.figures.drawing import make_grid
from compressor.report.figures.pictures import (
    STYLE,
    Painter,
    can_fork,
    digest_drawing,
    paint,
    render,
)
from compressor.report.figures.style import LineStyle, mark


def pictures(figures, headings, folder):
    with Painter(folder) as painter:
        for name, drawing in figures.items():
            painter.add(name, drawing, headings[name])
        return painter.finish()


OTHER = "COMPSIM_TESTS_PICTURES_ALONE"  # set in a process that was started for these tests
NAMES = ["one", "two", "three", "four", "five"]
HEADINGS = {name: f"Figure {name}" for name in NAMES}
pytestmark = pytest.mark.skipif(not can_fork(), reason="there is one core, or no fork")


@pytest.fixture
def figures():
    made = {}
    for number, name in enumerate(NAMES):
        made[name], grid = make_grid(1, 1, 2.0)
        grid[0, 0].plot([0, 1], [number, 2], LineStyle("#000000"))
    return made


@pytest.fixture
def alone(figures):
    return {f"{n}.{kind}": render(figures[n], kind) for n in NAMES for kind in ("png", "svg")}


@cache
def run_alone():
    """How the tests that need a process without threads end in one, which is started once."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", __file__]
    command += ["-m", "usefixtures"]
    return subprocess.run(command, capture_output=True, text=True, env=os.environ | {OTHER: "1"})


@pytest.fixture
def threadless():
    """No thread in this process; where another test has left one, a process without runs them."""
    if OTHER in os.environ:
        assert threading.active_count() == 1
    elif threading.active_count() > 1:
        done = run_alone()
        assert done.returncode == 0, done.stdout
        pytest.skip("passed in a process without threads")


@pytest.mark.usefixtures("threadless")
def test_two_processes_draw_what_one_does(figures, alone, capfd, tmp_path):
    assert pictures(figures, HEADINGS, tmp_path) == alone
    told = capfd.readouterr().err.splitlines()
    assert sorted(told) == sorted(f"drawing Figure {name}" for name in NAMES)


@pytest.mark.usefixtures("threadless")
def test_another_process_takes_part(figures, monkeypatch, tmp_path):
    def noted(*args):
        (tmp_path / str(os.getpid())).touch()
        return draw(*args)

    draw = module.render_kinds
    monkeypatch.setattr(module, "render_kinds", noted)
    pictures(figures, HEADINGS, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} > {str(os.getpid())}


@pytest.mark.usefixtures("threadless")
def test_a_process_that_dies_costs_nothing(figures, alone, monkeypatch, tmp_path):
    def deadly(*args):
        if os.getpid() != here:
            os._exit(9)
        return draw(*args)

    here, draw = os.getpid(), module.render_kinds
    monkeypatch.setattr(module, "render_kinds", deadly)
    assert pictures(figures, HEADINGS, tmp_path) == alone


@pytest.mark.usefixtures("threadless")
def test_an_error_of_the_other_process_is_raised(figures, monkeypatch, tmp_path):
    def failing(*args):
        if os.getpid() != here:
            raise ZeroDivisionError
        return draw(*args)

    here, draw = os.getpid(), module.render_kinds
    monkeypatch.setattr(module, "render_kinds", failing)
    with pytest.raises(ZeroDivisionError):
        pictures(figures, HEADINGS, tmp_path)


def test_beside_threads_nothing_is_forked(figures, alone, monkeypatch, tmp_path):
    monkeypatch.setattr(module, "ProcessPoolExecutor", pytest.fail)
    end = threading.Event()
    other = threading.Thread(target=end.wait)
    other.start()
    try:
        assert pictures(figures, HEADINGS, tmp_path) == alone
    finally:
        end.set()
        other.join()
    assert pictures({}, {}, tmp_path) == {}


def test_pictures_are_those_that_matplotlib_saves(figures):
    for name, drawing in figures.items():
        saved = {}
        with style.context(STYLE, after_reset=True):
            figure = paint(drawing)
            figure.get_layout_engine().execute(figure)
            figure.set_layout_engine("none")
            for kind, metadata in (
                ("png", {}),
                ("svg", {"Date": None, "Identifier": digest_drawing(drawing)}),
            ):
                saved[kind] = io.BytesIO()
                figure.savefig(saved[kind], format=kind, metadata=metadata)
        assert render(drawing, "svg") == saved["svg"].getvalue(), name
        png, same = (imread(io.BytesIO(data)) for data in (render(drawing, "png"),
                                                           saved["png"].getvalue()))  # fmt: skip
        assert np.array_equal(png, same)


@pytest.mark.usefixtures("threadless")
def test_what_is_drawn_already_is_not_drawn_again(figures, alone, tmp_path):
    def draw():
        return {*pictures(figures, HEADINGS, tmp_path)}

    def keep():
        for name, picture in alone.items():
            (tmp_path / name).write_bytes(picture)

    assert draw() == {*alone}
    keep()
    assert draw() == set()
    (tmp_path / "two.svg").unlink()  # one is lost, of one the end, one is another figure's
    (tmp_path / "three.png").write_bytes(alone["three.png"][:-20])
    (tmp_path / "four.png").write_bytes(alone["five.png"])
    assert draw() == {f"{name}.{kind}" for name in NAMES[1:4] for kind in ("png", "svg")}
    keep()
    figures["one"].panels[0].traces[0].y[1] += 1e-15  # any change is one
    figures["five"].panels[0].title = "other"
    assert draw() == {f"{name}.{kind}" for name in ("one", "five") for kind in ("png", "svg")}


def test_an_equal_drawing_has_the_same_digest_in_another_process(figures):
    code = (
        "from compressor.report.figures.drawing import make_grid\n"
        "from compressor.report.figures.pictures import digest_drawing\n"
        "from compressor.report.figures.style import LineStyle\n"
        "drawing, grid = make_grid(1, 1, 2.0)\n"
        "grid[0, 0].plot([0, 1], [3, 2], LineStyle('#000000'))\n"
        "print(digest_drawing(drawing))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == digest_drawing(figures["four"])


def test_other_code_draws_again(figures, monkeypatch):
    before = digest_drawing(figures["one"])
    monkeypatch.setattr(module, "code_digest", lambda: b"of another version")
    assert digest_drawing(figures["one"]) != before


def test_a_cloud_of_many_marks_is_pixels_in_an_svg_and_a_curve_is_not():
    for count, look, is_raster in (
        (module.MAX_VECTOR_MARKS, mark("#000000", "o", 3), False),
        (module.MAX_VECTOR_MARKS + 1, mark("#000000", "o", 3), True),
        (module.MAX_VECTOR_MARKS + 1, LineStyle("#000000"), False),
    ):
        drawing, grid = make_grid(1, 1, 2.0)
        grid[0, 0].plot(np.arange(count), np.arange(count), look)
        assert (b"<image" in render(drawing, "svg")) == is_raster
