"""The studies of a store: one JSON file each, with its axes and the keys of its jobs in C order.

A study whose case file asks for other jobs than before is replaced. Where finished jobs are no
longer in it, the former one stays as `former/NAME~1.json`, and opens under that name; the next is
NAME~2.
"""

import argparse
import contextlib
import datetime
import json
import math
import os
import re
import shlex
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from compressor.cases import MODEL_VERSION, Study, phrase_of, points, row_of, table
from compressor.program import VERSION, library_versions
from compressor.store.files import (
    KEY,
    Folder,
    StoreError,
    StoreWarning,
    publish,
    refusals,
    system_error,
)
from compressor.store.folders import no_results
from compressor.store.hdf5 import digest

if TYPE_CHECKING:
    import numpy as np

RENAMED = {"joint": "fault"}  # `joint` is a dimension of every dataset
UNIT_IN_GROUP = ("clearance_mm", "initial_offset_mm")
FORMER = re.compile(r"(.+)~([1-9][0-9]{0,8})")  # no name of a case file has a ~


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
    def former_of(self) -> str:
        """The name of the study that has replaced this one; "" for one that is no former study."""
        named = FORMER.fullmatch(self.name)
        return named[1] if named else ""

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
    """Return the values of a swept key as a coordinate, and its attributes.

    Numbers, nan where a job has none, have a unit; others are words, "" where there is none.
    """
    import numpy as np  # status does without

    row = row_of(key)
    attrs = {"long_name": phrase_of(key), "case_key": key}
    if row and row.kind in ("number", "integer") and not any(isinstance(v, str) for v in values):
        numbers = [math.nan if value is None else value for value in values]
        return np.array(numbers, float), attrs | {"units": row.unit or "1"}
    return np.array([in_words(value) for value in values], object), attrs


def in_words(value: Any) -> str:
    """Return a swept value as it is told: 0.2, big_end, true; several with commas, "" for none."""
    if isinstance(value, tuple | list):
        return ", ".join(map(in_words, value))
    return "" if value is None else str(value).lower()


def coordinate_names(keys: Sequence[str]) -> dict[str, str]:
    """Return what swept keys are called as coordinates: their last part, where that is enough."""
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
    """Return the studies that each of some jobs belongs to, by name, with its swept values
    there.
    """
    found: dict[str, dict[str, dict[str, Any]]] = {key: {} for key in keys}
    for study in studies:
        if not found.keys().isdisjoint(study.keys):
            for key, point in zip(study.keys, points(study), strict=True):
                if key in found:
                    found[key].setdefault(study.name, point)
    return found


class Change(NamedTuple):
    """How a study takes jobs out of the stored study of its name.

    `before`, `now`: their jobs; `shared`: those in both; `finished`: stored jobs that are in the
    former one alone, which stays under the name `former`, "" where there are none; `older_model`:
    the version of the model that the former one was made by, "" where it is the present one.
    """

    study: str
    before: int  # jobs
    now: int
    shared: int
    finished: int
    former: str
    older_model: str


def change_of(folder: Folder, study: "Study", stored: Callable[[], set[str]]) -> Change | None:
    """Return what writing a study would take out of the stored one; None where nothing.

    stored: gives the keys of all stored jobs, where it is asked.
    """
    old = _present(folder, study.name)
    gone = {*old.keys}.difference(study.keys) if old else set()
    if old is None or not gone:
        return None
    finished = len(gone & stored())
    former = _former_name(folder, old) if finished else ""
    model = str(old.versions.get("model", ""))
    return Change(
        study.name, old.jobs, study.jobs, len({*old.keys}) - len(gone), finished, former,
        "" if model == MODEL_VERSION else model,
    )  # fmt: skip


def _present(folder: Folder, name: str) -> StoredStudy | None:
    """Return the stored study of a name; None where there is none, or a damaged one."""
    with contextlib.suppress(StoreError, FileNotFoundError):
        return read_study(Path(folder) / "studies" / f"{name}.json")
    return None


def _former_name(folder: Folder, old: StoredStudy) -> str:
    """Return where a study that is replaced stays: under a new name, or one that has the same
    jobs.
    """
    mine = [study for study in former_studies(folder) if study.former_of == old.name]
    for study in mine:
        if (study.axes, study.keys) == (old.axes, old.keys):
            return study.name
    numbers = [int(study.name.rpartition("~")[2]) for study in mine]
    return f"{old.name}~{max(numbers, default=0) + 1}"


