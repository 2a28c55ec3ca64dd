"""Figures of regimes: every point is the stored one, and what cannot be drawn is said."""

import numpy as np
import pytest
import xarray as xr
from regimes_made import REVOLUTIONS, failed, made, plane

from compressor.report.figures.pictures import render
from compressor.report.plots import PlotChoice, PlotError, publish_drawings
from compressor.studies.regimes.figures import (
    CLASSES,
    PERIODS,
    ROWS_OF,
    draw_bifurcation,
    draw_periods,
    draw_sections,
    period_classes,
    period_rows,
)
from compressor.studies.regimes.plots import (
    MAX_SECTIONS,
    chosen_values,
    regime_figures,
)

BOTH = ("big_end", "small_end")
OVER = "clearance_mm_big_end"


@pytest.fixture(scope="module")
def data():
    return made()


def words(drawing):
    return [one.name for one in drawing.legend]


def points(panel):
    """Finite points of a panel's marks, those without lines."""
    found = [np.column_stack((one.x, one.y)) for one in panel.traces if one.is_points]
    return [xy[np.isfinite(xy).all(axis=1)] for xy in found]


def test_bifurcation_points_are_the_stored_ones(data):
    panel = draw_bifurcation(data).panels[0]
    for direction, drawn in zip(("up", "down"), points(panel), strict=True):
        stored = data["section"].sel(direction=direction, joint="big_end", coordinate="x").values
        there = np.isfinite(stored)
        x = np.repeat(data[OVER].values, REVOLUTIONS).reshape(stored.shape)
        np.testing.assert_allclose(
            drawn, np.column_stack((x[there], 1e3 * stored[there])), rtol=1e-12
        )
    assert panel.y.title == "$e_x$ (mm)"
    assert panel.x.log


def test_each_worn_joint_has_its_panels():
    pair = made(np.linspace(0.2, 0.4, 5), BOTH, ("up",))
    drawing = draw_bifurcation(pair)
    small = drawing.panels[1]
    stored = pair["section"].sel(joint="small_end", coordinate="x").values
    np.testing.assert_allclose(points(small)[0][:, 1], 1e3 * stored[np.isfinite(stored)])
    assert words(drawing) == ["up", "flight", "impact", "following"]
    pair.attrs["oiled"] = 1
    drawing = draw_bifurcation(pair)
    assert words(drawing) == ["up", "film alone", "dry contact begins", "dry contact"]
    names = {trace.name for trace in drawing.panels[-1].traces}
    assert names == {"film alone", "dry contact begins", "dry contact"}


def test_periods_stand_in_their_rows(data):
    chain = data.sel(direction="up").copy(deep=True)
    chain["regime"][:6] = ["periodic"] * 4 + ["chaotic", "undecided"]
    chain["period"][:6] = [1, 3, 16, np.nan, np.nan, np.nan]
    chain["regime"][6], chain["status"][7] = "", "failed"
    rows = period_rows(chain)[:8]
    expected = [PERIODS[1], PERIODS[3], PERIODS[16], ROWS_OF["undecided"], ROWS_OF["chaotic"],
                ROWS_OF["undecided"], np.nan, np.nan]  # fmt: skip
    np.testing.assert_array_equal(rows, expected)
    heights = [*PERIODS.values(), *ROWS_OF.values()]
    assert heights == sorted(heights)


def test_exponents_have_their_bars_and_a_zero_line(data):
    unsure = data.copy(deep=True)
    unsure["lyapunov_exponent_error"][0, 3] = np.inf
    panel = draw_bifurcation(unsure).panels[2]
    up = panel.traces[0]
    np.testing.assert_allclose(up.y, data["lyapunov_exponent"].values[0])
    bars = data["lyapunov_exponent_error"].values[0].copy()
    bars[3] = np.nan
    np.testing.assert_allclose(up.errors, [bars, bars])
    assert [note.y for note in panel.notes] == [0.0]


def test_contact_modes_are_stacked_to_the_whole(data):
    panel = draw_bifurcation(failed(data, "up", [4])).panels[-1]
    flight, impact, following, _ = panel.traces
    np.testing.assert_array_equal(impact.foot, np.nan_to_num(flight.y))
    np.testing.assert_allclose(np.delete(following.y, 4), 1.0)
    assert np.isnan(following.y[4])
    assert panel.title.endswith("big end, up")


