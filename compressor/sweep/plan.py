"""What a sweep will do, before it does it: its jobs, those done, and what the others will cost.

One job of each kind, the jobs of one study with the same joints, is run and timed; the others are
taken to cost the same for every revolution and sample.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from compressor.cases import Case, Study, points
from compressor.store import Folder, read_store, series_file
from compressor.sweep.sweep import stored, wanted
from compressor.sweep.warm_up import Needs, load_telling

ROW_BYTES = 341  # of one job in a file of rows, measured by `make store-bench`


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


def forecast(
    studies: Sequence[Study],
    folder: Folder,
    workers: int,
    first: int,
    remark: Callable[[str], None],
) -> Forecast:
    """What `sweep` would do with the selected jobs of some studies; nothing is stored.

    `remark` is told where compiling takes its time. Raises StoreError where the folder cannot
    be read.
    """
    cases = wanted(studies)
    ends = stored(read_store(folder), cases)
    missing = {key: case for key, case in cases.items() if key not in ends}
    parts: list[Part] = []
    ahead: list[Next] = []
    told: set[str] = set()
    if missing:
        load_telling(Needs.of(missing.values()), remark)
    for study in studies:
        jobs = []
        for job in selected(study):
            if job.key not in told:
                told.add(job.key)
                jobs.append(job)
        new = [job for job in jobs if job.key in missing]
        seconds, size = cost([missing[job.key] for job in new])
        parts.append(Part(study.name, len(jobs), len(jobs) - len(new), len(new), seconds, size))
        ahead += new
    working = max(1, min(workers, len(missing)))
    return Forecast(
        jobs=len(cases),
        done=len(cases) - len(missing),
        missing=len(missing),
        workers=working,
        seconds=sum(part.seconds for part in parts) / working,
        bytes=sum(part.bytes for part in parts),
        studies=tuple(parts),
        first=tuple(ahead[:first]),
    )


def selected(study: Study) -> Iterator[Next]:
    """The selected jobs of a study."""
    chosen = {*study.selected}
    for number, point in enumerate(points(study)):
        if number in chosen:
            yield Next(study.name, point, study.keys[number])


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
