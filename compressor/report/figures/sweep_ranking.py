"""Which swept key matters for which metric, and by how much, in lying bars."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import BarContainer
from matplotlib.figure import Figure

from compressor.analysis import Effects, grid_effects, sampled_effects
from compressor.metrics import METRICS
from compressor.report.figures.style import BLUE, GOLD, legend_above, sheet, styled
from compressor.report.figures.sweep_data import Sweep
from compressor.report.figures.sweep_metric import Measure

COLUMNS = 4
MAIN, TOTAL = "by itself (main effect)", "with its interactions (total effect)"
RANK = "correlation of ranks"
UNSURE = "whose intervals overlap"
FROM_IDEAL = ("rms_acceleration_deviation",)  # 0 without clearance, by its meaning
Ranking = dict[Measure, Effects]


def ranking(sweep: Sweep, measures: Sequence[Measure]) -> Ranking:
    """Return the effects of a sweep's axes on each measure of which enough is known; all of one
    kind.
    """
    columns = [axis.values for axis in sweep.axes]
    found = {}
    for measure in measures:
        values = sweep.known(measure)
        effects = grid_effects(values) if sweep.is_grid else sampled_effects(columns, values)
        if effects is not None and np.isfinite(effects.main).any():
            found[measure] = effects
    if any(effects.total is not None for effects in found.values()):
        return {m: effects for m, effects in found.items() if effects.total is not None}
    return found


def order_of(effects: Effects) -> list[int]:
    """Return the numbers of the axes, the strongest first; what is unknown is last."""
    return np.argsort(-np.nan_to_num(effects.strength), kind="stable").tolist()


def leading(sweep: Sweep, measures: Sequence[Measure], most: int) -> list[Measure]:
    """Return the measures that change most over a sweep, as the greatest over the least value.

    One a metric; none that is a count, or is 0 without clearance by its meaning.
    """
    ratios: dict[Measure, float] = {}
    for measure in measures:
        values = sweep.known(measure)
        values = values[np.isfinite(values) & (values >= 0.0)]
        row = METRICS[measure.variable]
        if values.size and not row.counted and measure.variable not in FROM_IDEAL:
            ratios[measure] = values.max() / values.min() if values.min() > 0.0 else 1.0
    chosen: dict[str, Measure] = {}
    for measure in sorted(ratios, key=lambda one: -ratios[one]):
        chosen.setdefault(measure.variable, measure)
    return [*chosen.values()][:most] or list(measures[:1])


def overall(found: Ranking) -> list[int]:
    """Return the numbers of the axes, the one that is strongest on the mean of the measures
    first.
    """
    strengths = [np.nan_to_num(effects.strength) for effects in found.values()]
    return np.argsort(-np.mean(strengths, axis=0), kind="stable").tolist()


@styled
def draw_ranking(sweep: Sweep, found: Ranking) -> Figure:
    """Return a panel an axis, the strongest first, with a row a measure; bars with 95 %
    intervals.
    """
    order = overall(found)
    rows, columns = math.ceil(len(order) / COLUMNS), min(COLUMNS, len(order))
    each = 0.26 * len(found) + 0.75
    figure, grid = sheet(rows, columns, rows * each + 0.7, sharey=True)
    panels = list(grid.flat)
    for panel in panels[len(order) :]:
        panel.remove()
    correlated = any(effects.total is None for effects in found.values())
    for panel, axis in zip(panels, order, strict=False):
        plot_bars(panel, list(found.values()), axis)
        panel.set_title(sweep.axes[axis].phrase)
        panel.set_xlabel(RANK if correlated else "share of variance (%)")
        panel.set_xlim(-1.05 if correlated else 0.0, 1.05 if correlated else 105.0)
        panel.grid(visible=False, axis="y")
        if correlated:
            panel.axvline(0.0, color="#606060", linewidth=0.8)
    panels[0].set_yticks(range(len(found)), [measure.title for measure in found])
    panels[0].set_ylim(len(found) - 0.5, -0.5)
    legend_above(figure, [own for own in panels[0].containers if isinstance(own, BarContainer)])
    return figure


def plot_bars(panel: Axes, found: Sequence[Effects], axis: int) -> None:
    """The effects of one axis on all measures: total effects above, main effects below them."""
    places = np.arange(len(found), dtype=float)
    if found[0].total is None:
        bars: tuple[tuple[str, float, float, str], ...] = ((RANK, 0.0, 0.5, BLUE),)
    else:
        bars = (TOTAL, -0.19, 0.36, GOLD), (MAIN, 0.19, 0.36, BLUE)
    for name, shift, height, color in bars:
        values, low, high = np.array([part(effects, axis, name) for effects in found]).T
        error = np.nan_to_num([values - low, high - values]).clip(min=0.0)
        more = {"xerr": error, "ecolor": "#303030", "capsize": 2.0} if error.any() else {}
        panel.barh(places + shift, np.nan_to_num(values), height, color=color, label=name, **more)


def part(effects: Effects, axis: int, name: str) -> tuple[float, float, float]:
    """Return an effect and the ends of its interval: a share in %, or a correlation."""
    values, ends = (
        (effects.main, effects.main_ends) if name != TOTAL else (effects.total, effects.total_ends)
    )
    if values is None:
        return math.nan, math.nan, math.nan
    factor = 1.0 if effects.total is None else 100.0
    low, high = (math.nan, math.nan) if ends is None else ends[:, axis] * factor
    return float(values[axis]) * factor, float(low), float(high)


def told(sweep: Sweep, found: Ranking) -> str:
    """Return the strongest axis of each measure, a sentence an axis; or axes that are not told
    apart.
    """
    groups: dict[tuple[int, ...], list[str]] = {}
    for measure, effects in found.items():
        words = f"{measure.title} ({strength_told(effects)})"
        groups.setdefault(tuple(first_ones(effects)), []).append(words)
    parts = []
    for axes, metrics in groups.items():
        names = " or ".join(sweep.axes[n].phrase for n in axes)
        verb = "matters" if len(axes) == 1 else f"({UNSURE}) matters"
        parts.append(f"{names[0].upper()}{names[1:]} {verb} most for {'; '.join(metrics)}.")
    return " ".join(parts)


def first_ones(effects: Effects) -> list[int]:
    """Return the strongest axis, and those whose intervals reach its own."""
    first, *others = order_of(effects)
    return [first, *(n for n in others if reaches(effects, n, first))]


def reaches(effects: Effects, weaker: int, stronger: int) -> bool:
    """Return whether the interval of an axis' strength overlaps that of a stronger one."""
    ends = effects.main_ends if effects.total is None else effects.total_ends
    if ends is None or np.isnan(ends[:, [weaker, stronger]]).any():
        return False
    low, high = ends[:, stronger]
    least = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
    return bool(abs(ends[:, weaker]).max() >= least)


def strength_told(effects: Effects) -> str:
    """Return the strongest axis' share of the variance, or its correlation, in words."""
    first = order_of(effects)[0]
    if effects.total is None:
        return f"{effects.main[first]:.2f}".replace("-", "−")
    return share(float(effects.total[first]))


def share(value: float) -> str:
    """Return a share in percent; what is below 0 or above 1 by sampling is cut."""
    return f"{100.0 * min(max(value, 0.0), 1.0):.0f} %"
