"""How many jobs of a store are done, how far to trust their numbers, and what is damaged.

Caveats are what stored numbers cannot say of themselves: motions that were not seen to repeat, or
settled after metrics began to count, clipped sensor records, cases outside the range that the
program was judged on. They come from stored values alone, so that older stores answer as far as
they have them. Studies and rows are read only, so that 100,000 jobs answer at once; of one job that
an older version has stored perhaps its file. Jobs whose row is damaged count as missing, with a
StoreWarning.

`verify` compares every file with its digest, and names the jobs that damage costs. There is no
index, so that a file that is gone is known by those that speak of it: rows of their files of time
series and of their study, studies and files of time series of their rows.
"""

import contextlib
import copy
import math
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.cases import (
    Case,
    CaseError,
    Sensor,
    outside_judged,
    paper_notes,
    points,
    stands_for,
    value_in,
)
from compressor.metrics import NUMBERS
from compressor.outcome import Regime
from compressor.store.failures import describe_failures
from compressor.store.files import Folder, StoreError, final_path, is_locked, no_results
from compressor.store.hdf5 import DamagedJob
from compressor.store.reader import places, read_store, unowned_series
from compressor.store.rows import FOREIGN_LINES, REMEDY, Cut, Rows
from compressor.store.series_file import read_dataset
from compressor.store.studies import (
    Again,
    StoredStudy,
    StudyChange,
    change_of,
    find_job,
    owners,
    read_studies,
    read_study,
    study_paths,
    swept_column,
)

if TYPE_CHECKING:
    from compressor.cases import Study

MAX_LOOKED_AT = 16  # stored jobs of a study, for what only their cases show
AUTO = "solve: {settle_rev: auto, duration_rev: auto} waits for that"
LONGER_REMEDY = "a longer run may give other numbers, or be chaotic"


def study_caveats(rows: Rows, study: StoredStudy) -> list[str]:
    """Return what to know of a study's finished jobs beside their numbers, a sentence each."""
    outside = (f"{key}: {text}" for key, text in _outside_of_study(study).items())
    return [
        *run_caveats(rows, study), *_of_paper_numbers(rows, study), *outside,
        *_of_failures(rows, study),
    ]  # fmt: skip


def _of_failures(rows: Rows, study: StoredStudy) -> list[str]:
    """Return where in a study jobs fail, a sentence a region."""
    positions = rows.find(study.keys)
    there = positions >= 0
    failed = rows.words["status"][positions[there]] == "failed"
    if not failed.any() or not study.axes:
        return []
    swept = [*points(study)]
    columns = {
        axis.key: swept_column(axis.key, [point.get(axis.key) for point in swept])[0][there]
        for axis in study.axes
    }
    return describe_failures(columns, failed)


def run_caveats(rows: Rows, study: StoredStudy) -> list[str]:
    """Return a sentence for each caveat of runs: series gone, no repetition, clipped records."""
    positions = rows.find(study.keys)
    there = positions >= 0
    there[there] = rows.words["status"][positions[there]] == "ok"
    positions = positions[there]
    if not positions.size:
        return []
    numbers, regimes = rows.course[positions], rows.words["regime"][positions]
    settle = np.array(_settle_revs(study), float)[there]
    unrepeated = is_unrepeated(regimes, numbers["settled_rev"])
    late = is_late(regimes, numbers["settled_rev"], settle)
    return [
        *_of_files(int(rows.gone[positions].sum()), positions.size),
        *_of_repetition(int(unrepeated.sum()), int(late.sum()), positions.size),
        *_of_clipping(numbers["clipped_fraction"]),
    ]


def is_unrepeated(regime: Any, settled: Any) -> Any:
    """Return whether motions were not seen to repeat; settled (rev): also where `auto` found it."""
    return (np.asarray(regime) == Regime.PREDICTABLE) & np.isnan(settled)


def is_late(regime: Any, settled: Any, settle: Any) -> Any:
    """Return whether periodic motions settled after metrics began to count, at `settle` (rev)."""
    return (np.asarray(regime) == Regime.PERIODIC) & (np.asarray(settled) > settle)


