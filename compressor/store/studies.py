"""The studies of a store: one JSON file each, with its axes and the keys of its jobs in C order."""

import argparse
import contextlib
import datetime
import json
import math
import os
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from compressor.cases import MODEL_VERSION, Study, points, row_of, table
from compressor.program import VERSION, library_versions
from compressor.store.files import KEY, Folder, StoreError, publish, refusals, system_error
from compressor.store.hdf5 import digest

if TYPE_CHECKING:
    import numpy as np

RENAMED = {"joint": "fault"}  # `joint` is a dimension of every dataset
UNIT_IN_GROUP = ("clearance_mm", "initial_offset_mm")


@dataclass(frozen=True)
class StoredAxis:
    """One swept key of a stored study, its values in the case file's unit."""

    key: str
    values: tuple[Any, ...]
    units: str  # "" for words


@dataclass(frozen=True)
class StoredStudy:
    """What a store knows of one study; `keys` are its jobs, in a grid in C order over `axes`.

    In a study that is no grid every axis is a column: a value for each job, None where it has none.
    """

    name: str
    case_file: str
    axes: tuple[StoredAxis, ...]
    keys: tuple[str, ...]
    fixed: dict[str, Any]  # values of the first case, as in a case file
    command: str
    versions: dict[str, str]
    written: str  # UTC
    is_grid: bool = True

    @property
    def jobs(self) -> int:
        return len(self.keys)

    @property
    def again(self) -> "Again":
        """What a run of the same jobs needs."""
        options = argparse.ArgumentParser(allow_abbrev=False, add_help=False)
        options.add_argument("--set", action="append", default=[])
        options.add_argument("--max-jobs", default="0")
        given, _ = options.parse_known_args(shlex.split(self.command))
        return Again(self.case_file, tuple(given.set), max(self.jobs, int(given.max_jobs)))


class Again(NamedTuple):
    """A case file, what was set in it on the command line, and the jobs that it counts, or more."""

    case_file: str
    overrides: tuple[str, ...]
    jobs: int


def swept_column(key: str, values: Sequence[Any]) -> tuple["np.ndarray", dict[str, str]]:
    """The values of a swept key as a coordinate, and its attributes.

    Numbers, nan where a job has none, have a unit; others are words, "" where there is none.
    """
    import numpy as np  # status does without

    row = row_of(key)
    attrs = {"long_name": row.phrase if row else key, "case_key": key}
    if row and row.kind in ("number", "integer") and not any(isinstance(v, str) for v in values):
        numbers = [math.nan if value is None else value for value in values]
        return np.array(numbers, float), attrs | {"units": row.unit or "1"}
    return np.array([_in_words(value) for value in values], object), attrs


def _in_words(value: Any) -> str:
    if isinstance(value, tuple | list):
        return ", ".join(map(_in_words, value))
    return "" if value is None else str(value).lower()


def coordinate_names(keys: Sequence[str]) -> dict[str, str]:
    """What swept keys are called as coordinates: their last part, where that is enough."""
    last = [key.rpartition(".")[2] for key in keys]
    return {
        key: RENAMED.get(key, short)
        if last.count(short) == 1 and key.partition(".")[0] not in UNIT_IN_GROUP
        else key.replace(".", "_")
        for key, short in zip(keys, last, strict=True)
    }


def owners(
    studies: "Iterable[StoredStudy]", keys: Iterable[str]
) -> dict[str, dict[str, dict[str, Any]]]:
    """The studies that each of some jobs belongs to, by name, with its swept values there."""
    found: dict[str, dict[str, dict[str, Any]]] = {key: {} for key in keys}
    for study in studies:
        if not found.keys().isdisjoint(study.keys):
            for key, point in zip(study.keys, points(study), strict=True):
                if key in found:
                    found[key].setdefault(study.name, point)
    return found


