"""A sensor's record: of a stored job, or of a file that is named in its place."""

import math
import os
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.store.files import Folder, StoreError, WrongName
from compressor.store.status import report_job
from compressor.store.stored import Stored, read_store

if TYPE_CHECKING:
    from compressor.vibration import Record

NEEDS_SENSOR = "run it with body: true, sensor: true and output.keep: series"
SERIES = ("sensor_time", "sensor_acceleration", "tacho_time")


def job_record(stored: Stored, key: str) -> "Record | None":
    """Return the sensor's record of a stored job; None where it has none."""
    found = stored.values(key, SERIES)
    if set(found) != set(SERIES):
        return None
    from compressor.vibration import Record  # loads parts of SciPy

    times, values, tacho = (np.asarray(found[name], float) for name in SERIES)
    return Record(times, values, tacho, math.nan)


def find_record(name: str, folder: Folder, hints: Mapping[str, Any]) -> "tuple[str, Record]":
    """Return a record by the name of its file, or by the beginning of a stored job's key.

    With the job's key, "" of a file; hints: what a file does not say, by the names that
    `compressor.vibration.read_record` has. Raises RecordError for a file, and StoreError for a job,
    also where it is given hints.
    """
    if not re.fullmatch("[0-9a-f]{1,20}", name) or os.path.exists(name):
        from compressor.vibration import read_record

        return "", read_record(name, **hints)
    if hints:
        options = " ".join(f"--{hint.replace('_', '-')}" for hint in hints)
        problem = f"a stored job such as {name} says all of its record"
        raise WrongName(folder, problem, f"leave {options} out")
    key = report_job(folder, name).key
    record = job_record(read_store(folder), key)
    if record is None:
        raise StoreError(folder, f"job {key} has no sensor's record", NEEDS_SENSOR)
    return key, record