def job_caveats(numbers: Mapping[str, Any], attributes: Mapping[str, Any]) -> list[str]:
    """Return what to know of a job that is ok beside its numbers, a sentence each.

    numbers, attributes: as a row of a store has them.
    """
    regime = attributes.get("regime", "")
    settled, clipped = (
        float(numbers.get(name, math.nan)) for name in ("settled_rev", "clipped_fraction")
    )
    try:
        case = Case.from_attribute(attributes["case"])
    except (KeyError, CaseError):
        return []  # of another version of the program
    found = []
    begin = math.nan if case.solve.settle_rev == "auto" else float(case.solve.settle_rev)
    if is_unrepeated(regime, settled):
        within = "its settled revolutions"
        if case.solve.duration_rev != "auto":
            count = (case.duration - case.settle) / case.turn
            within = f"{count:.3g} settled revolution{'s' * (round(count, 9) != 1)}"
        found.append(f"the motion was not seen to repeat within {within}; {LONGER_REMEDY}; {AUTO}")
    if is_late(regime, settled, begin):
        found.append(
            f"the motion repeats from revolution {settled:g} on, and metrics count from "
            f"{begin:g} on: start-up is in them; solve.settle_rev: auto leaves it out"
        )
    if case.sensor and (text := case.sensor.report_clipping(clipped)):
        found.append(text)
    found += [f"{key}: {note}" for key, note in paper_notes(case).items()]
    return [*found, *(f"{key}: {text}" for key, text in outside_judged(case.values()).items())]


def _of_files(gone: int, jobs: int) -> Iterator[str]:
    """Yield a sentence about jobs whose time series are gone, as in a copy without them."""
    if gone:
        yield (
            f"{gone} of {jobs} jobs have metrics alone: the files of their time series are gone; "
            "bring the folder jobs, or run the case file again"
        )


def _of_repetition(unrepeated: int, late: int, jobs: int) -> Iterator[str]:
    """Yield a sentence about motions that did not repeat, and one about those that did too late."""
    word = "job" if jobs == 1 else "jobs"
    if unrepeated:
        was = "was" if unrepeated == 1 else "were"
        yield f"{unrepeated} of {jobs} {word} {was} not seen to repeat; {LONGER_REMEDY}; {AUTO}"
    if late:
        yield (
            f"{late} of {jobs} {word} settled after solve.settle_rev, with start-up in the "
            "metrics; solve.settle_rev: auto leaves it out"
        )


def _of_clipping(fractions: np.ndarray) -> Iterator[str]:
    """Yield a sentence about sensor records clipped in a thousandth of their samples or more."""
    known = fractions[~np.isnan(fractions)]
    clipped = known[known >= Sensor.REPORTED]
    if clipped.size:
        yield (
            f"{clipped.size} of {known.size} sensor records are clipped, at worst "
            f"{100 * clipped.max():.3g} % of their samples: raise sensor.range_m_per_s2"
        )


def _of_paper_numbers(rows: Rows, study: StoredStudy) -> list[str]:
    """Return a sentence about each number of the paper's at other pins, by a stored job's case.

    Of the stored jobs a few are looked at, evenly over the study: a case takes a millisecond to
    read.
    """
    positions = rows.find(study.keys)
    positions = positions[positions >= 0]
    some = np.linspace(0, positions.size - 1, min(MAX_LOOKED_AT, positions.size)).astype(int)
    for position in positions[some].tolist():
        with contextlib.suppress(KeyError, CaseError):  # of another version of the program
            case = Case.from_attribute(rows.attributes(position)["case"])
            if notes := paper_notes(case):
                return [f"{key}: {note}" for key, note in notes.items()]
    return []


def _settle_revs(study: StoredStudy) -> list[float]:
    """Return the revolution from which metrics of each job count; nan where that is `auto`."""
    fixed = value_in(study.fixed, "solve.settle_rev")
    given = (point.get("solve.settle_rev", fixed) for point in points(study))
    return [float(v) if isinstance(v, int | float) else math.nan for v in given]


