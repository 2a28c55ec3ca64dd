"""Follow each machine of a case file along a key: each value starts from the last one's end.

    RESULTS/follow/chains/KEY.nc    the finished values of a chain, in the order of their running
    RESULTS/follow/STUDY-KEY.nc     all chains of a study over a key, as one labelled Dataset

A chain is named by a hash of all that decides its numbers. Its file is rewritten after each value
and is whole or absent; a chain that was interrupted goes on from the last value in it, and ends in
the same numbers to the bit.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor import cases, store
from compressor.cases import Case, Study
from compressor.metrics import JOINTS
from compressor.program import Progress
from compressor.studies import frame
from compressor.studies.follow import motion

FOLDER = "follow"
SCHEMA = 4  # of a row's numbers: a change of what they mean makes chains again
RUNS = 4  # of a value, each with the case's own wall time at most, and some more
# groups whose keys are not followed: of the run and its start, or of what the machine shakes
NOT_FOLLOWED = ("solve", "output", "body", "sensor", "initial_offset_mm")


@dataclass(frozen=True)
class KeyRange(frame.KeySpan):
    """The values of a key, and how they are followed.

    `both`: up and then down, each from its own start; `points`: Poincaré points of a motion that
    does not repeat itself; `exponent`: whether the largest Lyapunov exponent is looked for.
    """

    both: bool = False
    points: int = 64
    exponent: bool = True

    @property
    def ways(self) -> tuple[str, ...]:
        """Return the ways that it is followed, each a chain."""
        return ("up", "down") if self.both else ("up",)


def read_over(text: str, log: bool = False, **more: Any) -> KeyRange:
    """Return what a text KEY=LOW:HIGH:N asks for; more: other fields. Raises StudyError."""
    span = frame.read_range("--over", text, True, log)
    if span.key.partition(".")[0] in NOT_FOLLOWED:
        problem = f"{span.key} is nothing of the machine: give a key such as clearance_mm"
        raise frame.StudyError(f"--over {text}: {problem}")
    if span.count < 2:
        raise frame.StudyError(f"--over {text}: {span.count} value: give 2 at least")
    return KeyRange(**vars(span), **more)


def load_values(
    path: store.Folder, along: KeyRange, overrides: Sequence[str] = (), **how: Any
) -> Study:
    """Return the study of a case file with a job for each machine and value of the key.

    how: of `load_studies`. Raises CaseFileError, in which the values stand under --over.
    """
    form = "logspace" if along.log else "linspace"
    values = f"{along.key}={{{form}: [{along.low!r}, {along.high!r}, {along.count}]}}"
    try:
        (study,) = cases.load_studies(path, overrides=[*overrides, values], **how)
    except cases.CaseFileError as error:
        asked = f"--over {along.key}={along.low:g}:{along.high:g}:{along.count}"
        ours = f"--set {along.key}={{{form}"
        raise cases.CaseFileError([
            replace(problem, place=replace(problem.place, file=asked))
            if problem.place.file.startswith(ours) else problem
            for problem in error.problems
        ]) from error  # fmt: skip
    return study


@dataclass(frozen=True)
class Chain:
    """Cases that are run one after the other, each from the last one's end (`frame.GrowingRows`).

    `values`: of the key that is followed; `points`, `exponent`: see `KeyRange`.
    """

    cases: tuple[Case, ...]
    values: tuple[float, ...]
    points: int
    exponent: bool

    @cached_property
    def key(self) -> str:
        keys = [case.key for case in self.cases]
        return frame.hash_key([keys, [self.points, self.exponent], SCHEMA])

    def path(self, folder: store.Folder) -> Path:
        return Path(folder) / FOLDER / "chains" / f"{self.key}.nc"

    @property
    def size(self) -> int:
        return len(self.cases)

    @property
    def seconds(self) -> float:
        return RUNS * sum(case.solve.timeout_s for case in self.cases)

    def count_done(self, rows: Sequence[frame.Row]) -> int:
        return len(rows)

    def make_row(self, rows: Sequence[frame.Row]) -> frame.Row:
        """Run the next value, from the last one's end, or from its own start without one."""
        state = rows[-1]["end_state"] if rows else None
        begin = None if state is None or np.isnan(state).any() else state
        return motion.run_value(self.cases[len(rows)], begin, self.points, self.exponent)

    def to_dataset(self, rows: Sequence[frame.Row]) -> xr.Dataset:
        """Return its rows, with the dimension `value` in the order of running."""
        attrs = {"key": self.key, "case": self.cases[0].attributes()["case"]}
        found = frame.rows_dataset(rows, "value", motion.TEXTS, motion.NUMBERS)
        return found.assign_coords(value=[*self.values[: len(rows)]]).assign_attrs(attrs)


class FollowedMachine(NamedTuple):
    """One machine of a study: its swept values, and its chains by the way that they go."""

    point: dict[str, Any]
    chains: tuple[Chain, ...]


def machines(study: Study, along: KeyRange) -> list[FollowedMachine]:
    """Return the machines of the selected jobs of `load_values`. Raises StudyError."""
    selected, listed = {*study.selected}, []
    found: dict[str, tuple[dict[str, Any], list[tuple[float, Case]]]] = {}
    for number, point in enumerate(cases.points(study)):
        if number in selected:
            value = point.pop(along.key, math.nan)  # an ideal machine has no clearance
            # what does not change how the machine moves makes no other chain
            case = replace(
                study.cases[number], output=cases.Output(), wear=None, body=None, sensor=None
            )
            found.setdefault(repr(point), (point, []))[1].append((value, case))
    for point, jobs in found.values():
        if problem := objection(along, [case for _, case in jobs]):
            where = ", ".join(f"{key} {value}" for key, value in point.items())
            raise frame.StudyError(f"{study.path}: {problem}{f' ({where})' if where else ''}")
        jobs.sort(key=itemgetter(0))
        ways = ((*zip(*one, strict=True),) for one in (jobs, jobs[::-1])[: len(along.ways)])
        chains = (Chain(some, values, along.points, along.exponent) for values, some in ways)
        listed.append(FollowedMachine(point, (*chains,)))
    return listed


