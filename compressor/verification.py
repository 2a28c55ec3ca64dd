"""Compare every file of a store with its digest, and name the jobs that damage costs."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from compressor.durable import Folder, StoreError
from compressor.hdf5 import DamagedJob
from compressor.manifest import read_study, study_paths
from compressor.segments import Cut, Rows
from compressor.store import read_store


@dataclass(frozen=True)
class Damage:
    """A file of a store that is not what was written, and the jobs that are lost with it."""

    path: Path
    problem: str
    keys: tuple[str, ...]


def verify(
    folder: Folder, progress: Callable[[int, int], None] = lambda done, total: None
) -> list[Damage]:
    """All damage to a store: to segments, files of time series and studies.

    `progress` is told how many files of time series were read, of how many. A run of the studies
    mends the damage. Raises StoreError for a folder that cannot be read.
    """
    stored = read_store(folder, DamagedJob)
    if not (stored.segments or stored.damaged or study_paths(folder)):
        raise StoreError(folder, "holds no study", "choose the folder of a sweep")
    found: list[Damage] = []
    planned: set[str] = set()
    for path in study_paths(folder):
        try:
            planned |= set(read_study(path).keys)
        except StoreError as error:
            found.append(Damage(path, error.problem, ()))
    rows = Rows.of(stored.segments)
    keys = [key.decode() for key in rows.columns["key"]]
    absent = planned.difference(keys)
    for damage in stored.damaged:
        inside = damage.possible_keys() if isinstance(damage, Cut) else set()
        lost = absent & {key.decode() for key in inside} or absent
        found.append(Damage(Path(damage.path), damage.problem, tuple(sorted(lost))))
    for position, key in enumerate(keys):
        if not rows.intact(position):
            place = rows.path(position)
            assert place is not None
            problem = "is damaged" if place.exists() else "is missing"
            found.append(Damage(place, problem, (key,)))
        progress(position + 1, len(rows))
    return found
