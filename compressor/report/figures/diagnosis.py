"""The healthy machine beside the paper's faults: spectra, orbits, and when the frame shakes."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from compressor.analysis import (
    AFTER,
    BEFORE,
    CLEARANCES,
    FAULTS,
    ORDER,
    SPOKEN,
    Shaking,
    angle_modes,
    label,
    measure_orbit,
    mode_shares,
    near_a_turn,
    shaking,
)
from compressor.report.figures.curves import Runs
from compressor.report.figures.drawing import ROOM, WAYS, Panel, make_grid
from compressor.report.figures.job import ORDERS_AXIS, list_modes, plot_lines, plot_orbit, show_turn
from compressor.report.figures.paper import AT, sizes
from compressor.report.figures.rows import SweptRow, plot_modes, rows_modes
from compressor.report.figures.style import BLUE, BY_CLEARANCE, GOLD, IDEAL, RED, LineStyle, fill
from compressor.report.figures.table import DrawnFigure, figure, spell
from compressor.units import Units

Shakings = Mapping[str, Shaking]  # by label of the paper's cases

SINGLE_FAULTS = FAULTS[:2]  # clearance at one joint
BY_FAULT = {
    "big_end": LineStyle(BLUE, (), 1.2, 2.3, "circle"),
    "small_end": LineStyle(RED, (6, 1.2), 1.2, 2.2, "diamond"),
    "both": LineStyle(GOLD, (6, 1, 1.2, 1), 1.8, 2.1, "square"),
}
NEEDS = sizes("big_end", "design") + sizes("small_end") + sizes("both")
BIN = 5.0  # degrees over which the rms is taken
NEAR = fill("#f2ead9", zorder=0.5)


def measure_shaking(runs: Runs) -> Shakings:
    """Return `shaking` of the healthy machine and all faults."""
    return {name: shaking(runs[name]) for name in NEEDS}


@figure("diagnosis", "diagnosis-spectra", "Diagnosis 1: orders of the force on the frame", *NEEDS)
def draw_spectra(runs: Runs, found: Shakings, units: Units = "usual") -> DrawnFigure:
    """Return X over orders: healthy, and each joint at the greatest clearance.

    Rms over clearance.
    """
    drawing, panels = make_grid(1, 2, 4.6, widths=(2.3, 1), units=units)
    lines, trend = panels.flat
    lines.label("y", "amplitude of X ({})", "N")
    trend.label("x", "clearance ({})", "mm")
    trend.label("y", "rms ({})", "N")
    drawing.list_line("no clearance", IDEAL)
    names = {f: SPOKEN[f] + ("" if f in SINGLE_FAULTS else ", (b) only") for f in BY_FAULT}
    for fault in SINGLE_FAULTS:
        spectrum = found[label(fault, CLEARANCES[-1])].spectrum
        plot_lines(lines, spectrum.lines, replace(BY_FAULT[fault], marker=""), names[fault])
    ends = lines.y.range
    plot_lines(lines, found["design"].spectrum.lines, IDEAL, "no clearance")
    lines.y.range = ends
    lines.title = f"(a) force on the frame along the cylinder, {CLEARANCES[-1]:g} mm"
    lines.x.title = ORDERS_AXIS
    sizes = np.array(CLEARANCES)
    for fault, line in BY_FAULT.items():
        above = np.array([found[label(fault, c)].spectrum.above for c in CLEARANCES])
        trend.plot(sizes, above, line, names[fault])
    trend.rule(IDEAL, y=found["design"].spectrum.above)
    trend.title = f"(b) rms of X above order {ORDER}"
    trend.x.tickvals = trend.at("x", CLEARANCES)
    trend.span("x", CLEARANCES[0] - 0.03, CLEARANCES[-1] + 0.03)
    trend.span("y", low=0)
    sentence = (
        "(a) Order spectra of X, the force on the frame along the cylinder, over the settled "
        f"revolutions; dashed: order {ORDER}. (b) The rms above it over clearance."
    )
    numbers = [(f"rms above order {ORDER} without clearance",
                spell(found["design"].spectrum.above, "N"))]  # fmt: skip
    for fault in FAULTS:
        forces = [found[label(fault, c)].spectrum.above for c in CLEARANCES]
        numbers.append(
            (
                f"with {AT} at the {SPOKEN[fault]}" if fault != "both" else "at both joints",
                spell(forces, "N"),
            )
        )
    return DrawnFigure(drawing.figure(), sentence, numbers)


@figure("diagnosis", "diagnosis-orbits", "Diagnosis 2: orbits of the journals", *NEEDS)
def draw_orbits(runs: Runs, found: Shakings, units: Units = "usual") -> DrawnFigure:
    """Return the journals' orbits of each joint at three clearances, all to one scale."""
    drawing, panels = make_grid(
        len(SINGLE_FAULTS), len(CLEARANCES), 7.2, units=units, share_x="all", share_y="all"
    )
    for row, joint in zip(panels, SINGLE_FAULTS, strict=True):
        for panel, clearance in zip(row, CLEARANCES, strict=True):
            plot_orbit(panel, runs[label(joint, clearance)], joint)
            panel.title = f"{SPOKEN[joint]}, {clearance:g} mm"
    for way in WAYS:
        axes = [panel.axis(way) for panel in drawing.panels]
        axes[0].range = max((axis.range for axis in axes), key=max)
    sentence = (
        "The journal's centre in its bore over the last revolution, all to one scale; without "
        "clearance it is a point. Outside the circle it is pressed in."
    )
    numbers = []
    for joint in SINGLE_FAULTS:
        each = [measure_orbit(runs[label(joint, c)], joint) for c in CLEARANCES]
        off = [100.0 * one.off_wall for one in each]
        numbers.append((f"off its wall at the {SPOKEN[joint]}, {AT}", spell(off, "% of the time")))
        laps = [one.laps for one in each]
        numbers.append(("turns a revolution, counter-clockwise positive", spell(laps)))
    return DrawnFigure(drawing.figure(), sentence, numbers)


