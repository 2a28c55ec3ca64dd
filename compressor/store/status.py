"""What a store can be asked: how its studies stand, and what is known of one job.

Reads studies and rows only, so that 100,000 jobs answer at once; of one job that an older version
has stored perhaps its file.
Jobs whose row is damaged count as missing, with a StoreWarning.
"""

import contextlib
import math
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.metrics import NUMBERS
from compressor.store.caveats import job_caveats, study_caveats
from compressor.store.files import Folder, final_path
from compressor.store.hdf5 import DamagedJob
from compressor.store.names import find_job
from compressor.store.reader import read_store
from compressor.store.studies import Again, Change, change_of, owners, read_studies

if TYPE_CHECKING:
    from compressor.cases import Study


FORMER = "clipped_share"  # name of `clipped_fraction` in files of series


@dataclass(frozen=True)
class Standing:
    """How the jobs of one study stand.

    `reasons`: failed ones by reason; `promises`, `regimes`: those that are ok by what their
    accuracy promises, and by how far they can be foretold, "" where that is not known; each with
    the most frequent first. `caveats`: what to know beside the numbers, a sentence each.
    """

    study: str
    case_file: str
    jobs: int
    ok: int
    failed: int
    missing: int
    reasons: dict[str, int]
    promises: dict[str, int]
    regimes: dict[str, int]
    caveats: list[str]
    again: Again
    former_of: str = ""  # the study that has replaced this one; "" where none has
    written: str = ""  # when it was first run (UTC)


@dataclass(frozen=True)
class JobReport:
    """What is known of one job; numbers and attributes are empty where it is missing."""

    key: str
    status: str  # ok | failed | missing
    reason: str
    detail: str
    file: str  # with its time series; "" where none are kept
    studies: dict[str, dict[str, Any]]  # name -> swept values
    again: tuple[Again, ...]  # of the studies
    numbers: dict[str, Any]  # SI; a joint's or an axis's in lists
    attributes: dict[str, Any]
    caveats: list[str]  # of one that is ok: what to know beside its numbers, a sentence each


def standings(folder: Folder) -> list[Standing]:
    """Return how each study of a folder stands. Raises WrongName where there is none.

    Former studies come last, those that have finished jobs which the present one lacks.
    """
    studies = read_studies(folder, former=True)
    rows = read_store(folder).warned().rows
    found = []
    present = {study.name: {*study.keys} for study in studies}
    for study in studies:
        positions = rows.find(study.keys)
        stored = positions[positions >= 0]
        if study.former_of:
            more = {*study.keys}.difference(present.get(study.former_of, ()))
            if (rows.find(sorted(more)) < 0).all():
                continue
        good = rows.words["status"][stored] == "ok"

        def counts(word: str, which: np.ndarray) -> dict[str, int]:
            return dict(Counter(rows.words[word][which].tolist()).most_common())

        done = stored[good]
        ok, failed = int(good.sum()), int((~good).sum())
        missing = study.jobs - ok - failed
        found.append(
            Standing(
                study.name, study.case_file, study.jobs, ok, failed, missing,
                counts("reason", stored[~good]), counts("promise", done), counts("regime", done),
                study_caveats(rows, study), study.again, study.former_of, study.written,
            )
        )  # fmt: skip
    return found


def report_job(folder: Folder, *words: str) -> JobReport:
    """Return what is known of one job.

    words: the beginning of its key; or its study, and values of axes such as `clearance_mm=0.2`
    until one job is left. Raises WrongName where they name none or several.
    """
    studies = read_studies(folder, former=True)
    store = read_store(folder).warned()
    key = find_job(folder, words, studies, store.keys())
    position = store.position(key)
    mine = owners(studies, [key])[key]
    present = (study for study in studies if not study.former_of)  # whose case file has the job
    again = tuple(study.again for study in present if study.name in mine)
    if position is None:
        return JobReport(key, "missing", "", "", "", mine, again, {}, {}, [])
    end, path = store.status_at(position), store.rows.path(position)
    numbers = {name: np.asarray(end.numbers[name]).tolist() for name in NUMBERS}
    attributes = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in store.rows.attributes(position).items()
    }
    if path is not None and _hides_clipping(numbers, attributes):
        with contextlib.suppress(DamagedJob):
            numbers["clipped_fraction"] = float(store.values(key, [FORMER]).get(FORMER, np.nan))
    file = "" if path is None else os.fspath(final_path(path))
    caveats = job_caveats(numbers, attributes) if end.status == "ok" else []
    return JobReport(
        key, end.status, end.reason, end.detail, file, mine, again, numbers, attributes, caveats
    )


def _hides_clipping(numbers: dict[str, Any], attributes: dict[str, Any]) -> bool:
    """Return whether an older version kept how much of a sensor's record is clipped in its file
    alone.
    """
    return math.isnan(numbers["clipped_fraction"]) and '"sensor"' in attributes.get("case", "")


def changes(folder: Folder, studies: "Sequence[Study]") -> list[Change]:
    """Return what a run of studies would take out of the stored ones of their names. Raises
    StoreError.
    """
    found = (change_of(folder, study, lambda: read_store(folder).keys()) for study in studies)
    return [change for change in found if change]
