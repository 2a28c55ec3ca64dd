"""The jobs that studies want, each once, and how those stored ended."""

from collections.abc import Container, Hashable, Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from compressor.cases import Case, Study
from compressor.outcome import Outcome
from compressor.store import Stored
from compressor.sweep.pool import Input


class JobEnd(NamedTuple):
    """How a job ended."""

    status: str
    reason: str = ""
    detail: str = ""

    @classmethod
    def of(cls, outcome: Outcome) -> "JobEnd":
        return cls(outcome.status, outcome.reason, outcome.detail)


OK_END = JobEnd("ok")


class RequestedJobs(Mapping[str, Case]):
    """Each selected job once, by key; its case is built when it is used.

    Where studies share a job, its case serves them all. A case can be changed in what is no part of
    its key. among: the keys of those that are wanted, if not all.
    """

    def __init__(self, studies: Sequence[Study], among: Container[str] | None = None):
        self.places: dict[str, tuple[Study, int]] = {}
        self.own: dict[str, Case] = {}  # of jobs that several studies share, or that were changed
        for study in studies:
            for number in study.selected:
                key = study.keys[number]
                if among is not None and key not in among:
                    continue
                if key in self.places:
                    self.own[key] = serving_both(self[key], study.cases[number])
                else:
                    self.places[key] = study, number

    def __getitem__(self, key: str) -> Case:
        if key in self.own:
            return self.own[key]
        study, number = self.places[key]
        return study.cases[number]

    def __setitem__(self, key: str, case: Case) -> None:
        self.own[key] = case

    def __iter__(self) -> Iterator[str]:
        return iter(self.places)

    def __len__(self) -> int:
        return len(self.places)

    def alike(self) -> Iterator[tuple[Case, list[str]]]:
        """Yield a case, and the keys of jobs whose `solve` and `output` are equal to its own."""
        found: dict[Hashable, list[str]] = {}
        for key, (study, number) in self.places.items():
            kind = key if key in self.own else (study.name, study.solver_of(number))
            found.setdefault(kind, []).append(key)
        for keys in found.values():
            yield self[keys[0]], keys


class PendingJobs(Sized, Iterable[Input]):
    """Some requested jobs as workers take them: a job's id is its key, its payload the case.

    Cases are built one by one, since many take much memory.
    """

    def __init__(self, wanted: RequestedJobs, keys: Sequence[str]):
        self.wanted, self.keys = wanted, keys

    def __len__(self) -> int:
        return len(self.keys)

    def __iter__(self) -> Iterator[Input]:
        return ((case.key, case, case.solve.timeout_s) for case in self.cases())

    def cases(self) -> Iterator[Case]:
        """Yield the cases of the jobs."""
        return (self.wanted[key] for key in self.keys)


def serving_both(first: Case, second: Case) -> Case:
    """Return a case with all that two cases of one key ask for beside it."""
    keeping = [case.output for case in (first, second) if case.output.keep == "series"]
    output = replace(first.output, signals=first.output.signals or second.output.signals)
    if keeping:
        precision = max("single", *(o.precision for o in keeping), key=("single", "double").index)
        compress = all(o.compress for o in keeping)
        output = replace(output, keep="series", precision=precision, compress=compress)
    solve = replace(
        first.solve,
        error_bars=first.solve.error_bars or second.solve.error_bars,
        horizon=max(first.solve.horizon, second.solve.horizon, key=(False, "auto", True).index),
        timeout_s=max(first.solve.timeout_s, second.solve.timeout_s),
    )
    return replace(first, output=output, solve=solve)


def stored_ends(store: Stored, wanted: RequestedJobs) -> dict[str, JobEnd]:
    """Return how the jobs ended that need no new run: stored ones that serve, and are intact.

    A case whose job is to be run again goes on keeping the time series that its job has, as exact
    as they are.
    """
    found: dict[str, JobEnd] = {}
    for case, keys in [*wanted.alike()]:
        places = store.rows.find(keys)
        indices = np.flatnonzero(places >= 0)
        satisfied = store.serving(places[indices], case)
        for at, position, serves in zip(
            indices.tolist(), places[indices].tolist(), satisfied.tolist(), strict=True
        ):
            key = keys[at]
            if not (serves and store.intact(position)):
                wanted[key] = store.status_at(position).with_stored_outputs(wanted[key])
            elif store.rows.bytes_of["status"][position] == b"ok":
                found[key] = OK_END
            else:
                end = store.status_at(position)
                found[key] = JobEnd(end.status, end.reason, end.detail)
    return found
