"""The paper's claims over machines: margins over the mass plane, and what decides them."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, TwoSlopeNorm
from matplotlib.figure import Figure

from compressor.report import BLACK, BLUE, GREY, RED, in_style, sheet

REACH = 0.5  # of the threshold: margins beyond it have the same colour
ROD, RECIPROCATING = "rod_mass_kg", "reciprocating_mass_kg"
OF_MASSES = (3, 4, 5, 6, 7, 8)  # claims that masses can decide


@in_style
def draw_claims_map(found: xr.Dataset, place: tuple[float, float]) -> Figure:
    """Return each claim's margin over rod and reciprocating mass, and how many claims hold.

    place: rod mass and reciprocating mass (kg) of the defaults, which are marked.
    """
    figure, panels = sheet(2, 4, 5.6, sharex=True, sharey=True)
    flat = panels.flat
    colors = ScalarMappable(TwoSlopeNorm(0.0, -REACH, REACH), "RdBu")
    for claim in OF_MASSES:
        panel = next(flat)
        margin = found["margin"].sel(claim=claim).transpose(RECIPROCATING, ROD)
        panel.pcolormesh(
            found[ROD], found[RECIPROCATING], margin, cmap=colors.cmap, rasterized=True,
            norm=colors.norm, shading="nearest",
        )  # fmt: skip
        border(panel, found, margin.values >= 0.0, BLACK)
        panel.set_title(f"claim {claim}")
    figure.colorbar(
        colors, ax=panels[:, 3], location="right", aspect=40, extend="both",
        label="margin, relative to the threshold; holds above 0",
    )  # fmt: skip
    held = (found["held"] == 1).transpose("claim", RECIPROCATING, ROD)
    count = held.sum("claim").values
    panel = next(flat)
    counts = panel.pcolormesh(
        found[ROD], found[RECIPROCATING], count, cmap="cividis", rasterized=True,
        norm=BoundaryNorm(np.arange(1.5, 9.5), 256), shading="nearest",
    )  # fmt: skip
    figure.colorbar(counts, ax=panel, location="bottom", ticks=range(2, 9), aspect=18)
    panel.set_title("how many of eight hold")
    panel = next(flat)
    most = int(count.max())
    panel.set_facecolor("#f4f4f4")
    panel.contourf(
        found[ROD], found[RECIPROCATING], (count == most).astype(float), levels=[0.5, 1.5],
        colors=[BLUE], alpha=0.35,
    )  # fmt: skip
    border(panel, found, count == most, BLUE)
    panel.set_title("all eight hold" if most == 8 else f"most of them: {most} hold")
    for panel in panels.flat:
        panel.plot(*place, marker="o", markersize=6, markerfacecolor="none", color=RED, mew=1.8)
        panel.grid(visible=False)
    for panel in panels[1]:
        panel.set_xlabel("rod mass (kg)")
    for panel in panels[:, 0]:
        panel.set_ylabel("reciprocating mass (kg)")
    return figure


def border(panel: Axes, found: xr.Dataset, inside: np.ndarray, color: str) -> None:
    """Draw the line around the machines for which something is true."""
    if inside.any() and not inside.all():
        panel.contour(found[ROD], found[RECIPROCATING], inside.astype(float), [0.5], colors=color,
                      linewidths=1.0)  # fmt: skip


@in_style
def draw_sensitivity(table: xr.Dataset, names: list[str]) -> Figure:
    """Return main and total effect of each assumption on each claim's margin, with 95 % intervals.

    table: of `compressor.studies.claims.findings`; names: of its assumptions, in words.
    """
    claims = [c for c in table["claim"].values.tolist()
              if not np.isnan(table["total_order"].sel(claim=c)).all()]  # fmt: skip
    columns = 4
    rows = -(-len(claims) // columns)
    figure, panels = sheet(rows, columns, 0.8 + rows * (0.9 + 0.21 * len(names)), sharey="all")
    place = np.arange(len(names))
    for panel, claim in zip(panels.flat, claims, strict=False):
        one = table.sel(claim=claim)
        for name, color, shift, label in (
            ("first_order", GREY, 0.19, "main effect"), ("total_order", BLUE, -0.19, "total"),
        ):  # fmt: skip
            value = one[name].values
            low, high = (one[f"{name}{end}"].values for end in ("_low", "_high"))
            ends = np.nan_to_num([np.maximum(value - low, 0.0), np.maximum(high - value, 0.0)])
            panel.barh(place - shift, np.maximum(value, 0.0), 0.36, color=color, label=label)
            panel.errorbar(
                value, place - shift, xerr=ends, fmt="none", ecolor=BLACK, elinewidth=0.9
            )
        panel.set_title(f"claim {claim}")
        panel.set_xlim(0.0, 1.25)
    for panel in panels.flat[len(claims) :]:
        panel.set_visible(False)
    for panel in panels[:, 0]:
        panel.set_yticks(place, names)
    panels[0, 0].invert_yaxis()  # of all, which share it
    for panel in panels.flat:
        panel.set_xlabel("share of the variance")
    handles, labels = panels.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure
