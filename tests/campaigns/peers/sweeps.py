"""A sweep by a user's script and by `compsim run`: the same jobs, in turn, two processes each.

Whole processes are timed, and beside them what a further job takes: the difference between many
jobs and few, in which the script's compiling and our start have no part. Ours is compiled before,
once after installation; the script's code cannot be stored, and is compiled at each start.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from peers.mechanism import loosest

from compressor.cases.case import Case
from compressor.solve.simulate import measure
from compressor.store import open_study

ROOT = Path(__file__).parents[3]
SCRIPT = Path(__file__).with_name("script.py")
JOBS, FEW = 2_000, 200
TURNS = 4
EVERY = 20  # of the jobs one is judged
TRUE_RTOL = 1e-11
LADDER = (1e-4, 3e-5, 1e-5, 1e-6, 1e-7, 1e-8)  # the script's tolerances
OUR_LADDER = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6)
BEST = 1.1  # what the script's output grid leaves, and a tenth
PEAKS = ("peak_acceleration", "peak_contact_force")
OURS = {
    "`compsim run` without error bars": {"error_bars": False},
    "`compsim run`, promise and error bars of `standard`": {},
    "`compsim run`, promise and error bars of `draft`": {"accuracy": "draft"},
}


def case_values(clearance, **solve):
    """The script's machine as values of a case file; clearance: mm, or a list of them."""
    values = {"joint": "big_end", "clearance_mm": clearance, "output": {"keep": "metrics"}}
    return values | {"solve": solve}


def clearances(jobs):
    """The clearances (mm) of so many jobs, shape (jobs,): the script's."""
    return 1e3 * np.linspace(1e-4, 3e-4, jobs)


def our_peaks(chosen, rtol):
    """PEAKS of clearances (mm) at a tolerance of ours, shape (clearances, 2)."""
    cases = [Case.from_values(case_values(c, rtol=rtol, error_bars=False)) for c in chosen]
    numbers = [measure(case).numbers for case in cases]
    return np.array([[np.ravel(one[name])[0] for name in PEAKS] for one in numbers])


def peak_errors(found, truth):
    """Relative errors of peaks, shape (jobs, 2)."""
    return np.abs(found / truth - 1)


def choose_rtol(chosen, truth):
    """The script's loosest tolerance at which its grid alone decides its worst peak, and ours.

    Ours is the loosest whose worst peak is no worse than the script's.
    """
    from peers.script import run

    theirs, ours = {}, {}
    for rtol in LADDER:
        peaks = [run(1e-3 * clearance, rtol)[:2] for clearance in chosen]
        theirs[rtol] = peak_errors(np.array(peaks), truth).max()
    for rtol in OUR_LADDER:
        ours[rtol] = peak_errors(our_peaks(chosen, rtol), truth).max()
    rtol = loosest(theirs, BEST * min(theirs.values()))
    return rtol, loosest(ours, theirs[rtol])


def run_script(jobs, folder, rtol):
    """PEAKS of the script's jobs, shape (jobs, 2), and its wall and CPU seconds."""
    times = time_process([SCRIPT, jobs, "peaks.csv", rtol], folder)
    return np.loadtxt(Path(folder, "peaks.csv"), delimiter=",")[:, 1:3], times


def run_ours(jobs, folder, solve):
    """The same by `compsim run`."""
    values = {"name": "swept"} | case_values(clearances(jobs).tolist(), **solve)
    Path(folder, "swept.yaml").write_text(json.dumps(values), encoding="utf-8")
    command = ["-m", "compsim", "run", "swept.yaml", "-j", 2, "--quiet", "-r", "results"]
    times = time_process(command, folder)
    with open_study(Path(folder, "results"), "swept") as study:
        study = study.sel(clearance_mm=clearances(jobs), joint="big_end")
        return np.column_stack([study[name].values for name in PEAKS]), times


def time_process(arguments, folder):
    """Wall and CPU seconds of a Python process with all its children."""
    where = os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'cmd'}"}
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [sys.executable, *map(str, arguments)]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, env=where)
    wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def run_in_folder(run, jobs, how):
    """What `run_script` or `run_ours` returns, in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        return run(jobs, folder, how)


def make_rows(times, errors, more):
    """A row a way, the script's first: medians, and the script's time over ours of the same turn.

    `times`: by way, shape (turns, 2, 2): few jobs and many, wall and CPU s; `more`: how many more.
    """
    rows, script = [], None
    for way, found in times.items():
        found = np.array(found)
        whole, further = found[:, 1, 0], (found[:, 1] - found[:, 0]) / more
        wall, cpu = np.median(1e3 * further, axis=0)
        row = {"way": way, "seconds": np.median(whole), "ms_a_job": wall, "cpu_ms_a_job": cpu}
        for name, error in zip(PEAKS, np.transpose(errors[way]), strict=True):
            row |= {f"{name}_error": np.median(error), f"worst_{name}_error": max(error)}
        if script is None:
            script = whole, further
        else:
            row["ratio"] = np.median(script[0] / whole)
            row["ratio_a_job"], row["cpu_ratio_a_job"] = np.median(script[1] / further, axis=0)
        rows.append({key: rounded(value) for key, value in row.items()})
    return rows


def rounded(value):
    """Three digits of a number; a text as it is."""
    return value if isinstance(value, str) else float(f"{value:.3g}")


def compare(jobs=JOBS, few=FEW, turns=TURNS):
    """Rows of the script and of our sweep, or one with the reason why there are none."""
    name = "joblib over numbalsoda"
    chosen = clearances(jobs)[::EVERY]
    truth = our_peaks(chosen, TRUE_RTOL)
    try:
        theirs, ours = choose_rtol(chosen, truth)
    except ImportError as fault:
        return [{"way": name, "reason": str(fault)}]
    ways = {f"{name}, rtol {theirs:g}": (run_script, theirs)}
    ways |= {way: (run_ours, solve) for way, solve in OURS.items()}
    equal = {"rtol": ours, "error_bars": False}
    ways[f"`compsim run` without error bars, rtol {ours:g}"] = run_ours, equal
    run_in_folder(run_ours, few, equal)  # so that nothing is compiled while it is timed
    times, errors = {way: [] for way in ways}, {}
    for turn in range(turns):
        print(f"sweeps: turn {turn + 1} of {turns}", file=sys.stderr)
        for way in reversed(ways) if turn % 2 else ways:
            _, short = run_in_folder(ways[way][0], few, ways[way][1])
            peaks, long = run_in_folder(ways[way][0], jobs, ways[way][1])
            times[way].append((short, long))
            errors[way] = peak_errors(peaks[::EVERY], truth)
    return make_rows(times, errors, jobs - few)
