"""Figures 7, 9, 12, 15 and 16: the piston force of both models, and the joints' contact forces."""

from matplotlib.figure import Figure

from compressor.report.figures.curves import (
    ANGLE_AXIS,
    KILONEWTON,
    Quantity,
    Runs,
    differing_part,
    fault_curves,
    load_curves,
    plot,
    plot_enlarged,
)
from compressor.report.figures.style import legend_above, sheet, styled

PISTON = Quantity("piston_force", "", "force on the piston, towards the crank (kN)", KILONEWTON)


@styled
def draw_piston_force(runs: Runs) -> Figure:
    """Figure 7: the piston force of the design and the typical model."""
    figure, panels = sheet(1, 1, 4.2)
    (panel,) = panels.flat
    curves = load_curves(runs)
    plot(panel, curves, PISTON, tick=90.0)
    panel.set_ylim(bottom=0)
    panel.set_xlabel(ANGLE_AXIS)
    legend_above(figure, [curve.handle() for curve in curves])
    return figure


@styled
def draw_contact_force(runs: Runs, fault: str, joint: str) -> Figure:
    """Figures 9, 12, 15, 16: contact force at one joint, horizontal and vertical.

    Both enlarged views show the window in which the horizontal forces differ most.
    """
    figure, panels = sheet(2, 2, 7.4, width_ratios=(2, 1), sharex="col")
    curves = fault_curves(runs, fault, ideal=False)
    part, _ = differing_part(curves, contact_force(joint, "x"))
    for (full, enlarged), axis, letter in zip(panels, "xy", "ab", strict=True):
        quantity = contact_force(joint, axis)
        plot(full, curves, quantity, tick=90.0)
        plot_enlarged(full, enlarged, curves, quantity, part)
        full.set_title(f"({letter}) {quantity.title}")
        enlarged.set_title("enlarged")
        enlarged.set_ylabel("")
    for panel in panels[-1]:
        panel.set_xlabel(ANGLE_AXIS)
    legend_above(figure, [curve.handle() for curve in curves])
    return figure


def contact_force(joint: str, axis: str) -> Quantity:
    """The force on the rod at a joint along an axis, kN."""
    title = {"x": "horizontal (along the cylinder)", "y": "vertical"}[axis]
    where = (("joint", joint), ("axis", axis))
    return Quantity("contact_force", title, f"$F_{axis}$ on the rod (kN)", KILONEWTON, where=where)
