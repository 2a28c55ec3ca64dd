"""A machine that is followed along a parameter: its bifurcations and Poincaré sections.

The Dataset is that of a regimes study: `attrs["over"]` names the coordinate that was followed,
which runs are one direction after the other along the dimension `direction`.
"""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from compressor.analysis import SPOKEN
from compressor.report import (
    BLACK,
    BLUE,
    FOOT,
    GOLD,
    GREY,
    MARKS,
    MODE_COLORS,
    RED,
    UNSEEN,
    in_style,
    legend_above,
    mode_handles,
    positions,
    sheet,
)

# the second is smaller and lies on the first, so that both are seen where they agree
BY_DIRECTION = {"up": (BLUE, 4.0, 2.2), "down": (RED, 2.1, 2.4)}
# rows of the panel of periods: 1 to 4 one by one, up to 16 by octaves, and where there is none
PERIODS = {1: 0.0, 2: 1.0, 3: 2.0, 4: 3.0, 8: 4.0, 16: 5.0}
ROWS_OF = {"chaotic": 6.2, "undecided": 7.2}
FAILED = MARKS["failed"] | {"color": BLACK, "markersize": 5, "markeredgewidth": 1.3}
PLAIN_DECADES = 2.5  # of a log axis, up to which it has ticks at 2 and 5 as well
MILLI, MICRO = 1e3, 1e6
COLUMNS = 3
HATCH: dict[str, Any] = {"facecolor": UNSEEN, "edgecolor": GREY, "hatch": "////"}


@in_style
def draw_bifurcation(pair: xr.Dataset) -> Figure:
    """Return one machine along a parameter: Poincaré points, period, exponent, contact modes.

    pair: dims direction, the followed one, and the variables' own; some value has a result.
    """
    joints, x = joints_with_points(pair), positions(pair, pair.attrs["over"])
    rows = 2 * len(joints) + 2
    ratios = [2.2] * len(joints) + [1.2, 1.4] + [0.8] * len(joints)
    figure, grid = sheet(rows, 1, 1.35 * sum(ratios) + 1.2, sharex=True, height_ratios=ratios)
    panels = list(grid.flat)
    places, (periods, exponents) = panels[: len(joints)], panels[len(joints) : len(joints) + 2]
    for joint, panel in zip(joints, places, strict=True):
        plot_places(panel, pair, joint)
    plot_periods(periods, pair)
    plot_exponents(exponents, pair)
    for joint, panel in zip(joints, panels[-len(joints) :], strict=True):
        plot_shares(panel, pair, joint)
    for panel in panels:
        scale_along(panel, x, pair.attrs["log"])
        mark_failed(panel, pair)
    panels[-1].set_xlabel(axis_words(pair, pair.attrs["over"]))
    legend_above(figure, [*direction_handles(pair), *failed_handles(pair), *mode_handles()])
    return figure


def plot_places(panel: Axes, pair: xr.Dataset, joint: str) -> None:
    """Draw the journal's place along the cylinder, once a revolution, at each value."""
    over = pair.attrs["over"]
    for direction, (color, size, height) in looks(pair).items():
        points = pair["section"].sel(direction=direction, joint=joint, coordinate="x")
        points = points.transpose(over, "revolution")
        place = MILLI * points.values.ravel()
        x = np.repeat(positions(pair, over), points.sizes["revolution"])
        panel.plot(x, place, "o", color=color, markersize=0.7 * size, markeredgewidth=0,
                   zorder=height, rasterized=True)  # fmt: skip
    panel.set_title(
        f"journal's place along the cylinder, {SPOKEN[joint]}, once a revolution at "
        f"{pair.attrs['section_deg']:g}°"
    )
    panel.set_ylabel("$e_x$ (mm)")
    room(panel)


def plot_periods(panel: Axes, pair: xr.Dataset) -> None:
    """Draw the period at each value; above it where there is none."""
    x = positions(pair, pair.attrs["over"])
    for direction, (color, size, height) in looks(pair).items():
        row = period_rows(pair.sel(direction=direction))
        panel.plot(x, row, "o", color=color, markersize=1.2 * size, zorder=height,
                   markeredgewidth=0)  # fmt: skip
    ticks = [*PERIODS.values(), *ROWS_OF.values()]
    panel.set_yticks(ticks, [*map(str, PERIODS), *ROWS_OF])
    panel.set_ylim(-1.3, max(ROWS_OF.values()) + 0.6)
    panel.set_title("period (revolutions)")


