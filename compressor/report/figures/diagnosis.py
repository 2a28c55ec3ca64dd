"""The healthy machine beside the paper's faults: spectra, orbits, and when the frame shakes."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator

from compressor.analysis import (
    CLEARANCES,
    FAULTS,
    ORDER,
    SPOKEN,
    Shaking,
    SweptRow,
    angle_modes,
    label,
    rows_modes,
)
from compressor.report.figures.curves import ANGLE_AXIS, Runs
from compressor.report.figures.job import (
    CORNERS,
    ORDERS_AXIS,
    corner,
    mode_handles,
    plot_lines,
    plot_modes,
    plot_orbit,
)
from compressor.report.figures.style import (
    BLUE,
    BY_CLEARANCE,
    GOLD,
    IDEAL,
    RED,
    LineStyle,
    in_style,
    legend_above,
    sheet,
)

Shakings = Mapping[str, Shaking]  # by label of the paper's cases

SINGLE_FAULTS = FAULTS[:2]  # clearance at one joint
BY_FAULT = {
    "big_end": (LineStyle(BLUE, "-", 1.2, 2.3), "o"),
    "small_end": (LineStyle(RED, (0, (6, 1.2)), 1.2, 2.2), "D"),
    "both": (LineStyle(GOLD, (0, (6, 1, 1.2, 1)), 1.8, 2.1), "s"),
}
BIN = 5.0  # degrees over which the rms is taken
NEAR_COLOR = "#f2ead9"


@in_style
def draw_diagnosis_spectra(found: Shakings) -> Figure:
    """Return X over orders: healthy, and each joint at the greatest clearance.

    Rms over clearance.
    """
    figure, panels = sheet(1, 2, 4.6, width_ratios=(2.3, 1))
    lines, trend = panels.flat
    for fault in SINGLE_FAULTS:
        plot_lines(lines, found[label(fault, CLEARANCES[-1])].spectrum.lines, BY_FAULT[fault][0])
    bottom, top = lines.get_ylim()
    plot_lines(lines, found["design"].spectrum.lines, IDEAL)
    lines.set_ylim(bottom, top)
    lines.set_title(f"(a) force on the frame along the cylinder, {CLEARANCES[-1]:g} mm")
    lines.set_xlabel(ORDERS_AXIS)
    lines.set_ylabel("amplitude of X (N)")
    for fault, (line, marker) in BY_FAULT.items():
        above = [found[label(fault, c)].spectrum.above for c in CLEARANCES]
        trend.plot(CLEARANCES, above, marker=marker, **line.properties())
    healthy = found["design"].spectrum.above
    trend.axhline(healthy, clip_on=False, **IDEAL.properties())
    trend.set_title(f"(b) rms of X above order {ORDER}")
    trend.set(xticks=CLEARANCES, xlabel="clearance (mm)", ylabel="rms (N)")
    trend.set_xlim(CLEARANCES[0] - 0.03, CLEARANCES[-1] + 0.03)
    trend.set_ylim(bottom=0)
    handles = [Line2D([], [], label="no clearance", **IDEAL.properties())]
    for fault, (line, marker) in BY_FAULT.items():
        only = "" if fault in SINGLE_FAULTS else ", (b) only"
        handles.append(
            Line2D([], [], label=SPOKEN[fault] + only, marker=marker, **line.properties())
        )
    legend_above(figure, handles)
    return figure


@in_style
def draw_diagnosis_orbits(runs: Runs) -> Figure:
    """Return the journals' orbits of each joint at three clearances, all to one scale."""
    figure, panels = sheet(len(SINGLE_FAULTS), len(CLEARANCES), 7.2, sharex=True, sharey=True)
    for row, joint in zip(panels, SINGLE_FAULTS, strict=True):
        for panel, clearance in zip(row, CLEARANCES, strict=True):
            plot_orbit(panel, runs[label(joint, clearance)], joint)
            panel.set_title(f"{SPOKEN[joint]}, {clearance:g} mm")
            panel.label_outer()
    room = max(panel.dataLim.x1 for panel in panels.flat) * 1.08
    panels[0, 0].set(xlim=(-room, room), ylim=(-room, room))
    marks = [Line2D([], [], label=name, **corner(shape)) for name, shape in CORNERS.values()]
    legend_above(figure, marks)
    return figure


@in_style
def draw_diagnosis_angles(found: Shakings, runs: Runs) -> Figure:
    """Return when X has its high orders, and the joints' contact modes, over the crank angle."""
    figure, panels = sheet(2 * len(SINGLE_FAULTS), 1, 8.4, sharex=True, height_ratios=(2.6, 1) * 2)
    for joint, profile, strip in zip(SINGLE_FAULTS, panels[::2, 0], panels[1::2, 0], strict=True):
        plot_profiles(profile, found, joint)
        rows = [SweptRow(f"{c:g}", modes=angle_modes(runs[label(joint, c)])) for c in CLEARANCES]
        plot_modes(strip, rows_modes(rows)[joint])
        strip.set_yticks(range(len(rows)), [row.value for row in rows])
        strip.set_ylabel("mm")
        strip.set_title(f"contact mode, clearance at the {SPOKEN[joint]}")
    for panel in panels[::2, 0]:
        panel.set_ylim(0, max(p.get_ylim()[1] for p in panels[::2, 0]))
    panels[-1, 0].set_xlabel(ANGLE_AXIS)
    panels[-1, 0].xaxis.set_major_locator(MultipleLocator(45))
    handles = [
        Line2D([], [], label=f"{c:g} mm", **BY_CLEARANCE[c].properties()) for c in CLEARANCES
    ]
    near = Patch(facecolor=NEAR_COLOR, label="the force turns")
    legend_above(figure, [*handles, near, *mode_handles()])
    return figure


def plot_profiles(panel: Axes, found: Shakings, joint: str) -> None:
    """The rms of X above `ORDER` over bins of crank angle, and where the joint's force turns."""
    for clearance in CLEARANCES:
        one = found[label(joint, clearance)]
        count = round(360.0 / BIN)
        place = np.floor(one.angle / BIN + 1e-6).astype(int) % count
        mean = np.bincount(place, one.mean_square, count) / np.bincount(place, minlength=count)
        values = np.sqrt(np.append(mean, mean[-1]))
        edges = np.arange(count + 1) * BIN
        line = BY_CLEARANCE[clearance].properties()
        panel.plot(edges, values, drawstyle="steps-post", **line)
    fine = np.arange(0.0, 360.0, 0.5)
    near = one.near(fine)
    panel.fill_between(fine, 0, 1, where=near, transform=panel.get_xaxis_transform(),
                       color=NEAR_COLOR, linewidth=0, zorder=0.5)  # fmt: skip
    panel.set_title(f"rms of X above order {ORDER} in {BIN:g}°, clearance at the {SPOKEN[joint]}")
    panel.set_ylabel("rms (N)")
    panel.set_ylim(bottom=0)
