"""How far wear is over the limits, and what trips as a limit rises, with a caption."""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

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
    palette,
    render,
    title_figure,
)
from compressor.store import publish, write_dataset
from compressor.studies.alarms.alarms import best_of_each, rank_alarms
from compressor.studies.alarms.words import csv_text, detects_words, limit_words, rate_words

FILES = ("alarms.csv", "alarms.nc")

MAX_KINDS = 6  # kinds of alarm that have a line: the first to see wear
BEYOND = 3.0  # times the greatest level that half of the windows reach, to which limits are drawn
THRESHOLD = LineStyle(GREY, linewidth=0.8, linestyle="--")


def draw_alarms(found: xr.Dataset, noise: int = 0) -> Drawing:
    """Return two panels a joint: levels over the limit by clearance, and shares by the limit.

    found: of `judge_alarms`; noise: number of its level. Above, the kinds of alarm that see wear
    first over all joints, each with its best filter; below, the best alarm: the share of windows
    that trip as its limit rises, of sound machines and at each clearance.
    """
    joints = found["joint"].values.tolist()
    figure, grid = make_grid(2, len(joints), 7.4)
    lines = dict(zip(first_kinds(found, noise)[:MAX_KINDS], CYCLE, strict=False))
    for column, joint in enumerate(joints):
        above, below = grid[:, column]
        mine = np.flatnonzero(found["worn_joint"].values == joint)
        best_of = {str(found["kind"].values[n]): n for n in best_of_each(found, joint, noise)}
        for kind, line in lines.items():
            plot_levels(above, found.isel(alarm=best_of[kind], noise=noise, state=mine), line)
        figure.legend = above.traces
        above.notes.append(Note(y=1.0, style=THRESHOLD))
        best = found.isel(alarm=rank_alarms(found, joint, noise)[0], noise=noise)
        plot_curves(below, best.isel(state=mine))
        title = joint.replace("_", " ")
        above.title = f"({'abc'[column]}) {title}, by clearance"
        below.title = f"({'bcdef'[column + len(joints) - 1]}) {best['alarm'].item()}"
        above.y.title = "level over the limit" if not column else ""
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


def plot_levels(panel: Panel, one: xr.Dataset, line: LineStyle) -> None:
    """Draw by clearance the level that the share to be detected reaches, over an alarm's limit."""
    name = one["title"].item()
    panel.plot(
        one["clearance"].values, detected_levels(one), replace(line, marker="o", markersize=3.5),
        name,
    )  # fmt: skip
    panel.x.title, panel.x.margin = "clearance (mm)", 0.04
    panel.y.log = True


def detected_levels(one: xr.Dataset) -> np.ndarray:
    """Return the level that `detected` of the windows reach, over the limit, (states,).

    Above 1 the alarm detects; nan where it lies below all limits that were tried. A limit below
    these, as of peaks that no sound machine has, counts as the least of them.
    """
    reached = one["curve_detection"].values >= float(one.attrs["detected"])
    last = reached.sum(axis=1) - 1  # shares fall as the limit rises
    levels = np.where(last < 0, np.nan, one["factor"].values[last])
    return levels / max(float(one["limit_high"]), float(one["factor"][0]))


def plot_curves(panel: Panel, one: xr.Dataset) -> None:
    """Draw what trips over the limit of one alarm: sound machines, and a line a clearance."""
    limits, shares = one["factor"].values, one["curve_detection"].values
    count = one.sizes["state"]
    for state, colour in enumerate(palette("viridis", count + 1)[:count]):
        line = LineStyle(colour, linewidth=1.4)
        panel.plot(limits, shares[state], line, f"{one['clearance'].values[state]:.3g} mm")
    false = one["curve_false_alarms"].values
    panel.plot(limits, false, LineStyle(BLACK, linewidth=1.4, linestyle="--"), "sound")
    panel.legend = list(panel.traces)
    panel.notes.append(Note(x=max(float(one["limit_high"]), limits[0]), style=THRESHOLD))
    half = max(int((curve >= 0.5).sum()) for curve in (*shares, false))
    top = max(limits[max(half - 1, 0)], float(one["limit_high"]))
    panel.x.title, panel.x.log = "limit / usual reading", True
    panel.x.span(float(limits[0]), float(top) * BEYOND)
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
    level = float(found["noise"].values[noise])
    disturbed = f", {level:g} m/s² of noise added" if level else ""
    return (
        f"Above: level that {attrs['detected']:.0%} of windows reach, over the limit, by "
        f"clearance, each alarm with its best filter: above 1 (dashed) it detects; limits by sound "
        f"windows of other draws, {limit_words(found)}{disturbed}. "
        f"Best of {found.sizes['alarm']} alarms: "
        f"{'; '.join(texts)}. Below: of these, share of windows that trip as the limit rises, of "
        f"{attrs['sound_draws']} sound draws (black) and at each clearance; the line is the limit."
    )


def write_alarms(found: xr.Dataset, output: str, title: str) -> Iterator[str]:
    """Write a result as CSV, netCDF, and a figure for each level of noise; yield what was written.

    title: of the machine.
    """

    place = Path(output)
    publish(place / FILES[0], csv_text(found).encode())
    write_dataset(place / FILES[1], found)
    for name in FILES:
        yield os.path.join(output, name)
    for level, noise in enumerate(found["noise"].values.tolist()):
        path = place / (f"alarms-noise-{noise:g}.png" if noise else "alarms.png")
        drawing = draw_alarms(found, level)
        noisy = [f"noise of {noise:g} m/s²"] if noise else []
        drawing.title = title_figure(title, "alarms by clearance", noisy)
        publish(path, render(drawing, "png"))
        yield f"{path}\n  {caption(found, level)}"
