"""The least change of assumptions that makes all of the paper's claims hold, by a directed search.

A sweep that finds no such machine says little: a box of eight assumptions is mostly corners. So
differential evolution (Storn and Price, Journal of Global Optimization 11, 1997, by SciPy), and a
compass search from its best machine, look for one whose least margin is not negative, and then for
the one nearest to the defaults.
"""

import copy
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor.cases import Axis, Case, Study, design, value_in
from compressor.program import Progress, no_progress
from compressor.store import Folder, StoreError, write_dataset
from compressor.studies.claims.study import (
    ELSEWHERE,
    OTHER_MACHINES,
    ClaimsError,
    Judged,
    judge_machines,
    machine_key,
    read_kept_machines,
    read_machines,
    rows_of,
)

SEED = 1
POPULATION = 48  # machines of a generation
DIGITS = 6  # of an assumption's value
UNJUDGED_COST = 10.0  # the cost of a machine that was not judged
STEP, MIN_STEP = 0.05, 0.003  # of a compass search, as shares of the ranges
LONGER, LONGEST = 5, 20  # times: runs that show whether a machine is consistent
NAMES = {1: "", LONGER: "-longer", LONGEST: "-longest"}
HALVINGS = 4  # of each change, on the way back to the default


class AssumptionRange(NamedTuple):
    """An assumption: its key, the function that spreads it over its range, and its default."""

    key: str
    spread: Callable[[float], float]
    default: float

    def value(self, share: float) -> float:
        """Return the value at a share of the range, 0 to 1."""
        return float(f"{self.spread(share):.{DIGITS}g}")

    @property
    def home(self) -> float:
        """Return the default's share of the range, or the nearest end beyond it."""
        return self.share(self.default)

    def share(self, value: float) -> float:
        """Return the share of the range at which a value lies.

        The nearest end where it is outside.
        """
        from scipy.optimize import brentq  # takes a quarter of a second

        low, high = self.spread(0.0), self.spread(1.0)
        if not low < value < high:
            return float(value >= high)
        return float(brentq(lambda share: self.spread(share) - value, 0.0, 1.0))


