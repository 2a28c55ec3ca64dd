"""Measure the store: rows written a second, the opening of a study, time series and their price.

    python tests/campaigns/measure_store.py tests/results/store.json [jobs]  (make store-bench)

Rows are those of a real job under made-up keys, given to a `Writer` as a sweep would; the folder is
in the working directory, so that its disk is what is measured. The greatest wait is the time from a
row's `add` to its acknowledgement.

CPU to make a file: of jobs of one layout, one after the other, with numbers and texts that change;
bytes, digest and writing, without waiting for the disk. The price of time series in a sweep: whole
commands with and without them, in turn and in both orders, each with few and with many jobs; what
the further jobs take is divided by their number.
"""

import dataclasses
import hashlib
import itertools
import json
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from compressor.store.series_file import read_series, series_path, write_series
from compressor.store.writer import Writer
from measure_accuracy import provenance

from compressor.cases.case import Case
from compressor.cases.groups import Output
from compressor.solve.simulate import measure, simulate
from compressor.store.files import pending_path, sync_later
from compressor.store.reader import open_study, read_store
from compressor.store.status import verify
from compressor.store.studies import StoredAxis, StoredStudy, encode

WORN = {"joint": "big_end", "clearance_mm": 0.2}
FILES = 60  # that are made one after the other
SELECTED = 1000  # jobs whose acceleration is read
SWEPT, TURNS = (100, 500), 4  # jobs of a sweep, few and many; how often both are run
SWEEP = """
joint: big_end
clearance_mm: {{linspace: [0.05, 0.5, {jobs}]}}
output: {{keep: {keep}}}
"""
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
        path = pending_path(series_path(folder, dataset.attrs["key"], kept.digest))
        read, back = timed(lambda path=path: read_series(path), 5)
        exact, a = dataset["acceleration"].values, back["acceleration"].values
        found.append(
            {
                "precision": output.precision,
                "compress": output.compress,
                "bytes": path.stat().st_size,
                "write_ms": round(1000 * write, 1),
                "write_cpu_ms": round(1000 * file_cpu(folder, output), 2),
                "read_ms": round(1000 * read, 1),
                "acceleration_rounding": float(
                    f"{np.abs(a - exact).max() / np.abs(exact).max():.1g}"
                ),
            }
        )
    return found


def file_cpu(folder, output):
    """Median of the CPU seconds that a job's file takes; the first one lays its kind out."""
    dataset, seconds = simulate(Case.from_values(WORN)), []
    exact = dataset["acceleration"].values.copy()
    with sync_later():
        for number in range(FILES):
            dataset["acceleration"].values[:] = exact + number
            dataset.attrs |= {"key": key(number), "settle": float(number)}
            began = time.thread_time()
            write_series(folder, dataset, output)
            seconds.append(time.thread_time() - began)
    return statistics.median(seconds)


def selection(folder):
    """Seconds to open a study with time series, to read one of them at a time, and whole."""
    dataset, case = simulate(Case.from_values(WORN)), Case.from_values(WORN)
    found = measure(case)
    with Writer(folder) as writer, sync_later():
        for number in range(SELECTED):
            attributes = dataset.attrs | {"key": key(number)}
            kept = write_series(folder, dataset.assign_attrs(attributes), case.output)
            writer.pending[key(number)] = dataclasses.replace(
                found, attributes=attributes, series=kept
            )
    plan(folder, SELECTED)
    opened, study = timed(lambda: open_study(folder))
    one, _ = timed(lambda: study["acceleration"].isel(time=-1).values)
    whole, _ = timed(lambda: study["acceleration"].values)
    return {
        "jobs": SELECTED, "open_study_s": round(opened, 3), "one_time_s": round(one, 2),
        "whole_series_s": round(whole, 2),
    }  # fmt: skip


def sweep_seconds(folder, keep, jobs):
    """Wall and CPU seconds of a sweep of so many jobs, in a folder that it leaves empty."""
    folder.mkdir()
    (folder / "case.yaml").write_text(SWEEP.format(jobs=jobs, keep=keep), encoding="utf-8")
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    command = [sys.executable, "-m", "compsim", "run", "case.yaml", "-j", "2", "--quiet"]
    subprocess.run(command, cwd=folder, env=os.environ, check=True)
    wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    shutil.rmtree(folder)
    return np.array([wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime])


def price_of_series(folder):
    """What a further job of a sweep takes, with its time series and with metrics alone."""
    few, many = SWEPT
    found = {"series": [], "metrics": []}
    sweep_seconds(folder, "series", few)  # compiled and in the disk's cache from here on
    for turn in range(TURNS):
        for keep in sorted(found, reverse=turn % 2):
            further = sweep_seconds(folder, keep, many) - sweep_seconds(folder, keep, few)
            found[keep].append(1000 * further / (many - few))
    wall, cpu = np.median(np.array(found["series"]) / found["metrics"], axis=0)
    medians = {keep: np.median(times, axis=0) for keep, times in found.items()}
    return {
        "wall_ms": {keep: round(float(wall), 2) for keep, (wall, _) in medians.items()},
        "cpu_ms": {keep: round(float(cpu), 2) for keep, (_, cpu) in medians.items()},
        "wall_ratio": round(float(wall), 2), "cpu_ratio": round(float(cpu), 2),
    }  # fmt: skip


def main(target, jobs=100_000):
    place = Path(tempfile.mkdtemp(prefix="store-bench-", dir="."))
    try:
        kept = {
            **provenance("make store-bench"),
            "rows": rows(place / "many", int(jobs)),
            "series": series(place / "series"),
            "selection": selection(place / "selection"),
            "sweep": price_of_series(place / "sweep"),
        }
    finally:
        shutil.rmtree(place)
    Path(target).write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(kept, indent=1))


if __name__ == "__main__":
    main(*itertools.islice(sys.argv, 1, 3))
