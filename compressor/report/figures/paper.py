"""The paper's figures: 3 and 4, and 6 to 16."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from numpy.typing import ArrayLike

from compressor import analysis
from compressor.report.figures import curves, style
from compressor.report.figures.drawing import WAYS, Drawing, Panel, make_grid
from compressor.report.figures.table import DrawnFigure, figure, spell
from compressor.units import Units

SERIES = ("displacement", "velocity", "acceleration")
WORDS = "displacement, velocity and acceleration"
PEAKS = " Greatest values are of all settled revolutions, also between the samples that are drawn."
AT = f"{', '.join(f'{c:g}' for c in analysis.CLEARANCES)} mm"


def paper_figure(
    number: int, title: str, *needs: str, **options: str
) -> Callable[[Callable[..., DrawnFigure]], Callable[..., DrawnFigure]]:
    """Return a decorator that enters a figure of the paper into the table."""
    return figure("paper", f"figure-{number:02d}", f"Figure {number}: {title}", *needs, **options)


def sizes(fault: str, *more: str) -> tuple[str, ...]:
    """Return the labels of more runs, and of a fault's three clearances."""
    return (*more, *(analysis.label(fault, clearance) for clearance in analysis.CLEARANCES))


def spell_angles(found: ArrayLike) -> str:
    """Return angles (rad) in degrees, one after the other."""
    return ", ".join(f"{angle:.2f}°" for angle in np.degrees(np.atleast_1d(found)))


MOTION = (
    curves.Quantity(
        "displacement", "displacement", "displacement", "mm", 1e3, window=24.0, steep=True
    ),
    curves.Quantity("velocity", "velocity", "velocity", "m/s", steep=True),
    curves.Quantity("acceleration", "acceleration", "acceleration", "m/s²"),
)


@paper_figure(6, "Response of the design and the typical model", "design", "typical")
def draw_load_response(runs: curves.Runs, units: Units = "usual") -> DrawnFigure:
    """Return figure 6: the design and the typical model without clearance."""
    drawn = curves.load_curves(runs)
    drawing, panels = make_grid(3, 2, 9.6, units=units)
    for (full, enlarged), quantity, letters in zip(panels, MOTION, ("ab", "cd", "ef"), strict=True):
        curves.plot(full, drawn, quantity)
        enlarge([full], enlarged, drawn, quantity, letters)
    one, other = runs["design"], runs["typical"]
    away = [
        np.abs(one[name].values - other[name].values).max() / np.ptp(other[name].values)
        for name in SERIES
    ]
    sentence = (
        "Both models without clearance: left, the last revolution; right, the part in the black "
        "rectangle, at a peak."
    )
    shares = spell(np.where(np.array(away) <= curves.SAME_CURVE, 0.0, 100.0 * np.array(away)))
    numbers = [(f"greatest difference of {WORDS}", f"{shares} % of the range")]
    return DrawnFigure(finish_figure(drawing, panels[-1]), sentence, numbers)


@paper_figure(8, "Response with clearance at the big end", *sizes("big_end", "design"),
              fault="big_end")  # fmt: skip
@paper_figure(11, "Response with clearance at the small end", *sizes("small_end", "design"),
              fault="small_end")  # fmt: skip
@paper_figure(14, "Response with clearance at both joints", *sizes("both", "design"), fault="both")
def draw_fault_response(runs: curves.Runs, fault: str, units: Units = "usual") -> DrawnFigure:
    """Return figure 8, 11 or 14: no clearance, and three clearances of one fault."""
    drawn = curves.fault_curves(runs, fault, ideal=True)
    drawing, panels = make_grid(
        5, 2, 11.5, heights=(3, 3, 2, 2, 2), units=units, tall=[slice(2, 5)]
    )
    for (full, enlarged), quantity, letters in zip(panels, MOTION[:2], ("ab", "cd"), strict=False):
        curves.plot(full, drawn, quantity)
        enlarge([full], enlarged, drawn, quantity, letters)
    enlarged = panels[2, 1]
    curves.plot_rows(panels[2:, 0], drawn, MOTION[2])
    enlarge(panels[2:, 0], enlarged, drawn, MOTION[2], "ef")
    sentence = (
        "Left, the last revolution, acceleration in a row a clearance, with the motion without "
        "clearance dotted; right, the part in the black rectangles, where the curves differ most."
        f"{PEAKS}"
    )
    worn = [runs[analysis.label(fault, c)] for c in analysis.CLEARANCES]
    away = 100.0 * np.max([differences_from_ideal(run) for run in worn], axis=0)
    peaks = spell([run["peak_acceleration"] for run in worn], "m/s²", units)
    numbers = [
        (f"greatest difference of {WORDS} from no clearance", f"{spell(away)} % of the range"),
        (f"greatest acceleration at {AT}", peaks),
    ]
    for joint in analysis.faulty_joints(fault):
        lost = [100.0 * run["contact_loss_fraction"].sel(joint=joint) for run in worn]
        numbers.append((f"time without contact at the {analysis.SPOKEN[joint]}", spell(lost, "%")))
    return DrawnFigure(finish_figure(drawing, [panels[-1, 0], enlarged]), sentence, numbers)


