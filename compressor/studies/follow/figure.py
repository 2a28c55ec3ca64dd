"""The table and the figure of a machine that is followed along a key.

The Dataset is that of `follow.followed_dataset` at one job: dims direction, the followed key, whose
coordinate `attrs["over"]` names, and those of the variables.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN
from compressor.digits import align_columns
from compressor.report import (
    BLACK,
    BLUE,
    FOOT,
    MARKS,
    RED,
    LineStyle,
    Panel,
    PlotlyFigure,
    make_grid,
    mark,
    midway,
    positions,
    share_scales,
)

# the second is smaller and lies on the first, so that both are seen where they agree
BY_DIRECTION = {"up": (BLUE, 4.0, 2.2), "down": (RED, 2.1, 2.4)}
# rows of the panel of periods: 1 to 4 one by one, up to 16 by octaves, and where there is none
PERIODS = {1: 0.0, 2: 1.0, 3: 2.0, 4: 3.0, 8: 4.0, 16: 5.0}
ROWS_OF = {"chaotic": 6.2, "undecided": 7.2}
FAILED = replace(MARKS["failed"], color=BLACK, markersize=5, edge_width=1.3)
FAILED_NAME = "a run failed here"
MILLI = 1e3


class Stretch(NamedTuple):
    """Neighbouring values of one direction with the same motion, and the ends of its exponents."""

    direction: str
    first: float
    last: float
    values: int
    motion: str
    exponents: tuple[float, float]


def find_spans(machine: xr.Dataset) -> Iterator[Stretch]:
    """Yield the spans of each direction of a machine, by rising values."""
    over = machine.attrs["over"]
    for direction in machine["direction"].values.tolist():
        chain = machine.sel(direction=direction)
        values, exponents = chain[over].values, chain["lyapunov_exponent"].values
        motions = [name_motion(chain.isel({over: n})) for n in range(values.size)]
        for motion, group in itertools.groupby(range(values.size), motions.__getitem__):
            at = [*group]
            known = exponents[at][np.isfinite(exponents[at])]
            ends = (known.min(), known.max()) if known.size else (math.nan, math.nan)
            yield Stretch(direction, values[at[0]], values[at[-1]], len(at), motion, ends)


def name_motion(one: xr.Dataset) -> str:
    """Return the motion at one value in words: period n, chaotic, undecided, failed or missing."""
    status, regime = str(one["status"].values), str(one["regime"].values)
    if status != "ok":
        return " ".join(filter(None, (status, str(one["reason"].values))))
    return f"period {float(one['period']):g}" if regime == "periodic" else regime


def table(machine: xr.Dataset) -> list[str]:
    """Return the spans of a machine as lines of a table, and where up and down differ."""
    over = machine[machine.attrs["over"]]
    cells = [["direction", title_key(over), "values", "motion", "exponent (1/rev)"]]
    for one in find_spans(machine):
        ends = dict.fromkeys(f"{end:.4g}" for end in (one.first, one.last))
        rates = dict.fromkeys(f"{end:.2f}" for end in one.exponents if math.isfinite(end))
        where, rate = " to ".join(ends), " to ".join(rates)
        cells.append([one.direction, where, str(one.values), one.motion, rate])
    lines = align_columns(cells)
    if "differs" in machine and (marked := machine["differs"].values == 1).any():
        listed = ", ".join(f"{value:.4g}" for value in over.values[marked])
        where = f"{int(marked.sum())} of {over.size} values: {listed}"
        lines.append(f"up and down differ (two motions, or a long transient) at {where}")
    return lines


def title_key(over: xr.DataArray) -> str:
    """Return the name of the followed key with its unit."""
    name, unit = over.attrs["long_name"], over.attrs["units"]
    return f"{name} ({unit})" if unit != "1" else name


def draw_followed(machine: xr.Dataset, title: str = "") -> PlotlyFigure:
    """Return one machine over the key: Poincaré points, period, exponent, time without contact."""
    over, joints = machine.attrs["over"], joints_with_points(machine)
    x, log = positions(machine, over), bool(machine.attrs["log"])
    ratios = [2.2] * len(joints) + [1.2, 1.4] + [0.8] * len(joints)
    drawing, _ = make_grid(len(ratios), 1, 1.35 * sum(ratios) + 1.2, heights=ratios)
    panels = drawing.panels
    for joint, panel in zip(joints, panels, strict=False):
        plot_points(panel, machine, joint)
    plot_periods(panels[len(joints)], machine)
    plot_exponents(panels[len(joints) + 1], machine)
    for joint, panel in zip(joints, panels[len(joints) + 2 :], strict=True):
        plot_gaps(panel, machine, joint)
    low, *_, high = midway(np.sort(x), log)
    panels[0].x.type = "log" if log else None
    panels[0].span("x", low, high)
    share_scales(panels, "x")
    has_failed = (machine["status"] == "failed").any("direction").values
    for panel in panels if has_failed.any() else ():
        bottom, top = panel.limits("y")
        foot = np.full(has_failed.sum(), bottom + FOOT["failed"] * (top - bottom))
        panel.plot(x[has_failed], foot, FAILED, FAILED_NAME)
    panels[-1].x.title, drawing.title = title_key(machine[over]), title
    return drawing.figure()


def joints_with_points(machine: xr.Dataset) -> list[str]:
    """Return the joints that have Poincaré points."""
    known = machine["section"].notnull()
    known = known.any([dim for dim in known.dims if dim != "joint"])
    return [str(joint) for joint in machine["joint"].values[known.values]]


def direction_styles(machine: xr.Dataset, times: float = 1.0) -> dict[str, LineStyle]:
    """Return the marks of the directions that there are, so many times their size."""
    found = {str(name): BY_DIRECTION[str(name)] for name in machine["direction"].values}
    return {
        name: mark(color, "circle", times * size, zorder, edge_width=0.0)
        for name, (color, size, zorder) in found.items()
    }


def plot_points(panel: Panel, machine: xr.Dataset, joint: str) -> None:
    """Draw the journal's place along the cylinder, once a revolution, at each value."""
    over = machine.attrs["over"]
    panel.label("y", "e<sub>x</sub> (mm)")
    for direction, look in direction_styles(machine, 0.7).items():
        points = machine["section"].sel(direction=direction, joint=joint, coordinate="x")
        points = points.transpose(over, "revolution")
        x = np.repeat(positions(machine, over), points.sizes["revolution"])
        panel.plot(x, MILLI * points.values.ravel(), look, direction)
    panel.title = f"journal's place along the cylinder, {SPOKEN[joint]}, once a revolution"
    leave_room(panel)


