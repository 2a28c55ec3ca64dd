"""Measure what a sweep costs beside its physics: starting, and 10,000 jobs without time series.

    python tests/campaigns/measure_throughput.py tests/results/throughput.json [jobs] [commit]

All times are of whole processes, medians of a few in turn. The sweep has no error bars, so that
the wall times which its jobs store are all of the kernel's work; the pure kernel runs the same
cases in one process and is doubled for two cores.

Then this version and another commit are compared, by the same libraries: each measure of both in
turn, the first one first and last by turns, and the median of the ratios of neighbours.
"""

import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from result_pages import keep, provenance

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
BEFORE = "9ef7857"  # with which this version is compared: that before issue 34
MANY = 4000  # jobs from which on versions before 27 November compiled code for jobs side by side
SOLVER = """
import json
from compressor.cases import Case
from compressor.solve import measure
found = {}
for joint in ("big_end", "small_end", "both"):
    values = {"joint": joint, "clearance_mm": 0.2, "solve": {"error_bars": False}}
    case = Case.from_values(values | {"output": {"keep": "metrics"}})
    numbers = [measure(case).numbers for _ in range(60)]
    seconds, evaluations = (min(float(n[of]) for n in numbers) for of in ("seconds", "evaluations"))
    found[f"an evaluation, {joint}, ns"] = 1e9 * seconds / evaluations
print(json.dumps(found))
"""
CALLS = """
import json, time
from compressor.cases import Case
from compressor.solve.simulate import measure, simulate
found = {}
values = {"joint": "big_end", "clearance_mm": 0.2}
without = values | {"solve": {"error_bars": False}}
for name, call, case in (
    ("measure without bars, ms", measure, without | {"output": {"keep": "metrics"}}),
    ("measure with bars, ms", measure, values | {"output": {"keep": "metrics"}}),
    ("simulate without bars, ms", simulate, without),
    ("simulate with bars, ms", simulate, values),
):
    case, times = Case.from_values(case), []
    for _ in range(60):
        began = time.perf_counter()
        call(case)
        times.append(time.perf_counter() - began)
    found[name] = 1e3 * min(times[1:])
print(json.dumps(found))
"""
SWEPT = 3_000  # jobs of a sweep that is compared
PLANNED = 100_000
TURNS = 4
ROUNDS = 5
WORKERS = 2
SAMPLE = 100  # cases that the pure kernel runs


def wall(arguments, folder, tree=ROOT):
    """Wall time (s) of a Python process, with the sources of a tree."""
    began = time.perf_counter()
    said(arguments, folder, tree)
    return time.perf_counter() - began


def said(arguments, folder, tree):
    """What a Python process says, with the sources of a tree."""
    where = os.environ | {"PYTHONPATH": f"{tree}{os.pathsep}{tree / 'cmd'}"}
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, cwd=folder, check=True, capture_output=True, text=True, env=where
    ).stdout


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