@figure("diagnosis", "diagnosis-angles",
        "Diagnosis 3: when the frame shakes, and the contact modes", *NEEDS)  # fmt: skip
def draw_angles(runs: Runs, found: Shakings, units: Units = "usual") -> DrawnFigure:
    """Return X's high orders and the joints' contact modes over the crank angle."""
    drawing, panels = make_grid(
        2 * len(SINGLE_FAULTS), 1, 8.4, heights=(2.6, 1) * 2, units=units, share_x="all"
    )
    for joint, profile, strip in zip(SINGLE_FAULTS, panels[::2, 0], panels[1::2, 0], strict=True):
        plot_profiles(profile, found, joint)
        mark_turns(profile, found[label(joint, CLEARANCES[-1])])
        rows = [SweptRow(f"{c:g}", modes=angle_modes(runs[label(joint, c)])) for c in CLEARANCES]
        plot_modes(strip, rows_modes(rows)[joint])
        strip.name_ticks("y", [row.value for row in rows])
        strip.y.title = "mm"
        strip.title = f"contact mode, clearance at the {SPOKEN[joint]}"
    top = max(trace.y.max() for one in panels[::2, 0] for trace in one.traces)
    panels[0, 0].y.range = (0.0, (1.0 + ROOM) * top)  # plotly shares no scale with an open end
    panels[2, 0].y.matches = f"y{panels[0, 0].suffix}"
    for panel in drawing.panels:
        show_turn(panel)
    drawing.list_area("the force turns", NEAR)
    list_modes(drawing)
    sentence = (
        f"The part of X above order {ORDER} over crank angle; shaded: from {BEFORE:g}° before to "
        f"{AFTER:g}° after a change of direction of the joint's force along the cylinder, at "
        f"{CLEARANCES[-1]:g} mm. Below: contact modes."
    )
    numbers = []
    for joint in SINGLE_FAULTS:
        forces = [found[label(joint, c)] for c in CLEARANCES]
        turns = ", ".join(f"{turn:.0f}°" for turn in forces[-1].turns) or "nowhere"
        near, rest = ([getattr(o, n) for o in forces] for n in ("near_turns", "elsewhere"))
        shares = [mode_shares(runs[label(joint, c)]) for c in CLEARANCES]
        flight = [100.0 * one.sel(joint=joint, mode="flight") for one in shares]
        numbers += [
            (f"the force at the {SPOKEN[joint]} turns at", turns),
            (f"rms near these angles at {AT}", spell(near, "N")),
            ("elsewhere", spell(rest, "N")),
            ("in flight", spell(flight, "% of the time")),
        ]
    return DrawnFigure(drawing.figure(), sentence, numbers)


def plot_profiles(panel: Panel, found: Shakings, joint: str) -> None:
    """Draw the rms of X above `ORDER` over bins of crank angle."""
    panel.label("y", "rms ({})", "N")
    for clearance in CLEARANCES:
        one = found[label(joint, clearance)]
        count = round(360.0 / BIN)
        place = np.floor(one.angle / BIN + 1e-6).astype(int) % count
        mean = np.bincount(place, one.mean_square, count) / np.bincount(place, minlength=count)
        values = np.sqrt(np.append(mean, mean[-1]))
        line = replace(BY_CLEARANCE[clearance], is_step=True)
        panel.plot(np.arange(count + 1) * BIN, values, line, f"{clearance:g} mm")
    panel.title = f"rms of X above order {ORDER} in {BIN:g}°, clearance at the {SPOKEN[joint]}"


def mark_turns(panel: Panel, one: Shaking) -> None:
    """Draw where the joint's force turns."""
    fine = np.arange(0.0, 360.0, 0.5)
    is_near = near_a_turn(fine, one.turns)
    ends = np.flatnonzero(np.diff(is_near)) + 1
    for part in np.split(np.arange(fine.size), ends):
        if is_near[part[0]]:
            panel.draw_band("x", fine[part[0]], fine[part[-1]], NEAR)
