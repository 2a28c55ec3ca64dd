"""A stored study as what records are compared with: the features of each job's record."""

import hashlib
import inspect
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from compressor.cases import PerJoint, name_worn_joint, points
from compressor.program import PROGRAM, Progress, no_progress, report_progress
from compressor.store import (
    Folder,
    Stored,
    StoredStudy,
    StoreError,
    StoreWarning,
    find_study,
    healthy_clearance,
    job_record,
    read_dataset,
    read_store,
    write_dataset,
)
from compressor.studies.diagnosis import features as table
from compressor.studies.diagnosis.features import FEATURES, features
from compressor.vibration import Record, RecordError

SIDES = ("big_end", "small_end")

IDENTIFIED_KEYS = ("joint", "clearance_mm")  # keys of what is identified; all others are cautions


@dataclass(frozen=True)
class Library:
    """The n jobs of a study that have a sensor's record.

    joints: worn ones, (n,) none, big_end, small_end or both; clearances: mm, (n, 2) of big and
    small end, 0 where there is none; features: (n, FEATURES), nan where a record does not have one;
    jobs: of the study, with those that failed or are missing; swept: values (n,) by key of other
    swept keys.
    """

    study: str
    keys: np.ndarray
    joints: np.ndarray
    clearances: np.ndarray
    features: np.ndarray
    jobs: int
    swept: dict[str, np.ndarray]

    def without(self, key: str) -> "Library":
        """Return the library without a job, since a job must not explain itself."""
        return self.only(self.keys != key)

    def only(self, mask: np.ndarray) -> "Library":
        """Return the jobs that a mask (n,) keeps."""
        swept = {name: values[mask] for name, values in self.swept.items()}
        own = {n: getattr(self, n)[mask] for n in ("keys", "joints", "clearances", "features")}
        return replace(self, swept=swept, **own)


def open_library(folder: Folder, name: str, progress: Progress = no_progress) -> Library:
    """Return the library of a stored study.

    Features are stored in `<folder>/features/<study>.nc` and computed again when jobs, the version
    or the code of features has changed. Raises StoreError where there is no such study or no
    record in it.
    """
    study, stored = find_study(folder, name), read_store(folder).warned()
    positions = {key: place for key in study.keys if (place := _place(stored, key)) is not None}
    made_of = _digest(stored, positions)
    path = Path(folder) / "features" / f"{name}.nc"
    rows = _read_features(path, made_of)
    if rows is None:
        rows = _compute_features(stored, positions, progress).assign_attrs(made_of=made_of)
        try:
            write_dataset(path, rows)
        except StoreError as error:
            warnings.warn(f"features are not kept: {error}", StoreWarning, stacklevel=2)
    if not rows.sizes["job"]:
        remedy = "run it with body: true, sensor: true and output.keep: series"
        raise StoreError(folder, f"study {name!r} has no sensor's record", remedy)
    keys, healthy = rows["key"].values.astype(str), healthy_clearance(study)
    labels = [
        name_worn_joint(joint, PerJoint(*clearances), healthy)
        for joint, clearances in zip(
            rows["joint"].values.tolist(), rows["clearance"].values.tolist(), strict=True
        )
    ]
    return Library(
        name, keys, np.array(labels, "U9"), rows["clearance"].values,
        rows["feature"].values, study.jobs, _swept(study, keys),
    )  # fmt: skip


def vector(record: Record) -> np.ndarray:
    """Return the features of a record as a row of a library, (FEATURES,). Raises RecordError."""
    found = features(record.times, record.values, record.tacho)
    return np.array([found[name] for name in FEATURES])


def _place(stored: Stored, key: str) -> int | None:
    """Return the row in a store of a job that is ok and has series, else None."""
    place = stored.position(key)
    if place is None or stored.rows.bytes_of["status"][place] != b"ok":
        return None
    return place if stored.rows.samples[place] else None


def _digest(stored: Stored, positions: dict[str, int]) -> str:
    """Return the hash of the jobs from which features are made, of their code and the version."""
    places = [*positions.values()]
    kept = zip(stored.rows.keys[places], stored.rows.bytes_of["precision"][places], strict=True)
    names = [f"{key.decode()} {precision.decode()}" for key, precision in kept]
    return hashlib.sha256(
        "\n".join([PROGRAM, inspect.getsource(table), *names]).encode()
    ).hexdigest()


def _read_features(path: Path, made_of: str) -> xr.Dataset | None:
    """Return the features that are kept, unless they are stale, damaged or absent."""
    try:
        found = read_dataset(path)
        return found if found.attrs.get("made_of") == made_of else None
    except (OSError, StoreError):
        return None


def _compute_features(stored: Stored, positions: dict[str, int], progress: Progress) -> xr.Dataset:
    """Return the features of all jobs with a record.

    Those whose record cannot be used are left out.
    """
    rows: list[tuple[str, str, list[float], np.ndarray]] = []
    unknown = 0  # jobs whose case this version cannot read
    for key, place in report_progress([*positions.items()], progress):
        record = job_record(stored, key)
        if record is None:
            continue
        case = stored.case_at(place)
        if case is None:
            unknown += 1
            continue
        clearances = [getattr(case.clearance_mm, side) for side in SIDES]
        try:
            rows.append((key, case.joint, clearances, vector(record)))
        except RecordError as error:
            warnings.warn(f"job {key} is left out: {error}", StoreWarning, stacklevel=2)
    if unknown:
        text = f"{unknown} of {len(positions)} jobs are left out: this version knows no such case"
        warnings.warn(text, StoreWarning, stacklevel=2)
    clearance = np.array([row[2] for row in rows], float).reshape(-1, len(SIDES))
    found = np.array([row[3] for row in rows], float).reshape(-1, len(FEATURES))
    return xr.Dataset(
        {
            "key": ("job", np.array([row[0] for row in rows], dtype="U20")),
            "joint": ("job", np.array([row[1] for row in rows], dtype="U9")),
            "clearance": (("job", "side"), clearance, {"units": "mm"}),
            "feature": (("job", "name"), found),
        }
    )


def _swept(study: StoredStudy, keys: np.ndarray) -> dict[str, np.ndarray]:
    """Return the values of the swept keys other than joint and clearance, by key, (n,) each."""
    own: dict[str, dict[str, Any]] = dict(zip(study.keys, points(study), strict=True))
    others = [axis.key for axis in study.axes if axis.key.partition(".")[0] not in IDENTIFIED_KEYS]
    return {name: np.array([own[key].get(name) for key in keys.tolist()]) for name in others}
