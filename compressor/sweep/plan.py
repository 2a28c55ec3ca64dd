"""What a sweep will do, before it does it: its jobs, those done, and what the others will cost.

Counts come first, at once. Then one missing job of each study is run and timed; the others are
taken to cost as much, which is no more than a guess where jobs differ.
"""

import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from compressor.cases import Case, Study, points
from compressor.store import Folder, encode_batch, read_store
from compressor.sweep.pool import cores
from compressor.sweep.sweep import RequestedJobs, run_job
from compressor.sweep.warm_up import compile_once, compile_seconds, needed_parts
from compressor.sweep.worker import attempt

ROW_BYTES = 700  # of one job in a merged batch without time series
MAX_SAMPLED = 1_000  # missing jobs that are looked at for what is to be compiled, drawn evenly
START_SECONDS = 2.0  # of wall time until workers have loaded the equations, on an idle machine
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


def forecast(
    studies: Sequence[Study], folder: Folder, first: int
) -> tuple[Forecast, RequestedJobs]:
    """Return what `sweep` would do with the selected jobs of some studies, and what is missing.

    The forecast has no times and bytes (`add_times`), and `first` missing jobs by name. Nothing is
    stored. Raises StoreError where the folder cannot be read.
    """
    stored, wanted = read_store(folder), RequestedJobs(studies)
    done = wanted.among(stored.keys()).stored_ends(stored).keys()
    missing = wanted.among(wanted.places.keys() - done)
    ahead: list[Next] = []
    shares: list[StudyShare] = []
    for study in studies:
        jobs = len(jobs_of(study.name, wanted))
        new = jobs_of(study.name, missing)
        shares.append(StudyShare(study.name, jobs, jobs - len(new), len(new)))
        if named := {*new[: first - len(ahead)]}:
            found = zip(study.keys, points(study), strict=True)
            ahead += [Next(study.name, point, key) for key, point in found if key in named]
    counts = len(wanted), len(done), len(missing)
    return Forecast(*counts, tuple(shares), tuple(ahead)), missing


def jobs_of(name: str, jobs: RequestedJobs) -> list[str]:
    """Return the keys of jobs that count for the study of a name."""
    return [key for key, (study, _) in jobs.places.items() if study.name == name]


def add_times(
    counts: Forecast, missing: RequestedJobs, workers: int, remark: Callable[[str], None]
) -> Forecast:
    """Return a forecast with the time and bytes of missing jobs, run by so many processes.

    With the time until these have started. Each job is taken to cost as much as the middle one of
    its study. remark: called about compiling.
    """
    if not missing:
        return counts
    keys = {share.study: jobs_of(share.study, missing) for share in counts.studies}
    timed = {study: missing[mine[len(mine) // 2]] for study, mine in keys.items() if mine}
    some = random.Random(0).sample([*missing.places], min(MAX_SAMPLED, len(missing)))
    parts = needed_parts([*timed.values(), *(missing[key] for key in some)])
    compiling = compile_seconds(parts, min(workers, cores()))
    compile_once(parts, remark, workers)
    shares = []
    for share in counts.studies:
        if case := timed.get(share.study):
            seconds, size = time_job(case)
            size = size if case.output.keep == "series" else ROW_BYTES
            share = replace(share, seconds=share.missing * seconds, bytes=share.missing * size)
        shares.append(share)
    working = min(workers, counts.missing)
    return replace(
        counts,
        studies=tuple(shares),
        workers=working,
        seconds=START_SECONDS + sum(share.seconds for share in shares) / min(working, cores()),
        compiling=compiling,
        bytes=sum(share.bytes for share in shares),
    )


def time_job(case: Case) -> tuple[float, int]:
    """Return the seconds of one core that a job takes, and the bytes of its batch."""
    for _ in range(2):  # the first pays for what a process finds once, such as a bearing's map
        began = time.process_time()
        end = attempt(run_job, case)  # a job may fail by an exception, too
        if (seconds := time.process_time() - began) > LONG_JOB:
            break
    return seconds, 0 if end.reason else len(encode_batch([end.result]))