def period_rows(chain: xr.Dataset) -> np.ndarray:
    """Return where the period of each value stands; nan where it has no result."""
    words, ok = chain["regime"].values, chain["status"].values == "ok"
    repeats = (words == "periodic") & np.isfinite(chain["period"].values)
    period = np.where(repeats, chain["period"].values, 1.0)
    rows = np.where(period <= 4, period - 1.0, np.log2(period) + 1.0)
    rows = np.where(repeats, rows, ROWS_OF["undecided"])
    rows = np.where(words == "chaotic", ROWS_OF["chaotic"], rows)
    return np.where(ok & (words != ""), rows, np.nan)


def plot_exponents(panel: Axes, pair: xr.Dataset) -> None:
    """Draw the largest Lyapunov exponent with its error at each value."""
    x = positions(pair, pair.attrs["over"])
    for direction, (color, size, height) in looks(pair).items():
        chain = pair.sel(direction=direction)
        bars = chain["lyapunov_exponent_error"].values
        panel.errorbar(
            x, chain["lyapunov_exponent"].values, np.where(np.isfinite(bars), bars, np.nan),
            fmt="o", color=color, markersize=size, markeredgewidth=0, elinewidth=0.9,
            zorder=height,
        )  # fmt: skip
    panel.axhline(0.0, color=BLACK, linewidth=0.8)
    panel.set_title("largest Lyapunov exponent, with its 95 % bar; above 0 close motions part")
    panel.set_ylabel("per revolution")
    room(panel)


def plot_shares(panel: Axes, pair: xr.Dataset, joint: str) -> None:
    """Shares of the time in each contact mode, stacked, of the first direction."""
    over, direction = pair.attrs["over"], str(pair["direction"].values[0])
    shares = pair["mode_share"].sel(direction=direction, joint=joint).transpose(over, "mode")
    edges, foot = edges_of(positions(pair, over), pair.attrs["log"]), np.zeros(pair.sizes[over])
    panel.patch.set(**HATCH)
    for mode, color in MODE_COLORS.items():
        height = shares.sel(mode=mode).values
        panel.bar(edges[:-1], height, np.diff(edges), foot, color=color, align="edge", linewidth=0)
        foot = foot + np.nan_to_num(height)
    panel.set_title(f"share of time in each contact mode, {SPOKEN[joint]}, {direction}")
    panel.set(ylim=(0, 1), yticks=(0, 1), ylabel="share")
    panel.grid(visible=False)


