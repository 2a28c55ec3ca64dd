"""How the rod load at the crosshead pin changes its side, which keeps the pin's bearing oiled.

API 618 (5th edition) judges the combined rod load there: for how many degrees of a revolution it
lies on its smaller side, and how great its peak on that side is beside the other one's.
"""

import math

import numpy as np

from compressor.cases import Case
from compressor.metrics import ROD_LOAD
from compressor.physics import Column
from compressor.solve.error_bars import Companion, Metrics

A_TURN = 1440  # samples of the rod load a revolution
FEWEST, MOST = 64, 200_000  # of them over a settled part
SMALL_END = Column.FORCE + 2  # of the pin's force along x, positive in tension


def reversal_times(case: Case) -> np.ndarray:
    """Return the times (s) after settling at which the rod load is sampled; none without
    signals.
    """
    span = case.duration - case.settle
    count = round(min(max(A_TURN * span / case.turn, FEWEST), MOST)) if case.output.signals else 0
    return case.settle + span / max(count, 1) * (np.arange(count) + 0.5)


def reversal(rows: np.ndarray) -> Metrics:
    """Return the `ROD_LOAD` numbers of observed rows, (m, COLUMNS); none without rows.

    Each row stands in the middle of one of m equal steps. Between samples the load is a straight
    line, its peaks those of the samples.
    """
    load = rows[:, SMALL_END]
    if not load.size:
        return {}
    before, after = load[:-1], load[1:]
    width = np.abs(after - before)
    above = np.maximum(before, 0.0) + np.maximum(after, 0.0)
    # of a step whose ends have the same sign all or nothing, else the part above zero
    crossing = before * after < 0.0
    part = np.divide(above, width, out=np.zeros_like(width), where=crossing)
    inside = np.where(crossing, part, before + after > 0.0).sum()
    tension = (inside + 0.5 * (load[0] > 0.0) + 0.5 * (load[-1] > 0.0)) / load.size
    pull, push = max(load.max(), 0.0), max(-load.min(), 0.0)
    greater = max(pull, push)
    return {
        "rod_load_reversal_angle": 2.0 * math.pi * min(tension, 1.0 - tension),
        "rod_load_reversal_share": min(pull, push) / greater if greater else 0.0,
    }


def reversal_bars(rows: np.ndarray, other: Companion | None, others: np.ndarray) -> Metrics:
    """Return the error bar of each number, by another run at the same times; inf without one.

    What half as many samples would change stands for what is lost between samples. The bars are as
    careful as those of the metrics that were calibrated (`compressor.metrics.Bar`).
    """
    ours = reversal(rows)
    if other is None or others.shape != rows.shape:
        return dict.fromkeys(ours, math.inf)
    theirs, coarse = reversal(others), reversal(rows[::2])
    found = {}
    for name, value in ours.items():
        bar = ROD_LOAD[name].bar
        path = bar.path * float(other.apart["contact_force"][1]) * abs(value)
        by_run = other.closeness * math.hypot(bar.own * (value - theirs[name]), path)
        found[name] = by_run + abs(value - coarse[name])
    return found
