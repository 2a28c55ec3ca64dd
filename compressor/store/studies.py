"""The studies of a store: one JSON file each, with its axes and the keys of its jobs in C order.

A study whose case file has other jobs than before is replaced; its finished jobs stay stored.

What studies and jobs are called: the error of a wrong name has the nearest ones. A job is named by
the beginning of its key, or by its study and values of the study's axes, such as `wear
clearance_mm=0.2`.
"""

import contextlib
import datetime
import hashlib
import json
import math
import os
import shlex
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from compressor.cases import MODEL_VERSION, Axis, Study, phrase_of, points, row_of, values_given
from compressor.digits import setting
from compressor.program import VERSION, did_you_mean, library_versions
from compressor.store.files import (
    Folder,
    StoreError,
    StoreWarning,
    WrongName,
    publish,
    refusals,
    system_error,
)
from compressor.store.netcdf import DamagedFile

RENAMED = {"joint": "fault"}  # `joint` is a dimension of every dataset
DIGEST = b',\n "digest": '  # the last entry of a study, after all that it is made of
UNIT_IN_GROUP = ("clearance_mm", "initial_offset_mm")


@dataclass(frozen=True)
class StoredStudy:
    """What a store knows of one study; `keys` are its jobs, in a grid in C order over `axes`.

    In a study that is no grid every axis is a column: a value for each job, None where it has none.
    """

    name: str
    case_file: str
    axes: tuple[Axis, ...]  # values in the case file's unit
    keys: tuple[str, ...]
    fixed: dict[str, Any]  # values of the first case, as in a case file
    command: str
    versions: dict[str, str]
    written: str  # UTC
    is_grid: bool = True
    title: str = ""  # what the page of the report says of the machine
    notes: str = ""
    given: tuple[str, ...] = ()  # keys that the file gives, and does not sweep
    overrides: tuple[str, ...] = ()  # KEY=VALUE that the command line set in the file
    figures: str = ""  # whose figures the page draws of it: `paper`, or "" for its sweep
    is_curve: bool = False  # its jobs are along one key, or several that are zipped

    @property
    def jobs(self) -> int:
        return len(self.keys)

    @property
    def is_trial(self) -> bool:
        """Return whether its jobs are steps of a search, as of `compsim find`, not of a run."""
        return shlex.split(self.command)[1:2] not in ([], ["run"])

    @property
    def again(self) -> "Again":
        """Return what a run of the same jobs needs."""
        return Again(self.case_file, self.overrides, self.jobs)


class Again(NamedTuple):
    """A case file, what was set in it on the command line, and the jobs that it counts, or more."""

    case_file: str
    overrides: tuple[str, ...]
    jobs: int


def swept_column(key: str, values: Sequence[Any]) -> tuple[np.ndarray, dict[str, str]]:
    """Return the values of a swept key as a coordinate, (jobs,), and its attributes.

    Numbers, nan where a job has none, have a unit; others are words, "" where there is none.
    """
    attrs, row = {"long_name": phrase_of(key), "case_key": key}, row_of(key)
    unit = (row.unit or "1") if row and row.is_number else ""
    if unit and not any(isinstance(value, str) for value in values):
        return np.array([math.nan if v is None else v for v in values]), attrs | {"units": unit}
    return np.array([in_words(value) for value in values], "U"), attrs


def in_words(value: Any) -> str:
    """Return a swept value as case files have it: 0.2, true; several with commas, "" for none."""
    if isinstance(value, tuple | list):
        return ", ".join(map(in_words, value))
    text = "" if value is None else str(value)
    return text.lower() if isinstance(value, bool) else text


def coordinate_names(keys: Sequence[str]) -> dict[str, str]:
    """Return what swept keys are called as coordinates: without the group, where that is enough."""
    last = ["_".join(key.split(".")[1:]) or key for key in keys]
    return {
        key: RENAMED.get(key, short)
        if last.count(short) == 1 and key.partition(".")[0] not in UNIT_IN_GROUP
        else key.replace(".", "_")
        for key, short in zip(keys, last, strict=True)
    }


def write_study(
    folder: Folder, study: "Study", command: str = "", overrides: Sequence[str] = ()
) -> None:
    """Write which jobs a study has; a study that is stored already is left as it is.

    Raises StoreError where the disk refuses.
    """
    same = ("name", "axes", "keys", "is_grid", "title", "notes", "figures", "is_curve")
    new = StoredStudy(
        **{name: getattr(study, name) for name in same},
        case_file=os.path.abspath(study.path),
        fixed=study.cases[0].values(),
        command=command,
        versions={"compsim": VERSION, "model": MODEL_VERSION}
        | library_versions("numpy", "scipy", "numba", "h5py", "xarray"),
        written=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        given=tuple(dict.fromkeys(key for block in study.fixed for key in values_given(block))),
        overrides=tuple(overrides),
    )
    path = Path(folder) / "studies" / f"{study.name}.json"
    with contextlib.suppress(StoreError, FileNotFoundError):  # one that is damaged is replaced
        old = read_study(path)
        when = ("command", "overrides", "versions", "written")
        if replace(new, **{name: getattr(old, name) for name in when}) == old:
            return
    publish(path, encode(new))


