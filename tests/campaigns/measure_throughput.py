"""Measure what a sweep costs beside its physics: starting, and 10,000 jobs without time series.

    python tests/campaigns/measure_throughput.py tests/results/throughput.json [jobs]

All times are of whole processes, medians of a few in turn. The sweep has no error bars, so that
the wall times which its jobs store are all of the kernel's work; the pure kernel runs the same
cases in one process and is doubled for two cores.
"""

import json
import math
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from measure_accuracy import provenance

from compressor.cases.load import load_studies
from compressor.solve.simulate import measure
from compressor.store.reader import read_store

ROOT = Path(__file__).parents[2]
CONFIGS = sorted(map(str, (ROOT / "configs").glob("*.yaml")))
ONE_CASE = (
    "compressor.simulate(compressor.Case.from_values({'joint': 'both', 'clearance_mm': 0.1}))"
)
COMMANDS = {
    "compsim --help": ["-m", "compsim", "--help"],
    # xarray imports dask where it finds it, as where the tests run; a plain install has none
    "first simulate in a new process": [
        "-c", f"import sys; sys.modules['dask'] = None; import compressor; {ONE_CASE}",
    ],
    "the same with the extra dask installed": ["-c", f"import compressor; {ONE_CASE}"],
    "compsim run configs/*.yaml": ["-m", "compsim", "run", *CONFIGS, "-j", "2", "--quiet"],
}  # fmt: skip
ROUNDS = 5
WORKERS = 2
SAMPLE = 100  # cases that the pure kernel runs


def wall(arguments, folder):
    """Wall time (s) of a Python process."""
    began = time.perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=folder, check=True, capture_output=True)
    return time.perf_counter() - began


def starting():
    """Median wall time (s) of each command, its caches warm."""
    times = {name: [] for name in COMMANDS}
    for number in range(ROUNDS + 1):
        for name, arguments in COMMANDS.items():
            with tempfile.TemporaryDirectory() as folder:
                seconds = wall(arguments, folder)
            if number:  # the first warms the caches
                times[name].append(seconds)
    return {name: round(statistics.median(found), 3) for name, found in times.items()}


def many(jobs):
    """A study of big-end jobs without time series, as a case file."""
    side = next(n for n in range(math.isqrt(jobs), 0, -1) if jobs % n == 0)
    return json.dumps(
        {
            "name": "many",
            "joint": "big_end",
            "clearance_mm": np.linspace(0.1, 0.3, side).tolist(),
            "machine": {"rod_mass_kg": np.linspace(3, 5, jobs // side).tolist()},
            "solve": {"error_bars": False},
            "output": {"keep": "metrics"},
        }
    )


def sweeping(jobs):
    """How the wall time of a whole `compsim run` of many jobs is spent."""
    with tempfile.TemporaryDirectory(dir=".") as folder:
        path = Path(folder, "many.yaml")
        path.write_text(many(jobs), encoding="utf-8")
        seconds = wall(["-m", "compsim", "run", "many.yaml", "-j", str(WORKERS), "--quiet"], folder)
        numbers = read_store(Path(folder, "results")).rows.numbers
        again = wall(["-m", "compsim", "run", "many.yaml", "--quiet"], folder)
        (study,) = load_studies(path)
    chosen = study.cases[:: len(study.cases) // SAMPLE]
    alone = statistics.mean(float(measure(case).numbers["seconds"]) for case in chosen)
    kernel = float(numbers["seconds"].sum())
    return {
        "jobs": len(numbers),
        "workers": WORKERS,
        "wall_s": round(seconds, 2),
        "again_s": round(again, 2),
        "jobs_per_s": round(len(numbers) / seconds, 1),
        "kernel_share": round(kernel / WORKERS / seconds, 3),
        "kernel_ms": round(1e3 * kernel / len(numbers), 3),
        "alone_jobs_per_s": round(WORKERS / alone, 1),
    }


def main(target, jobs=10_000):
    kept = {**provenance("make throughput"), "start": starting(), "sweep": sweeping(int(jobs))}
    Path(target).write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(kept, indent=1))


if __name__ == "__main__":
    main(*sys.argv[1:])