def plot_periods(panel: Panel, machine: xr.Dataset) -> None:
    """Draw the period at each value; above it where there is none."""
    x = positions(machine, machine.attrs["over"])
    for direction, look in direction_styles(machine, 1.2).items():
        panel.plot(x, period_rows(machine.sel(direction=direction)), look, direction)
    rows = PERIODS | ROWS_OF
    panel.name_ticks("y", [*map(str, rows)], [*rows.values()])
    panel.span("y", -1.3, max(ROWS_OF.values()) + 0.6)
    panel.title = "period (revolutions)"


def period_rows(chain: xr.Dataset) -> np.ndarray:
    """Return the height of each value's period in the panel; nan where it has no result."""
    words, is_ok = chain["regime"].values, chain["status"].values == "ok"
    period = np.where(words == "periodic", chain["period"].values, 1.0)
    rows = np.where(period <= 4, period - 1.0, np.log2(period) + 1.0)
    for word, row in ROWS_OF.items():
        rows = np.where(words == word, row, rows)
    return np.where(is_ok, rows, np.nan)


def plot_exponents(panel: Panel, machine: xr.Dataset) -> None:
    """Draw the largest Lyapunov exponent with its error at each value."""
    x = positions(machine, machine.attrs["over"])
    for direction, look in direction_styles(machine).items():
        chain = machine.sel(direction=direction)
        bars = chain["lyapunov_exponent_error"].values
        bars = np.where(np.isfinite(bars), bars, np.nan)
        exponents = chain["lyapunov_exponent"].values
        panel.plot(x, exponents, look, direction, np.stack([bars, bars]))
    panel.rule(LineStyle(BLACK, linewidth=0.8), y=0.0)
    panel.title = "largest Lyapunov exponent, with its 95 % bar; above 0 close motions part"
    panel.y.title = "per revolution"
    leave_room(panel)


def plot_gaps(panel: Panel, machine: xr.Dataset, joint: str) -> None:
    """Draw the share of time in which a joint has no dry contact."""
    x = positions(machine, machine.attrs["over"])
    for direction, look in direction_styles(machine).items():
        shares = machine["contact_loss_fraction"].sel(direction=direction, joint=joint)
        panel.plot(x, 100.0 * shares.values, look, direction)
    panel.title = f"time without dry contact, {SPOKEN[joint]}"
    panel.y.title = "%"
    leave_room(panel)


def leave_room(panel: Panel) -> None:
    """Leave room below the points for marks, and a little above them."""
    low, high = panel.limits("y")
    panel.span("y", low - 0.1 * (high - low), high)
