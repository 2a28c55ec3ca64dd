"""Run the chains of regimes studies that a folder does not hold yet, side by side in workers.

    RESULTS/regimes/STUDY/study.json    which chains a study has

Chains of one machine are independent of each other; within a chain each value needs the last one's
end. Where a study goes both ways, what differs is looked at again (`confirm`).
"""

import contextlib
import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from compressor.cases import MODEL_VERSION, Study, points
from compressor.program import PROGRAM, Progress
from compressor.store import Folder, StoreError, publish
from compressor.studies.regimes.chains import (
    FOLDER,
    SECONDS_BETWEEN_WRITES,
    Chain,
    ChainEnd,
    ChainTask,
    read_chain,
    run_chain,
)
from compressor.studies.regimes.confirm import ChainPair, Verdict, VerdictBook, confirm
from compressor.studies.regimes.group import Regimes
from compressor.sweep import JobLost, JobResult, Needs, run_here

LEGS = 4  # runs of a value, each with the case's own wall time at most, and some more
LOOK = 1.0  # s between two looks at how far chains have come
FILE = "study.json"


@dataclass(frozen=True)
class FollowedMachine:
    """The chains of one case of a study, by direction; `point`: its swept values."""

    study: str
    point: dict[str, Any]
    chains: tuple[Chain, ...]

    @property
    def pair(self) -> ChainPair | None:
        """Return the chains up and down, where both are followed, else None."""
        return ChainPair(*self.chains) if len(self.chains) == 2 else None


class ValueFailure(NamedTuple):
    """A failed value, or a chain that has no more of them."""

    study: str
    point: dict[str, Any]
    direction: str
    value: float
    reason: str
    detail: str


class ChainCount(NamedTuple):
    """What a study has now: chains and values in each; values that are done, and failed.

    differ, confirmed: values at which up and down differ, and second attractors among these.
    """

    study: str
    chains: int
    values: int
    done: int
    failed: int
    differ: int
    confirmed: int


@dataclass(frozen=True)
class RegimesSummary:
    """What a run did: values in all, those that were stored before, by study what there is now."""

    total: int
    done_before: int
    counts: tuple[ChainCount, ...]
    failed: tuple[ValueFailure, ...]
    seconds: float


def run_regimes(
    studies: Sequence[Study], folder: Folder, workers: int, progress: Progress, rerun: bool = False
) -> RegimesSummary:
    """Run and store what is missing of studies with `regimes`.

    rerun: chains are run again from their first failed value on. Progress counts values, and then
    second attractors. Raises StoreError and WorkersFailed; whatever ends it early, what was stored
    stays, and the same call goes on.
    """
    began = time.monotonic()
    folder = Path(folder).absolute()
    machines = [machine for study in studies for machine in machines_of(study)]
    for study in studies:
        write_manifest(folder, study)
    chains = [chain for machine in machines for chain in machine.chains]
    total = sum(len(chain.cases) for chain in chains)
    before = sum(done(chain, folder) for chain in chains)
    tasks = [ChainTask(str(folder), chain, rerun) for chain in chains]
    ends = run_chains(tasks, workers, ChainWatch(chains, folder, total, progress))
    books = confirm_doubts(machines, ends, folder, workers, progress)
    counts, failures = describe_progress(studies, machines, ends, books)
    return RegimesSummary(total, before, counts, failures, time.monotonic() - began)


def machines_of(study: Study) -> list[FollowedMachine]:
    """Return the selected machines of a study with their chains."""
    found, selected = [], {*study.selected}
    for number, point in enumerate(points(study)):
        if number in selected:
            found.append(FollowedMachine(study.name, point, chains_of(study, number)))
    return found


def chains_of(study: Study, number: int) -> tuple[Chain, ...]:
    """Return the chains of one case of a study."""
    request = study.request
    assert isinstance(request, Regimes)
    cases = study.chains[number]
    return tuple(Chain.of(study.name, request, way, cases) for way in request.directions)


def write_manifest(folder: Path, study: Study) -> None:
    """Store which chains a study has."""
    request = study.request
    assert isinstance(request, Regimes)
    every = [chains_of(study, number) for number in range(study.jobs)]
    plain = {
        "name": study.name,
        "case_file": os.path.abspath(study.path),
        "regimes": request.plain(),
        "axes": [{"key": axis.key, "values": axis.values} for axis in study.axes],
        "is_grid": study.is_grid,
        "chains": [[chain.key for chain in chains] for chains in every],
        "pairs": [ChainPair(*chains).key for chains in every if len(chains) == 2],
        "model_version": MODEL_VERSION,
        "program": PROGRAM,
    }
    if study.title:
        plain["title"] = study.title
    text = json.dumps(plain, indent=1) + "\n"
    publish(folder / FOLDER / study.name / FILE, text.encode())


def done(chain: Chain, folder: Path) -> int:
    """Return the number of stored values of a chain. Raises StoreError."""
    path = chain.path(folder)
    return read_chain(path).sizes.get("value", 0) if path.exists() else 0


class ChainWatch:
    """Reports how many values are stored, from the chains' files."""

    def __init__(self, chains: Sequence[Chain], folder: Path, total: int, progress: Progress):
        self.paths = {chain.path(folder): chain for chain in chains}
        self.folder, self.total, self.progress = folder, total, progress
        self.seen: dict[Path, float] = {}
        self.counts = dict.fromkeys(self.paths, 0)
        self.looked = 0.0
        self.look()

    def remark(self, text: str) -> None:
        """Report a remark as progress."""
        self.progress(sum(self.counts.values()), self.total, text)

    def pulse(self) -> None:
        """Look again, if the last look is more than `LOOK` seconds ago."""
        if time.monotonic() - self.looked > LOOK:
            self.look()

    def look(self) -> None:
        """Read the files that have changed."""
        for path, chain in self.paths.items():
            with contextlib.suppress(OSError):
                changed = path.stat().st_mtime
                if self.seen.get(path) != changed:
                    self.seen[path], self.counts[path] = changed, done(chain, self.folder)
        self.looked = time.monotonic()
        self.remark("")


