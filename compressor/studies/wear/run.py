"""Follow the wear of machines that a folder does not hold yet, side by side in workers."""

import contextlib
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from compressor.cases import Case, Study, points
from compressor.program import CompsimError, Progress
from compressor.store import Folder, writable_folder
from compressor.studies.wear.stages import (
    Life,
    Stage,
    Worn,
    first_stage,
    life,
    next_stage,
    read_kept_stages,
    stages_dataset,
    write,
)
from compressor.sweep import JobLost, JobResult, Needs, run_here

AT_MOST = 100_000  # motions, whose wall time a machine may take


@dataclass(frozen=True)
class WornMachine:
    """How a machine of a study has worn; `point`: its swept values, `reason`: why it ended early.

    `stages`: that are stored; `life`: None where there is none.
    """

    study: str
    point: dict[str, Any]
    case: Case
    stages: int
    life: Life | None
    reason: str = ""
    detail: str = ""


@dataclass(frozen=True)
class WearSummary:
    """What a run did: machines, how many of them were complete before, and seconds."""

    machines: tuple[WornMachine, ...]
    done_before: int
    seconds: float

    @property
    def failed(self) -> list[WornMachine]:
        """Return the machines that ended early."""
        return [machine for machine in self.machines if machine.reason]


class WearTask(NamedTuple):
    """A machine to be followed in a folder of results; `rerun`: from its failed stage on."""

    folder: str
    worn: Worn
    rerun: bool = False


class WearEnd(NamedTuple):
    """How a machine's wear ended: stages, its life, and why it ended early."""

    stages: int
    life: Life | None
    reason: str
    detail: str


class NoWear(CompsimError):
    """A case that has nothing to wear."""

    exit_code = 2


def check_wear(studies: Sequence[Study]) -> None:
    """Raise NoWear unless each case wears, and is measured over whole revolutions."""
    for study in studies:
        for case in study.cases:
            if case.joint == "none":
                raise NoWear(f"{study.path}: joint: none has no bore that wears: leave none out")
            if not case.wear:
                raise NoWear(
                    f"{study.path}: has no wear: write wear: true, or keys of it (compsim schema)"
                )
            if case.solve.duration_rev == "auto":
                continue
            turns = (case.duration - case.settle) / case.turn
            if abs(turns - round(turns)) > 1e-9 or turns < 1.0 - 1e-9:
                raise NoWear(
                    f"{study.path}: solve.duration_rev: {turns:g} after settle_rev must be whole "
                    "revolutions, one at least"
                )


def run_wear(
    studies: Sequence[Study], folder: Folder, workers: int, progress: Progress, rerun: bool = False
) -> WearSummary:
    """Follow and store the wear of all cases of studies, as far as it is missing.

    rerun: machines that failed go on from their last good stage. Progress counts machines. Raises
    StoreError and WorkersFailed; whatever ends it early, what was stored stays, and the same call
    goes on.
    """
    began = time.monotonic()
    writable_folder(folder)
    listed = [
        (study.name, point, case)
        for study in studies
        for point, case in zip(points(study), study.cases, strict=True)
    ]
    tasks = {(worn := Worn(case)).key: WearTask(str(folder), worn, rerun) for _, _, case in listed}
    before = [key for key, task in tasks.items() if complete(task)]
    missing = [task for key, task in tasks.items() if key not in before]
    ends: dict[str, WearEnd | JobLost] = {}

    def remark(text: str) -> None:
        progress(len(before) + len(ends), len(tasks), text)

    remark("")
    jobs = [(t.worn.key, t, AT_MOST * t.worn.case.solve.timeout_s) for t in missing]
    needs = Needs.of(task.worn.case for task in missing)
    running = run_here(follow_wear, jobs, needs, workers, remark)
    with contextlib.closing(running):
        for end in running:
            ends[end.id] = end.result if isinstance(end, JobResult) else end
            remark("")
    ends |= {key: wear_end(tasks[key].worn, stored_stages(tasks[key])) for key in before}
    found = tuple(machine(*one, ends[Worn(one[2]).key]) for one in listed)
    return WearSummary(found, len(before), time.monotonic() - began)


def stored_stages(task: WearTask) -> list[Stage]:
    """Return the stages of a machine that are kept of an earlier run. Raises StoreError."""
    stages = read_kept_stages(task.worn, task.worn.path(task.folder))
    good = [stage for stage in stages if not stage["reason"]]
    return good if task.rerun else stages


def complete(task: WearTask) -> bool:
    """Return whether all stages of a machine are stored. Raises StoreError."""
    stages = stored_stages(task)
    return bool(stages) and task.worn.over(stages[-1])


def follow_wear(task: WearTask) -> WearEnd:
    """Follow what is missing of a machine, in a worker. Raises StoreError."""
    worn = task.worn
    stages = stored_stages(task)
    if not stages:
        stages = [first_stage(worn)]
        write(worn, task.folder, stages)
    while not worn.over(stages[-1]):
        stages.append(next_stage(worn, stages[-1]))
        write(worn, task.folder, stages)
    return wear_end(worn, stages)


def wear_end(worn: Worn, stages: list[Stage]) -> WearEnd:
    """Return the end of a machine's wear."""
    last = stages[-1]
    return WearEnd(
        len(stages), life(worn, stages_dataset(worn, stages)), last["reason"], last["detail"]
    )


def machine(study: str, point: dict[str, Any], case: Case, end: WearEnd | JobLost) -> WornMachine:
    """Return a machine of a study, and how it ended."""
    if isinstance(end, JobLost):
        return WornMachine(study, point, case, 0, None, str(end.reason), end.detail)
    return WornMachine(study, point, case, *end)
