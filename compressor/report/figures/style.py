"""How figures look: one style, and lines that differ in lightness as well as in dashes.

Figures are made on the Agg canvas without pyplot, and inside a style context, so that neither a
user's matplotlibrc nor a user's own figures are touched.
"""

import functools
import io
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, ParamSpec, TypeVar

import numpy as np
from matplotlib import style
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

DPI = 150
WIDTH = 9.6  # inches, of every figure
LEGEND_WIDTH = 130  # characters, in a row of a legend

STYLE: dict[str, Any] = {
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # found anew for each drawing it takes a tenth of the time
    "axes.labelsize": 9.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.xmargin": 0.0,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 9.5,
    "legend.frameon": False,
    "legend.handlelength": 3.2,
    "lines.dash_capstyle": "butt",
    "agg.path.chunksize": 20000,
    "svg.fonttype": "path",
    "svg.hashsalt": "compsim",
    "savefig.dpi": DPI,
}


@dataclass(frozen=True)
class LineStyle:
    """How one curve is drawn; a higher `zorder` lies on top."""

    color: str
    linestyle: Any = "-"
    linewidth: float = 1.2
    zorder: float = 2.0

    def properties(self) -> dict[str, Any]:
        """Return the keywords of `Axes.plot`."""
        return asdict(self)


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

P = ParamSpec("P")
R = TypeVar("R")


def in_style(draw: Callable[P, R]) -> Callable[P, R]:
    """Run a drawing function in this module's style, whatever the user's defaults are."""

    @functools.wraps(draw)
    def inside(*args: P.args, **kwargs: P.kwargs) -> R:
        with style.context(STYLE, after_reset=True):
            return draw(*args, **kwargs)

    return inside


def sheet(rows: int, columns: int, height: float, **more: Any) -> tuple[Figure, np.ndarray]:
    """Return a figure of the common width and its axes, shape (rows, columns); height in inches."""
    layout = ConstrainedLayoutEngine(w_pad=0.07, h_pad=0.06, wspace=0.03)
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False, **more)


def legend_above(figure: Figure, handles: list[Any]) -> None:
    """Draw a legend in the margin above all axes, where it covers nothing."""
    longest = max(len(str(handle.get_label())) for handle in handles)
    columns = min(len(handles), max(1, LEGEND_WIDTH // (longest + 9)))
    figure.legend(handles=handles, loc="outside upper center", ncols=columns)


@in_style
def render(figure: Figure, kind: str) -> bytes:
    """Return a figure as the bytes of a `png` or `svg` file, which tell nothing of when they were
    made.

    Its layout is found once, and without drawing: matplotlib draws all once more to find it.
    """
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, metadata={"Date": None} if kind == "svg" else {})
    return stream.getvalue()