def run_chains(
    tasks: Sequence[ChainTask], workers: int, watch: ChainWatch
) -> dict[str, ChainEnd | JobLost]:
    """Return the end of each chain, by its key; run what is missing."""
    missing = [task for task in tasks if task.rerun or not complete(task)]
    cases = [case for task in missing for case in task.chain.cases[:1]]
    jobs = [(task.chain.key, task, seconds(task.chain)) for task in missing]
    found: dict[str, ChainEnd | JobLost] = {}
    running = run_here(run_chain, jobs, Needs.of(cases), workers, watch.remark, watch.pulse)
    with contextlib.closing(running):
        for end in running:
            found[end.id] = result(end)
    if jobs:
        watch.look()
    for task in tasks:
        if task.chain.key not in found:
            stored = run_chain(ChainTask(task.folder, task.chain))  # nothing is missing
            assert isinstance(stored, ChainEnd)
            found[task.chain.key] = stored
    return found


def complete(task: ChainTask) -> bool:
    """Return whether all values of a chain are stored."""
    return done(task.chain, Path(task.folder)) == len(task.chain.cases)


def seconds(chain: Chain) -> float:
    """Return the wall time that a chain may take, s."""
    return LEGS * sum(case.solve.timeout_s for case in chain.cases)


def result(end: JobResult | JobLost) -> Any:
    """Return the result of a job, or how it was lost; raise the StoreError that it gave."""
    if isinstance(end, JobResult) and isinstance(end.result, StoreError):
        raise end.result
    return end.result if isinstance(end, JobResult) else end


def confirm_doubts(
    machines: Sequence[FollowedMachine],
    ends: dict[str, ChainEnd | JobLost],
    folder: Path,
    workers: int,
    progress: Progress,
) -> dict[str, VerdictBook]:
    """Return the verdicts of all pairs of chains, by the pair's key; what is missing is run."""
    pairs = [
        machine.pair
        for machine in machines
        if machine.pair and all(isinstance(ends[c.key], ChainEnd) for c in machine.chains)
    ]
    books = {pair.key: VerdictBook(pair, folder, SECONDS_BETWEEN_WRITES) for pair in pairs}
    doubted = [doubt for book in books.values() for doubt in book.missing]
    if not doubted:
        return books
    jobs = [
        ((doubt.pair.key, doubt.number), doubt, 12 * LEGS * doubt.case.solve.timeout_s)
        for doubt in doubted
    ]
    remark = partial(progress, 0, len(jobs))
    remark(f"{len(jobs)} values differ between up and down: running on from both")
    count, needs = 0, Needs.of(doubt.case for doubt in doubted)
    running = run_here(confirm, jobs, needs, workers, remark)
    try:
        with contextlib.closing(running):
            for end in running:
                verdict = result(end)
                key, number = end.id
                if isinstance(verdict, Verdict):
                    books[key].add(number, verdict)
                count += 1
                progress(count, len(jobs), "")
    finally:
        for book in books.values():
            if book.missing:
                book.write()
    return books


def describe_progress(
    studies: Sequence[Study],
    machines: Sequence[FollowedMachine],
    ends: dict[str, ChainEnd | JobLost],
    books: dict[str, VerdictBook],
) -> tuple[tuple[ChainCount, ...], tuple[ValueFailure, ...]]:
    """Return the counts of each study, and every failed value."""
    counts, failures = [], []
    for study in studies:
        own = [machine for machine in machines if machine.study == study.name]
        chains = [chain for machine in own for chain in machine.chains]
        bad = [failure for machine in own for failure in failed_values(machine, ends)]
        finished = [end for c in chains if isinstance(end := ends[c.key], ChainEnd)]
        pairs = [books[pair.key].count() for m in own if (pair := m.pair) and pair.key in books]
        differ, confirmed = (
            (sum(column) for column in zip(*pairs, strict=True)) if pairs else (0, 0)
        )
        values = study.request.n if study.request else 0
        complete = sum(end.values for end in finished)
        counts.append(
            ChainCount(study.name, len(chains), values, complete, len(bad), differ, confirmed)
        )
        failures += bad
    return tuple(counts), tuple(failures)


def failed_values(
    machine: FollowedMachine, ends: dict[str, ChainEnd | JobLost]
) -> Iterator[ValueFailure]:
    """Yield the failed values of a machine.

    Of a chain that was lost, its first value without a run.
    """
    for chain in machine.chains:
        end = ends[chain.key]
        where = machine.study, machine.point, chain.direction
        if isinstance(end, JobLost):
            yield ValueFailure(*where, chain.values[0], str(end.reason), end.detail)
            continue
        for value, reason, detail in end.failed:
            yield ValueFailure(*where, value, reason, detail)


class ChainProgress(NamedTuple):
    """How far a study is: its chains, the values of each, and how many are stored of all."""

    study: str
    chains: int
    values: int
    done: int


def standing(studies: Sequence[Study], folder: Folder) -> list[ChainProgress]:
    """Return the progress of the chains of studies; run nothing. Raises StoreError."""
    place: Callable[[Chain], int] = partial(done, folder=Path(folder))
    found = []
    for study in studies:
        chains = [chain for machine in machines_of(study) for chain in machine.chains]
        values = study.request.n if study.request else 0
        found.append(ChainProgress(study.name, len(chains), values, sum(map(place, chains))))
    return found
