"""The least change of assumptions that makes all of the paper's claims hold, by a directed search.

A sweep that finds no such machine says little: a box of eight assumptions is mostly corners. So
differential evolution (Storn and Price, Journal of Global Optimization 11, 1997, by SciPy) looks
for a machine whose least margin is not negative, and then for the one nearest to the defaults.
"""

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import brentq, differential_evolution

from compressor.cases import Axis, Case, Study, value_in
from compressor.machines.judged import Judged
from compressor.machines.study import ClaimsError, judge_machines, machine_key, rows_of
from compressor.store import Folder, write_dataset
from compressor.sweep import Progress

SEED = 1
POPULATION = 48  # machines of a generation
DIGITS = 6  # of an assumption's value
FAR = 10.0  # the cost of a machine that was not judged
HALVINGS = 5  # of each change, on the way back to the default


class Span(NamedTuple):
    """An assumption: its key, the function that spreads it over its range, and its default."""

    key: str
    spread: Callable[[float], float]
    default: float

    def value(self, share: float) -> float:
        """The value at a share of the range, 0 to 1."""
        return float(f"{self.spread(share):.{DIGITS}g}")

    @property
    def home(self) -> float:
        """The share of the range at which the default lies; the nearest end where it is outside."""
        low, high = self.spread(0.0), self.spread(1.0)
        if not low < self.default < high:
            return float(self.default >= high)
        return float(brentq(lambda share: self.spread(share) - self.default, 0.0, 1.0))


class Search:
    """The machines of a search, which grow; each is judged once and stored."""

    def __init__(self, study: Study, folder: Folder, workers: int, progress: Progress):
        self.study, self.folder = study, folder
        self.workers, self.progress = workers, progress
        self.base = study.cases[0].values()
        defaults = Case.from_values({}).values()
        self.spans = [
            Span(axis.key, axis.spread, float(value_in(defaults, axis.key)))
            for axis in study.axes
            if axis.spread is not None and isinstance(value_in(defaults, axis.key), int | float)
        ]
        if len(self.spans) < len(study.axes) or not self.spans:
            raise ClaimsError(
                f"{study.path}: a search needs assumptions that are drawn between two numbers, "
                "such as {saltelli: [2, 9]}, and nothing else that is swept"
            )
        self.points: dict[tuple[float, ...], Judged] = {}
        self.asked: list[tuple[float, ...]] = []

    @property
    def home(self) -> np.ndarray:
        """The defaults as shares of their ranges, (k,)."""
        return np.array([span.home for span in self.spans])

    def values(self, shares: Sequence[float]) -> tuple[float, ...]:
        """The assumptions' values at shares of their ranges; the default where it is that near."""
        return tuple(
            span.default if abs(share - span.home) < 1e-9 else span.value(share)
            for span, share in zip(self.spans, shares, strict=True)
        )

    def judge(self, many: Sequence[Sequence[float]]) -> list[Judged]:
        """The verdicts of machines at shares of the ranges."""
        wanted = [self.values(shares) for shares in many]
        new = [point for point in dict.fromkeys(wanted) if point not in self.points]
        if new:
            self.asked += new
            rows = rows_of(judge_machines(self.grown(), self.folder, self.workers, self.progress))
            self.points |= {point: rows[machine_key(self.case(point))] for point in new}
        return [self.points[point] for point in wanted]

    def grown(self) -> Study:
        """The study of all machines that were asked for."""
        cases = [self.case(point) for point in self.asked]
        columns = zip(*self.asked, strict=True)
        axes = [Axis(span.key, column) for span, column in zip(self.spans, columns, strict=True)]
        name = f"{self.study.name}-search"
        keys = tuple(case.key for case in cases)
        return Study(name, self.study.path, tuple(axes), cases, keys, False, range(len(cases)))

    def case(self, point: Sequence[float]) -> Case:
        """The machine with these values."""
        values: dict[str, Any] = json.loads(json.dumps(self.base))
        for span, value in zip(self.spans, point, strict=True):
            group, _, name = span.key.rpartition(".")
            values[group][name] = value
        return Case.from_values(values)


def cost(verdict: Judged, distance: float) -> float:
    """What a search makes small: 1 and what the least margin lacks, or else the distance below 1.

    distance: over its greatest.
    """
    least = min(verdict.margin)
    if math.isnan(least):  # not judged
        return FAR
    return distance if least >= 0.0 else 1.0 - least


def least_change(
    study: Study,
    folder: Folder,
    workers: int,
    generations: int,
    progress: Progress = lambda done, total, remark: None,
) -> xr.Dataset:
    """The machine nearest to the defaults at which all claims hold, or the one that lacks least.

    All machines of the search come back, as of `judge_machines`; the attribute `best` is the number
    of that one, and `distance` how far it is from the defaults.

    study: whose axes are all drawn by a design, in whose ranges is looked; machines are stored in
    FOLDER/NAME-search.nc, and the same call goes on from them. The distance is the sum of changes,
    each as a share of its range. Where all claims hold, each change is then taken back as far as
    they go on holding. Raises ClaimsError where the study draws nothing.
    """
    search = Search(study, folder, workers, progress)
    home, most = search.home, float(len(search.spans))

    def costs(shares: np.ndarray) -> np.ndarray:
        many = np.atleast_2d(shares.T)
        away = np.abs(many - home).sum(axis=1) / most
        verdicts = search.judge(many.tolist())
        return np.array([cost(v, d) for v, d in zip(verdicts, away.tolist(), strict=True)])

    rounds = -(-POPULATION // len(search.spans))
    best = differential_evolution(
        costs, [(0.0, 1.0)] * len(search.spans), maxiter=generations, popsize=rounds, tol=0.0,
        vectorized=True, updating="deferred", polish=False, rng=np.random.default_rng(SEED),
        x0=home,
    ).x  # fmt: skip
    if costs(best) < 1.0:
        best = taken_back(search, best)
    found = judge_machines(search.grown(), folder, workers, progress)
    values = search.values(best)
    found.attrs["best"] = search.asked.index(values)
    found.attrs["distance"] = float(np.abs(best - home).sum())
    write_dataset(Path(found.encoding["source"]), found)
    return found


def taken_back(search: Search, best: np.ndarray) -> np.ndarray:
    """A machine at which all claims hold, with each change taken back as far as they go on to.

    The smallest change first; a whole one if that goes, else by bisection.
    """
    home = search.home
    for number in np.argsort(np.abs(best - home)):
        inside, outside = float(best[number]), float(home[number])
        if inside == outside:
            continue
        for tried in [outside, *[None] * HALVINGS]:
            share = 0.5 * (inside + outside) if tried is None else tried
            moved = best.copy()
            moved[number] = share
            (verdict,) = search.judge([moved.tolist()])
            if cost(verdict, 0.0) < 1.0:
                inside, best = share, moved
                if share == home[number]:
                    break
            else:
                outside = share
    return best