class MachineSearch:
    """The machines of a search, which grow; each is judged once and stored.

    longer: how many times as long as the study's their runs are. In longer runs a claim counts as
    held where its margin is beyond its error, else by its margin alone.
    """

    def __init__(
        self, study: Study, folder: Folder, workers: int, progress: Progress, longer: int = 1
    ):
        self.study, self.folder, self.longer = study, folder, longer
        self.workers, self.progress = workers, progress
        defaults = Case.from_values({}).values()
        self.spans = [
            AssumptionRange(axis.key, axis.spread, float(value_in(defaults, axis.key)))
            for axis in study.axes
            if axis.spread is not None and isinstance(value_in(defaults, axis.key), int | float)
        ]
        if len(self.spans) < len(study.axes) or not self.spans or len(study.fixed) > 1:
            raise ClaimsError(
                f"{study.path}: a search needs assumptions that are drawn between two numbers, "
                "such as {saltelli: [2, 9]}, no blocks, and nothing else that is swept"
            )
        self.points = self.stored()
        self.requested: list[tuple[float, ...]] = []  # in this search

    def stored(self) -> dict[tuple[float, ...], Judged]:
        """Return the machines of earlier searches in this folder. Raises StoreError."""
        path = Path(self.folder) / f"{self.name}.nc"
        if not path.exists():
            return {}
        found = read_machines(path)
        at = {coordinate.attrs.get("case_key"): coordinate for coordinate in found.coords.values()}
        if any(span.key not in at for span in self.spans):
            raise StoreError(path, OTHER_MACHINES, ELSEWHERE)
        points = zip(*(at[span.key].values.tolist() for span in self.spans), strict=True)
        rows = rows_of(found)
        keys = {point: machine_key(self.case(point)) for point in points}
        if not {*keys.values()} >= {*rows}:
            raise StoreError(path, OTHER_MACHINES, ELSEWHERE)
        return {point: rows[key] for point, key in keys.items() if key in rows}

    @property
    def name(self) -> str:
        """Return the name of the study of the search's machines."""
        return f"{self.study.name}-search{NAMES[self.longer]}"

    @property
    def home(self) -> np.ndarray:
        """Return the defaults as shares of their ranges, (k,)."""
        return np.array([span.home for span in self.spans])

    def values(self, shares: Sequence[float]) -> tuple[float, ...]:
        """Return the assumptions' values at shares of their ranges.

        The default where it is that near.
        """
        return tuple(
            span.default if abs(share - span.home) < 1e-9 else span.value(share)
            for span, share in zip(self.spans, shares, strict=True)
        )

    def judge(self, many: Sequence[Sequence[float]]) -> list[Judged]:
        """Return the verdicts of machines at shares of the ranges."""
        return self.verdicts_at([self.values(shares) for shares in many])

    def verdicts_at(self, points: Sequence[tuple[float, ...]]) -> list[Judged]:
        """Return the verdicts of machines with these values of the assumptions."""
        self.requested += points
        new = [point for point in dict.fromkeys(points) if point not in self.points]
        if new:
            found = self.judged(new)
            rows = rows_of(found)
            self.points |= {point: rows[machine_key(self.case(point))] for point in new}
        return [self.points[point] for point in points]

    def judged(self, new: Sequence[tuple[float, ...]] = ()) -> xr.Dataset:
        """Return all machines that are known, and new ones behind them."""
        points = [*self.points, *new]
        cases = [self.case(point) for point in points]
        columns = zip(*points, strict=True)
        axes = [Axis(span.key, column) for span, column in zip(self.spans, columns, strict=True)]
        keys = tuple(case.key for case in cases)
        count = range(len(cases))
        study = Study(self.name, self.study.path, tuple(axes), cases, keys, False, count)
        return judge_machines(study, self.folder, self.workers, self.progress)

    def cost(self, point: Sequence[float]) -> float:
        """Return the cost, as `cost`, of a machine that is known."""
        verdict = self.points[tuple(point)]
        return cost(verdict, self.distance(point) / len(self.spans), self.longer > 1)

    def distance(self, point: Sequence[float]) -> float:
        """Return the sum of changes from the defaults, each as a share of its range."""
        pairs = zip(self.spans, point, strict=True)
        return math.fsum(abs(span.share(value) - span.home) for span, value in pairs)

    def case(self, point: Sequence[float]) -> Case:
        """Return the machine with these values."""
        values: dict[str, Any] = {"name": self.study.name, **copy.deepcopy(self.study.fixed[0])}
        for span, value in zip(self.spans, point, strict=True):
            group, _, name = span.key.rpartition(".")
            values.setdefault(group, {})[name] = value
        if self.longer > 1:
            solve = self.study.cases[0].solve
            key = "duration_rev" if solve.duration_s is None else "duration_s"
            values.setdefault("solve", {})[key] = self.longer * getattr(solve, key)
        return Case.resolve(values)


def cost(verdict: Judged, distance: float, sure: bool = False) -> float:
    """Return the cost that a search minimizes: above 1 while a claim fails, else the distance.

    Above 1 it is 1 and what the least margin lacks. distance: over its greatest. sure: a margin
    counts less its error.
    """
    pairs = zip(verdict.margin, verdict.error, strict=True)
    least = min(margin - error if sure else margin for margin, error in pairs)
    if not math.isfinite(least):  # not judged, or an error that is not known
        return UNJUDGED_COST
    return distance if least >= 0.0 else 1.0 - least


