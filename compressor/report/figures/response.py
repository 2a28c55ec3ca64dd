"""Figures 6, 8, 11 and 14: displacement, velocity and acceleration, each with an enlarged view."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compressor.report.figures.curves import (
    ANGLE_AXIS,
    Curve,
    Quantity,
    Runs,
    differing_part,
    fault_curves,
    load_curves,
    plot,
    plot_enlarged,
    plot_rows,
)
from compressor.report.figures.style import legend_above, sheet, styled

MOTION = (
    Quantity("displacement", "displacement", "displacement (mm)", 1e3, window=24.0, steep=True),
    Quantity("velocity", "velocity", "velocity (m/s)", steep=True),
    Quantity("acceleration", "acceleration", "acceleration (m/s²)"),
)


@styled
def draw_load_response(runs: Runs) -> Figure:
    """Return the figure 6: the design and the typical model without clearance."""
    curves = load_curves(runs)
    figure, panels = sheet(3, 2, 9.6)
    for (full, enlarged), quantity, letters in zip(panels, MOTION, ("ab", "cd", "ef"), strict=True):
        plot(full, curves, quantity)
        enlarge([full], enlarged, curves, quantity, letters)
    return finished(figure, panels[-1], curves)


@styled
def draw_fault_response(runs: Runs, fault: str) -> Figure:
    """Return the figures 8, 11, 14: no clearance and three clearances of one fault.

    Acceleration oscillates fast: it has a row a clearance.
    """
    curves = fault_curves(runs, fault, ideal=True)
    figure, panels = sheet(5, 2, 11.5, height_ratios=(3, 3, 2, 2, 2))
    for (full, enlarged), quantity, letters in zip(panels, MOTION[:2], ("ab", "cd"), strict=False):
        plot(full, curves, quantity)
        enlarge([full], enlarged, curves, quantity, letters)
    enlarged = beside(figure, panels, slice(2, 5))
    plot_rows(panels[2:, 0], curves, MOTION[2])
    enlarge(panels[2:, 0], enlarged, curves, MOTION[2], "ef")
    return finished(figure, [panels[-1, 0], enlarged], curves)


def beside(figure: Figure, panels: np.ndarray, rows: slice) -> Axes:
    """Return one panel in place of those in the second column of some rows."""
    grid = panels[0, 0].get_gridspec()
    for _, panel in panels[rows]:
        panel.remove()
    return figure.add_subplot(grid[rows, 1])


def enlarge(
    full: Sequence[Axes] | np.ndarray,
    enlarged: Axes,
    curves: Sequence[Curve],
    quantity: Quantity,
    letters: str,
) -> None:
    """The view where the curves differ most, and the titles of both."""
    part, differs = differing_part(curves, quantity)
    plot_enlarged(full, enlarged, curves, quantity, part)
    full[0].set_title(f"({letters[0]}) {full[0].get_title('left')}")
    remark = "" if differs else ": the curves coincide"
    enlarged.set_title(f"({letters[1]}) {quantity.title}, enlarged{remark}")


def finished(
    figure: Figure, lowest: Sequence[Axes] | np.ndarray, curves: Sequence[Curve]
) -> Figure:
    """Return the figure with the titles of its lowest axes and a legend."""
    for panel in lowest:
        panel.set_xlabel(ANGLE_AXIS)
    legend_above(figure, [curve.handle() for curve in curves])
    return figure
