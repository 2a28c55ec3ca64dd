"""Measure the store: rows written a second, the opening of a study, time series.

    python tests/campaigns/measure_store.py tests/results/store.json [jobs]  (make store-bench)

Rows are those of a real job under made-up keys, in batches as a sweep's; the folder is in the
working directory, so that its disk is what is measured. Series are of a default job.
"""

import dataclasses
import hashlib
import shutil
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
from result_pages import keep, provenance, run_campaign

from compressor.cases.case import Case
from compressor.cases.study import Axis
from compressor.store.batch import batch_paths, encode_batch, write_batch
from compressor.store.merge import merge_batches
from compressor.store.reader import open_study, read_store
from compressor.store.status import verify
from compressor.store.studies import StoredStudy, encode
from compressor.sweep.sweep import run_job

WORN = {"joint": "big_end", "clearance_mm": 0.2}
BATCH = 100  # rows in a batch, as of a sweep whose jobs take 2 ms
SELECTED = 1000  # jobs whose acceleration is read


def key(number):
    return hashlib.sha256(str(number).encode()).hexdigest()[:20]


def copies(found, numbers):
    """The outcome of a job under made-up keys; each peak acceleration is its number."""
    for number in numbers:
        row = found.numbers.copy()
        row["peak_acceleration"] = number
        yield dataclasses.replace(
            found, numbers=row, attributes=found.attributes | {"key": key(number)}
        )


def write_rows(folder, jobs):
    """Seconds to write rows, the longest that a batch takes, and seconds to merge them."""
    found = run_job(Case.from_values({**WORN, "output": {"keep": "metrics"}}))
    seconds = []
    for first in range(0, jobs, BATCH):
        batch = [*copies(found, range(first, min(first + BATCH, jobs)))]
        began = time.monotonic()
        write_batch(folder, batch)
        seconds.append(time.monotonic() - began)
    began = time.monotonic()
    merge_batches(folder)
    return sum(seconds), max(seconds), time.monotonic() - began


def plan(folder, jobs):
    """Store the study of the rows: a grid of two axes."""
    many = 100 if jobs % 100 == 0 else 1
    axes = (
        Axis("machine.speed_rpm", tuple(range(jobs // many))),
        Axis("machine.rod_mass_kg", tuple(range(many))),
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
    """Writing, merging, reading, opening and verifying many rows."""
    write, wait, merged = write_rows(folder, jobs)
    plan(folder, jobs)
    read, _ = timed(lambda: read_store(folder))
    opened, study = timed(lambda: open_study(folder))
    assert (np.sort(study.peak_acceleration.values, axis=None) == np.arange(jobs)).all()
    checked, damage = timed(lambda: verify(folder), 1)
    assert not damage
    files = batch_paths(folder)
    return {
        "jobs": jobs,
        "write_s": round(write, 2),
        "jobs_per_s": round(jobs / write),
        "greatest_wait_s": round(wait, 3),
        "merge_s": round(merged, 2),
        "batches": len(files),
        "bytes_a_job": round(sum(path.stat().st_size for path in files) / jobs),
        "read_rows_s": round(read, 3),
        "open_study_s": round(opened, 3),
        "verify_s": round(checked, 3),
    }


def series():
    """Bytes of a default job with its time series, as they are and as small as can be."""
    found = []
    for precision, compress in (("double", False), ("single", True)):
        values = {**WORN, "output": {"precision": precision, "compress": compress}}
        data = encode_batch([run_job(Case.from_values(values))])
        found.append({"precision": precision, "compress": compress, "bytes": len(data)})
    return found


def selection(folder):
    """Seconds to open a study with time series, to read one of them at a time, and whole."""
    found = run_job(Case.from_values(WORN))
    for first in range(0, SELECTED, 20):
        write_batch(folder, [*copies(found, range(first, first + 20))])
    plan(folder, SELECTED)
    opened, study = timed(lambda: open_study(folder))
    one, _ = timed(lambda: study["acceleration"].isel(time=-1).values)
    whole, _ = timed(lambda: study["acceleration"].values)
    return {
        "jobs": SELECTED, "open_study_s": round(opened, 3), "one_time_s": round(one, 2),
        "whole_series_s": round(whole, 2),
    }  # fmt: skip


def main(target, jobs=100_000):
    place = Path(tempfile.mkdtemp(prefix="store-bench-", dir="."))
    try:
        kept = {
            **provenance("make store-bench"),
            "rows": rows(place / "many", jobs),
            "series": series(),
            "selection": selection(place / "selection"),
        }
    finally:
        shutil.rmtree(place)
    keep(target, kept)


if __name__ == "__main__":
    run_campaign(main)