def differences_from_ideal(run: xr.Dataset) -> list[float]:
    """Return how far `SERIES` of a run leave those of ideal joints, as shares of their ranges."""
    settled = analysis.settled_part(run)
    return [
        float(np.abs(settled[name].values - ideal).max() / np.ptp(ideal))
        for name, ideal in zip(SERIES, analysis.ideal_motion(settled), strict=True)
    ]


def enlarge(
    full: Sequence[Panel] | np.ndarray,
    enlarged: Panel,
    drawn: Sequence[curves.Curve],
    quantity: curves.Quantity,
    letters: str,
) -> None:
    """Draw the view where the curves differ most, and the titles of both."""
    part, differs = curves.differing_part(drawn, quantity)
    curves.plot_enlarged(full, enlarged, drawn, quantity, part)
    full[0].title = f"({letters[0]}) {full[0].title}"
    remark = "" if differs else ": the curves coincide"
    enlarged.title = f"({letters[1]}) {quantity.title}, enlarged{remark}"


def finish_figure(drawing: Drawing, lowest: Sequence[Panel] | np.ndarray) -> go.Figure:
    """Return the figure with titles of its lowest axes."""
    for panel in lowest:
        panel.x.title = curves.ANGLE_AXIS
    return drawing.figure()


PISTON = curves.Quantity(
    "piston_force", "force on the piston, towards the crank", "force", "kN", curves.KILONEWTON
)


@paper_figure(7, "Piston force of the design and the typical model", "design", "typical")
def draw_piston_force(runs: curves.Runs, units: Units = "usual") -> DrawnFigure:
    """Return figure 7: the piston force of the design and the typical model."""
    drawing, panels = make_grid(1, 1, 4.2, units=units)
    curves.plot(panels[0, 0], curves.load_curves(runs), PISTON)
    panels[0, 0].span("y", low=0)
    sentence = (
        "The force on the piston over the last revolution. Steps of the spring's force are its "
        "damping, which acts only while the follower rests."
    )
    numbers = []
    for load, name in (("design", "spring"), ("typical", "gas")):
        peak = float(runs[load]["piston_force"].max()) * curves.KILONEWTON
        numbers.append((f"greatest force of the {name}", spell(peak, "kN", units)))
        numbers.append(
            (f"corners of the {name}", spell_angles(analysis.record_of(runs[load]).corners))
        )
    return DrawnFigure(finish_figure(drawing, panels[0]), sentence, numbers)


@paper_figure(9, "Contact force at the big end", *sizes("big_end"), fault="big_end",
              joint="big_end")  # fmt: skip
@paper_figure(12, "Contact force at the small end", *sizes("small_end"), fault="small_end",
              joint="small_end")  # fmt: skip
@paper_figure(15, "Contact force at the big end, clearance at both joints", *sizes("both"),
              fault="both", joint="big_end")  # fmt: skip
@paper_figure(16, "Contact force at the small end, clearance at both joints", *sizes("both"),
              fault="both", joint="small_end")  # fmt: skip
