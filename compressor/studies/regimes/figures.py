"""A machine that is followed along a parameter: its bifurcations and Poincaré sections.

The Dataset is that of a regimes study: `attrs["over"]` names the coordinate that was followed,
which runs are one direction after the other along the dimension `direction`.
"""

from dataclasses import replace

import numpy as np
import xarray as xr

from compressor.analysis import MODES, OILED_MODES, SPOKEN
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
    WAYS,
    ColorScale,
    Drawing,
    LineStyle,
    Note,
    Panel,
    Scale,
    Trace,
    Way,
    entry,
    fill,
    make_grid,
    map_cells,
    mark,
    midway,
    mode_entries,
    positions,
    share_scales,
    stack_modes,
)
from compressor.studies.regimes.captions import unit_of

# the second is smaller and lies on the first, so that both are seen where they agree
BY_DIRECTION = {"up": (BLUE, 4.0, 2.2), "down": (RED, 2.1, 2.4)}
# rows of the panel of periods: 1 to 4 one by one, up to 16 by octaves, and where there is none
PERIODS = {1: 0.0, 2: 1.0, 3: 2.0, 4: 3.0, 8: 4.0, 16: 5.0}
ROWS_OF = {"chaotic": 6.2, "undecided": 7.2}
FAILED = replace(MARKS["failed"], color=BLACK, markersize=5, edge_width=1.3)
FAILED_NAME = "a run failed here"
MILLI, MICRO = 1e3, 1e6
COLUMNS = 3


def draw_bifurcation(pair: xr.Dataset) -> Drawing:
    """Return one machine along a parameter: Poincaré points, period, exponent, contact modes.

    pair: dims direction, the followed one, and the variables' own; some value has a result.
    """
    joints, x = joints_with_points(pair), positions(pair, pair.attrs["over"])
    rows = 2 * len(joints) + 2
    ratios = [2.2] * len(joints) + [1.2, 1.4] + [0.8] * len(joints)
    figure, _ = make_grid(rows, 1, 1.35 * sum(ratios) + 1.2, heights=ratios)
    panels = figure.panels
    places, (periods, exponents) = panels[: len(joints)], panels[len(joints) : len(joints) + 2]
    for joint, panel in zip(joints, places, strict=True):
        plot_places(panel, pair, joint)
    plot_periods(periods, pair)
    plot_exponents(exponents, pair)
    for joint, panel in zip(joints, panels[-len(joints) :], strict=True):
        plot_shares(panel, pair, joint)
    scale_along(panels[0].x, x, pair.attrs["log"])
    share_scales(panels, "x")
    for panel in panels:
        mark_failed(panel, pair)
    panels[-1].x.title = axis_words(pair, pair.attrs["over"])
    failed = [entry(FAILED_NAME, FAILED)] if (pair["status"] == "failed").any() else []
    figure.legend = [*direction_entries(pair), *failed, *mode_entries(mode_words(pair))]
    return figure


def plot_places(panel: Panel, pair: xr.Dataset, joint: str) -> None:
    """Draw the journal's place along the cylinder, once a revolution, at each value."""
    over = pair.attrs["over"]
    for direction, look in direction_styles(pair, 0.7).items():
        points = pair["section"].sel(direction=direction, joint=joint, coordinate="x")
        points = points.transpose(over, "revolution")
        x = np.repeat(positions(pair, over), points.sizes["revolution"])
        panel.plot(x, MILLI * points.values.ravel(), look, direction)
    panel.title = (
        f"journal's place along the cylinder, {SPOKEN[joint]}, once a revolution at "
        f"{pair.attrs['section_deg']:g}°"
    )
    panel.y.title = "$e_x$ (mm)"
    leave_room(panel)


def plot_periods(panel: Panel, pair: xr.Dataset) -> None:
    """Draw the period at each value; above it where there is none."""
    x = positions(pair, pair.attrs["over"])
    for direction, look in direction_styles(pair, 1.2).items():
        panel.plot(x, period_rows(pair.sel(direction=direction)), look, direction)
    panel.y.words = {row: str(word) for word, row in (PERIODS | ROWS_OF).items()}
    panel.y.span(-1.3, max(ROWS_OF.values()) + 0.6)
    panel.title = "period (revolutions)"


def period_rows(chain: xr.Dataset) -> np.ndarray:
    """Return the height of each value's period in the panel; nan where it has no result."""
    words, ok = chain["regime"].values, chain["status"].values == "ok"
    repeats = (words == "periodic") & np.isfinite(chain["period"].values)
    period = np.where(repeats, chain["period"].values, 1.0)
    rows = np.where(period <= 4, period - 1.0, np.log2(period) + 1.0)
    rows = np.where(repeats, rows, ROWS_OF["undecided"])
    rows = np.where(words == "chaotic", ROWS_OF["chaotic"], rows)
    return np.where(ok & (words != ""), rows, np.nan)


