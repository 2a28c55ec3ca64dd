"""How many jobs of a store are done, what is known of each, and what is damaged.

Jobs in a damaged batch count as missing, with a StoreWarning. `verify` reads every file, whose
values HDF5 compares with their checksums, names the jobs that damage costs, and sets their batches
aside, so that a run computes them again. There is no index: jobs whose batch is gone are missing.
"""

import contextlib
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import filterfalse
from pathlib import Path
from typing import Any

import numpy as np

from compressor.cases import Case, Study, points
from compressor.metrics import NUMBERS
from compressor.outcome import Regime
from compressor.store.batch import FOLDER as BATCHES
from compressor.store.caveats import job_caveats, study_caveats
from compressor.store.files import Folder, StoreError, refusals
from compressor.store.merge import set_aside
from compressor.store.netcdf import DamagedFile, check_file
from compressor.store.stored import read_store
from compressor.store.studies import (
    Again,
    StoredStudy,
    find_job,
    no_results,
    read_studies,
    read_study,
    study_paths,
)

Owners = dict[str, dict[str, Any]]  # name of a study -> swept values of a job in it


def find_owners(studies: Iterable[StoredStudy], keys: Iterable[str]) -> dict[str, Owners]:
    """Return the studies of each job by its key."""
    found: dict[str, Owners] = {key: {} for key in keys}
    for study in studies:
        if not found.keys().isdisjoint(study.keys):
            for key, point in zip(study.keys, points(study), strict=True):
                if key in found:
                    found[key].setdefault(study.name, point)
    return found


def list_orphans(folder: Folder, studies: Sequence[Study]) -> dict[str, list[str]]:
    """Return the stored jobs that are in no study once some studies take the place of others.

    Keys by the name of the study that loses them. Raises StoreError.
    """
    names, known = {study.name for study in studies}, list[StoredStudy]()
    for path in study_paths(folder):
        with contextlib.suppress(StoreError, FileNotFoundError):  # a damaged one has lost its own
            known.append(read_study(path))
    kept = {key for study in studies for key in study.keys}
    kept |= {key for study in known if study.name not in names for key in study.keys}
    left = {one.name: [*filterfalse(kept.__contains__, one.keys)] for one in known}
    if not any(left.values()):
        return {}
    stored = read_store(folder).keys()
    found = {name: [key for key in keys if key in stored] for name, keys in left.items()}
    return {name: keys for name, keys in found.items() if keys}


@dataclass(frozen=True)
class Damage:
    """A file of a store that is gone or not what was written, and the jobs that are lost with it.

    studies: those of each of the lost jobs by key; at_most: it cannot be known which of these the
    file had, since it cannot be opened. A run of `again` computes them again; `remedy` is what else
    is to be done, or "".
    """

    path: Path
    problem: str
    remedy: str
    studies: dict[str, Owners]
    again: tuple[Again, ...]
    at_most: bool = False


def verify(folder: Folder) -> list[Damage]:
    """Return all damage to a store: to batches, studies and the files of studies.

    Damaged batches are set aside. Raises StoreError for a folder that cannot be read.
    """
    place = Path(os.path.abspath(folder))  # as batches have it
    studies: list[StoredStudy] = []
    found: list[Damage] = []

    def note(error: StoreError, keys: Iterable[str], remedy: str, at_most: bool = False) -> None:
        """Note damage that costs some jobs, at most; remedy: where it costs none."""
        path, belong = Path(error.path), find_owners(studies, keys)
        names = {name for owners in belong.values() for name in owners}
        again = tuple(study.again for study in studies if study.name in names)
        found.append(Damage(path, error.problem, "" if belong else remedy, belong, again, at_most))
        if path.parent.name == BATCHES:
            set_aside(path)

    for path in study_paths(place):
        try:
            studies.append(read_study(path))
        except StoreError as error:
            note(error, (), "run its case file again")
    stored = read_store(place)
    paths, source, _ = stored.places
    absent = {key for study in studies for key in study.keys} - stored.keys()
    for damage in stored.damaged:  # not even their keys can be read
        note(damage, sorted(absent), "delete it: no job needs it", at_most=True)
    with refusals(place):
        others = sorted(place.glob("**/*.nc"))
    if not (studies or found or paths or others):
        raise no_results(folder)
    for number, path in enumerate([*paths, *others]):
        try:
            check_file(path)
        except FileNotFoundError:
            pass  # merged with others meanwhile
        except DamagedFile as error:
            keys = [key.decode() for key in stored.columns["job"][source == number]]
            note(error, keys, "delete it: the command that made it makes it again")
    return found


