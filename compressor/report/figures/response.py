"""Figures 6, 8, 11 and 14: displacement, velocity and acceleration, each with an enlarged view."""

from collections.abc import Sequence

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
)
from compressor.report.figures.style import legend_above, sheet, styled

MOTION = (
    Quantity("displacement", "displacement", "x (mm)", 1e3, window=24.0, steep=True),
    Quantity("velocity", "velocity", "v (m/s)", steep=True),
    Quantity("acceleration", "acceleration", "a (m/s²)"),
)


def draw_load_response(runs: Runs) -> Figure:
    """Figure 6: the design and the typical model without clearance."""
    return draw_response(load_curves(runs))


def draw_fault_response(runs: Runs, fault: str) -> Figure:
    """Figures 8, 11, 14: no clearance and three clearances of one fault."""
    return draw_response(fault_curves(runs, fault, ideal=True))


@styled
def draw_response(curves: Sequence[Curve]) -> Figure:
    """Six panels: each quantity in full, and enlarged where the curves differ most."""
    figure, panels = sheet(3, 2, 9.6)
    for (full, enlarged), quantity, letters in zip(panels, MOTION, ("ab", "cd", "ef"), strict=True):
        part, differs = differing_part(curves, quantity)
        plot(full, curves, quantity)
        plot_enlarged(full, enlarged, curves, quantity, part)
        full.set_title(f"({letters[0]}) {quantity.title}")
        remark = "" if differs else ": the curves coincide"
        enlarged.set_title(f"({letters[1]}) {quantity.title}, enlarged{remark}")
    for panel in panels[-1]:
        panel.set_xlabel(ANGLE_AXIS)
    legend_above(figure, [curve.handle() for curve in curves])
    return figure
