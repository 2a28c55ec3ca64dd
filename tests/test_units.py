"""Units that people read: factors by definition, texts with units, and figures in them."""

import math

import numpy as np
import pytest

from compressor.report.figures.drawing import ColorScale, Note, make_grid, map_cells
from compressor.report.figures.plant_units import in_units
from compressor.report.figures.style import RED, LineStyle
from compressor.units import read_quantity, unit_in

LINE = LineStyle(RED)


@pytest.mark.parametrize(
    ("unit", "units", "read", "factor"),
    [
        ("kN", "usual", "kN", 1.0), ("kN", "plant", "kN", 1.0), ("kN", "si", "N", 1e3),
        ("N", "plant", "kN", 1e-3), ("m/s²", "plant", "g", 1 / 9.80665), ("m/s²", "si", "m/s²", 1),
        ("m/s2", "si", "m/s2", 1.0), ("µm", "plant", "mm", 1e-3), ("µm", "si", "m", 1e-6),
        ("m/s", "plant", "mm/s", 1e3), ("MPa", "plant", "bar", 10.0), ("MPa", "si", "Pa", 1e6),
        ("rad/s", "plant", "rpm", 60 / math.tau), ("rad", "plant", "°", 180 / math.pi),
        ("°", "si", "°", 1.0), ("%", "si", "%", 1.0), ("per rev", "plant", "per rev", 1.0),
    ],
)  # fmt: skip
def test_a_number_is_read_in_the_unit_that_is_chosen(unit, units, read, factor):
    found, times = unit_in(unit, units)
    assert found == read
    assert times == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "si", "value"),
    [
        ("166 kN", "N", 166e3), ("166kN", "N", 166e3), ("166000", "N", 166e3),
        ("2 g", "m/s2", 19.6133), ("0.1 mm", "m", 1e-4), ("3 mm/s", "m/s", 3e-3),
        ("5 %", "1", 0.05), ("-1.5e-3", "1", -1.5e-3),
        ("90 deg", "rad", math.pi / 2), ("740 rpm", "rad/s", 740 * math.tau / 60), ("x", "N", None),
    ],
)  # fmt: skip
def test_a_text_may_have_a_unit(text, si, value):
    assert read_quantity(text, si) == (value if value is None else pytest.approx(value, rel=1e-12))


def test_a_unit_of_another_quantity_is_refused():
    with pytest.raises(ValueError, match="'kN' is no unit of it; there are m, mm, µm, um"):
        read_quantity("1 kN", "m")


def test_a_figure_s_numbers_follow_its_titles():
    drawing, grid = make_grid(1, 3, 3.0)
    line, bars, image = grid.flat
    line.plot([0.0, 90.0], [9.80665, -19.6133], LINE, "a", errors=np.full((2, 2), 9.80665))
    line.x.title, line.y.title = "crank angle (°), 0 = top dead centre", "a (m/s²)"
    line.y.span(-29.41995, 29.41995)
    line.notes = [Note(x=45.0, style=LINE), Note(y=9.80665, style=LINE)]
    line.notes.append(Note("inside", 45.0, 0.5, inside="y"))
    bars.plot([2.0], [1.0], LINE, "b", kind="columns", thick=0.5, foot=np.array([0.5]))
    bars.x.title, bars.y.title = "place (mm)", "pressure p (MPa, absolute)"
    colors = ColorScale(("#000000", "#ffffff"), 1.0, 4.0, title="amplitude (kN)", levels=(2.0,))
    image.traces.append(map_cells(np.arange(3.0), np.arange(2.0), np.array([[1.0, 4.0]]), colors))
    image.y.words = {0.0: "0.1"}
    image.y.title = "clearance (mm)"

    assert in_units(drawing, "usual") is drawing
    one, two, three = in_units(drawing, "plant").panels
    assert (one.x.title, one.y.title) == ("crank angle (°), 0 = top dead centre", "a (g)")
    assert one.traces[0].x.tolist() == [0.0, 90.0]
    assert one.traces[0].y == pytest.approx([1.0, -2.0])
    assert one.traces[0].errors == pytest.approx(np.ones((2, 2)))
    assert one.limits("y") == pytest.approx((-3.0, 3.0))
    assert (one.notes[0].x, one.notes[1].y) == (45.0, pytest.approx(1.0))
    assert (one.notes[2].x, one.notes[2].y) == (45.0, 0.5)
    assert two.y.title == "pressure p (bar, absolute)"
    assert (two.traces[0].y, two.traces[0].foot, two.traces[0].thick) == (10.0, 5.0, 0.5)
    assert three.traces[0].z.tolist() == [[1.0, 4.0]]

    _, two, three = in_units(drawing, "si").panels
    assert (two.x.title, two.traces[0].x) == ("place (m)", pytest.approx(2e-3))
    assert two.traces[0].thick == pytest.approx(0.5e-3)
    (cells,) = three.traces
    assert (cells.scale.title, cells.scale.low, cells.scale.high) == ("amplitude (N)", 1e3, 4e3)
    assert (cells.z.tolist(), cells.scale.levels) == ([[1e3, 4e3]], (2e3,))
    assert three.y.title == "clearance (mm)"  # its ticks are words


def test_an_axis_without_a_title_has_its_neighbour_s_unit():
    """An enlarged view stands beside the curves of its row, and lower rows have no title."""
    drawing, grid = make_grid(2, 2, 3.0)
    for panel in grid.flat:
        panel.plot([0.0, 1.0], [1.0, 2.0], LINE, "force")
    grid[0, 0].y.title = grid[1, 0].y.title = "force (kN)"
    grid[1, 0].x.title = "place (mm)"
    panels = in_units(drawing, "si").panels
    assert [panel.traces[0].y.tolist() for panel in panels] == [[1e3, 2e3]] * 4
    assert [panel.traces[0].x[1] for panel in panels] == pytest.approx([1e-3, 1.0, 1e-3, 1.0])