def encode(study: StoredStudy) -> bytes:
    """Return the text of a study's file."""
    plain = vars(study) | {"axes": [vars(axis) for axis in study.axes]}
    return seal(json.dumps(plain, indent=1).removesuffix("\n}").encode())


def seal(head: bytes) -> bytes:
    """Return a study's file, whose last entry is the digest of what stands before it."""
    digest = hashlib.blake2b(head, digest_size=10).hexdigest()
    return head + DIGEST + f'"{digest}"\n}}\n'.encode()


def study_paths(folder: Folder) -> list[Path]:
    """Return the files of all studies of a store. Raises StoreError."""
    with refusals(Path(folder)):
        found = Path(folder).glob("studies/*.json")
        return sorted(path for path in found if path.name[0] != ".")  # as some disks add


def no_results(folder: Folder) -> WrongName:
    """Return the error about a folder that holds no study of jobs."""
    place = Path(folder)
    problem = (
        "is a file, where a folder of results is needed" if place.is_file()
        else "holds no study" if place.exists()
        else "there is no such folder of results"
    )  # fmt: skip
    return WrongName(folder, problem, "choose another folder, or make one: compsim run CONFIG...")


def read_studies(folder: Folder) -> list[StoredStudy]:
    """Return all studies of a store, by name; of damaged ones a StoreWarning is given.

    Raises WrongName where there is none, and DamagedFile where all are damaged.
    """
    paths = study_paths(folder)
    if not paths:
        raise no_results(folder)
    found: list[StoredStudy] = []
    damaged: list[DamagedFile] = []
    for path in paths:
        try:
            found.append(read_study(path))
        except DamagedFile as error:
            damaged.append(error)
    if not found:
        raise damaged[0]
    for damage in damaged:
        warnings.warn(f"left out: {damage}", StoreWarning, stacklevel=3)
    return found


def refuse_damaged(folder: Folder, name: str) -> None:
    """Raise DamagedFile where the study of a name, which `read_studies` left out, is damaged."""
    for path in study_paths(folder):
        if path.stem == name:
            read_study(path)


def read_study(path: Path) -> StoredStudy:
    """Return a study from its file. Raises DamagedFile where it is not what was written."""
    try:
        data = path.read_bytes()
        plain = json.loads(data)
        del plain["digest"]
        axes = (Axis(a["key"], _frozen(a["values"])) for a in plain["axes"])
        more = {"axes": tuple(axes), "keys": tuple(plain["keys"])}
        more |= {name: tuple(plain[name]) for name in ("given", "overrides")}
        study = StoredStudy(**plain | more)
        if seal(data.partition(DIGEST)[0]) != data or study.name != path.stem:
            raise ValueError
    except FileNotFoundError:
        raise
    except OSError as error:
        raise system_error(path, error) from error
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        problem = "is damaged, or of another version of compsim"
        raise DamagedFile(path, problem, "run its case file again") from error
    return study


def _frozen(values: Sequence[Any]) -> tuple[Any, ...]:
    """Return the values as a case holds them; JSON makes lists of tuples."""
    return tuple(_frozen(value) if isinstance(value, list) else value for value in values)


AS_PRINTED = 1e-5  # relative; values are shown to six digits


def find_study(
    folder: Folder, name: str | None = None, known: Sequence[StoredStudy] | None = None
) -> StoredStudy:
    """Return the study of a name, or the only one; known: the folder's studies, if they were read.

    Raises WrongName with the nearest name where there is none, or without a name several.
    """
    studies = {one.name: one for one in (read_studies(folder) if known is None else known)}
    if name is None and len(studies) == 1:
        return next(iter(studies.values()))
    if name is None:
        raise WrongName(folder, "holds several studies", f"name one: {list_few([*studies])}")
    if name not in studies:
        refuse_damaged(folder, name)
        holds = f"it holds {list_few([*studies]) or 'none'}"
        raise WrongName(folder, f"holds no study {name!r}", did_you_mean(name, studies) or holds)
    return studies[name]


