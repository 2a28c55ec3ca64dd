"""Measure the store: rows written a second, the opening of a study, sizes of time series.

    python tests/campaigns/measure_store.py tests/results/store.json [jobs]  (make store-bench)

Rows are those of a real job under made-up keys, given to a `Writer` as a sweep would; the folder is
in the working directory, so that its disk is what is measured. The greatest wait is the time from a
row's `add` to its acknowledgement.
"""

import dataclasses
import hashlib
import itertools
import json
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from measure_accuracy import provenance

from compressor.cases.case import Case
from compressor.cases.groups import Output
from compressor.solve.simulate import measure, simulate
from compressor.store.reader import open_study, read_store
from compressor.store.series_file import read_series, series_path, write_series
from compressor.store.status import verify
from compressor.store.studies import StoredAxis, StoredStudy, encode
from compressor.store.writer import Writer

WORN = {"joint": "big_end", "clearance_mm": 0.2}
OUTPUTS = [Output(precision=p, compress=c) for p in ("double", "single") for c in (False, True)]


def key(number):
    return hashlib.sha256(str(number).encode()).hexdigest()[:20]


def write_rows(folder, jobs):
    """Seconds to write rows, and the greatest wait for an acknowledgement."""
    found = measure(Case.from_values({**WORN, "output": {"keep": "metrics"}}))
    came, waits = {}, []

    def acknowledged(keys):
        waits.extend(time.monotonic() - came.pop(k) for k in keys)

    began = time.monotonic()
    with Writer(folder) as writer:
        for number in range(jobs):
            numbers = found.numbers.copy()
            numbers["peak_acceleration"] = number
            attributes = found.attributes | {"key": key(number)}
            outcome = dataclasses.replace(found, numbers=numbers, attributes=attributes)
            came[outcome.key] = time.monotonic()
            acknowledged(writer.add(outcome))
        acknowledged(writer.flush())
    assert not came
    return time.monotonic() - began, max(waits)


def plan(folder, jobs):
    """Store the study of the rows: a grid of two axes."""
    many = 100 if jobs % 100 == 0 else 1
    axes = (
        StoredAxis("machine.speed_rpm", tuple(range(jobs // many)), "rpm"),
        StoredAxis("machine.rod_mass_kg", tuple(range(many)), "kg"),
    )
    keys = tuple(map(key, range(jobs)))
    study = StoredStudy("many", "many.yaml", axes, keys, {}, "", {}, "")
    (folder / "studies").mkdir()
    (folder / "studies" / "many.json").write_bytes(encode(study))


def timed(function, times=3):
    """Median of the seconds that a call takes, and what it gives."""
    seconds = []
    for _ in range(times):
        began = time.monotonic()
        found = function()
        seconds.append(time.monotonic() - began)
    return statistics.median(seconds), found


def rows(folder, jobs):
    """Writing, reading, opening and verifying many rows."""
    write, wait = write_rows(folder, jobs)
    plan(folder, jobs)
    read, _ = timed(lambda: read_store(folder))
    opened, study = timed(lambda: open_study(folder))
    assert (np.sort(study.peak_acceleration.values, axis=None) == np.arange(jobs)).all()
    checked, damage = timed(lambda: verify(folder), 1)
    assert not damage
    files = list(folder.glob("rows/*"))
    return {
        "jobs": jobs,
        "write_s": round(write, 2),
        "jobs_per_s": round(jobs / write),
        "greatest_wait_s": round(wait, 3),
        "segments": len(files),
        "bytes_a_job": round(sum(path.stat().st_size for path in files) / jobs),
        "read_rows_s": round(read, 3),
        "open_study_s": round(opened, 3),
        "verify_s": round(checked, 3),
    }


def series(folder):
    """Size and time of a default job's file in each form of its time series."""
    dataset = simulate(Case.from_values(WORN))
    found = []
    for output in OUTPUTS:
        write, kept = timed(lambda output=output: write_series(folder, dataset, output), 5)
        path = series_path(folder, dataset.attrs["key"], kept.digest)
        read, back = timed(lambda path=path: read_series(path), 5)
        exact, a = dataset["acceleration"].values, back["acceleration"].values
        found.append(
            {
                "precision": output.precision,
                "compress": output.compress,
                "bytes": path.stat().st_size,
                "write_ms": round(1000 * write, 1),
                "read_ms": round(1000 * read, 1),
                "acceleration_rounding": float(
                    f"{np.abs(a - exact).max() / np.abs(exact).max():.1g}"
                ),
            }
        )
    return found


def main(target, jobs=100_000):
    place = Path(tempfile.mkdtemp(prefix="store-bench-", dir="."))
    try:
        kept = {
            **provenance("make store-bench"),
            "rows": rows(place / "many", int(jobs)),
            "series": series(place / "series"),
        }
    finally:
        shutil.rmtree(place)
    Path(target).write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(kept, indent=1))


if __name__ == "__main__":
    main(*itertools.islice(sys.argv, 1, 3))
