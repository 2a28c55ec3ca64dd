"""What a sweep will do, before it does it: its jobs, those done, and what the others will cost.

Counts come first, at once. One job of each kind, the jobs of one study with the same joints, is run
and timed; the others are taken to cost the same for every revolution and sample.
"""

import random
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from compressor.cases import Case, Study, points
from compressor.store import Folder, read_store, series_file
from compressor.sweep.wanted import Wanted, stored
from compressor.sweep.warm_up import Needs, compile_once

ROW_BYTES = 462  # of one job in a file of rows, measured by `make store-bench`
MOST_CASES = 10_000  # of the missing jobs of a study that are looked at, evenly drawn


@dataclass(frozen=True)
class Next:
    """A job that is to be run."""

    study: str
    coordinates: dict[str, Any]  # swept key -> value
    key: str


@dataclass(frozen=True)
class Part:
    """One study's share; a job of several studies counts for the first of them."""

    study: str
    jobs: int
    done: int
    missing: int
    seconds: float  # of one core, to run what is missing
    bytes: int  # that it will take in the store


@dataclass(frozen=True)
class Forecast:
    """What is ahead of some studies; `seconds` are of wall time, with `workers` processes."""

    jobs: int
    done: int
    missing: int
    workers: int
    seconds: float
    bytes: int
    studies: tuple[Part, ...]
    first: tuple[Next, ...]


class Ahead:
    """What is ahead of some studies: `counts`, a Forecast without times and bytes, and `timed`."""

    def __init__(self, counts: Forecast, missing: dict[str, list[str]], cases: dict[str, Case]):
        self.counts = counts
        self.missing = missing  # keys, by study
        self.cases = cases  # of some of them, by key

    def timed(self, workers: int, remark: Callable[[str], None]) -> Forecast:
        """The whole forecast, for so many processes; `remark` is told of compiling."""
        if self.counts.missing:
            compile_once(Needs.of(self.cases.values()), remark)
        parts = []
        for part in self.counts.studies:
            keys = self.missing[part.study]
            looked_at = [self.cases[key] for key in keys if key in self.cases]
            seconds, size = cost(looked_at)
            share = len(keys) / max(len(looked_at), 1)
            parts.append(replace(part, seconds=share * seconds, bytes=round(share * size)))
        working = max(1, min(workers, self.counts.missing))
        return replace(
            self.counts,
            workers=working,
            seconds=sum(part.seconds for part in parts) / working,
            bytes=sum(part.bytes for part in parts),
            studies=tuple(parts),
        )


def forecast(studies: Sequence[Study], folder: Folder, first: int) -> Ahead:
    """What `sweep` would do with the selected jobs of some studies, `first` of them by name.

    Nothing is stored. Raises StoreError where the folder cannot be read.
    """
    store = read_store(folder)
    keys = {study.name: dict.fromkeys(study.keys[n] for n in study.selected) for study in studies}
    done = {*stored(store, Wanted(studies, store.keys()))}
    missing: dict[str, list[str]] = {}
    looked_at: set[str] = set()
    ahead: list[Next] = []
    parts: list[Part] = []
    told: set[str] = set()
    for study in studies:
        mine = [key for key in keys[study.name] if key not in told]
        told.update(mine)
        new = [key for key in mine if key not in done]
        missing[study.name] = new
        few = len(new) <= MOST_CASES
        looked_at.update(new if few else random.Random(0).sample(new, MOST_CASES))
        parts.append(Part(study.name, len(mine), len(mine) - len(new), len(new), 0.0, 0))
        ahead += next_of(study, {*new}, first - len(ahead))
    counts = Forecast(
        len(told), len(done), len(told) - len(done), 1, 0.0, 0, tuple(parts), tuple(ahead)
    )
    return Ahead(counts, missing, dict(Wanted(studies, looked_at)))


def next_of(study: Study, keys: set[str], most: int) -> Iterator[Next]:
    """The first of a study's jobs with some keys."""
    left = keys if most > 0 else set()
    for number, point in enumerate(points(study)):
        if not left or most == 0:
            return
        if (key := study.keys[number]) in left:
            left.discard(key)
            most -= 1
            yield Next(study.name, point, key)


def cost(cases: Sequence[Case]) -> tuple[float, int]:
    """What cases of one study take: seconds of one core, bytes of the store."""
    seconds, size = 0.0, 0.0
    for joint in dict.fromkeys(case.joint for case in cases):
        alike = [case for case in cases if case.joint == joint]
        turn, sample = measured(alike[0])
        seconds += turn * sum(case.duration / case.turn for case in alike)
        size += ROW_BYTES * len(alike)
        size += sample * sum(case.steps + 1 for case in alike if case.output.keep == "series")
    return seconds, round(size)


def measured(case: Case) -> tuple[float, float]:
    """A job's seconds for a revolution, and its file's bytes for a sample."""
    from compressor.solve import measure, observe  # needs numba: only to simulate

    began = time.perf_counter()
    size = 0
    if case.output.keep == "metrics":
        measure(case)
    else:
        size = len(series_file(observe(case)[1], case.output)[1])
    seconds = time.perf_counter() - began
    return seconds / (case.duration / case.turn), size / (case.steps + 1)