@dataclass(frozen=True)
class StudyProgress:
    """How many jobs of one study are done, failed or missing, and why.

    `reasons`: failed ones by reason; `promises`, `regimes`: those that are ok by what their
    accuracy promises, `chaotic` where it can promise nothing, and by how far they can be foretold,
    "" where that is not known; each with the most frequent first. `caveats`: what to know beside
    the numbers, a sentence each.
    """

    study: str
    jobs: int
    ok: int
    failed: int
    missing: int
    reasons: dict[str, int]
    promises: dict[str, int]
    regimes: dict[str, int]
    caveats: list[str]
    again: Again


@dataclass(frozen=True)
class JobReport:
    """What is known of one job; numbers and attributes are empty where it is missing."""

    key: str
    studies: Owners
    again: tuple[Again, ...]  # of the studies
    status: str = "missing"  # ok | failed | missing
    reason: str = ""
    detail: str = ""
    file: str = ""  # its batch
    samples: int = 0  # of its time series
    numbers: dict[str, Any] = field(default_factory=dict)  # SI; a joint's or an axis's in lists
    attributes: dict[str, Any] = field(default_factory=dict)
    caveats: list[str] = field(default_factory=list)  # of one that is ok

    @cached_property
    def case(self) -> Case:
        """Return the case of a job that was run. Raises CaseError where this version has none."""
        return Case.from_attribute(self.attributes["case"])


def standings(folder: Folder) -> list[StudyProgress]:
    """Return the progress of each study of a folder. Raises WrongName where there is none."""
    studies, stored = read_studies(folder), read_store(folder, warn=True)
    found = []
    for study in studies:
        positions = stored.find(study.keys)
        positions = positions[positions >= 0]
        is_ok = stored.columns["status"][positions] == b"ok"
        ok, failed = positions[is_ok], positions[~is_ok]

        def counts(words: np.ndarray) -> dict[str, int]:
            return dict(Counter(words.tolist()).most_common())

        promises, regimes = stored.words("promise")[ok], stored.words("regime")[ok]
        is_vain = (promises == "none") & (regimes == Regime.CHAOTIC)
        found.append(
            StudyProgress(
                study.name,
                study.jobs,
                ok.size,
                failed.size,
                study.jobs - positions.size,
                counts(stored.words("reason")[failed]),
                counts(np.where(is_vain, Regime.CHAOTIC, promises)),
                counts(regimes),
                study_caveats(stored, study),
                study.again,
            )
        )
    return found


def report_job(folder: Folder, *words: str) -> JobReport:
    """Return what is known of one job.

    words: the beginning of its key; or its study, and values of axes such as `clearance_mm=0.2`
    until one job is left. Raises WrongName where they name none or several, DamagedFile where its
    batch is damaged.
    """
    studies, stored = read_studies(folder), read_store(folder, warn=True)
    key = find_job(folder, words, studies, stored.keys())
    mine = find_owners(studies, [key])[key]
    again = tuple(study.again for study in studies if study.name in mine)
    position = stored.position(key)
    if position is None:
        return JobReport(key, mine, again)
    end, row = stored.status_at(position), stored.numbers([position])[0]
    numbers = {name: row[name].tolist() for name in NUMBERS}
    attributes = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in stored.attributes(position).items()
    }
    return JobReport(
        key,
        mine,
        again,
        end.status,
        end.reason,
        str(attributes.get("detail", "")),
        os.fspath(stored.batch_of(position)[0]),
        end.samples,
        numbers,
        attributes,
        job_caveats(stored, position) if end.status == "ok" else [],
    )