def plot_exponents(panel: Panel, pair: xr.Dataset) -> None:
    """Draw the largest Lyapunov exponent with its error at each value."""
    x = positions(pair, pair.attrs["over"])
    for direction, look in direction_styles(pair).items():
        chain = pair.sel(direction=direction)
        bars = chain["lyapunov_exponent_error"].values
        bars = np.where(np.isfinite(bars), bars, np.nan)
        exponents = chain["lyapunov_exponent"].values
        panel.plot(x, exponents, look, direction, errors=np.stack([bars, bars]), caps=0.0)
    panel.notes.append(Note(y=0.0, style=LineStyle(BLACK, linewidth=0.8)))
    panel.title = "largest Lyapunov exponent, with its 95 % bar; above 0 close motions part"
    panel.y.title = "per revolution"
    leave_room(panel)


def plot_shares(panel: Panel, pair: xr.Dataset, joint: str) -> None:
    """Draw the share of time in each contact mode, stacked, of the first direction."""
    over, direction = pair.attrs["over"], str(pair["direction"].values[0])
    shares = pair["mode_share"].sel(direction=direction, joint=joint).transpose(over, "mode")
    edges = midway(np.sort(positions(pair, over)), pair.attrs["log"])
    heights = [shares.sel(mode=mode).values for mode in MODE_COLORS]
    middles = 0.5 * (edges[1:] + edges[:-1])
    stack_modes(panel, middles, np.diff(edges), heights, mode_words(pair))
    panel.ground = UNSEEN
    panel.title = f"share of time in each contact mode, {SPOKEN[joint]}, {direction}"


def mode_words(pair: xr.Dataset) -> tuple[str, ...]:
    """Return the names of the contact modes: an oiled joint's film bears where a dry one flies."""
    return OILED_MODES if pair.attrs.get("oiled") else MODES


