"""The paper's claims over machines: margins over the mass plane, and what decides them."""

from dataclasses import replace

import numpy as np
import xarray as xr

from compressor.report import (
    BLACK,
    BLUE,
    GREY,
    RED,
    ColorScale,
    Drawing,
    LineStyle,
    Panel,
    Trace,
    contour_area,
    contour_lines,
    fill,
    join_with_gaps,
    make_grid,
    map_cells,
    mark,
    midway,
    palette,
    share_scales,
)

REACH = 0.5  # of the threshold: margins beyond it have the same colour
ROD, RECIPROCATING = "rod_mass_kg", "reciprocating_mass_kg"
OF_MASSES = (3, 4, 5, 6, 7, 8)  # claims that masses can decide
EFFECTS = (
    ("first_order", GREY, 0.19, "main effect"),
    ("total_order", BLUE, -0.19, "total"),
)


def draw_claims_map(found: xr.Dataset, place: tuple[float, float]) -> Drawing:
    """Return each claim's margin over rod and reciprocating mass, and how many claims hold.

    place: rod mass and reciprocating mass (kg) of the defaults, which are marked.
    """
    figure, panels = make_grid(2, 4, 5.6)
    x, y = (midway(values) for values in masses(found))
    colors = ColorScale(palette("RdBu"), -REACH, REACH, side="")
    *shown, number, best = figure.panels
    for claim, panel in zip(OF_MASSES, shown, strict=True):
        margin = found["margin"].sel(claim=claim).transpose(RECIPROCATING, ROD).values
        panel.traces.append(map_cells(x, y, margin, colors))
        border(panel, found, margin >= 0.0, BLACK)
        panel.title = f"claim {claim}"
    bar = replace(colors, side="right", aspect=40, beside_column=True, pointed=True,
                  bar_title="margin, relative to the threshold; holds above 0")  # fmt: skip
    last = panels[0, 3].traces
    last[0] = replace(last[0], scale=bar)
    held = (found["held"] == 1).transpose("claim", RECIPROCATING, ROD)
    count = held.sum("claim").values
    steps = ColorScale(palette("cividis", 7), 1.5, 8.5, side="bottom", aspect=18,
                       ticks=(*range(2, 9),))  # fmt: skip
    number.traces.append(map_cells(x, y, count.astype(float), steps))
    number.title = "how many of eight hold"
    most = int(count.max())
    best.ground = fill("#f4f4f4")
    around = contour_area(*masses(found), (count == most).astype(float), 0.5, 1.5)
    best.plot(*around, fill(BLUE, 0.35), kind="band")
    border(best, found, count == most, BLUE)
    best.title = "all eight hold" if most == 8 else f"most of them: {most} hold"
    for panel in figure.panels:
        panel.plot(*place, mark(RED, "o", 6, is_hollow=True, edge_width=1.8))
        panel.grid = ""
    for panel in panels[1]:
        panel.x.title = "rod mass (kg)"
    for panel in panels[:, 0]:
        panel.y.title = "reciprocating mass (kg)"
    share_scales(figure.panels, "x", "y")
    return figure


def masses(found: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return the masses of the rod and of the reciprocating parts on a map."""
    return found[ROD].values, found[RECIPROCATING].values


def border(panel: Panel, found: xr.Dataset, inside: np.ndarray, color: str) -> None:
    """Draw the line around the machines for which something is true."""
    if inside.any() and not inside.all():
        panel.plot(
            *contour_lines(*masses(found), inside.astype(float), [0.5]),
            LineStyle(color, linewidth=1.0),
        )


def draw_sensitivity(table: xr.Dataset, names: list[str]) -> Drawing:
    """Return main and total effect of each assumption on each claim's margin, with 95 % intervals.

    table: of `compressor.studies.claims.findings`; names: of its assumptions, in words.
    """
    claims = [c for c in table["claim"].values.tolist()
              if not np.isnan(table["total_order"].sel(claim=c)).all()]  # fmt: skip
    columns = 4
    rows = -(-len(claims) // columns)
    height = 0.8 + rows * (0.9 + 0.21 * len(names))
    figure, _ = make_grid(rows, columns, height, len(claims))
    place = np.arange(len(names), dtype=float)
    for panel, claim in zip(figure.panels, claims, strict=True):
        plot_effects(panel, table.sel(claim=claim), place)
        panel.title = f"claim {claim}"
        panel.x.title = "share of the variance"
        panel.x.span(0.0, 1.25)
    first = figure.panels[0]
    first.y.name(names)
    low, high = first.limits("y")
    first.y.span(high, low)
    share_scales(figure.panels, "y")
    figure.legend = [trace for trace in first.traces if trace.name]
    return figure


def plot_effects(panel: Panel, one: xr.Dataset, place: np.ndarray) -> None:
    """Draw bars with their intervals."""
    for variable, color, shift, name in EFFECTS:
        value, at = one[variable].values, place - shift
        low, high = (one[f"{variable}{end}"].values for end in ("_low", "_high"))
        bars = Trace(np.maximum(value, 0.0), at, fill(color), name, "bars", thick=0.36)
        ends = np.minimum(value, low), np.maximum(value, high)
        pairs = np.stack([np.stack([end, at], axis=1) for end in ends], axis=1)
        x, y = join_with_gaps(pairs)
        panel.traces += [bars, Trace(x, y, LineStyle(BLACK, linewidth=0.9))]