@in_style
def draw_sections(shown: xr.Dataset) -> Figure:
    """Return the Poincaré sections, one panel a value: the journal's place along the cylinder, and
    its rate.

    shown: as for `draw_bifurcation`, at the values that are to be drawn.
    """
    over, joints, unit = shown.attrs["over"], joints_with_points(shown), unit_of(shown)
    rows = -(-shown.sizes[over] // COLUMNS)
    figure, grid = sheet(rows * len(joints), COLUMNS, 2.9 * rows * len(joints) + 0.7)
    for joint, part in zip(joints, np.split(grid, len(joints)), strict=True):
        panels = list(part.flat)
        for panel in panels[shown.sizes[over] :]:
            panel.remove()
        drawn = panels[: shown.sizes[over]]
        for i, panel in enumerate(drawn):
            one = shown.isel({over: i}).sel(joint=joint)
            plot_section(panel, one)
            where = f", {SPOKEN[joint]}" if len(joints) > 1 else ""
            panel.set_title(f"{float(one[over]):.4g}{unit}{where}: {regimes_of(one)}")
        spread_alike(drawn)
        for number, panel in enumerate(drawn):
            if number % COLUMNS == 0:
                panel.set_ylabel("rate of $e_x$ (mm/s)")
            if number + COLUMNS >= len(drawn):
                panel.set_xlabel("$e_x$ (µm), along the cylinder")
    legend_above(figure, direction_handles(shown))
    return figure


def plot_section(panel: Axes, one: xr.Dataset) -> None:
    """Draw the Poincaré points of one value and one joint."""
    for direction, (color, size, height) in looks(one).items():
        points = one["section"].sel(direction=direction)
        x, rate = (points.sel(coordinate=name).values for name in ("x", "x_rate"))
        panel.plot(x * MICRO, rate * MILLI, "o", color=color, markersize=1.5 * size,
                   markeredgewidth=0, zorder=height)  # fmt: skip


def spread_alike(panels: list[Axes]) -> None:
    """Room around the points; a few close points are not drawn apart by more than others' tenth."""
    for limits, change in (("intervalx", "set_xlim"), ("intervaly", "set_ylim")):
        spans = [getattr(panel.dataLim, limits) for panel in panels]
        widest = max((high - low for low, high in spans if np.isfinite(high - low)), default=0.0)
        for panel, (low, high) in zip(panels, spans, strict=True):
            if not np.isfinite(high - low):
                continue
            least = max(0.1 * widest, 0.02 * abs(high + low)) or 1.0
            half, middle = 0.6 * max(high - low, least), (high + low) / 2
            getattr(panel, change)(middle - half, middle + half)
    for panel in panels:
        for axis in (panel.xaxis, panel.yaxis):
            axis.set_major_locator(MaxNLocator(4))


def regimes_of(one: xr.Dataset) -> str:
    """Return the regime at one value, of each direction where they differ."""
    found = {}
    for direction in one["direction"].values:
        chain = one.sel(direction=direction)
        if str(chain["status"].values) == "ok":
            word, period = str(chain["regime"].values), float(chain["period"])
            known = word == "periodic" and np.isfinite(period)
            found[str(direction)] = f"period {period:g}" if known else word
    words = [*dict.fromkeys(found.values())]
    return words[0] if len(words) == 1 else ",\n".join(f"{w} {d}" for d, w in found.items())


def joints_with_points(data: xr.Dataset) -> list[str]:
    """Return the joints that have Poincaré points."""
    others = [dim for dim in data["section"].dims if dim != "joint"]
    there = data["section"].notnull().any(others).values
    return [str(joint) for joint, seen in zip(data["joint"].values, there, strict=True) if seen]


def looks(data: xr.Dataset) -> dict[str, tuple[str, float, float]]:
    """Return the colour, size and height of the directions that a dataset has."""
    return {str(name): BY_DIRECTION[str(name)] for name in data["direction"].values}


def edges_of(x: np.ndarray, log: bool) -> np.ndarray:
    """Return the edges halfway between values, in the scale of the axis, in rising order."""
    values = np.log(np.sort(x)) if log else np.sort(x)
    middle = (values[1:] + values[:-1]) / 2
    if values.size == 1:
        middle = values[:0]
        first, last = values[0] - 0.5, values[0] + 0.5
    else:
        first, last = 2 * values[0] - middle[0], 2 * values[-1] - middle[-1]
    edges = np.concatenate(([first], middle, [last]))
    return np.exp(edges) if log else edges


def scale_along(panel: Axes, x: np.ndarray, log: bool) -> None:
    """The axis of the followed parameter: its scale, its ends, and plain numbers at its ticks."""
    low, *_, high = edges_of(x, log)
    if log:
        panel.set_xscale("log")
        fine = np.log10(high / low) <= PLAIN_DECADES
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if fine else (1.0,)))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set_xlim(low, high)


def room(panel: Axes) -> None:
    """Room below the points for marks, and a little above them."""
    low, high = panel.dataLim.intervaly
    if np.isfinite(high - low):
        span = (high - low) or 0.1 * abs(high) or 1.0
        panel.set_ylim(low - 0.16 * span, high + 0.08 * span)


def mark_failed(panel: Axes, pair: xr.Dataset) -> None:
    """Draw a mark at the foot of a panel where a run of either direction failed."""
    over = pair.attrs["over"]
    failed = (pair["status"] == "failed").any("direction").values
    x = positions(pair, over)[failed]
    foot = np.full(x.size, FOOT["failed"])
    if x.size:
        panel.plot(x, foot, transform=panel.get_xaxis_transform(), clip_on=False, **FAILED)


def failed_handles(pair: xr.Dataset) -> list[Line2D]:
    """Return the mark of failed runs, if there are any."""
    if not (pair["status"] == "failed").any():
        return []
    return [Line2D([], [], label="a run failed here", **FAILED)]


