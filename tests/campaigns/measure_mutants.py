"""Plant bugs and see whether the fast tests bite (make mutants).

Each of the thirty planted bugs and sixty drawn mutants is tried in a copy of the tree: with the JIT
off first, which needs no minute of compiling, and what no test caught then with the JIT on against
tests of whole runs. Writes a small JSON file; what escaped is listed there and in the README.
"""

import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue

from mutation import EQUIVALENT, PHYSICS, ROOT, SEED, drawn
from planted_bugs import bugs
from result_pages import keep, provenance, run_campaign

COPIED = ("compressor", "cmd", "tests", "configs", "pyproject.toml", "README.md", "Makefile")
DRAWN = 60
# the order in which tests are tried, but for a file's own, which come first
PURE = ("kinematics", "contact", "loads", "cam", "tally", "onset", "step_control",
        "steppers", "case", "integrate", "motion", "march",
        "general_mechanism")  # fmt: skip
COMPILED = ("invariances", "march", "integrate", "steppers", "simulate", "accuracy",
            "regime")  # fmt: skip
LAWS = ("contact_laws", "friction_laws")
TESTED_IN = {
    "mechanism": ("general_mechanism", "steppers"),
    "mechanism_rows": ("general_mechanism", "feature_runs"),
    "march": ("march", "wear"),
    "motion": ("motion", *LAWS),
    "contact": ("contact", *LAWS),
    "loads": ("loads", "card"),
    "observe": ("motion", "general_mechanism"),
    "rosenbrock": ("steppers",),
    "runge_kutta": ("steppers",),
}  # where not in the module of the same name alone
OPTIONS = (
    "-o addopts= -x -v --tb=no --hypothesis-seed=0 "
    "-p no:xdist -p no:faulthandler -p no:cacheprovider"
)
NO_JIT, JIT = "not slow and not compiled", "not slow"
# s of processor time with the JIT off and on; a mutant that takes longer is caught: it never ends
PATIENCE = {False: 150, True: 900}
BEGAN = re.compile(r"^(?:tests/)?(\S+::.*?)(?: (PASSED|FAILED|ERROR|SKIPPED|XFAIL)\b.*)? *$", re.M)


class CannotBeLoaded(Exception):
    """No test ran: nothing can be said of the mutant."""


def first_failure(folder, files, jit, cache):
    """The first failing test of some files of a folder, "" if none fails; raises CannotBeLoaded.

    cache: folder of machine code. A test that the process did not outlive counts as failed.
    """
    environment = os.environ | {
        "COMPSIM_JIT": str(int(jit)),
        "NUMBA_CACHE_DIR": str(folder / cache),
        "PYTHONPATH": f"{folder}:{folder / 'cmd'}",
    }
    call = [sys.executable, "-m", "pytest", *OPTIONS.split(), "-m", JIT if jit else NO_JIT]
    done = subprocess.run(
        [*call, *files], cwd=folder, env=environment, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, 2 * (PATIENCE[jit],)),
    )  # fmt: skip
    tests = BEGAN.findall(done.stdout)
    if done.returncode == 1:
        return next(name for name, end in tests if end in ("FAILED", "ERROR"))
    if not tests or done.returncode > 0:
        raise CannotBeLoaded(f"{done.stdout[-1000:]}exit code {done.returncode}")
    return f"{tests[-1][0]}: ended by signal {-done.returncode}" if done.returncode else ""


class Copy:
    """A copy of the tree in which one mutant after the other is tried."""

    def __init__(self, folder):
        self.folder = Path(folder)
        for name in COPIED:
            source, target = ROOT / name, self.folder / name
            if source.is_dir():
                shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy2(source, target)

    def attempt(self, mutant, jit, modules):
        """The first test of some modules that fails, "" if none does; raises CannotBeLoaded."""
        files = [
            str(path) for name in modules for path in self.folder.glob(f"tests/**/test_{name}.py")
        ]
        if not mutant:
            return first_failure(self.folder, files, jit, "machine-code")
        path = self.folder / mutant.file
        whole, stamp = path.read_bytes(), path.stat()
        shutil.rmtree(self.folder / "other-code", ignore_errors=True)
        try:
            write(path, mutant.source(self.folder))
            physics = mutant.file.startswith(PHYSICS)
            cache = "other-code" if physics else "machine-code"
            return first_failure(self.folder, files, jit, cache)
        finally:  # numba's cache goes by the time of the sources
            write(path, whole)
            os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))