def many(jobs, bars=False, joint="big_end"):
    """A study of jobs without time series, as a case file."""
    side = next(n for n in range(math.isqrt(jobs), 0, -1) if jobs % n == 0)
    return json.dumps(
        {
            "name": "many",
            "joint": joint,
            "clearance_mm": np.linspace(0.1, 0.3, side).tolist(),
            "machine": {"rod_mass_kg": np.linspace(3, 5, jobs // side).tolist()},
            "solve": {"error_bars": bars},
            "output": {"keep": "metrics"},
        }
    )


def measures(tree):
    """What is compared, measured once with the sources of a tree: by name, a number."""
    found = {}
    with tempfile.TemporaryDirectory(dir=".") as folder:
        for script in (SOLVER, CALLS):
            found |= json.loads(said(["-c", script], folder, tree))
        first = COMMANDS["first simulate in a new process"]
        found["first simulate in a new process, s"] = wall(first, folder, tree)
        for name, text, words in (
            ("plan", many(PLANNED), ["plan", "--max-jobs", str(PLANNED)]),
            ("sweep without bars", many(SWEPT), ["run", "-j", str(WORKERS), "--quiet"]),
            ("sweep with bars", many(SWEPT // 3, True), ["run", "-j", str(WORKERS), "--quiet"]),
        ):
            Path(folder, "many.yaml").write_text(text, encoding="utf-8")
            option = "-r" if tree == ROOT else "-o"  # of commits until 28 November 2026
            command = ["-m", "compsim", words[0], "many.yaml", *words[1:], option, name]
            seconds = wall(command, folder, tree)
            if name == "plan":
                found[f"plan of {PLANNED:,} jobs, s"] = seconds
            else:
                jobs = len(read_store(Path(folder, name)).rows)
                found[f"{name}, ms a job"] = 1e3 * seconds / jobs
    return found


def compared(commit):
    """This version and another commit: the median of each measure, and of the ratios in turn."""
    with tempfile.TemporaryDirectory() as folder:
        other = Path(folder, "other")
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--detach", str(other), commit], check=True)
        try:
            for tree in (ROOT, other):  # compiled before anything counts
                said(["-c", SOLVER], folder, tree)
                said(["-c", CALLS], folder, tree)
                Path(folder, "many.yaml").write_text(many(MANY), encoding="utf-8")
                # each into a folder of its own, or the second finds all jobs stored
                place = ("-r", "now") if tree == ROOT else ("-o", "then")
                first = ["run", "many.yaml", "--quiet", *place]
                said(["-m", "compsim", *first], folder, tree)
            pairs = []
            for turn in range(TURNS):
                trees = (ROOT, other) if turn % 2 else (other, ROOT)
                found = {tree: measures(tree) for tree in trees}
                pairs.append((found[ROOT], found[other]))
        finally:
            subprocess.run([*git, "remove", "--force", str(other)], check=True)
    median = statistics.median
    return {
        name: {
            "now": median(now[name] for now, _ in pairs),
            "before": median(before[name] for _, before in pairs),
            "times as fast": median(before[name] / now[name] for now, before in pairs),
        }
        for name in pairs[0][0]
    }


def sweeping(jobs):
    """How the wall time of a whole `compsim run` of many jobs is spent."""
    with tempfile.TemporaryDirectory(dir=".") as folder:
        path = Path(folder, "many.yaml")
        path.write_text(many(jobs), encoding="utf-8")
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = wall(["-m", "compsim", "run", "many.yaml", "-j", str(WORKERS), "--quiet"], folder)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        busy = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        stored = read_store(Path(folder, "results"))
        numbers = stored.numbers(np.arange(len(stored)), ["seconds"])["seconds"]
        again = wall(["-m", "compsim", "run", "many.yaml", "--quiet"], folder)
        (study,) = load_studies(path)
    chosen = study.cases[:: len(study.cases) // SAMPLE]
    alone = statistics.mean(float(measure(case).numbers["seconds"]) for case in chosen)
    kernel = float(numbers.sum())
    return {
        "jobs": len(numbers),
        "workers": WORKERS,
        "wall_s": round(seconds, 2),
        "again_s": round(again, 2),
        "jobs_per_s": round(len(numbers) / seconds, 1),
        "kernel_share": round(kernel / WORKERS / seconds, 3),
        "kernel_ms": round(1e3 * kernel / len(numbers), 3),
        "other_share": round((busy - kernel) / WORKERS / seconds, 3),
        "idle_share": round(1 - busy / WORKERS / seconds, 3),
        "alone_jobs_per_s": round(WORKERS / alone, 1),
    }


def main(target, jobs=10_000, commit=BEFORE):
    kept = {**provenance("make throughput")}
    kept |= {"start": starting(), "sweep": sweeping(int(jobs))}
    kept |= {"before": commit, "compared": compared(commit)}
    keep(target, kept)
    print(json.dumps(kept, indent=1))


if __name__ == "__main__":
    main(*sys.argv[1:])