def _outside_of_study(study: StoredStudy) -> dict[str, str]:
    """Return the keys of a study that leave the judged range, each with a sentence.

    Of an axis both ends are looked at.
    """
    base = copy.deepcopy(study.fixed)
    ends: list[tuple[str, Any]] = []
    for axis in study.axes:
        values = [v for v in axis.values if isinstance(v, int | float)]
        ends += [(axis.key, end) for end in ({min(values), max(values)} if values else ())]
        if axis.key == "joint":
            base["joint"] = next((v for v in axis.values if v != "none"), "none")
    found = outside_judged(base)
    for key, value in sorted(ends):
        for part in stands_for(key) or (key,):
            group, _, name = part.rpartition(".")
            if group:
                changed = {group: (base.get(group) or {}) | {name: value}}
                found |= outside_judged(base | changed)
    return found


FORMER_REMEDY = "delete it: its jobs stay stored"
ROWS_REMEDY = "bring the missing files of rows, or run their case files, which computes them again"
STUDY_REMEDY = "run its case file again, which recomputes no job"
STUDY_FILES = (
    "follow/*.nc",
    "follow/chains/*.nc",
    "wear/*.nc",
    "models/*.nc",
)  # of studies, beside jobs
STUDY_FILE_REMEDY = "delete it: the command that made it makes it again"


@dataclass(frozen=True)
class Damage:
    """A file of a store that is gone or not what was written, and the jobs that are lost with it.

    keys: of the lost jobs; studies: for each of them its swept values by study. A run of `again`
    computes them again; `remedy` is what else is to be done, or "".
    """

    path: Path
    problem: str
    keys: tuple[str, ...]
    remedy: str = ""
    studies: dict[str, dict[str, dict[str, Any]]] = field(default_factory=dict)
    again: tuple[Again, ...] = ()


def verify(
    folder: Folder, progress: Callable[[int, int], None] = lambda done, total: None
) -> list[Damage]:
    """Return all damage to a store: to segments, files of time series, studies and their files.

    Jobs that a study has and no row knows are damage, too, unless a run is at work there: they have
    not run, or their row is gone. `progress` is called with how many files of time series, of how
    many, were read. Raises StoreError for a folder that cannot be read.
    """
    busy = {place for place in places(folder) if is_locked(place)}
    stored = read_store(folder, DamagedJob)
    others = [path for pattern in STUDY_FILES for path in sorted(Path(folder).glob(pattern))]
    if not (stored.segments or stored.damaged or study_paths(folder) or others):
        raise no_results(folder)
    found: list[Damage] = []
    for path in others:
        try:
            read_dataset(path, STUDY_FILE_REMEDY)
        except StoreError as error:
            found.append(Damage(path, error.problem, (), error.remedy))
    studies: list[StoredStudy] = []
    for where, remedy in (("studies", "run its case file again"), ("former", FORMER_REMEDY)):
        for path in study_paths(folder, where):
            try:
                studies.append(read_study(path))
            except StoreError as error:
                found.append(Damage(path, error.problem, (), remedy))
    rows = Rows.of(stored.segments)
    keys = [key.decode() for key in rows.columns["key"]]
    absent = {key for study in studies for key in study.keys}.difference(keys)
    for damage in stored.damaged:
        inside = damage.possible_keys() if isinstance(damage, Cut) else set()
        lost = absent & {key.decode() for key in inside} or absent
        remedy = "" if isinstance(damage, Cut) else damage.remedy
        found.append(Damage(Path(damage.path), damage.problem, tuple(sorted(lost)), remedy))
    for position, key in enumerate(keys):
        if not rows.intact(position):
            place = rows.path(position)
            assert place is not None
            problem = "is damaged" if place.exists() else "is missing"
            found.append(Damage(place, problem, (key,)))
        progress(position + 1, len(rows))
    busy |= {place for place in places(folder) if is_locked(place)}
    found += _gone(folder, rows, studies, {key for damage in found for key in damage.keys}, busy)
    return _name_owners(found, studies)