def write(path, source):
    """Write a source, and remove its bytecode: Python tells sources apart by whole seconds."""
    path.write_bytes(source)
    for stale in path.parent.glob(f"__pycache__/{path.stem}.*"):
        stale.unlink()


def put_first(own, modules):
    """Modules of tests, a mutant's own first."""
    return [*own, *(name for name in modules if name not in own)]


def try_mutant(mutant, tree, pure, compiled):
    """What became of a mutant: its row of the kept measurement."""
    began, stem = time.monotonic(), Path(mutant.file).stem
    row = {"kind": mutant.kind, "mutant": mutant.identity, "jit": False, "caught_by": ""}
    own, reason = TESTED_IN.get(stem, (stem,)), EQUIVALENT.get(mutant.identity)
    if reason:
        row["equivalent"] = reason
    try:
        if pure:
            first = [name for name in own if name in pure]  # some take minutes without the JIT
            row["caught_by"] = tree.attempt(mutant, False, put_first(first, pure))
        if compiled and not reason and not row["caught_by"]:
            row["jit"] = True
            row["caught_by"] = tree.attempt(mutant, True, put_first(own, compiled))
    except CannotBeLoaded as error:
        row["cannot_be_loaded"] = str(error)
    end = row.get("cannot_be_loaded") or row["caught_by"] or row.get("equivalent") or "ESCAPED"
    print(f"{time.monotonic() - began:4.0f} s  {mutant.identity}\n        {end}", flush=True)
    return row


def campaign(mutants, jobs, pure=PURE, compiled=COMPILED):
    """Rows of mutants, `jobs` at a time, tried on modules of tests with the JIT off, then on."""
    trees = Queue()

    def tried(mutant):
        tree = trees.get()
        try:
            return try_mutant(mutant, tree, pure, compiled)
        finally:
            trees.put(tree)

    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(jobs) as pool:
        for number in range(jobs):
            trees.put(tree := Copy(Path(folder, f"{number}")))
        for jit, modules in ((False, pure), (True, compiled)):
            if failed := modules and tree.attempt(None, jit, modules):
                sys.exit(f"without a mutant {failed} fails: mend that first")
        return list(pool.map(tried, mutants))


def merge_earlier(target, rows, mutants):
    """These rows, and those of the other mutants that a file has, if there is one."""
    whole = json.loads(Path(target).read_text("utf-8")) if Path(target).exists() else {}
    known = {row["mutant"]: row for row in [*whole.get("mutants", ()), *rows]}
    return [known[mutant.identity] for mutant in mutants if mutant.identity in known]


def main(target, jobs=2, only=("",), pure=PURE, compiled=COMPILED):
    everyone = [*bugs(), *drawn(DRAWN)]
    mutants = [m for m in everyone if any(text in m.identity for text in only)]
    began = time.monotonic()
    rows = campaign(mutants, jobs, pure, compiled)
    minutes = round((time.monotonic() - began) / 60, 1)
    every = rows if [*only] == [""] else merge_earlier(target, rows, everyone)
    keep(target, {**provenance("make mutants"), "seed": SEED, "minutes": minutes, "mutants": every})
    sys.exit(judge(rows, minutes) or 0)


def judge(rows, minutes):
    """Tell how many mutants were caught; what is wrong with the campaign itself, "" if nothing."""
    unloaded = [row["mutant"] for row in rows if "cannot_be_loaded" in row]
    wrong = [row["mutant"] for row in rows if "equivalent" in row and row["caught_by"]]
    caught = sum(bool(row["caught_by"]) for row in rows)
    same = sum("equivalent" in row for row in rows)
    print(
        f"{len(rows)} mutants in {minutes} minutes: {caught} caught, {same} change nothing, "
        f"{len(unloaded)} cannot be loaded"
    )
    problems = [f"no test ran, since they cannot be loaded: {unloaded}"] if unloaded else []
    problems += [f"said to change nothing, but caught: {wrong}"] if wrong else []
    return "\n".join(problems)


if __name__ == "__main__":
    run_campaign(main)
