"""What a sweep will do, before it does it: its jobs, those done, and what the others will cost.

Counts come first, at once. Then a dozen jobs of each study, drawn evenly over its design, are run
and timed, within some seconds. The others are taken to cost as much for every revolution, in the
mean; how far the drawn ones differ gives a range. Jobs are drawn alike each time. What they cost is
processor time; how much of that workers get in a second is measured, too, since others may be at
work on this machine.
"""

import itertools
import math
import random
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from compressor.cases import Case, Study, points
from compressor.store import Folder, read_store, series_file
from compressor.sweep.speed import cores_at_work
from compressor.sweep.wanted import RequestedJobs, revolutions, stored_ends
from compressor.sweep.warm_up import Needs, compile_once, compile_seconds

ROW_BYTES = 462  # of one job in a file of rows, measured by `make store-bench`
MAX_CASES = 10_000  # of the missing jobs of a study that are looked at, evenly drawn
TIMED_JOBS = 12  # jobs of a study that are timed
TIMING_SECONDS = 4.0  # s of timing, of all studies, after which no further job is begun
LONG_JOB = 120.0  # s of a job that is not run twice for what loading was in it
LOADED: set[bool] = set()  # whether chaos was looked for, in the jobs that this process has run


@dataclass(frozen=True)
class Next:
    """A job that is to be run."""

    study: str
    coordinates: dict[str, Any]  # swept key -> value
    key: str


@dataclass(frozen=True)
class StudyShare:
    """One study's share; a job of several studies counts for the first of them.

    `least`, `most`: the range of `seconds`; they are the same where all missing jobs were timed,
    and nan where one of several was.
    """

    study: str
    jobs: int
    done: int
    missing: int
    seconds: float = 0.0  # of one core, to run what is missing
    least: float = 0.0
    most: float = 0.0
    timed: int = 0  # jobs
    bytes: int = 0  # that it will take in the store


@dataclass(frozen=True)
class Forecast:
    """What is ahead of some studies; `seconds` are of wall time, with `workers` processes.

    `least`, `most`: the range of `seconds`, nan where too few jobs were timed; `loading`: those of
    them in which workers load what they need; `cores`: idle cores that these workers are worth here
    and now; `compiling`: seconds before the first job, where this machine has not compiled all that
    the run needs.
    """

    jobs: int
    done: int
    missing: int
    studies: tuple[StudyShare, ...]
    first: tuple[Next, ...]
    workers: int = 1
    seconds: float = 0.0
    least: float = 0.0
    most: float = 0.0
    timed: int = 0
    loading: float = 0.0
    cores: float = 1.0
    compiling: int = 0
    bytes: int = 0


class Ahead:
    """What is ahead of some studies: `counts` is a Forecast without times and bytes."""

    def __init__(self, counts: Forecast, missing: dict[str, list[str]], cases: dict[str, Case]):
        self.counts = counts
        self.missing = missing  # keys, by study
        self.cases = cases  # of some of them, by key

    def with_times(self, workers: int, remark: Callable[[str], None]) -> Forecast:
        """Return the whole forecast, for so many processes; `remark` is called about compiling."""
        if not self.counts.missing:
            return self.counts
        looked_at = list(self.cases.values())
        needs = Needs.of(looked_at)
        compile_once(needs, remark)
        drawn = {part.study: draw_cases(self.missing[part.study], self.cases)[:TIMED_JOBS]
                 for part in self.counts.studies if part.missing}  # fmt: skip
        costs = time_in_turn(drawn, TIMING_SECONDS)
        parts = [
            self.estimate(part, costs[part.study]) if part.missing else part
            for part in self.counts.studies
        ]
        working = min(workers, self.counts.missing)
        at_once = cores_at_work(working)
        loading = working * sum(cost.loading for some in costs.values() for cost in some)
        # the last jobs leave workers idle: nine jobs take two workers as long as ten
        rounds = math.ceil(self.counts.missing / working) * working / self.counts.missing

        def wall(seconds: Iterable[float]) -> float:
            return (loading + rounds * sum(seconds)) / at_once

        return replace(
            self.counts,
            studies=tuple(parts),
            workers=working,
            seconds=wall(part.seconds for part in parts),
            least=wall(part.least for part in parts),
            most=wall(part.most for part in parts),
            timed=sum(part.timed for part in parts),
            loading=wall([]),
            cores=at_once,
            compiling=compile_seconds(needs),
            bytes=sum(part.bytes for part in parts),
        )

    def estimate(self, part: StudyShare, costs: "Sequence[Cost]") -> StudyShare:
        """Return a study's part with what its missing jobs will take, by some of them."""
        keys = self.missing[part.study]
        looked_at = [self.cases[key] for key in keys if key in self.cases]
        share = len(keys) / len(looked_at)
        turns = share * sum(map(revolutions, looked_at))
        mean, least, most = mean_with_range([cost.turn for cost in costs], len(keys))
        samples = [cost.sample for cost in costs if cost.sample]
        stored = sum(case.steps + 1 for case in looked_at if case.output.keep == "series")
        size = ROW_BYTES * len(keys) + share * stored * (samples[0] if samples else 0.0)
        return replace(
            part, seconds=turns * mean, least=turns * least, most=turns * most,
            timed=len(costs), bytes=round(size),
        )  # fmt: skip