def _gone(
    folder: Folder, rows: Rows, studies: list[StoredStudy], lost: set[str], busy: set[Path]
) -> Iterator[Damage]:
    """Yield what the files of a store show to be gone, but for jobs known to be lost.

    busy: the places that a run was at work in, whose rows may have come since they were read.
    """
    stored = {key.decode() for key in rows.columns["key"]}
    for place in (place for place in places(folder) if place not in busy):
        series = unowned_series(place, rows)
        if keys := {name[:20] for name in series} - lost:
            problem = f"no row knows the jobs of {len(series)} of its files"
            yield Damage(place / "jobs", problem, tuple(sorted(keys)), ROWS_REMEDY)
            lost = lost | keys
    for study in () if busy else studies:
        absent = {*study.keys} - stored - lost
        if absent and not study.former_of:
            problem = f"no row knows {len(absent)} of its {study.jobs} jobs: not run yet, or gone"
            path = Path(folder) / "studies" / f"{study.name}.json"
            yield Damage(path, problem, tuple(sorted(absent)))
    known = {key for study in studies for key in study.keys}
    strays = [
        at for at, key in enumerate(rows.columns["key"].tolist()) if key.decode() not in known
    ]
    strays.sort(key=rows.source.__getitem__)  # attributes are read by segment
    names = Counter(str(rows.attributes(at).get("name", "")) for at in strays)
    for name, count in sorted(names.items()):
        path = Path(folder) / "studies" / f"{name}.json"
        if name and not path.exists():
            yield Damage(
                path, f"is gone, and {count} stored jobs were run for it", (), STUDY_REMEDY
            )


def _name_owners(found: list[Damage], studies: list[StoredStudy]) -> list[Damage]:
    """Return the damage with the studies of its jobs."""
    belong = owners(studies, (key for damage in found for key in damage.keys))
    owned = []
    for damage in found:
        mine = {key: belong[key] for key in damage.keys}
        names = {name for points in mine.values() for name in points}
        present = (study for study in studies if not study.former_of)
        again = tuple(study.again for study in present if study.name in names)
        owned.append(replace(damage, studies=mine, again=again))
    return owned


@dataclass(frozen=True)
class StudyProgress:
    """How many jobs of one study are done, failed or missing, and why.

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

    @cached_property
    def case(self) -> Case:
        """Return the case of a job that was run. Raises CaseError where this version has none."""
        return Case.from_attribute(self.attributes["case"])


def standings(folder: Folder) -> list[StudyProgress]:
    """Return the progress of each study of a folder. Raises WrongName where there is none.

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
        is_ok = rows.words["status"][stored] == "ok"

        def counts(word: str, which: np.ndarray) -> dict[str, int]:
            return dict(Counter(rows.words[word][which].tolist()).most_common())

        done = stored[is_ok]
        ok, failed = int(is_ok.sum()), int((~is_ok).sum())
        missing = study.jobs - ok - failed
        found.append(
            StudyProgress(
                study.name, study.case_file, study.jobs, ok, failed, missing,
                counts("reason", stored[~is_ok]), counts("promise", done), counts("regime", done),
                study_caveats(rows, study), study.again, study.former_of, study.written,
            )
        )  # fmt: skip
    return found


def report_job(folder: Folder, *words: str) -> JobReport:
    """Return what is known of one job.

    words: the beginning of its key; or its study, and values of axes such as `clearance_mm=0.2`
    until one job is left. Raises WrongName where they name none or several, DamagedJob where its
    row holds no case.
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
    known = end.numbers
    numbers = {name: np.asarray(known[name]).tolist() for name in NUMBERS}
    attributes = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in store.rows.attributes(position).items()
    }
    if "case" not in attributes:
        segment = store.rows.segments[store.rows.source[position]]
        raise DamagedJob(segment.path, FOREIGN_LINES, REMEDY)
    file = "" if path is None else os.fspath(final_path(path))
    caveats = job_caveats(numbers, attributes) if end.status == "ok" else []
    return JobReport(
        key, end.status, end.reason, end.detail, file, mine, again, numbers, attributes, caveats
    )


def changes(folder: Folder, studies: "Sequence[Study]") -> list[StudyChange]:
    """Return what a run of studies would take out of the stored ones. Raises StoreError."""
    found = (change_of(folder, study, lambda: read_store(folder).keys()) for study in studies)
    return [change for change in found if change]
