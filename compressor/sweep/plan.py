"""What a sweep will do, before it does it: its jobs, those done, and what the others will cost.

Counts come first, at once. Then one missing job of each study is run and timed; the others are
taken to cost as much for every revolution, which is no more than a guess where jobs differ.
"""

import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from compressor.cases import Case, Study, points
from compressor.store import Folder, encode_batch, read_store
from compressor.sweep.pool import cores
from compressor.sweep.sweep import run_job
from compressor.sweep.wanted import RequestedJobs
from compressor.sweep.warm_up import compile_once, compile_seconds, needed_parts
from compressor.sweep.worker import attempt

ROW_BYTES = 700  # of one job in a merged batch without time series
MAX_CASES = 1_000  # of the missing jobs of a study that are looked at, drawn evenly
LONG_JOB = 10.0  # s of a job that is not run twice for what loading was in it


@dataclass(frozen=True)
class Next:
    """A job that is to be run."""

    study: str
    coordinates: dict[str, Any]  # swept key -> value
    key: str


@dataclass(frozen=True)
class StudyShare:
    """One study's share; a job of several studies counts for the first of them."""

    study: str
    jobs: int
    done: int
    missing: int
    seconds: float = 0.0  # of one core, to run what is missing
    bytes: int = 0  # that it will take in the store


@dataclass(frozen=True)
class Forecast:
    """What is ahead of some studies; `seconds` are of wall time, with `workers` processes.

    `compiling`: seconds before the first job, where this machine has not compiled all that the run
    needs.
    """

    jobs: int
    done: int
    missing: int
    studies: tuple[StudyShare, ...]
    first: tuple[Next, ...]
    workers: int = 1
    seconds: float = 0.0
    compiling: int = 0
    bytes: int = 0


@dataclass(frozen=True)
class Ahead:
    """What is ahead of some studies: `counts` is a Forecast without times and bytes."""

    counts: Forecast
    missing: dict[str, list[str]]  # keys, by study
    cases: RequestedJobs

    def with_times(self, workers: int, remark: Callable[[str], None]) -> Forecast:
        """Return the whole forecast, for so many processes; `remark` is called about compiling."""
        if not self.counts.missing:
            return self.counts
        looked_at = {study: self.draw_cases(keys) for study, keys in self.missing.items()}
        parts = needed_parts(case for cases in looked_at.values() for case in cases)
        compiling = compile_seconds(parts, min(workers, cores()))
        compile_once(parts, remark, workers)
        shares = [
            self.estimate(one, looked_at[one.study]) if one.missing else one
            for one in self.counts.studies
        ]
        working = min(workers, self.counts.missing)
        return replace(
            self.counts,
            studies=tuple(shares),
            workers=working,
            seconds=sum(one.seconds for one in shares) / min(working, cores()),
            compiling=compiling,
            bytes=sum(one.bytes for one in shares),
        )

    def draw_cases(self, keys: Sequence[str]) -> list[Case]:
        """Return the cases of missing jobs, of some drawn at random where they are many."""
        few = keys if len(keys) <= MAX_CASES else random.Random(0).sample(keys, MAX_CASES)
        return [self.cases[key] for key in few]

    def estimate(self, part: StudyShare, cases: Sequence[Case]) -> StudyShare:
        """Return a study's part with what its missing jobs will take, by one of them."""
        seconds, size = time_job(timed := cases[len(cases) // 2])
        share = part.missing / len(cases)
        turns = share * sum(map(revolutions, cases))
        samples = share * sum(case.steps + 1 for case in cases if case.output.keep == "series")
        series = max(0, size - ROW_BYTES) * samples / (timed.steps + 1)
        taken = round(ROW_BYTES * part.missing + series)
        return replace(part, seconds=turns * seconds / revolutions(timed), bytes=taken)


def forecast(studies: Sequence[Study], folder: Folder, first: int) -> Ahead:
    """Return what `sweep` would do with the selected jobs of some studies, `first` of them by name.

    Nothing is stored. Raises StoreError where the folder cannot be read.
    """
    stored, wanted = read_store(folder), RequestedJobs(studies)
    done = wanted.among(stored.keys()).stored_ends(stored).keys()
    missing: dict[str, list[str]] = {}
    ahead: list[Next] = []
    parts: list[StudyShare] = []
    for study in studies:
        mine = [key for key, (owner, _) in wanted.places.items() if owner is study]
        new = missing[study.name] = [key for key in mine if key not in done]
        parts.append(StudyShare(study.name, len(mine), len(mine) - len(new), len(new)))
        if named := {*new[: first - len(ahead)]}:
            found = zip(study.keys, points(study), strict=True)
            ahead += [Next(study.name, point, key) for key, point in found if key in named]
    counts = len(wanted), len(done), len(wanted) - len(done)
    return Ahead(Forecast(*counts, tuple(parts), tuple(ahead)), missing, wanted)


def revolutions(case: Case) -> float:
    """Return how many revolutions a run of a case is, at most."""
    return case.duration / case.turn


def time_job(case: Case) -> tuple[float, int]:
    """Return the seconds of one core that a job takes, and the bytes of its batch.

    A short one runs twice, since this process may load machine code with the first.
    """
    for _ in range(2):
        began = time.process_time()
        end = attempt(run_job, case)  # a job may fail by an exception, too
        seconds = time.process_time() - began
        if seconds > LONG_JOB:
            break
    return seconds, 0 if end.reason else len(encode_batch([end.result]))