def draw_sections(shown: xr.Dataset) -> Drawing:
    """Return the Poincaré sections, one panel a value.

    Each has the journal's place along the cylinder and its rate. shown: as for `draw_bifurcation`,
    at the values that are to be drawn.
    """
    over, joints, unit = shown.attrs["over"], joints_with_points(shown), unit_of(shown)
    rows = -(-shown.sizes[over] // COLUMNS)
    figure, grid = make_grid(rows * len(joints), COLUMNS, 2.9 * rows * len(joints) + 0.7)
    figure.panels = []
    for joint, part in zip(joints, np.split(grid, len(joints)), strict=True):
        used = [*part.flat][: shown.sizes[over]]
        figure.panels += used
        for i, panel in enumerate(used):
            one = shown.isel({over: i}).sel(joint=joint)
            plot_section(panel, one)
            where = f", {SPOKEN[joint]}" if len(joints) > 1 else ""
            panel.title = f"{float(one[over]):.4g}{unit}{where}: {regimes_of(one)}"
        spread_alike(used)
        for number, panel in enumerate(used):
            if number % COLUMNS == 0:
                panel.y.title = "rate of $e_x$ (mm/s)"
            if number + COLUMNS >= len(used):
                panel.x.title = "$e_x$ (µm), along the cylinder"
    figure.legend = direction_entries(shown)
    return figure


def plot_section(panel: Panel, one: xr.Dataset) -> None:
    """Draw the Poincaré points of one value and one joint."""
    for direction, look in direction_styles(one, 1.5).items():
        points = one["section"].sel(direction=direction)
        x, rate = (points.sel(coordinate=name).values for name in ("x", "x_rate"))
        panel.plot(x * MICRO, rate * MILLI, look, direction)


def spread_alike(panels: list[Panel]) -> None:
    """Leave room around the points.

    A few close points are not drawn apart by more than others' tenth.
    """
    for way in WAYS:
        spans = [ends_of(panel, way) for panel in panels]
        widest = max((high - low for low, high in spans if np.isfinite(high - low)), default=0.0)
        for panel, (low, high) in zip(panels, spans, strict=True):
            scale = panel.x if way == "x" else panel.y
            scale.max_ticks = 4
            if np.isfinite(high - low):
                least = max(0.1 * widest, 0.02 * abs(high + low)) or 1.0
                half, middle = 0.6 * max(high - low, least), (high + low) / 2
                scale.span(middle - half, middle + half)


def ends_of(panel: Panel, way: Way) -> tuple[float, float]:
    """Return the least and the greatest value in a panel; nan where there is none."""
    values = np.concatenate([trace.extent(way) for trace in panel.traces])
    values = values[np.isfinite(values)]
    return (values.min(), values.max()) if values.size else (np.nan, np.nan)


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
    known = data["section"].notnull().any(others).values
    return [str(joint) for joint, some in zip(data["joint"].values, known, strict=True) if some]


def direction_styles(data: xr.Dataset, times: float = 1.0) -> dict[str, LineStyle]:
    """Return the marks of the directions that a dataset has, so many times their size."""
    found = {str(name): BY_DIRECTION[str(name)] for name in data["direction"].values}
    return {
        name: mark(color, "o", times * size, zorder, edge_width=0.0)
        for name, (color, size, zorder) in found.items()
    }


def scale_along(scale: Scale, x: np.ndarray, log: bool) -> None:
    """Scale the axis of the followed parameter, with plain numbers at its ticks."""
    low, *_, high = midway(np.sort(x), log)
    scale.log = scale.plain = bool(log)
    scale.span(low, high)


def leave_room(panel: Panel) -> None:
    """Leave room below the points for marks, and a little above them."""
    low, high = ends_of(panel, "y")
    if np.isfinite(high - low):
        span = (high - low) or 0.1 * abs(high) or 1.0
        panel.y.span(low - 0.16 * span, high + 0.08 * span)


def mark_failed(panel: Panel, pair: xr.Dataset) -> None:
    """Draw a mark at the foot of a panel where a run of either direction failed."""
    failed = (pair["status"] == "failed").any("direction").values
    x = positions(pair, pair.attrs["over"])[failed]
    low, high = panel.limits("y")
    if x.size:
        foot = np.full(x.size, low + FOOT["failed"] * (high - low))
        panel.plot(x, foot, FAILED, FAILED_NAME)


def direction_entries(data: xr.Dataset) -> list[Trace]:
    """Return the directions' colours, for a legend."""
    return [entry(name, look) for name, look in direction_styles(data, 1.6).items()]


def axis_words(data: xr.Dataset, name: str) -> str:
    """Return a coordinate's phrase with its unit."""
    attrs = data[name].attrs
    unit = attrs.get("units", "")
    phrase = attrs.get("long_name") or attrs.get("case_key", name)
    return f"{phrase} ({unit})" if unit not in ("", "1") else str(phrase)


MAX_TICKS = 12
MAX_SINGLE = 4  # periods of a map that have a colour of their own
CLASSES = {
    "period 1": "#e3e9f3", "period 2": "#a5bfe3", "period 3": "#5c87c9", "period 4": BLUE,
    "period 5 to 16": GOLD, "chaotic": RED, "undecided": GREY, "failed": BLACK,
}  # fmt: skip


def draw_periods(plane: xr.Dataset, other: str) -> Drawing:
    """Return the regime over the followed parameter and another one, a panel a direction.

    plane: dims direction, the followed one, `other`, and the variables' own.
    """
    over = plane.attrs["over"]
    directions = [str(one) for one in plane["direction"].values]
    figure, _ = make_grid(1, len(directions), 4.8)
    for direction, panel in zip(directions, figure.panels, strict=True):
        chain = plane.sel(direction=direction).transpose(other, over, ...)
        plot_classes(panel, chain, positions(chain, over), positions(chain, other))
        panel.title = direction
        panel.x.title = axis_words(plane, over)
    first = figure.panels[0].y
    if plane[other].dtype.kind not in "fiu":
        first.name([str(word) for word in dict.fromkeys(plane[other].values)])
    first.title = axis_words(plane, other)
    share_scales(figure.panels, "y")
    found = np.unique(period_classes(plane))
    for number, (name, color) in enumerate(CLASSES.items()):
        if number in found:
            figure.legend.append(entry(name, fill(color, edge=BLACK, edge_width=0.4), "band"))
    if (found < 0).any():
        figure.legend.append(entry("not run", UNSEEN, "band"))
    return figure


def plot_classes(panel: Panel, chain: xr.Dataset, x: np.ndarray, y: np.ndarray) -> None:
    """Draw the classes of one direction in their colours, dims (other, over)."""
    across, along = np.argsort(x, kind="stable"), np.argsort(y, kind="stable")
    classes = period_classes(chain)[np.ix_(along, across)]
    edges = midway(x[across], chain.attrs["log"]), midway(y[along])
    colors = ColorScale((*CLASSES.values(),), -0.5, len(CLASSES) - 0.5, side="")
    cells = map_cells(*edges, np.where(classes < 0, np.nan, classes), colors)
    panel.traces.append(replace(cells, style=fill(BLACK, edge="#ffffff", edge_width=0.3)))
    panel.ground, panel.grid = UNSEEN, ""
    scale_along(panel.x, x, chain.attrs["log"])
    if y.size <= MAX_TICKS:
        panel.y.ticks = y.tolist()


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