def find_job(
    folder: Folder, words: Sequence[str], studies: Sequence[StoredStudy], stored: set[str]
) -> str:
    """Return the key of the job that words name; stored: the keys of the jobs that are stored.

    words: the beginning of a key; or a study, and `axis=value` until one job is left. Raises
    WrongName with the nearest names.
    """
    first, *values = words
    if not values and all(study.name != first for study in studies):
        return whole_key(folder, first, studies, stored)
    study = find_study(folder, first, studies)
    found = [find_value(folder, study, word) for word in values]
    wanted = dict(found)
    if len(wanted) < len(found):
        raise WrongName(folder, f"{' '.join(values)}: an axis is given twice", "give one value")
    jobs = {
        key: point
        for key, point in zip(study.keys, points(study), strict=True)
        if all(key in point and point[key] == value for key, value in wanted.items())
    }
    if len(jobs) == 1:
        return next(iter(jobs))
    conditions = " and ".join(f"{key}={in_words(value)}" for key, value in wanted.items())
    if not jobs:
        raise WrongName(folder, f"no job of {study.name} has {conditions}", _name_axes(study))
    problem = f"{study.name} is a study of {len(jobs)} jobs"
    if wanted:
        problem = f"{len(jobs)} jobs of {study.name} have {conditions}"
    left = {a.key: {point.get(a.key): 0 for point in jobs.values()} for a in study.axes}
    more = [f"{key}=… of {_name_values(some)}" for key, some in left.items() if len(some) > 1]
    raise WrongName(
        folder, problem, f"choose one by {'; '.join(more)}" if more else "give a job's key"
    )


def whole_key(
    folder: Folder, beginning: str, studies: Sequence[StoredStudy], stored: set[str]
) -> str:
    """Return the one key, of a stored or a missing job, that begins so. Raises WrongName."""
    known = sorted(stored.union(*(study.keys for study in studies)))
    matches = [key for key in known if key.startswith(beginning)]
    if len(matches) == 1:
        return matches[0]
    refuse_damaged(folder, beginning)
    if matches:
        problem = f"{len(matches)} jobs' keys begin with {beginning!r}: {list_few(matches)}"
        raise WrongName(folder, problem, "give more of the key")
    problem = f"no job's key begins with {beginning!r}, and no study is called so"
    remedy = "compsim status lists the studies, and a job is named by STUDY AXIS=VALUE, too"
    hint = did_you_mean(beginning, [study.name for study in studies])
    raise WrongName(folder, problem, hint or remedy)


def find_axis(folder: Folder, study: StoredStudy, name: str) -> Axis:
    """Return the axis of a study by its key, or the end of it. Raises WrongName."""
    short = coordinate_names([axis.key for axis in study.axes])
    found = [
        axis
        for axis in study.axes
        if name in (axis.key, short[axis.key]) or axis.key.endswith(f".{name}")
    ]
    if len(found) == 1:
        return found[0]
    problem = f"{study.name} has {len(found) or 'no'} {'axes' if found else 'axis'} {name!r}"
    hint = did_you_mean(name, [*short, *short.values()])
    raise WrongName(folder, problem, hint or _name_axes(study))


def find_value(folder: Folder, study: StoredStudy, word: str) -> tuple[str, Any]:
    """Return an axis' key and value that `axis=value` means, in any case. Raises WrongName."""
    name, equals, text = word.partition("=")
    if not equals or not text:
        raise WrongName(folder, f"{word!r} is no AXIS=VALUE of {study.name}", _name_axes(study))
    axis = find_axis(folder, study, name)
    row = row_of(axis.key)
    text = row.choice_of(text) if row else text
    words = {in_words(value): value for value in axis.values}
    meant = {one.lower(): value for one, value in words.items()} | words
    numbers = [value for value in axis.values if isinstance(value, int | float)]
    with contextlib.suppress(ValueError):
        near = min(numbers, key=lambda value: abs(value - float(text)), default=math.nan)
        if math.isclose(near, float(text), rel_tol=AS_PRINTED):
            meant.setdefault(text, near)
    for one in (text, text.lower()):
        if one in meant:
            return axis.key, meant[one]
    problem = f"no job of {study.name} has {axis.key}={text}"
    raise WrongName(folder, problem, f"there are {_name_values(axis.values)}")


def _name_axes(study: StoredStudy) -> str:
    """Return a hint at the axes of a study, by which one of its jobs is named."""
    if not study.axes:
        return "it is one job: leave the values out"
    first = f"{study.axes[0].key}={in_words(study.axes[0].values[0])}"
    return f"its axes are {list_few([axis.key for axis in study.axes])}, as in {first}"


def _name_values(values: Iterable[Any]) -> str:
    """Return a few values of an axis."""
    found = [value for value in dict.fromkeys(values) if value is not None]
    return list_few([setting(one) if isinstance(one, float) else in_words(one) for one in found])


def list_few(names: list[str]) -> str:
    """Return the first five names, and whether there are more."""
    return ", ".join(names[:5]) + (", …" if len(names) > 5 else "")