def write_study(folder: Folder, study: "Study", command: str = "") -> None:
    """Store which jobs a study has; a study that is stored already is left as it is."""
    axes = [StoredAxis(axis.key, tuple(axis.values), _unit(axis.key)) for axis in study.axes]
    new = StoredStudy(
        study.name,
        os.path.abspath(study.path),
        tuple(axes),
        study.keys,
        study.cases[0].values(),
        command,
        {"compsim": VERSION, "model": MODEL_VERSION}
        | library_versions("numpy", "scipy", "numba", "h5py", "xarray"),
        datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        study.is_grid,
    )
    path = Path(folder) / "studies" / f"{study.name}.json"
    with contextlib.suppress(StoreError, FileNotFoundError):
        old = read_study(path)
        same = replace(new, command=old.command, versions=old.versions, written=old.written)
        if same == old:
            return
    publish(path, encode(new))


def encode(study: StoredStudy) -> bytes:
    """The text of a study's file; its last entry is the digest of what stands before it."""
    plain = vars(study) | {"axes": [vars(axis) for axis in study.axes]}
    if study.is_grid:  # as in files that are older than other studies
        del plain["is_grid"]
    text = json.dumps(plain, indent=1)
    head = text.removesuffix("\n}").encode()
    return head + f',\n "digest": "{digest(head)}"\n}}\n'.encode()


def study_paths(folder: Folder) -> list[Path]:
    """The files of all studies of a store. Raises StoreError."""
    with refusals(folder):
        return sorted(Path(folder).glob("studies/*.json"))


def read_studies(folder: Folder) -> list[StoredStudy]:
    """All studies of a store, by name."""
    paths = study_paths(folder)
    if not paths:
        remedy = "choose the folder of a sweep, or make one: compsim run CONFIG..."
        raise StoreError(folder, "holds no study", remedy)
    return [read_study(path) for path in paths]


def read_study(path: Path) -> StoredStudy:
    """A study from its file. Raises StoreError where the file is not what was written."""
    try:
        data = path.read_bytes()
        plain = json.loads(data)
        del plain["digest"]
        axes = (StoredAxis(a["key"], _frozen(a["values"]), a["units"]) for a in plain["axes"])
        study = StoredStudy(**plain | {"axes": tuple(axes), "keys": tuple(plain["keys"])})
        sizes = [len(axis.values) for axis in study.axes]
        if study.is_grid and study.jobs != math.prod(sizes):
            raise ValueError
        if not study.is_grid and {*sizes} - {study.jobs}:
            raise ValueError
        if encode(study) != data or not _is_sound(study, path):
            raise ValueError
    except FileNotFoundError:
        raise
    except OSError as error:
        raise system_error(path, error) from error
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        problem = "is damaged, or of another version of compsim"
        raise StoreError(path, problem, "delete it and run its case file again") from error
    return study


def _is_sound(study: StoredStudy, path: Path) -> bool:
    """Whether a study's entries are of the kinds that we write, and its name that of its file."""
    swept = {key for name in table() for key in (name, name.rpartition(".")[0])}
    texts = (study.case_file, study.command, study.written, *study.versions.values())
    return (
        study.name == path.stem
        and not table()["name"].check(study.name)
        and all(isinstance(text, str) for text in (*texts, *study.versions))
        and all(KEY.fullmatch(key) for key in study.keys)
        and isinstance(study.fixed, dict)
        and len({axis.key for axis in study.axes} & swept) == len(study.axes)
        and all(axis.units.isprintable() for axis in study.axes)
        and all(_is_plain(value) for axis in study.axes for value in axis.values)
    )


def _is_plain(value: Any) -> bool:
    """Whether a value is one that a case file can sweep: a number, a word, none, or some."""
    if isinstance(value, tuple):
        return all(map(_is_plain, value))
    if isinstance(value, str):
        return value.isprintable()
    return value is None or isinstance(value, int | float)


def _frozen(values: Sequence[Any]) -> tuple[Any, ...]:
    """Values as a case holds them; JSON makes lists of tuples."""
    return tuple(_frozen(value) if isinstance(value, list) else value for value in values)


def _unit(key: str) -> str:
    """The unit of a swept key, "" for words."""
    row = row_of(key)
    return (row.unit or "1") if row and row.kind in ("number", "integer") else ""