def write_study(
    folder: Folder,
    study: "Study",
    command: str = "",
    stored: Callable[[], set[str]] = set,
) -> None:
    """Store which jobs a study has; a study that is stored already is left as it is.

    One that is replaced stays as a former study where finished jobs, of those that `stored` gives,
    are no longer in the new one.
    """
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
    old = _present(folder, study.name)
    if old:
        same = replace(new, command=old.command, versions=old.versions, written=old.written)
        if same == old:
            return
        change = change_of(folder, study, stored)
        if change and change.former:
            former = Path(folder) / "former" / f"{change.former}.json"
            if not former.exists():
                publish(former, encode(replace(old, name=change.former)))
    publish(Path(folder) / "studies" / f"{study.name}.json", encode(new))


def encode(study: StoredStudy) -> bytes:
    """Return the text of a study's file; its last entry is the digest of what stands before it."""
    plain = vars(study) | {"axes": [vars(axis) for axis in study.axes]}
    if study.is_grid:  # as in files that are older than other studies
        del plain["is_grid"]
    text = json.dumps(plain, indent=1)
    head = text.removesuffix("\n}").encode()
    return head + f',\n "digest": "{digest(head)}"\n}}\n'.encode()


def study_paths(folder: Folder, where: str = "studies") -> list[Path]:
    """Return the files of all studies of a store, or of the `former` ones. Raises StoreError."""
    with refusals(folder):
        return sorted(Path(folder).glob(f"{where}/*.json"))


def former_studies(folder: Folder) -> list[StoredStudy]:
    """Return the studies that others of their names have replaced, by name; damaged ones are
    told of.
    """
    found = []
    for path in study_paths(folder, "former"):
        try:
            found.append(read_study(path))
        except StoreError as error:
            text = f"{path}: {error.problem}; delete it: its jobs are stored all the same"
            warnings.warn(text, StoreWarning, stacklevel=2)
    return found


def read_studies(folder: Folder, former: bool = False) -> list[StoredStudy]:
    """Return all studies of a store, by name; with `former`, then those that others have replaced.

    Raises WrongName where there is none.
    """
    paths = study_paths(folder)
    if not paths:
        raise no_results(folder)
    return [read_study(path) for path in paths] + (former_studies(folder) if former else [])


def read_study(path: Path) -> StoredStudy:
    """Return a study from its file. Raises StoreError where the file is not what was written."""
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
        study = _in_present_words(study)
    except FileNotFoundError:
        raise
    except OSError as error:
        raise system_error(path, error) from error
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        problem = "is damaged, or of another version of compsim"
        raise StoreError(path, problem, "delete it and run its case file again") from error
    return study


def _in_present_words(study: StoredStudy) -> StoredStudy:
    """Return a study whose words are today's; of older versions a choice may have another."""
    axes = [
        replace(axis, values=tuple(map(row.choice_of, axis.values)))
        if (row := row_of(axis.key)) and row.aliases
        else axis
        for axis in study.axes
    ]
    fixed = {
        key: row.choice_of(value) if (row := row_of(key)) else value
        for key, value in study.fixed.items()
    }
    return replace(study, axes=tuple(axes), fixed=fixed)


def _is_sound(study: StoredStudy, path: Path) -> bool:
    """Return whether a study's entries are of the kinds that we write, and its name that of its
    file.
    """
    swept = {key for name in table() for key in (name, name.rpartition(".")[0])}
    texts = (study.case_file, study.command, study.written, *study.versions.values())
    return (
        study.name == path.stem
        and bool(study.former_of) == (path.parent.name == "former")
        and not table()["name"].check(study.former_of or study.name)
        and all(isinstance(text, str) for text in (*texts, *study.versions))
        and all(KEY.fullmatch(key) for key in study.keys)
        and isinstance(study.fixed, dict)
        and len({axis.key for axis in study.axes} & swept) == len(study.axes)
        and all(axis.units.isprintable() for axis in study.axes)
        and all(_is_plain(value) for axis in study.axes for value in axis.values)
    )


def _is_plain(value: Any) -> bool:
    """Return whether a value is one that a case file can sweep: a number, a word, none, or some."""
    if isinstance(value, tuple):
        return all(map(_is_plain, value))
    if isinstance(value, str):
        return value.isprintable()
    return value is None or isinstance(value, int | float)


def _frozen(values: Sequence[Any]) -> tuple[Any, ...]:
    """Return the values as a case holds them; JSON makes lists of tuples."""
    return tuple(_frozen(value) if isinstance(value, list) else value for value in values)


def _unit(key: str) -> str:
    """Return the unit of a swept key, "" for words."""
    row = row_of(key)
    return (row.unit or "1") if row and row.kind in ("number", "integer") else ""
