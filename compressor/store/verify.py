"""Compare every file of a store with its digest, and name the jobs that damage costs.

There is no index, so that a file that is gone is known by those that speak of it: rows of their
files of time series and of their study, studies and files of time series of their rows.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from compressor.store.files import Folder, StoreError, is_locked
from compressor.store.folders import no_results
from compressor.store.hdf5 import DamagedJob
from compressor.store.reader import places, read_store, unowned_series
from compressor.store.rows import Rows
from compressor.store.segment import Cut
from compressor.store.series_file import read_dataset
from compressor.store.studies import Again, StoredStudy, owners, read_study, study_paths

FORMER_REMEDY = "delete it: its jobs stay stored"
# machines over values and over hours, and by choices of the model
FOLLOWED = ("regimes/*/*.nc", "wear/*.nc", "models/*.nc")
ROWS_REMEDY = "bring the missing files of rows, or run their case files, which computes them again"
STUDY_REMEDY = "run its case file again, which computes nothing anew"
FOLLOWED_REMEDY = "delete it: the command that made it makes it again"


@dataclass(frozen=True)
class LostJob:
    """A job whose result is damaged, and the studies that it belongs to, with its swept values."""

    key: str
    studies: dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Damage:
    """A file of a store that is gone or not what was written, and the jobs that are lost with it.

    A run of `again` computes the jobs anew; `remedy` is what else is to be done, or "".
    """

    path: Path
    problem: str
    keys: tuple[str, ...]
    remedy: str = ""
    jobs: tuple[LostJob, ...] = ()
    again: tuple[Again, ...] = ()


def verify(
    folder: Folder, progress: Callable[[int, int], None] = lambda done, total: None
) -> list[Damage]:
    """Return all damage to a store: to segments, files of time series, studies, chains, wear and
    choices of the model.

    Jobs that a study has and no row knows are damage, too, unless a run is at work there: they have
    not run, or their row is gone. `progress` is told how many files of time series were read, of
    how many. Raises StoreError for a folder that cannot be read.
    """
    busy = {place for place in places(folder) if is_locked(place)}
    stored = read_store(folder, DamagedJob)
    followed = [path for pattern in FOLLOWED for path in sorted(Path(folder).glob(pattern))]
    if not (stored.segments or stored.damaged or study_paths(folder) or followed):
        raise no_results(folder)
    found: list[Damage] = []
    for path in followed:
        try:
            read_dataset(path, FOLLOWED_REMEDY)
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
    return _owned(found, studies)


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


def _owned(found: list[Damage], studies: list[StoredStudy]) -> list[Damage]:
    """Return the damage with the studies of its jobs."""
    belong = owners(studies, (key for damage in found for key in damage.keys))
    owned = []
    for damage in found:
        jobs = tuple(LostJob(key, belong[key]) for key in damage.keys)
        names = {name for job in jobs for name in job.studies}
        present = (study for study in studies if not study.former_of)
        again = tuple(study.again for study in present if study.name in names)
        owned.append(replace(damage, jobs=jobs, again=again))
    return owned
