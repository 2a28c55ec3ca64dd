"""How figures look: lines that differ in lightness as well as in dashes, and maps' colours."""

from dataclasses import dataclass
from functools import cache
from typing import Any

from matplotlib import colormaps
from matplotlib.colors import to_hex


@dataclass(frozen=True)
class LineStyle:
    """How one curve, its marks or an area is drawn; a higher `zorder` lies on top.

    linestyle: "-", "none", or (0, dashes) with lengths of strokes and gaps in widths of the line.
    marker: of matplotlib's letters. edge: colour of the marks' or the area's outline, "" as the
    rest; is_hollow: marks are outlines alone; is_hatched: the area is; is_step: a value holds up
    to the next x.
    """

    color: str
    linestyle: Any = "-"
    linewidth: float = 1.2
    zorder: float = 2.0
    marker: str = ""
    markersize: float = 6.0
    edge: str = ""
    edge_width: float = 1.0
    is_hollow: bool = False
    is_hatched: bool = False
    is_step: bool = False
    alpha: float = 1.0


def mark(color: str, marker: str, size: float, zorder: float = 2.0, **more: Any) -> LineStyle:
    """Return a style of marks without a line."""
    return LineStyle(color, "none", 1.2, zorder, marker, size, **more)


def fill(color: str, alpha: float = 1.0, zorder: float = 1.0, **more: Any) -> LineStyle:
    """Return a style of an area."""
    return LineStyle(color, zorder=zorder, alpha=alpha, **more)


# from dark to light: lightness (CIE L*) 0, 30, 54, 77
BLACK, BLUE, RED, GOLD = "#000000", "#1f4488", "#d0583b", "#ecb44a"
GREY = "#b5b5b5"
IDEAL = LineStyle(BLACK, (0, (1, 1.2)), 1.3, 2.4)
BY_CLEARANCE = {
    0.1: LineStyle(BLUE, (0, (4.5, 1.2)), 0.9, 2.3),
    0.2: LineStyle(RED, (0, (6, 1, 1.2, 1)), 1.0, 2.2),
    0.3: LineStyle(GOLD, "-", 1.6, 2.1),
}
BY_LOAD = {
    "typical": LineStyle(GOLD, "-", 2.6, 2.1),
    "design": LineStyle(BLUE, (0, (4.5, 1.6)), 1.3, 2.2),
}
# for a handful of curves of any meaning
CYCLE = (
    LineStyle(BLUE, "-", 1.4),
    LineStyle(RED, (0, (6, 1.5)), 1.4),
    LineStyle(GOLD, (0, (6, 1.2, 1.2, 1.2)), 1.8),
    LineStyle(BLACK, (0, (1, 1.2)), 1.5),
    LineStyle("#8c8c8c", (0, (3, 1.2)), 1.6),
)


@cache
def palette(name: str, count: int = 256) -> tuple[str, ...]:
    """Return colours of one of matplotlib's maps, from its least to its greatest value."""
    colors = colormaps[name]
    return tuple(to_hex(colors(number / max(1, count - 1))) for number in range(count))
