"""Alarms by clearance, and detection against false alarms, with a caption of their numbers."""

import math
from dataclasses import replace

import numpy as np
import xarray as xr

from compressor.report import (
    BLACK,
    CYCLE,
    GREY,
    Drawing,
    LineStyle,
    Note,
    Panel,
    make_grid,
    mark,
    palette,
)
from compressor.studies.alarms.alarms import best_of_each, rank_alarms
from compressor.studies.alarms.words import detects_words, limit_words, rate_words

SHOWN = 0.3  # rate of false alarms up to which a curve is drawn
ASIDE = 0.008  # of the clearances' range: between two alarms' points
THRESHOLD = LineStyle(GREY, linewidth=0.8, linestyle="--")


def draw_alarms(found: xr.Dataset, noise: int = 0) -> Drawing:
    """Return two panels a joint: detection by clearance, and against false alarms by the limit.

    found: of `judge_alarms`; noise: number of its level. Above, the kinds of alarm that see wear
    first over all joints, each with its best filter and 95 % intervals; below, the curve of the
    best alarm at each clearance.
    """
    joints = found["joint"].values.tolist()
    figure, grid = make_grid(2, len(joints), 7.4)
    lines = dict(zip(first_kinds(found, noise), CYCLE, strict=False))
    for column, joint in enumerate(joints):
        above, below = grid[:, column]
        mine = np.flatnonzero(found["worn_joint"].values == joint)
        best_of = {str(found["kind"].values[n]): n for n in best_of_each(found, joint, noise)}
        span = np.ptp(found["clearance"].values[mine])
        for place, (kind, line) in enumerate(lines.items()):
            one = found.isel(alarm=best_of[kind], noise=noise, state=mine)
            plot_rates(above, one, line, ASIDE * span * (place - len(lines) // 2))
        figure.legend = above.traces
        above.notes.append(Note(y=float(found.attrs["detected"]), style=THRESHOLD))
        best = found.isel(alarm=rank_alarms(found, joint, noise)[0], noise=noise)
        plot_curves(below, best.isel(state=mine))
        title = joint.replace("_", " ")
        above.title = f"({'abc'[column]}) {title}, by clearance"
        below.title = f"({'bcdef'[column + len(joints) - 1]}) {best['alarm'].item()}"
        above.y.title = "windows in which it trips" if not column else ""
        below.y.title = "windows in which it trips" if not column else ""
    return figure


def first_kinds(found: xr.Dataset, noise: int) -> list[str]:
    """Return the kinds of alarm, the one first that sees wear first on average over joints."""
    places: dict[str, int] = {}
    for joint in found["joint"].values.tolist():
        for rank, place in enumerate(best_of_each(found, joint, noise)):
            kind = str(found["kind"].values[place])
            places[kind] = places.get(kind, 0) + rank
    return sorted(places, key=lambda kind: places[kind])


def plot_rates(panel: Panel, one: xr.Dataset, line: LineStyle, aside: float) -> None:
    """Draw an alarm's detection by clearance, with its intervals; aside: so that none is hidden."""
    x, y = one["clearance"].values + aside, one["detection"].values
    low, high = (one[f"detection_{end}"].values for end in ("low", "high"))
    errors = np.array([np.maximum(y - low, 0.0), np.maximum(high - y, 0.0)])
    panel.plot(x, y, replace(line, marker="o", markersize=3.5), one["title"].item(), errors=errors)
    panel.x.title, panel.x.margin = "clearance (mm)", 0.04
    panel.y.span(-0.02, 1.04)


def plot_curves(panel: Panel, one: xr.Dataset) -> None:
    """Draw detection against false alarms over the limit of one alarm, a line a clearance."""
    false = one["curve_false_alarms"].values
    count = one.sizes["state"]
    for state, colour in enumerate(palette("viridis", count + 1)[:count]):
        line = LineStyle(colour, linewidth=1.4)
        name = f"{one['clearance'].values[state]:.3g} mm"
        panel.plot(false, one["curve_detection"].values[state], line, name)
    panel.legend = list(panel.traces)
    if math.isnan(float(one.attrs["factor"])):
        panel.notes.append(Note(x=float(one.attrs["attainable"]), style=THRESHOLD))
    panel.plot(one["false_alarms"].values, 0.0, mark(BLACK, "^", 5.0), "measured at the limit")
    panel.x.title = "false alarms"
    panel.x.span(-0.005, SHOWN)
    panel.y.span(-0.02, 1.04)


def caption(found: xr.Dataset, noise: int = 0) -> str:
    """Return what the figure shows, with its numbers."""
    attrs = found.attrs
    texts = []
    for joint in found["joint"].values.tolist():
        one = found.isel(alarm=rank_alarms(found, joint, noise)[0], noise=noise)
        texts.append(
            f"{joint.replace('_', ' ')}: {one['alarm'].item()}, which {detects_words(one, joint)}, "
            f"with {rate_words(one)} of false alarms"
        )
    has_aim = math.isnan(float(attrs["factor"]))
    aim = ", and below the rate of false alarms that limits aim at" if has_aim else ""
    level = float(found["noise"].values[noise])
    disturbed = f", {level:g} m/s² of noise added" if level else ""
    return (
        f"Above: share of windows in which an alarm trips, by clearance, each with its best filter "
        f"and 95 % intervals by draws, moved aside a little; limits by sound windows of other "
        f"draws, {limit_words(found)}{disturbed}. Dashed: {attrs['detected']:.0%}{aim}. "
        f"Best of {found.sizes['alarm']} alarms: "
        f"{'; '.join(texts)}. Below: of these, "
        f"detection against false alarms as the limit rises, a line a clearance; the mark is what "
        f"was counted at the limit above, of {attrs['sound_draws']} sound draws."
    )
