"""The jobs that studies want, each once, and how those of them ended that are stored."""

from collections.abc import Container, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, overload

import numpy as np

from compressor.cases import Case, Study
from compressor.store import Stored


class End(NamedTuple):
    """How a job ended."""

    status: str
    reason: str
    detail: str


WELL = End("ok", "", "")


class Wanted(Mapping[str, Case]):
    """Each selected job once, by key; its case is built when it is asked for.

    Where studies share a job, its case serves them all. A case can be changed in what is no part of
    its key.
    """

    def __init__(self, studies: Sequence[Study], among: Container[str] | None = None):
        """among: the keys of those that are wanted, if not all."""
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
        """Yield the keys of jobs whose cases ask for the same beside their results, with one of
        them.
        """
        found: dict[Hashable, list[str]] = {}
        for key, (study, number) in self.places.items():
            kind = key if key in self.own else (study.name, study.sheet_of(number))
            found.setdefault(kind, []).append(key)
        for keys in found.values():
            yield self[keys[0]], keys


class Missing(Sequence[Case]):
    """The cases of some wanted jobs, each built when it is asked for: many take much memory."""

    def __init__(self, wanted: Wanted, keys: Sequence[str]):
        self.wanted, self.keys = wanted, keys

    def __len__(self) -> int:
        return len(self.keys)

    @overload
    def __getitem__(self, index: int) -> Case: ...
    @overload
    def __getitem__(self, index: slice) -> "Missing": ...
    def __getitem__(self, index: int | slice) -> "Case | Missing":
        if isinstance(index, slice):
            return Missing(self.wanted, self.keys[index])
        return self.wanted[self.keys[index]]


def serving_both(first: Case, second: Case) -> Case:
    """Return a case with all that two cases of one key ask for beside it."""
    keeping = [case.output for case in (first, second) if case.output.keep == "series"]
    output = first.output
    if keeping:
        precision = max("single", *(o.precision for o in keeping), key=("single", "double").index)
        compress, signals = all(o.compress for o in keeping), any(o.signals for o in keeping)
        output = replace(
            output, keep="series", precision=precision, compress=compress, signals=signals
        )
    solve = replace(
        first.solve,
        error_bars=first.solve.error_bars or second.solve.error_bars,
        horizon=max(first.solve.horizon, second.solve.horizon, key=(False, "auto", True).index),
        timeout_s=max(first.solve.timeout_s, second.solve.timeout_s),
    )
    return replace(first, output=output, solve=solve)


def stored(store: Stored, wanted: Wanted) -> dict[str, End]:
    """Return how the jobs ended that need no new run: stored ones that serve, with intact files.

    A case whose job is to be run again goes on keeping the time series that its job has, as exact
    as they are.
    """
    found: dict[str, End] = {}
    rows = store.rows
    for case, keys in [*wanted.alike()]:
        places = rows.find(keys)
        here = np.flatnonzero(places >= 0)
        serving = store.serving(places[here], case)
        for at, position, serves in zip(
            here.tolist(), places[here].tolist(), serving.tolist(), strict=True
        ):
            key = keys[at]
            if serves and rows.intact(position):
                found[key] = WELL
                if rows.columns["status"][position] != b"ok":
                    end = store.status_at(position)
                    found[key] = End(end.status, end.reason, end.detail)
            else:
                wanted[key] = store.status_at(position).kept_by(wanted[key])
    return found
