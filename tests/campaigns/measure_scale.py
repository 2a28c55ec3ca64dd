"""Measure a sweep of 100,000 jobs, and every command on it: seconds and peak memory (RSS).

    python tests/campaigns/measure_scale.py tests/results/scale.json [jobs]  (make scale)

The sweep is a real one but for its physics: workers answer every job with the outcome of one, so
that what is measured is all that a sweep does beside simulating. Each command is a process of its
own, started cold; its memory is the greatest resident set, of the parent where it has workers.
"""

import dataclasses
import functools
import json
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from compressor.cases.load import load_studies
from compressor.store.studies import read_studies
from compressor.sweep.sweep import sweep

JOBS = 100_000
PYTHON = {"open_study": "import compressor; compressor.open_study('results').load()"}
STARTER = """
import os, sys, time
began = time.perf_counter()
pid = os.fork()
if not pid:
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.execv(sys.argv[1], sys.argv[1:])
_, status, usage = os.wait4(pid, 0)
print(time.perf_counter() - began, usage.ru_maxrss / 1024)
sys.exit(status != 0)
"""
COMMANDS = {
    "run, nothing missing": "run many.yaml --max-jobs {jobs} --quiet",
    "plan": "plan many.yaml --max-jobs {jobs}",
    "status": "status",
    "show": "show {key}",
    "verify": "verify",
    "export to CSV": "export -o many.csv",
    "export to netCDF": "export -o many.nc",
}


def measured(case):
    """The outcome of a case."""
    from compressor.solve.simulate import measure

    return measure(case)


def answered(found, case):
    """A worker's answer: the outcome of one job under the key of another."""
    attributes = found.attributes | {"key": case.key, "physics_key": case.physics_key}
    return dataclasses.replace(found, attributes=attributes), False


def stub_sweep(jobs):
    """Sweep many.yaml in this process, with workers that do not simulate."""
    (study,) = load_studies("many.yaml", max_jobs=jobs)
    with ProcessPoolExecutor(1) as other:  # as in a real run, this process has no equations
        found = other.submit(measured, study.cases[0]).result()
    from measure_scale import answered as answer  # workers find it under this name

    sys.modules["compressor.sweep.sweep"].run_job = functools.partial(answer, found)
    sweep([study], "results", 2)


def process(*arguments):
    """Wall time (s) and peak resident set (MB) of a Python process.

    A small process starts it: at its start, the one that it comes from counts as its own memory.
    """
    starter = [sys.executable, "-I", "-S", "-c", STARTER, sys.executable, *arguments]
    said = subprocess.run(starter, check=True, capture_output=True, text=True)
    seconds, megabytes = map(float, said.stdout.split())
    print(f"{seconds:.1f} s, {megabytes:.0f} MB: {' '.join(arguments)}", file=sys.stderr)
    return {"seconds": round(seconds, 2), "peak_MB": round(megabytes)}


def scale(jobs):
    """What the sweep and each command take, in the working directory."""
    from measure_throughput import many  # much memory, which the sweep's process must not have

    Path("many.yaml").write_text(many(jobs), encoding="utf-8")
    found = {"sweep": process(__file__, "--sweep", str(jobs))}
    (study,) = read_studies("results")
    for name, code in PYTHON.items():
        found[name] = process("-c", code)
    for name, command in COMMANDS.items():
        words = command.format(jobs=jobs, key=study.keys[-1]).split()
        found[name] = process("-m", "compsim", *words)
    sizes = {name: Path(name).stat().st_size for name in ("many.csv", "many.nc")}
    return {"jobs": study.jobs, "bytes": sizes, "processes": found}


def main(target, jobs=JOBS):
    from result_pages import keep, provenance

    target, home = Path(target).absolute(), os.getcwd()
    place = tempfile.mkdtemp(prefix="scale-", dir=".")
    os.chdir(place)
    try:
        kept = {**provenance("make scale"), **scale(int(jobs))}
    finally:
        os.chdir(home)
        shutil.rmtree(place)
    keep(target, kept)
    print(json.dumps(kept, indent=1))


if __name__ == "__main__":
    if sys.argv[1] == "--sweep":
        stub_sweep(int(sys.argv[2]))
    else:
        main(*sys.argv[1:3])
