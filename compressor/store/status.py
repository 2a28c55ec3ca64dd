"""How many jobs of a store are done, how far to trust their numbers, and what is damaged.

Caveats are what stored numbers cannot say of themselves: motions that were not seen to repeat, or
settled after metrics began to count, clipped sensor records, cases outside the range that the
program was judged on. They come from stored values alone. Jobs in a damaged batch count as missing,
with a StoreWarning.

`verify` reads every file, whose values HDF5 compares with their checksums, and names the jobs that
damage costs. There is no index: jobs whose batch is gone are missing.
"""

import contextlib
import copy
import math
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

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
from compressor.store.batch import batch_paths
from compressor.store.files import Folder, StoreError, no_results, refusals
from compressor.store.netcdf import DamagedFile, check_file
from compressor.store.reader import read_store
from compressor.store.rows import Rows
from compressor.store.studies import (
    Again,
    StoredStudy,
    find_job,
    owners,
    read_studies,
    read_study,
    study_paths,
    swept_column,
)

MIN_FAILED = 3  # failed jobs, and good ones, for a tree of where jobs fail
MIN_GAIN = 0.02  # of impurity that a split must bring
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
    """Return where in a study jobs fail: a decision tree, where scikit-learn is installed."""
    positions = rows.find(study.keys)
    there = positions >= 0
    failed = rows.bytes_of["status"][positions[there]] == b"failed"
    if min(failed.sum(), (~failed).sum()) < MIN_FAILED or not study.axes:
        return []
    try:
        from sklearn.tree import DecisionTreeClassifier, export_text
    except ImportError:
        return []
    swept = [*points(study)]
    columns: dict[str, np.ndarray] = {}
    for axis in study.axes:
        values = swept_column(axis.key, [point.get(axis.key) for point in swept])[0][there]
        if values.dtype.kind == "f":
            columns[axis.key] = values
        else:  # of words a column each
            columns |= {f"{axis.key} is {word}": values == word for word in np.unique(values)}
    tree = DecisionTreeClassifier(
        max_depth=2, min_samples_leaf=MIN_FAILED, min_impurity_decrease=MIN_GAIN, random_state=0
    ).fit(np.array([*columns.values()], float).T, np.where(failed, "failed", "ok"))
    if tree.get_depth() == 0:
        return []
    text = export_text(tree, feature_names=[*columns], decimals=4, show_weights=True)
    return [f"where jobs fail (jobs of each class in weights):\n{text.rstrip()}"]


def run_caveats(rows: Rows, study: StoredStudy) -> list[str]:
    """Return a sentence for each caveat of runs: series gone, no repetition, clipped records."""
    positions = rows.find(study.keys)
    there = positions >= 0
    there[there] = rows.bytes_of["status"][positions[there]] == b"ok"
    positions = positions[there]
    if not positions.size:
        return []
    numbers = rows.numbers(positions, ("settled_rev", "clipped_fraction"))
    regimes = rows.word("regime")[positions]
    settle = np.array(_settle_revs(study), float)[there]
    unrepeated = is_unrepeated(regimes, numbers["settled_rev"])
    late = is_late(regimes, numbers["settled_rev"], settle)
    return [
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
    """Return all damage to a store: to batches, studies and the files of studies.

    `progress` is called with how many files, of how many, were read. Raises StoreError for a folder
    that cannot be read.
    """
    place = Path(os.path.abspath(folder))  # as batches have it
    with refusals(folder):
        paths, others = batch_paths(place), sorted(place.glob("**/*.nc"))
    if not (paths or others or study_paths(place)):
        raise no_results(folder)
    found: list[Damage] = []
    studies: list[StoredStudy] = []
    for path in study_paths(place):
        try:
            studies.append(read_study(path))
        except StoreError as error:
            found.append(Damage(path, error.problem, (), "run its case file again"))
    stored = read_store(place)
    rows = stored.rows
    absent = {key for study in studies for key in study.keys} - stored.keys()
    for damage in stored.damaged:  # of which even the keys cannot be read
        remedy = "" if absent else "delete it: no job needs it"
        found.append(Damage(Path(damage.path), damage.problem, tuple(sorted(absent)), remedy))
    broken = [Path(damage.path) for damage in stored.damaged]
    whole = [path for path in (*paths, *others) if path not in broken]
    for number, path in enumerate(whole):
        try:
            check_file(path)
        except FileNotFoundError:
            pass  # merged with others meanwhile
        except DamagedFile as error:
            mine = [at for at, batch in enumerate(rows.batches) if batch.path == path]
            keys = rows.keys[np.isin(rows.source, mine)].tolist()
            remedy = "" if keys else "delete it: the command that made it makes it again"
            found.append(Damage(path, error.problem, tuple(k.decode() for k in keys), remedy))
        progress(number + 1, len(whole))
    return _name_owners(found, studies)


def _name_owners(found: list[Damage], studies: list[StoredStudy]) -> list[Damage]:
    """Return the damage with the studies of its jobs."""
    belong = owners(studies, (key for damage in found for key in damage.keys))
    owned = []
    for damage in found:
        mine = {key: belong[key] for key in damage.keys}
        names = {name for points in mine.values() for name in points}
        again = tuple(study.again for study in studies if study.name in names)
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
    written: str = ""  # when it was first run (UTC)


@dataclass(frozen=True)
class JobReport:
    """What is known of one job; numbers and attributes are empty where it is missing."""

    key: str
    status: str  # ok | failed | missing
    reason: str
    detail: str
    file: str  # its batch; "" where it is missing
    samples: int  # of its time series, 0 where none are kept
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
    """Return the progress of each study of a folder. Raises WrongName where there is none."""
    studies = read_studies(folder)
    rows = read_store(folder).warned().rows
    found = []
    for study in studies:
        positions = rows.find(study.keys)
        stored = positions[positions >= 0]
        is_ok = rows.word("status")[stored] == "ok"

        def counts(word: str, which: np.ndarray) -> dict[str, int]:
            return dict(Counter(rows.word(word)[which].tolist()).most_common())

        done = stored[is_ok]
        ok, failed = int(is_ok.sum()), int((~is_ok).sum())
        missing = study.jobs - ok - failed
        found.append(
            StudyProgress(
                study.name, study.case_file, study.jobs, ok, failed, missing,
                counts("reason", stored[~is_ok]), counts("promise", done), counts("regime", done),
                study_caveats(rows, study), study.again, study.written,
            )
        )  # fmt: skip
    return found


def report_job(folder: Folder, *words: str) -> JobReport:
    """Return what is known of one job.

    words: the beginning of its key; or its study, and values of axes such as `clearance_mm=0.2`
    until one job is left. Raises WrongName where they name none or several, DamagedFile where its
    batch is damaged.
    """
    studies = read_studies(folder)
    store = read_store(folder).warned()
    key = find_job(folder, words, studies, store.keys())
    position = store.position(key)
    mine = owners(studies, [key])[key]
    again = tuple(study.again for study in studies if study.name in mine)
    if position is None:
        return JobReport(key, "missing", "", "", "", 0, mine, again, {}, {}, [])
    end = store.status_at(position)
    row = store.rows.number_row(position)
    numbers = {name: row[name].tolist() for name in NUMBERS}
    attributes = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in store.rows.attributes(position).items()
    }
    file = os.fspath(store.rows.path(position))
    caveats = job_caveats(numbers, attributes) if end.status == "ok" else []
    return JobReport(
        key,
        end.status,
        end.reason,
        end.detail,
        file,
        end.samples,
        mine,
        again,
        numbers,
        attributes,
        caveats,
    )