def objection(along: KeyRange, some: Sequence[Case]) -> str:
    """Return why a machine cannot be followed, or ""."""
    worn = {tuple(getattr(case.clearance_mm, joint) > 0 for joint in JOINTS) for case in some}
    if len(worn) > 1:
        return f"--over begins at {along.key} = {along.low:g}, where a joint is ideal: begin above"
    if not any(*worn):
        return "no joint has clearance, so that nothing is to follow: set joint and clearance_mm"
    if len(some) < 2:
        one = f"--over {along.key} has one value of this machine"
        return f"{one}: give more, or mend --only, exclude or zip"
    if some[0].key == some[-1].key:
        return f"--over {along.key} changes nothing in this machine: follow another key"
    return ""


class Followed(NamedTuple):
    """What was followed: values in all, those stored before, the Dataset and its file."""

    total: int
    done_before: int
    data: xr.Dataset
    path: Path


def follow(
    study: Study,
    along: KeyRange,
    folder: store.Folder,
    workers: int,
    progress: Progress,
    rerun: bool = False,
) -> Followed:
    """Run and store what is missing of the chains of a study, and write its Dataset.

    study: of `load_values`; rerun: chains are run again from their first failed value on. Progress
    counts values. Raises StudyError, StoreError and WorkersFailed; whatever ends it early, what
    was stored stays, and the same call goes on.
    """
    every = machines(study, along)
    store.writable_folder(folder)
    chains = [chain for machine in every for chain in machine.chains]
    before, lost = frame.run_rows(chains, folder, workers, progress, rerun)
    rows = [
        [rows_to_show(chain, folder, lost.get(chain.key)) for chain in machine.chains]
        for machine in every
    ]
    data = followed_dataset(study, along, every, rows)
    path = Path(folder) / FOLDER / f"{study.name}-{along.key}.nc"
    store.write_dataset(path, data)
    return Followed(sum(chain.size for chain in chains), before, data, path)


def rows_to_show(
    chain: Chain, folder: store.Folder, lost: tuple[str, str] | None
) -> list[frame.Row]:
    """Return the rows of a chain, at least one; lost: why it was, at the value after them."""
    rows = frame.stored_rows(chain, folder)
    blank = motion.empty_row(chain.cases[0], chain.points) | {"status": "missing"}
    if lost and len(rows) < len(chain.cases):
        reason, detail = lost
        return [*rows, blank | {"status": "failed", "reason": reason, "detail": detail}]
    return rows or [blank]


def differing(
    machine: FollowedMachine, up: Sequence[frame.Row], down: Sequence[frame.Row]
) -> set[float]:
    """Return the values at which a machine ends in different motions on its ways up and down."""
    first, last = machine.chains
    other = dict(zip(last.values, down, strict=False))
    return {
        value
        for case, value, row in zip(first.cases, first.values, up, strict=False)
        if value in other and motion.differ(case, row, other[value])
    }


def followed_dataset(
    study: Study,
    along: KeyRange,
    every: Sequence[FollowedMachine],
    rows: Sequence[list[list[frame.Row]]],
) -> xr.Dataset:
    """Return the rows of all chains as one Dataset.

    Dims: `job` (a machine), `direction` (up, down), the key by its coordinate's name, which stands
    in the attribute `over`, going up, and those of the variables (`motion.NUMBERS`). `differs`: up
    and down end differently. A value that a machine does not have is `missing`, with numbers of
    nan. rows: by machine and way.
    """
    parts = [
        [
            chain.to_dataset(its).drop_vars("end_state")
            for chain, its in zip(machine.chains, ways, strict=True)
        ]
        for machine, ways in zip(every, rows, strict=True)
    ]
    missing = dict.fromkeys(motion.TEXTS, "") | {"status": "missing"}
    data = xr.combine_nested(
        parts, ["job", "direction"], join="outer", fill_value=missing, combine_attrs="override"
    )
    data = data.sortby("value").transpose("job", "direction", "value", ...)
    values = data["value"].values.tolist()
    if along.both:
        marks = [differing(machine, *ways) for machine, ways in zip(every, rows, strict=True)]
        marked = [[int(value in mine) for value in values] for mine in marks]
        about = {"units": "1", "long_name": "1: up and down end in different motions here"}
        data["differs"] = ("job", "value"), marked, about
    keys = [*dict.fromkeys(key for machine in every for key in machine.point)]
    names = store.coordinate_names([*keys, along.key])
    swept = {key: [machine.point.get(key) for machine in every] for key in keys}
    data = data.rename(value=(over := names[along.key])).assign_coords(
        {names[key]: ("job", *store.swept_column(key, column)) for key, column in swept.items()}
        | {over: (over, *store.swept_column(along.key, values))}
    )
    data = data.assign_coords(
        direction=("direction", [*along.ways], {"long_name": "which way it is followed"}),
        joint=("joint", [*JOINTS], {"long_name": "joint of the rod"}),
        coordinate=("coordinate", [*motion.COORDINATES], {"long_name": "coordinate of a point"}),
    )
    data.attrs = {
        "study": study.name, "title": study.title, "over": over, "log": int(along.log),
    }  # fmt: skip
    return data