def direction_handles(data: xr.Dataset) -> list[Line2D]:
    """Return the directions' colours, for a legend."""
    look: dict[str, Any] = {"marker": "o", "linestyle": "none", "markeredgewidth": 0}
    return [
        Line2D([], [], label=name, color=color, markersize=1.6 * size, **look)
        for name, (color, size, _) in looks(data).items()
    ]


def axis_words(data: xr.Dataset, name: str) -> str:
    """Return a coordinate's phrase with its unit."""
    attrs = data[name].attrs
    unit = attrs.get("units", "")
    phrase = attrs.get("long_name") or attrs.get("case_key", name)
    return f"{phrase} ({unit})" if unit not in ("", "1") else str(phrase)


def unit_of(data: xr.Dataset) -> str:
    """Return the unit of the followed parameter with a space before it, "" where it has none."""
    unit = data[data.attrs["over"]].attrs.get("units", "")
    return f" {unit}" if unit not in ("", "1") else ""


MAX_TICKS = 12
MAX_SINGLE = 4  # periods of a map that have a colour of their own
CLASSES = {
    "period 1": "#e3e9f3", "period 2": "#a5bfe3", "period 3": "#5c87c9", "period 4": BLUE,
    "period 5 to 16": GOLD, "chaotic": RED, "undecided": GREY, "failed": BLACK,
}  # fmt: skip


@in_style
def draw_periods(plane: xr.Dataset, other: str) -> Figure:
    """Return the regime over the followed parameter and another one, a panel a direction.

    plane: dims direction, the followed one, `other`, and the variables' own.
    """
    over = plane.attrs["over"]
    directions = [str(one) for one in plane["direction"].values]
    figure, grid = sheet(1, len(directions), 4.8, sharey=True)
    for direction, panel in zip(directions, grid.flat, strict=True):
        chain = plane.sel(direction=direction).transpose(other, over, ...)
        x, y = positions(chain, over), positions(chain, other)
        plot_classes(panel, chain, x, y)
        panel.set_title(direction)
        panel.set_xlabel(axis_words(plane, over))
    if plane[other].dtype.kind not in "fiu":
        words = [str(word) for word in dict.fromkeys(plane[other].values)]
        grid[0, 0].set_yticks(range(len(words)), words)
    grid[0, 0].set_ylabel(axis_words(plane, other))
    found = np.unique(period_classes(plane))
    handles = [
        Patch(facecolor=color, edgecolor=BLACK, linewidth=0.4, label=name)
        for number, (name, color) in enumerate(CLASSES.items())
        if number in found
    ]
    if (found < 0).any():
        handles.append(Patch(label="not run", **HATCH))
    legend_above(figure, handles)
    return figure


def plot_classes(panel: Axes, chain: xr.Dataset, x: np.ndarray, y: np.ndarray) -> None:
    """Draw the classes of one direction in their colours, dims (other, over)."""
    across, along = np.argsort(x, kind="stable"), np.argsort(y, kind="stable")
    classes = period_classes(chain)[np.ix_(along, across)]
    panel.patch.set(**HATCH)
    panel.pcolormesh(
        edges_of(x[across], chain.attrs["log"]), edges_of(y[along], False),
        np.ma.masked_less(classes, 0), cmap=ListedColormap([*CLASSES.values()]), vmin=-0.5,
        vmax=len(CLASSES) - 0.5, rasterized=True, edgecolors="white", linewidth=0.3,
    )  # fmt: skip
    scale_along(panel, x, chain.attrs["log"])
    if y.size <= MAX_TICKS:
        panel.set_yticks(y)
    panel.grid(visible=False)


def period_classes(data: xr.Dataset) -> np.ndarray:
    """Return the place in `CLASSES` of each value's regime; -1 where it was not run."""
    names, status = [*CLASSES], data["status"].values
    words, period = data["regime"].values, data["period"].values
    known = (words == "periodic") & np.isfinite(period)
    number = np.where(known, period, 1.0).astype(int)
    found = np.where(number <= MAX_SINGLE, number - 1, names.index("period 5 to 16"))
    found = np.where(known, found, names.index("undecided"))
    found = np.where(words == "chaotic", names.index("chaotic"), found)
    found = np.where(words == "", -1, found)
    return np.where(status == "failed", names.index("failed"), np.where(status == "ok", found, -1))
