"""Measure start-up, and a sweep of 100,000 jobs that is killed three times and resumed.

    python tests/campaigns/measure_sweep.py tests/results/sweep.json [jobs]  (make sweep-bench)

Start-up times are of whole processes, medians of a few in turn. The sweep has no error bars, so
that the times which its jobs store are all of the solver's work, and its jobs are short, since the
sweep is what is measured. It runs through the real command on two workers, once undisturbed and
once killed (SIGKILL of the parent alone, or with its workers) and resumed; both stores must hold
the same, to the bit, timings apart. Memory is each process's greatest resident set, as /proc tells
it while they run.
"""

import contextlib
import json
import math
import random
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from chaos.processes import Run, members
from result_pages import keep, provenance, run_campaign
from stores_compared import contents, damage

from compressor.store.reader import open_study, read_store

CONFIGS = sorted(map(str, (Path(__file__).parents[2] / "configs").glob("*.yaml")))
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
JOBS = 100_000
KILLS = (False, True, True)  # whether its workers are killed, too
SHORT = {"settle_rev": 0, "duration_rev": 1}
LONGEST = 4 * 3600.0  # s
LOOK = 0.5  # s between two looks at memory
PEAK = re.compile(r"VmHWM:\s*(\d+) kB")


def time_startup():
    """Return the median wall time (s) of each command, its caches warm."""
    times = {name: [] for name in COMMANDS}
    for _ in range(ROUNDS + 1):
        for name, arguments in COMMANDS.items():
            with tempfile.TemporaryDirectory() as folder:
                began = time.perf_counter()
                subprocess.run([sys.executable, *arguments], cwd=folder, check=True,
                               capture_output=True)  # fmt: skip
                times[name].append(time.perf_counter() - began)
    # the first round warms the caches
    return {name: round(statistics.median(found[1:]), 3) for name, found in times.items()}


def many(jobs):
    """Return a case file of jobs without time series or error bars."""
    side = next(n for n in range(math.isqrt(jobs), 0, -1) if jobs % n == 0)
    values = {"name": "many", "joint": "big_end", "solve": {"error_bars": False} | SHORT}
    values |= {"clearance_mm": np.linspace(0.1, 0.3, side).tolist()}
    values |= {"machine": {"rod_mass_kg": np.linspace(3, 5, jobs // side).tolist()}}
    return json.dumps(values | {"output": {"keep": "metrics"}})


class Sweep:
    """The sweep in a folder, run once or several times."""

    def __init__(self, folder, jobs, peaks):
        self.folder, self.jobs, self.peaks = folder, jobs, peaks
        folder.mkdir()
        (folder / "many.yaml").write_text(many(jobs), encoding="utf-8")

    def run(self, seconds=LONGEST):
        """Run the real command for so long, or to its end; memory is noted. The run."""
        words = ["run", "many.yaml", "-j", str(WORKERS), "--max-jobs", str(self.jobs)]
        run, until = Run(words, self.folder, real=True), time.monotonic() + seconds
        while run.watch(min(LOOK, until - time.monotonic())) and time.monotonic() < until:
            for pid in members(run.pid):
                with contextlib.suppress(OSError):
                    if found := PEAK.search(Path(f"/proc/{pid}/status").read_text()):
                        whose = "parent" if pid == run.pid else "worker"
                        self.peaks[whose] = max(self.peaks[whose], int(found[1]))
        return run

    def complete(self):
        """Seconds of a run to its end."""
        began = time.monotonic()
        run = self.run()
        code = run.finish()
        assert code == 0, run.text()[-2000:]
        return time.monotonic() - began

    def kill(self, seconds, whole):
        """Start it and kill it after a time: jobs that it had told of, and that are stored."""
        run = self.run(seconds)
        run.send(signal.SIGKILL, whole)
        code = run.finish()
        assert code == -signal.SIGKILL, f"{code}: {run.text()[-2000:]}"
        stored = len(read_store(self.folder / "results"))
        assert stored >= run.told(), f"told of {run.told()} jobs, {stored} are stored"
        assert not damage(self.folder / "results"), damage(self.folder / "results")
        return {"of": "all" if whole else "parent", "told": run.told(), "stored": stored}


def main(target, jobs=JOBS):
    peaks = {"parent": 0, "worker": 0}  # kB
    start = time_startup()  # first: what is compiled takes memory that is not the sweep's
    with tempfile.TemporaryDirectory(prefix="sweep-bench-", dir=".") as place:
        calm, torn = (
            Sweep(Path(place, name).absolute(), jobs, peaks) for name in ("undisturbed", "killed")
        )
        seconds = calm.complete()
        again = calm.complete()
        draw = random.Random(1)
        kills = [torn.kill(draw.uniform(0.1, 0.25) * seconds, whole) for whole in KILLS]
        last, results = torn.complete(), torn.folder / "results"
        assert not damage(results), damage(results)
        began = time.monotonic()
        study = open_study(results)
        opened = time.monotonic() - began
        assert (study.status == "ok").sum() == study.status.size == jobs, "not complete"
        same = contents(calm.folder / "results") == contents(results)
        assert same, "the resumed study differs from the undisturbed one"
        sizes = [path.stat().st_size for path in results.rglob("*") if path.is_file()]
    keep(target, {
        **provenance("make sweep-bench"), "start": start, "jobs": jobs,
        "workers": WORKERS, "wall_s": round(seconds, 1), "jobs_per_s": round(jobs / seconds, 1),
        "again_s": round(again, 2), "kills": kills, "last_run_s": round(last, 1),
        "bit_equal": same,
        "peak_MB": {name: round(peak * 1024 / 1e6) for name, peak in peaks.items()},
        "bytes": sum(sizes), "files": len(sizes), "open_study_s": round(opened, 3),
    })  # fmt: skip


if __name__ == "__main__":
    run_campaign(main)