def test_failed_values_are_marked_in_every_panel(data):
    drawing = draw_bifurcation(failed(data, "down", [3, 30]))
    for panel in drawing.panels:
        (mark,) = [trace for trace in panel.traces if trace.style.marker == "x"]
        np.testing.assert_allclose(mark.x, data[OVER].values[[3, 30]])
        low, high = panel.limits("y")
        assert (low < mark.y).all()
        assert (mark.y < high).all()
    assert "a run failed here" in words(drawing)
    assert "a run failed here" not in words(draw_bifurcation(data))


def test_sections_show_the_points_of_their_values(data):
    chosen = chosen_values(data)
    drawing = draw_sections(data.isel({OVER: chosen}))
    assert len(drawing.panels) == len(chosen) == MAX_SECTIONS
    for place, panel in zip(chosen, drawing.panels, strict=True):
        stored = data["section"].isel({OVER: place}).sel(direction="up", joint="big_end")
        x, rate = (stored.sel(coordinate=name).values for name in ("x", "x_rate"))
        there = np.isfinite(x)
        expected = np.column_stack((1e6 * x[there], 1e3 * rate[there]))
        np.testing.assert_allclose(points(panel)[0], expected)
        assert panel.title.startswith(f"{float(data[OVER][place]):.4g} mm: ")
        for drawn in points(panel):
            for values, way in zip(drawn.T, "xy", strict=True):
                low, high = panel.limits(way)
                assert (low < values).all()
                assert (values < high).all()


def test_a_fixed_point_is_not_blown_up(data):
    panels = draw_sections(data.isel({OVER: [0, 38]})).panels
    widths = [np.ptp(panel.limits("x")) for panel in panels]
    assert widths[0] >= 0.1 * widths[1]


def test_sections_are_chosen_evenly_among_the_regimes(data):
    one = data.isel(direction=[0]).copy(deep=True)
    one["regime"][0], one["period"][0] = "periodic", 1.0
    one["regime"][0, 37:], one["period"][0, 37:] = "chaotic", np.nan
    chosen = chosen_values(one)
    assert len(chosen) == MAX_SECTIONS
    assert sum(place >= 37 for place in chosen) == 3
    assert chosen_values(failed(one, "up", [*range(1, 40)])) == [0]
    gone = failed(data, "up", [*range(40)])  # then the other direction is looked at
    assert chosen_values(gone) == chosen_values(gone.isel(direction=[1])) != []
    many = one.copy(deep=True)
    many["regime"][0], many["period"][0] = "periodic", 1.0 + np.arange(40) // 4
    periods = many["period"].values[0, chosen_values(many)]
    assert len({*periods}) == MAX_SECTIONS


def test_a_map_colours_each_regime():
    data = plane(values=np.geomspace(0.01, 1, 6), directions=("up",))
    data["regime"][0, 0] = ["periodic"] * 4 + ["chaotic", "undecided"]
    data["period"][0, 0] = [1, 4, 5, 16, np.nan, np.nan]
    data["status"][1, 0, :2], data["regime"][1, 0, 1] = ["failed", "missing"], ""
    names = [*CLASSES]
    found = [names[i] for i in period_classes(data)[0, 0]]
    assert found == ["period 1", "period 4", *["period 5 to 16"] * 2, "chaotic", "undecided"]
    assert names[period_classes(data)[1, 0, 0]] == "failed"
    assert period_classes(data)[1, 0, 1] == -1
    drawing = draw_periods(data, "speed_rpm")
    (cells,) = drawing.panels[0].traces
    assert cells.z.shape == (3, 6)
    assert np.isnan(cells.z).sum() == 1
    np.testing.assert_array_equal(cells.z[0], period_classes(data)[0, 0])
    assert {"failed", "not run", "chaotic"} <= {*words(drawing)}