def draw_contact_force(
    runs: curves.Runs, fault: str, joint: str, units: Units = "usual"
) -> DrawnFigure:
    """Return figure 9, 12, 15 or 16: contact force at one joint both ways, a row a clearance.

    All enlarged views show one window, chosen at the fault's first joint.
    """
    both = slice(0, 3), slice(3, 6)
    drawing, panels = make_grid(
        6, 2, 11.5, widths=(2, 1), units=units, share_x="columns", tall=both
    )
    drawn = curves.fault_curves(runs, fault, ideal=False)
    chosen_by = analysis.faulty_joints(fault)[0]
    part, _ = curves.differing_part(drawn, contact_force(chosen_by, "x"))
    for rows, axis, letter in zip(both, "xy", "ab", strict=True):
        quantity = contact_force(joint, axis)
        enlarged = panels[rows.start, 1]
        curves.plot_rows(panels[rows, 0], drawn, quantity)
        curves.plot_enlarged(panels[rows, 0], enlarged, drawn, quantity, part)
        for panel in panels[rows, 0]:
            panel.title = f"({letter}) {panel.title}"
        enlarged.title = "enlarged"
        enlarged.y.title = ""
    sentence = (
        "Force on the rod: (a) along the cylinder, positive away from the crank, and (b) vertical, "
        "on a scale of its own. Left, the last revolution, a row a clearance; right, the part in "
        f"the black rectangles, where the horizontal forces at the {analysis.SPOKEN[chosen_by]} "
        f"differ most.{PEAKS}"
    )
    numbers = []
    for axis, words in (("x", "along the cylinder"), ("y", "across it")):
        worn = [runs[analysis.label(fault, c)] for c in analysis.CLEARANCES]
        peaks = [run["peak_contact_force_axis"].sel(joint=joint, axis=axis) for run in worn]
        values = spell(np.array(peaks) * curves.KILONEWTON, "kN", units)
        numbers.append((f"greatest {words} at {AT}", values))
    return DrawnFigure(finish_figure(drawing, [panels[-1, 0], enlarged]), sentence, numbers)


def contact_force(joint: str, axis: str) -> curves.Quantity:
    """Return the force on the rod at a joint along an axis, kN."""
    title = {"x": "horizontal force on the rod", "y": "vertical force on the rod"}[axis]
    where = (("joint", joint), ("axis", axis))
    return curves.Quantity("contact_force", title, "force", "kN", curves.KILONEWTON, where=where)


@paper_figure(10, "Acceleration against horizontal contact force, big end", *sizes("big_end"),
              joint="big_end")  # fmt: skip
@paper_figure(13, "Acceleration against horizontal contact force, small end", *sizes("small_end"),
              joint="small_end")  # fmt: skip
def draw_relation(runs: curves.Runs, joint: str, units: Units = "usual") -> DrawnFigure:
    """Return one panel a clearance: every stored sample and the regression line."""
    drawing, panels = make_grid(1, 3, 4.0, units=units, share_x="all", share_y="all")
    found = []
    for panel, letter, clearance in zip(panels.flat, "abc", analysis.CLEARANCES, strict=True):
        run, name = runs[analysis.label(joint, clearance)], f"{clearance:g} mm"
        settled = analysis.settled_part(run)
        a, force = settled["acceleration"].values, contact_force(joint, "x").values(settled)
        panel.label("x", "horizontal force on the rod ({})", "kN")
        panel.label("y", "acceleration ({})", "m/s²")
        color = style.BY_CLEARANCE[clearance].color
        dots = style.mark(color, "circle", 2.2, edge_width=0.0, alpha=0.45)
        panel.plot(force, a, dots, name, listed=False)
        found.append(fit := analysis.force_relation(run, joint))
        ends = np.array([a.min(), a.max()])
        fitted = (fit.slope * ends + fit.intercept) * curves.KILONEWTON
        line = style.LineStyle(style.BLACK, linewidth=1.1)
        panel.plot(fitted, ends, line, "fit", listed=False)
        panel.title = f"({letter}) {name}"
    sentence = (
        "A dot for each stored sample; the line is the least-squares fit of force on acceleration, "
        "whose slope is a mass."
    )
    numbers = [
        (f"slope at {AT}", spell([one.slope for one in found], "kg")),
        ("force without acceleration", spell([1e-3 * one.intercept for one in found], "kN", units)),
        ("r²", spell([one.r2 for one in found])),
    ]
    return DrawnFigure(drawing.figure(), sentence, numbers)


CLOSED = style.LineStyle(style.BLUE, (), 1.8, 2.3)
PRINTED = style.LineStyle(style.GOLD, (), 1.6, 2.2)
BASE = style.LineStyle("#707070", (1, 1.2), 1.2, 2.1)