def least_change(
    study: Study,
    folder: Folder,
    workers: int,
    generations: int,
    progress: Progress = no_progress,
) -> xr.Dataset:
    """Return the machine nearest to the defaults at which all claims hold.

    If there is none, it is the one that lacks least. It has the form of `judge_machines`, and is
    stored in FOLDER/NAME-best.nc. Its attribute `distance` is the sum of changes from the defaults,
    each as a share of its range; `looked` is the number of machines that were judged; `least` is 1
    where changes were taken back as far as the claims go on holding.

    study: its axes are all drawn by a design, whose ranges are searched. All machines are stored,
    in FOLDER/NAME-search.nc and -longer, -longest, and the same call goes on from them. The search
    begins at the best of the study's own machines that are judged. Evolution finds a region, and a
    compass search goes on from its best machine. Chaotic runs of few revolutions leave wide errors,
    in which a search finds lucky machines: so another compass search goes on in runs 5 times as
    long, until all claims hold beyond their errors. Then each change is taken back as far as they
    go on holding. Where some hold only within their errors, a run 20 times as long decides. Raises
    ClaimsError where the study draws nothing.
    """
    from scipy.optimize import differential_evolution

    search = MachineSearch(study, folder, workers, progress)

    def costs(shares: np.ndarray) -> np.ndarray:
        many = np.atleast_2d(shares.T).tolist()
        search.judge(many)  # a whole generation, so that workers run it side by side
        return np.array([search.cost(search.values(point)) for point in many])

    differential_evolution(
        costs, [(0.0, 1.0)] * len(search.spans), maxiter=generations, init=first_generation(search),
        tol=0.0, vectorized=True, updating="deferred", polish=False,
        rng=np.random.default_rng(SEED),
    )  # fmt: skip
    first_best = descend(search, min(search.requested, key=search.cost), STEP)
    longer = MachineSearch(study, folder, workers, progress, LONGER)
    best = descend(longer, first_best, STEP / 2.0)
    if holds := longer.cost(best) < 1.0:
        take_back_changes(longer, best)
    best = min(longer.points, key=longer.cost)
    looked, last = len(search.points) + len(longer.points), longer
    if not holds and min(longer.points[best].margin) >= 0.0:
        last = MachineSearch(study, folder, workers, progress, LONGEST)
        last.verdicts_at([best])
        looked += 1
    found = last.judged().isel(machine=[[*last.points].index(best)])
    found.attrs |= {"distance": last.distance(best), "looked": looked, "least": int(holds)}
    path = Path(folder) / f"{study.name}-best.nc"
    write_dataset(path, found)
    found.encoding["source"] = str(path)
    return found


def first_generation(search: MachineSearch) -> np.ndarray:
    """Return the first generation of machines, (machines, k), as shares of the ranges.

    It has the defaults, the study's best machines, and draws where these are few; no machines of
    earlier searches, so that the same call takes the same way.
    """
    study, spans = search.study, search.spans
    known = read_kept_machines(Path(search.folder) / f"{study.name}.nc")
    found = []
    for number, case in enumerate(study.cases):
        verdict = known.get(machine_key(case))
        if verdict is not None:
            point = [axis.values[number] for axis in study.axes]
            shares = [span.share(value) for span, value in zip(spans, point, strict=True)]
            found.append((cost(verdict, search.distance(point) / len(spans)), shares))
    best = [shares for _, shares in sorted(found)][: POPULATION - 1]
    draws = design("lhs", POPULATION - 1 - len(best), len(spans), SEED)
    return np.array([search.home.tolist(), *best, *draws])


def descend(search: MachineSearch, best: tuple[float, ...], step: float) -> tuple[float, ...]:
    """Return the best machine of a compass search that begins at one.

    Until claims hold, or steps end.

    All neighbours of a round, one up and one down in each assumption, are judged side by side
    (Kolda, Lewis and Torczon, SIAM Review 45, 2003, 385-482).
    """
    search.verdicts_at([best])
    while step >= MIN_STEP and search.cost(best) >= 1.0:
        shares = np.array([s.share(value) for s, value in zip(search.spans, best, strict=True)])
        moves = step * np.vstack([np.eye(shares.size), -np.eye(shares.size)])
        around = np.clip(shares + moves, 0.0, 1.0).tolist()
        search.judge(around)
        nearest = min((search.values(point) for point in around), key=search.cost)
        if search.cost(nearest) < search.cost(best):
            best = nearest
        else:
            step /= 2.0
    return best


def take_back_changes(search: MachineSearch, best: tuple[float, ...]) -> None:
    """Take back each change of a machine at which all claims hold, as far as they go on to.

    The smallest change first; a whole one if that goes, else by bisection.
    """
    home = search.home
    shares = np.array([s.share(value) for s, value in zip(search.spans, best, strict=True)])
    for number in np.argsort(np.abs(shares - home)):
        inside, outside = float(shares[number]), float(home[number])
        if inside == outside:
            continue
        for tried in [outside, *[None] * HALVINGS]:
            share = 0.5 * (inside + outside) if tried is None else tried
            trial = shares.copy()
            trial[number] = share
            search.judge([trial.tolist()])
            if search.cost(search.values(trial.tolist())) < 1.0:
                inside, shares = share, trial
                if share == home[number]:
                    break
            else:
                outside = share
