"""What is plotted of a run: stored series of its last revolution, in a reader's units.

Every panel of curves can have an enlarged view beside it, placed where the curves differ most. What
oscillates so fast that curves would hide each other has a row a curve.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.lib.stride_tricks import sliding_window_view

from compressor import analysis
from compressor.report.figures import style
from compressor.report.figures.drawing import ROOM, Panel, rectangle

Runs = Mapping[str, xr.Dataset]

ANGLE_AXIS = "crank angle (°), 0 = top dead centre"
LOADS = {"typical": "typical model (gas force)", "design": "design model (spring and cam)"}
KILONEWTON = 1e-3
TICK = 90.0  # degrees between ticks
SAME_CURVE = 1e-9  # curves closer than this share of their range are one curve
WINDOW = style.LineStyle(style.BLACK, linewidth=1.1, zorder=3)
MIN_MARK = 0.05  # of a panel's height: a flatter mark would not be seen


@dataclass(frozen=True)
class Quantity:
    """A stored series as it is plotted; `window` is the width (°) of its enlarged view.

    A `steep` one changes by far more than its curves differ, so they are compared in relation to
    the height that a window needs.
    """

    series: str
    title: str
    axis: str  # its title, without the unit
    unit: str
    factor: float = 1.0  # from SI to the unit
    window: float = 40.0
    steep: bool = False
    where: tuple[tuple[str, str], ...] = ()  # joint and axis of a force

    def values(self, run: xr.Dataset) -> np.ndarray:
        """Return a run's samples in the unit."""
        return run[self.series].sel(dict(self.where)).values * self.factor


@dataclass(frozen=True)
class Curve:
    """A run in a figure: its name in the legend, its last revolution, by degrees, and its line."""

    name: str
    degrees: np.ndarray
    run: xr.Dataset
    line: style.LineStyle


def fault_curves(runs: Runs, fault: str, ideal: bool) -> list[Curve]:
    """Return the curves of 0.1, 0.2 and 0.3 mm, and that of no clearance before them."""
    curves = []
    if ideal:
        curves.append(Curve("no clearance", *analysis.last_revolution(runs["design"]), style.IDEAL))
    for c in analysis.CLEARANCES:
        x, run = analysis.last_revolution(runs[analysis.label(fault, c)])
        curves.append(Curve(f"{c:g} mm", x, run, style.BY_CLEARANCE[c]))
    return curves


def load_curves(runs: Runs) -> list[Curve]:
    """Return the curves of the typical and the design model, without clearance."""
    return [
        Curve(name, *analysis.last_revolution(runs[load]), style.BY_LOAD[load])
        for load, name in LOADS.items()
    ]


def plot(panel: Panel, curves: Sequence[Curve], quantity: Quantity, listed: bool = True) -> None:
    """Draw all curves of one quantity over the revolution; listed: in the legend."""
    panel.label("x", "", "°")
    panel.label("y", f"{quantity.axis} ({{}})", quantity.unit)
    for curve in curves:
        values = quantity.values(curve.run)
        panel.plot(curve.degrees, values, curve.line, curve.name, listed=listed)
    panel.span("x", curves[0].degrees[0], curves[0].degrees[-1])
    panel.x.dtick = TICK
    panel.title = quantity.title


def plot_rows(
    panels: Sequence[Panel] | np.ndarray, curves: Sequence[Curve], quantity: Quantity
) -> None:
    """Draw a panel a curve, from the top; the one of no clearance is in all of them."""
    ideal = [curve for curve in curves if curve.line is style.IDEAL]
    worn = [curve for curve in curves if curve.line is not style.IDEAL]
    for panel, curve in zip(panels, worn, strict=True):
        alone = replace(curve, line=replace(curve.line, dash=(), linewidth=1.0))
        plot(panel, [*ideal, alone], quantity, listed=False)
        panel.title = curve.name
    panels[0].title = f"{quantity.title}, {worn[0].name}"
    values = np.array([quantity.values(curve.run) for curve in curves])
    room = ROOM * np.ptp(values)
    for panel in panels:
        panel.span("y", values.min() - room, values.max() + room)
        panel.y.matches = None if panel is panels[0] else f"y{panels[0].suffix}"
    for panel in panels[:-1]:
        panel.x.showticklabels = False


def plot_enlarged(
    full: Sequence[Panel] | np.ndarray,
    enlarged: Panel,
    curves: Sequence[Curve],
    quantity: Quantity,
    part: slice,
) -> None:
    """Draw the same curves over a part of the span, which is marked in the full panels."""
    plot(enlarged, curves, quantity)
    enlarged.x.dtick = 10 if quantity.window > 30 else 5
    angle = curves[0].degrees[part]
    values = np.array([quantity.values(curve.run)[part] for curve in curves])
    margin = 0.06 * np.ptp(values)
    low, high = values.min() - margin, values.max() + margin
    enlarged.span("x", angle[0], angle[-1])
    enlarged.span("y", low, high)
    whole = np.ptp([quantity.values(curve.run) for curve in curves])
    lift = max(0.0, MIN_MARK * whole - (high - low)) / 2
    outline = rectangle(angle[[0, -1]], np.array([low - lift, high + lift]))
    for panel in full:
        panel.plot(*outline, WINDOW)


def differing_part(curves: Sequence[Curve], quantity: Quantity) -> tuple[slice, bool]:
    """Return the window's samples in which a quantity differs most, and whether it does.

    The window lies around the greatest distance between the outermost curves; for a steep
    quantity it is the one with the greatest mean distance over the height that it needs. Where all
    curves are one, it lies around the greatest value.
    """
    angle = curves[0].degrees
    values = np.array([quantity.values(curve.run) for curve in curves])
    low, high = values.min(axis=0), values.max(axis=0)
    count = min(angle.size, round(quantity.window / (angle[1] - angle[0])) + 1)
    half = count // 2
    inner = slice(half, half + angle.size - count + 1)  # the middle of every window
    differs = bool((high - low).max() > SAME_CURVE * np.ptp(values))
    if not differs:
        score = np.abs(values[0])[inner]
    elif quantity.steep:
        height = sliding_window_view(high, count).max(axis=1)
        height -= sliding_window_view(low, count).min(axis=1)
        score = sliding_window_view(high - low, count).mean(axis=1) / height
    else:
        score = (high - low)[inner]
    start = int(np.argmax(score))
    return slice(start, start + count), differs