def test_all_axes_say_what_they_are(data):
    swept = plane(values=np.geomspace(0.01, 1, 4))
    chosen = data.isel({OVER: chosen_values(data)})
    for drawing in (
        draw_bifurcation(data), draw_sections(chosen), draw_periods(swept, "speed_rpm"),
    ):  # fmt: skip
        assert all(panel.title for panel in drawing.panels)
        assert any(panel.x.title for panel in drawing.panels)
        assert drawing.panels[0].y.title
        assert words(drawing)
        assert render(drawing, "png").startswith(b"\x89PNG")


# ---- which are drawn, and why not ---------------------------------------------------------------


def test_a_study_is_drawn_into_files_with_captions(data, tmp_path):
    named = data.assign_attrs(study="wear")
    figures = [*regime_figures(named, PlotChoice())]
    choice = PlotChoice(kinds=("png", "svg"))
    drawn = [*publish_drawings(figures, tmp_path, "wear", choice, "Unit 3")]
    assert [one.title for *_, one in figures] == ["Unit 3: bifurcation", "Unit 3: sections"]
    names = [path.name for one in drawn for path in one.paths]
    assert names == [f"wear-{n}.{k}" for n in ("bifurcation", "sections") for k in ("png", "svg")]
    assert all(path.stat().st_size > 1000 for one in drawn for path in one.paths)
    assert "Up: period 1 is lost at" in drawn[0].caption
    assert "6 of 40 values" in drawn[1].caption


def test_another_axis_makes_a_map_and_is_fixed_elsewhere():
    data = plane(values=np.geomspace(0.01, 1, 5))
    found = {name: caption for name, caption, _ in regime_figures(data, PlotChoice())}
    assert [*found] == ["bifurcation", "sections", "periods"]
    assert found["bifurcation"].endswith("Here speed_rpm 400.")
    assert "Here" not in found["periods"]
    asked = PlotChoice(("bifurcation",), at=("machine.speed_rpm=600",))
    ((_, caption, drawing),) = regime_figures(data, asked)
    assert caption.endswith("Here speed_rpm 600.")
    chain = data.isel(speed_rpm=2).sel(direction="down")
    drawn = drawing.panels[2].traces[1]
    np.testing.assert_allclose(drawn.y, chain["lyapunov_exponent"].values)


def test_of_several_axes_the_map_is_over_the_one_asked_for():
    part = plane(values=np.geomspace(0.01, 1, 3), directions=("up",))
    data = xr.concat([part, part], "rod_mass_kg").assign_coords(rod_mass_kg=[1.0, 2.0])
    asked = PlotChoice(("periods",), over="rod_mass_kg", at=("speed_rpm=500",))
    ((_, caption, drawing),) = regime_figures(data, asked)
    assert drawing.panels[0].y.title == "rod_mass_kg"
    assert caption.endswith("Here speed_rpm 500.")


@pytest.mark.parametrize(
    ("choice", "problem"),
    [
        (PlotChoice(("orbits",)), "has no figure 'orbits': it has bifurcation, sections, periods"),
        (PlotChoice(("periods",)), "follows one parameter: a period map needs another"),
        (PlotChoice(over="speed_rpm"), "no axis 'speed_rpm' to choose: its axes are clearance_mm."),
        (PlotChoice(at=("speed_rpm=3",)), "no axis 'speed_rpm' to choose: its axes are none"),
    ],
)
def test_what_a_study_does_not_have_is_refused(data, choice, problem):
    with pytest.raises(PlotError, match=problem):
        [*regime_figures(data, choice)]


def test_a_value_that_an_axis_does_not_have_is_refused():
    data = plane(values=[0.1, 0.2], directions=("up",))
    with pytest.raises(PlotError, match="--at speed_rpm=3: the axis has 400, 500, 600"):
        [*regime_figures(data, PlotChoice(at=("speed_rpm=3",)))]


def test_where_there_is_nothing_to_draw_it_is_said_why(data):
    gone = failed(failed(data, "up", [*range(40)]), "down", [*range(40)])
    words = r"all that were run failed: step_underflow \(80\): try another solve.method"
    for name in ("bifurcation", "sections"):
        with pytest.raises(PlotError, match=words):
            [*regime_figures(gone, PlotChoice((name,)))]
    unrun = gone.assign(status=xr.full_like(gone["status"], "missing"))
    with pytest.raises(PlotError, match="was run yet"):
        [*regime_figures(unrun, PlotChoice())]
