"""The jobs that studies want, each once, and how those stored ended."""

from collections.abc import Container, Hashable, Iterator, Sequence
from typing import NamedTuple

from compressor.cases import Case, Study
from compressor.outcome import Outcome
from compressor.store import Stored, serving_both
from compressor.sweep.pool import Input


class JobEnd(NamedTuple):
    """How a job ended."""

    status: str
    reason: str = ""
    detail: str = ""

    @classmethod
    def of(cls, outcome: Outcome) -> "JobEnd":
        return cls(outcome.status, outcome.reason, outcome.detail)


class RequestedJobs:
    """Jobs of studies, each once, by key; a case is built when it is used, since many take much.

    Where studies share a job, its case serves them all. Iterating gives jobs as workers take them:
    key, case and the time that it may take. `own`: cases that are shared, or were changed in what
    is no part of their key.
    """

    def __init__(self, studies: Sequence[Study]):
        self.places: dict[str, tuple[Study, int]] = {}
        self.own: dict[str, Case] = {}
        for study in studies:
            for number in study.selected:
                key = study.keys[number]
                if key in self.places:
                    self.own[key] = serving_both(self[key], study.cases[number])
                else:
                    self.places[key] = study, number

    def among(self, keys: Container[str]) -> "RequestedJobs":
        """Return those jobs with some keys."""
        found = RequestedJobs(())
        found.places = {key: place for key, place in self.places.items() if key in keys}
        found.own = self.own
        return found

    def __getitem__(self, key: str) -> Case:
        if key in self.own:
            return self.own[key]
        study, number = self.places[key]
        return study.cases[number]

    def __len__(self) -> int:
        return len(self.places)

    def __iter__(self) -> Iterator[Input]:
        return ((case.key, case, case.solve.timeout_s) for case in self.cases())

    def cases(self) -> Iterator[Case]:
        """Yield the cases of the jobs."""
        return (self[key] for key in self.places)

    def stored_ends(self, stored: Stored) -> dict[str, JobEnd]:
        """Return how the jobs ended that need no new run: stored ones that serve, and are intact.

        A case whose job is to be run again goes on keeping the time series that its job has, as
        exact as they are.
        """
        found: dict[str, JobEnd] = {}
        verdicts: dict[Hashable, bool] = {}  # by what a verdict depends on
        studies = {study.name: study for study, _ in self.places.values()}
        shared = {name for name, study in studies.items() if study.is_of_one_solver}
        columns = (stored.columns[name].tolist() for name in ("status", "reason", "kept"))
        ends = [*zip(*columns, strict=True)]
        positions = stored.find([*self.places]).tolist()
        for (key, (study, _)), position in zip(self.places.items(), positions, strict=True):
            if position < 0:
                continue
            kind = study.name if study.name in shared and key not in self.own else key
            about = kind, ends[position]
            if about not in verdicts:
                verdicts[about] = stored.status_at(position).satisfies(self[key])
            if not (verdicts[about] and stored.intact(position)):
                self.own[key] = stored.status_at(position).with_stored_outputs(self[key])
            elif ends[position][0] == b"ok":
                found[key] = JobEnd("ok")
            else:
                status, reason, _ = ends[position]
                found[key] = JobEnd(status.decode(), reason.decode(), stored.detail(position))
        return found