def forecast(studies: Sequence[Study], folder: Folder, first: int) -> Ahead:
    """Return what `sweep` would do with the selected jobs of some studies, `first` of them by name.

    Nothing is stored. Raises StoreError where the folder cannot be read.
    """
    store = read_store(folder)
    keys = {study.name: dict.fromkeys(study.keys[n] for n in study.selected) for study in studies}
    done = {*stored_ends(store, RequestedJobs(studies, store.keys()))}
    missing: dict[str, list[str]] = {}
    looked_at: set[str] = set()
    ahead: list[Next] = []
    parts: list[StudyShare] = []
    counted: set[str] = set()
    for study in studies:
        mine = [key for key in keys[study.name] if key not in counted]
        counted.update(mine)
        new = [key for key in mine if key not in done]
        missing[study.name] = new
        few = len(new) <= MAX_CASES
        looked_at.update(new if few else random.Random(0).sample(new, MAX_CASES))
        parts.append(StudyShare(study.name, len(mine), len(mine) - len(new), len(new)))
        ahead += next_of(study, {*new}, first - len(ahead))
    counts = Forecast(len(counted), len(done), len(counted) - len(done), tuple(parts), tuple(ahead))
    return Ahead(counts, missing, dict(RequestedJobs(studies, looked_at)))


def next_of(study: Study, keys: set[str], most: int) -> Iterator[Next]:
    """Yield the first of a study's jobs with some keys."""
    left = keys if most > 0 else set()
    for number, point in enumerate(points(study)):
        if not left or most == 0:
            return
        if (key := study.keys[number]) in left:
            left.discard(key)
            most -= 1
            yield Next(study.name, point, key)


class Cost(NamedTuple):
    """What a job took: seconds of one core for a revolution, bytes of its file for a sample.

    loading: s of one core that a process spends once, on its first job: libraries, machine code,
    tables of a bearing.
    """

    turn: float
    sample: float
    loading: float = 0.0


def draw_cases(keys: Sequence[str], cases: Mapping[str, Case]) -> list[Case]:
    """Return up to a dozen of the missing jobs of a study, one at random from each stretch of them.

    Jobs stand in the order of the design, so that stretches spread over its axes. They come in
    random order: any first few are spread, too.
    """
    known, chance = [key for key in keys if key in cases], random.Random(0)
    count = min(TIMED_JOBS, len(known))
    bounds = [len(known) * i // count for i in range(count + 1)]
    found = [known[chance.randrange(*pair)] for pair in itertools.pairwise(bounds)]
    chance.shuffle(found)
    return [cases[key] for key in found]


def time_in_turn(drawn: Mapping[str, Sequence[Case]], seconds: float) -> dict[str, list[Cost]]:
    """Return the costs of jobs of each study, run in turn until these have taken so many seconds.

    At least one of each study is run.
    """
    costs: dict[str, list[Cost]] = {study: [] for study in drawn}
    for number in range(TIMED_JOBS):
        for study, cases in drawn.items():
            if number < len(cases) and (number == 0 or seconds > 0.0):
                costs[study].append(measure_cost(cases[number]))
                seconds -= costs[study][-1].turn * revolutions(cases[number])
    return costs


def mean_with_range(values: Sequence[float], of: int) -> tuple[float, float, float]:
    """Return the mean of some of so many values, and the least and greatest that all may have.

    By Student's t at 95 %; a part of the whole that is known is in no doubt. All that is not timed
    costs at least as much as the cheapest one. The bounds are nan by one value of several.
    """
    count, mean = len(values), sum(values) / len(values)
    if count == of:
        return mean, mean, mean
    if count == 1:
        return mean, math.nan, math.nan
    from compressor.solve import sure  # needs numba: only where jobs are timed

    spread = math.sqrt(sum((value - mean) ** 2 for value in values) / (count - 1))
    error = float(sure(np.array(spread * math.sqrt((1.0 - count / of) / count)), count))
    return mean, max(mean - error, min(values)), mean + error


def measure_cost(case: Case) -> Cost:
    """Return what a job costs; the first of a process runs again, for what was loading in it.

    The first search for chaos of a process loads machine code of its own.
    """
    took, size, searched = run_timed(case)
    loading = 0.0
    if searched not in LOADED and took < LONG_JOB:
        LOADED.update((False, searched))
        again, size, _ = run_timed(case)
        loading, took = max(0.0, took - again), again
    return Cost(took / revolutions(case), size / (case.steps + 1), loading)


def run_timed(case: Case) -> tuple[float, int, bool]:
    """Return the seconds that a job took, its file's bytes, and whether chaos was looked for."""
    began = time.process_time()
    from compressor.solve import observe  # needs numba: only to simulate

    found, variables = observe(case)
    size = 0
    if case.output.keep == "series":
        size = len(series_file(found.table(variables), case.output)[1])
    seconds = time.process_time() - began
    return seconds, size, not math.isnan(float(found.numbers["predictability_horizon"]))
