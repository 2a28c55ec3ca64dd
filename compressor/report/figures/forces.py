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
    plot_rows,
)
from compressor.report.figures.response import beside, finished
from compressor.report.figures.style import legend_above, sheet, styled

PISTON = Quantity("piston_force", "", "force on the piston, towards the crank (kN)", KILONEWTON)


@styled
def draw_piston_force(runs: Runs) -> Figure:
    """Return the figure 7: the piston force of the design and the typical model."""
    figure, panels = sheet(1, 1, 4.2)
    (panel,) = panels.flat
    curves = load_curves(runs)
    plot(panel, curves, PISTON)
    panel.set_ylim(bottom=0)
    panel.set_xlabel(ANGLE_AXIS)
    legend_above(figure, [curve.handle() for curve in curves])
    return figure


@styled
def draw_contact_force(runs: Runs, fault: str, joint: str) -> Figure:
    """Return the figures 9, 12, 15, 16: contact force at one joint, both ways, a row a clearance.

    All enlarged views show the window in which the horizontal forces at the fault's first joint
    differ most, so that those of both joints show the same angles.
    """
    figure, panels = sheet(6, 2, 11.5, width_ratios=(2, 1))
    curves = fault_curves(runs, fault, ideal=False)
    part, _ = differing_part(curves, contact_force(first_joint(fault), "x"))
    for rows, axis, letter in zip((slice(0, 3), slice(3, 6)), "xy", "ab", strict=True):
        quantity = contact_force(joint, axis)
        enlarged = beside(figure, panels, rows)
        plot_rows(panels[rows, 0], curves, quantity)
        plot_enlarged(panels[rows, 0], enlarged, curves, quantity, part)
        top = panels[rows, 0][0]
        top.set_title(f"({letter}) {top.get_title('left')}")
        enlarged.set_title("enlarged")
        enlarged.set_ylabel("")
    return finished(figure, [panels[-1, 0], enlarged], curves)


def first_joint(fault: str) -> str:
    """Return the joint whose forces choose the enlarged view."""
    return "small_end" if fault == "small_end" else "big_end"


def contact_force(joint: str, axis: str) -> Quantity:
    """Return the force on the rod at a joint along an axis, kN."""
    title = {"x": "horizontal force on the rod", "y": "vertical force on the rod"}[axis]
    where = (("joint", joint), ("axis", axis))
    return Quantity("contact_force", title, "force (kN)", KILONEWTON, where=where)