@paper_figure(3, "The ideal p–V diagram", "typical")
def draw_pressure_volume(runs: curves.Runs, units: Units = "usual") -> DrawnFigure:
    """Return figure 3: cylinder pressure over volume."""
    run, gas = analysis.settled_part(runs["typical"]), analysis.case_of(runs["typical"]).gas
    states = analysis.end_states(run)
    end = (gas.compressing_ends or [*states])[0]
    volume, pressure = states[end]
    drawing, panels = make_grid(1, 1, 5.2, units=units)
    (panel,) = panels.flat
    panel.label("x", f"{'displaced' if gas.is_measured else 'gas'} volume V ({{}})", "litres")
    panel.label("y", "pressure p ({}, absolute)", "MPa")
    panel.plot(volume, pressure, CLOSED, "gas in the cylinder")
    panel.span("x", 0, 1.05 * volume.max())
    panel.span("y", 0, 1.15 * pressure.max())
    sentence = (
        f"Pressure over gas volume in the {end} end of the typical model's cylinder; against "
        "the clock, from the upper left: expansion, suction, compression, discharge."
    )
    numbers, used = [], analysis.record_of(run).corners
    if used.any():
        off = np.abs(used - analysis.Cam(analysis.record_of(run)).gas_corners).max()
        numbers = [
            ("the phases change at", spell_angles(used)),
            ("off the ideal gas's corners by up to", spell_angles(off)),
        ]
    return DrawnFigure(drawing.figure(), sentence, numbers)


@paper_figure(4, "The cam of the spring load", "design")
def draw_cam(runs: curves.Runs, units: Units = "usual") -> DrawnFigure:
    """Return figure 4: the cam's contour, and its follower's displacement, also as printed."""
    cam = analysis.Cam(analysis.record_of(runs["design"]))
    angles = np.radians(np.linspace(0, 360, 1441))
    drawing, panels = make_grid(1, 2, 4.9, widths=(1, 1.25), units=units)
    draw_contour(panels[0, 0], cam, angles)
    draw_follower(panels[0, 1], cam, angles)
    sentence = (
        "(a) The path of the roller's centre around the base circle, at rest while the gas would "
        "expand or be compressed. (b) The follower's displacement: of the closed cam, our "
        "reconstruction, and of Eq. 10 as printed, with the ideal gas's corners."
    )
    rise, fall = cam.printed_follower([math.pi, cam.gas_corners[2]])
    numbers = [
        ("as printed it rises and falls by", spell([1e3 * rise, 1e3 * fall], "mm", units)),
        ("the closed cam, each way, by", spell(1e3 * cam.follower(math.pi), "mm", units)),
        ("both are the same from", spell_angles(cam.gas_corners[2])),
    ]
    return DrawnFigure(drawing.figure(), sentence, numbers)


def draw_contour(panel: Panel, cam: analysis.Cam, angles: np.ndarray) -> None:
    """Draw the closed cam's pitch curve around its base circle."""
    x, y = cam.contour(angles)
    panel.title = "(a) contour of the closed cam"
    panel.y.scaleanchor = f"x{panel.suffix}"
    panel.label("x", "x ({})", "mm")
    panel.label("y", "y ({})", "mm")
    rim = analysis.BASE_RADIUS * 1e3 * np.array([np.cos(angles), np.sin(angles)])
    panel.plot(rim[0], rim[1], BASE, f"base circle, {analysis.BASE_RADIUS * 1e3:g} mm")
    panel.plot(x * 1e3, y * 1e3, CLOSED, "roller's path")
    for way, values in zip(WAYS, (x, y), strict=True):
        room = 0.06 * np.ptp(values)
        panel.span(way, 1e3 * (values.min() - room), 1e3 * (values.max() + room))


def draw_follower(panel: Panel, cam: analysis.Cam, angles: np.ndarray) -> None:
    """Draw the follower displacement of the closed cam, and of Eq. 10 taken literally."""
    panel.label("x", "cam angle (°)")
    panel.label("y", "s ({})", "mm")
    fall = cam.gas_corners[2]
    jump = np.array([math.nan, fall])  # which no line crosses
    parts = np.concatenate([angles[angles < fall], jump, angles[angles >= fall]])
    s = cam.printed_follower(parts) * 1e3
    panel.plot(np.degrees(parts), s, PRINTED, "as printed, Eq. 10")
    s = cam.follower(angles) * 1e3
    panel.plot(np.degrees(angles), s, CLOSED, "closed cam, as simulated")
    height, left = 1e3 * cam.printed_follower([math.pi, fall])
    dots = style.LineStyle(style.RED, (1, 1.65), 1.5)
    panel.plot(np.degrees([fall, fall]), [left, height], dots)
    panel.title, panel.x.dtick = "(b) follower displacement", 60.0
    panel.span("x", 0, 360)
    panel.span("y", -6, 1.12 * height)
