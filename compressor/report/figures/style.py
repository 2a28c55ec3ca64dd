"""How figures look: lines that differ in lightness as well as in dashes, and maps' colours."""

from dataclasses import dataclass
from functools import cache
from typing import Any

from matplotlib import colormaps
from matplotlib.colors import to_hex

PIXEL = 4.0 / 3.0  # of a point, 1/72 inch


@dataclass(frozen=True)
class LineStyle:
    """How one curve, its marks or an area is drawn; a higher `zorder` lies on top.

    dash: lengths of strokes and gaps in widths of the line, () of a solid one; linewidth and
    markersize: in points, of a line that is not drawn 0; marker: plotly's name of it, "" without;
    edge: colour of the marks' outline, "" as the rest; is_hollow: marks are outlines alone.
    """

    color: str
    dash: tuple[float, ...] = ()
    linewidth: float = 1.2
    zorder: float = 2.0
    marker: str = ""
    markersize: float = 6.0
    edge: str = ""
    edge_width: float = 1.0
    is_hollow: bool = False
    alpha: float = 1.0

    @property
    def line(self) -> dict[str, Any]:
        """Return plotly's description of the line."""
        strokes = [round(PIXEL * part * self.linewidth, 2) for part in self.dash]
        dash = ",".join(f"{part}px" for part in strokes) or "solid"
        return {"color": self.color, "width": round(PIXEL * self.linewidth, 2), "dash": dash}

    @property
    def marks(self) -> dict[str, Any]:
        """Return plotly's description of the marks."""
        edge = {"color": self.edge or self.color, "width": round(PIXEL * self.edge_width, 2)}
        symbol = f"{self.marker}-open" if self.is_hollow else self.marker
        size = round(PIXEL * self.markersize, 2)
        return {"symbol": symbol, "size": size, "color": self.color, "line": edge}


def mark(color: str, marker: str, size: float, zorder: float = 2.0, **more: Any) -> LineStyle:
    """Return a style of marks without a line."""
    return LineStyle(color, (), 0.0, zorder, marker, size, **more)


def fill(color: str, alpha: float = 1.0, zorder: float = 1.0, **more: Any) -> LineStyle:
    """Return a style of an area."""
    return LineStyle(color, zorder=zorder, alpha=alpha, **more)


# from dark to light: lightness (CIE L*) 0, 30, 54, 77
BLACK, BLUE, RED, GOLD = "#000000", "#1f4488", "#d0583b", "#ecb44a"
GREY = "#b5b5b5"
IDEAL = LineStyle(BLACK, (1, 1.2), 1.3, 2.4)
BY_CLEARANCE = {
    0.1: LineStyle(BLUE, (4.5, 1.2), 0.9, 2.3),
    0.2: LineStyle(RED, (6, 1, 1.2, 1), 1.0, 2.2),
    0.3: LineStyle(GOLD, (), 1.6, 2.1),
}
BY_LOAD = {
    "typical": LineStyle(GOLD, (), 2.6, 2.1),
    "design": LineStyle(BLUE, (4.5, 1.6), 1.3, 2.2),
}
# for a handful of curves of any meaning
CYCLE = (
    LineStyle(BLUE, (), 1.4),
    LineStyle(RED, (6, 1.5), 1.4),
    LineStyle(GOLD, (6, 1.2, 1.2, 1.2), 1.8),
    LineStyle(BLACK, (1, 1.2), 1.5),
    LineStyle("#8c8c8c", (3, 1.2), 1.6),
)


@cache
def palette(name: str, count: int = 33) -> tuple[str, ...]:
    """Return colours of one of matplotlib's maps, from its least to its greatest value."""
    colors = colormaps[name]
    return tuple(to_hex(colors(number / max(1, count - 1))) for number in range(count))
