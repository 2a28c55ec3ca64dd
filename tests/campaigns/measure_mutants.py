"""Plant bugs and see whether the fast tests bite (make mutants).

Each of the thirty planted bugs and sixty drawn mutants is tried in a copy of the tree: with the JIT
off first, which needs no minute of compiling, and what no test caught then with the JIT on against
tests of whole runs. Writes a small JSON file; what escaped is listed there and in the README.

Tests run in forks of this process, in which their libraries, and the independent reference with
all that sympy derives for it, are loaded already; the program is not, so that each fork loads its
own copy.
"""

import argparse
import json
import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numba
import numpy as np
import pytest
import reference
import scipy.optimize  # noqa: F401
import xarray  # noqa: F401
from equivalent_mutants import EQUIVALENT
from mutation import PHYSICS, ROOT, SEED, drawn
from planted_bugs import bugs

COPIED = ("compressor", "cmd", "tests", "configs", "pyproject.toml", "README.md", "Makefile")
DRAWN = 60
# the order in which tests are tried, but for a file's own, which come first
PURE = ("kinematics", "contact", "loads", "observe", "cam", "tally", "onset", "step_control",
        "runge_kutta", "rosenbrock", "case", "integrate", "motion", "march",
        "general_mechanism")  # fmt: skip
COMPILED = ("invariances", "march", "integrate", "rosenbrock", "simulate", "accuracy",
            "regime")  # fmt: skip
LAWS = ("contact_laws", "friction_laws", "chosen_laws")
TESTED_IN = {
    "mechanism": ("general_mechanism", "linear_systems"),
    "mechanism_rows": ("general_mechanism", "feature_runs"),
    "march": ("march", "wear_stages"),
    "motion": ("motion", *LAWS),
    "contact": ("contact", *LAWS),
    "loads": ("loads", "card_curve", "card"),
    "rosenbrock": ("rosenbrock", "linear_systems"),
}  # where not in the module of the same name alone
NO_JIT, JIT = "not slow and not compiled", "not slow"
# s of processor time with the JIT off and on; a mutant that takes longer is caught: it never ends
PATIENCE = {False: 120, True: 900}


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
        try:
            write(path, mutant.source(self.folder))
            physics = mutant.file.startswith(PHYSICS)
            cache = "other-code" if physics else "machine-code"
            return first_failure(self.folder, files, jit, cache)
        finally:  # numba's cache goes by the time of the sources
            write(path, whole)
            os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))


class CannotBeLoaded(Exception):
    """No test ran: nothing can be said of the mutant."""


class Notes:
    """A plugin of pytest that notes at once which tests begin and which fail."""

    def __init__(self, path):
        self.file = open(path, "w", buffering=1, encoding="utf-8")

    def pytest_runtest_logstart(self, nodeid):
        self.file.write(f"began {nodeid}\n")

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.file.write(f"failed {report.nodeid}\n")


def first_failure(folder, files, jit, cache):
    """The first failing test of some files of a folder, "" if none fails; raises CannotBeLoaded.

    They run in a fork; machine code is kept in the folder `cache`.
    """
    for made in (folder / "other-code", folder / ".hypothesis"):
        shutil.rmtree(made, ignore_errors=True)
    notes, output = folder / "notes.txt", folder / "output.txt"
    notes.write_text("")
    child = os.fork()
    if not child:
        code = 99
        try:
            become(folder, output, jit, cache)
            call = ["-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider"]
            call += ["--hypothesis-seed=0", "-m", JIT if jit else NO_JIT]
            code = pytest.main(call + files, plugins=[Notes(notes)])
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return verdict(notes.read_text("utf-8").splitlines(), code, output)


def verdict(notes, code, output):
    """The test that failed or was never done, by a fork's notes and exit code; "" if none.

    Raises CannotBeLoaded, with the end of the fork's output, where no test ran.
    """
    told = [(what, test.removeprefix("tests/")) for what, test in (n.split(" ", 1) for n in notes)]
    for what, test in told:
        if what == "failed":
            return test
    if not told or code > 0:
        raise CannotBeLoaded(f"{output.read_text('utf-8')[-1000:]}exit code {code}")
    if code < 0:
        endless = -code in (signal.SIGXCPU, signal.SIGKILL)
        return f"{told[-1][1]}: {'no end' if endless else f'ended by signal {-code}'}"
    return ""


def become(folder, output, jit, cache):
    """Make of this process one that tests a copy, and writes what it says to a file."""
    resource.setrlimit(resource.RLIMIT_CPU, (PATIENCE[jit], PATIENCE[jit]))
    out = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(out, 1)
    os.dup2(out, 2)
    os.chdir(folder)
    kept = [path for path in sys.path if not Path(path or ".").resolve().is_relative_to(ROOT)
            or ".venv" in path]  # fmt: skip
    sys.path[:] = [str(folder), str(folder / "cmd"), *kept]
    # workers that a test starts are no forks: they go by the environment
    os.environ |= {"COMPSIM_JIT": str(int(jit)), "NUMBA_CACHE_DIR": str(folder / cache)}
    numba.config.CACHE_DIR = str(folder / cache)


def write(path, source):
    """Write a source, and remove its bytecode: Python tells sources apart by whole seconds."""
    path.write_bytes(source)
    for stale in path.parent.glob(f"__pycache__/{path.stem}.*"):
        stale.unlink()


def load_reference():
    """Let sympy derive, and numba compile, what tests ask of the independent reference."""
    for joint in ("big_end", "small_end", "both"):
        params = reference.paper_params("gas", joint, 2e-4)
        y = np.zeros(len(reference.COORDINATES[joint]))
        reference.joint_forces(joint, y, y, 0.0, 0, params)
        reference.reference_solution(params, joint, np.array([0.0, 1e-5]), rtol=1e-3)
    reference.ideal_joint_forces(0.0, 0, reference.paper_params("none", "none", 0.0))


def put_first(own, modules):
    """Modules of tests, a mutant's own first."""
    return [*own, *(name for name in modules if name not in own)]


def own_modules(mutant):
    """The modules of tests of a mutant's file."""
    stem = Path(mutant.file).stem
    return TESTED_IN.get(stem, (stem,))


def try_mutant(mutant, tree, pure, compiled):
    """What became of a mutant: its row of the kept measurement."""
    began = time.monotonic()
    row = {"kind": mutant.kind, "mutant": mutant.identity, "jit": False, "caught_by": ""}
    own, reason = own_modules(mutant), EQUIVALENT.get(mutant.identity)
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
    tell(began, f"{mutant.identity}\n        {outcome(row)}")
    return row


def outcome(row):
    """What became of a mutant, in words."""
    if "cannot_be_loaded" in row:
        return f"CANNOT BE LOADED: {row['cannot_be_loaded']}"
    return row["caught_by"] or (f"equivalent: {row['equivalent']}" if "equivalent" in row
                                else "ESCAPED")  # fmt: skip


def tell(began, what):
    print(f"{time.monotonic() - began:4.0f} s  {what}", file=sys.stderr, flush=True)


WORKER = []  # a worker process's own: its copy, and the modules of tests


def prepare(folder, pure, compiled):
    """Give a worker its copy, and see that the tests pass there without a mutant."""
    tree = Copy(Path(folder) / str(os.getpid()))
    for jit, modules in ((False, pure), (True, compiled)):
        began = time.monotonic()
        failed = modules and tree.attempt(None, jit, modules)
        if failed:
            raise RuntimeError(f"without a mutant {failed} fails: mend that first")
        tell(began, f"without a mutant, JIT {'on' if jit else 'off'}")
    WORKER[:] = tree, pure, compiled


def tried(mutant):
    return try_mutant(mutant, *WORKER)


def campaign(mutants, jobs, pure=PURE, compiled=COMPILED):
    """Rows of mutants, `jobs` at a time, tried on modules of tests with the JIT off, then on.

    Raises BrokenProcessPool where the sources without a mutant fail or cannot be loaded.
    """
    fork = multiprocessing.get_context("fork")
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(jobs, fork, prepare, (folder, pure, compiled)) as pool,
    ):
        return list(pool.map(tried, mutants))


def earlier(target, rows, mutants):
    """The whole campaign of a file, if any: these rows, and its own of the other mutants."""
    if not Path(target).exists():
        return {}
    whole = json.loads(Path(target).read_text(encoding="utf-8"))
    known = {row["mutant"]: row for row in [*whole["mutants"], *rows]}
    rows = [known[mutant.identity] for mutant in mutants if mutant.identity in known]
    return {"minutes": whole["minutes"], "mutants": rows}


def main(target, jobs, only, pure, compiled):
    everyone = [*bugs(), *drawn(DRAWN)]
    mutants = [m for m in everyone if any(text in m.identity for text in only)]
    began = time.monotonic()
    if {"motion", "march"} & {*pure}:
        load_reference()
    rows = campaign(mutants, jobs, pure, compiled)
    minutes = round((time.monotonic() - began) / 60, 1)
    from result_pages import keep, provenance  # which loads the program

    kept = {**provenance("make mutants"), "seed": SEED, "minutes": minutes, "mutants": rows}
    if only != [""]:
        kept |= earlier(target, rows, everyone)
    keep(target, kept)
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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", help="JSON file to write")
    parser.add_argument("-j", "--jobs", type=int, default=2, help="mutants at a time")
    parser.add_argument(
        "--only",
        nargs="*",
        default=[""],
        help="try mutants whose identity has one of these texts, and keep the target's others",
    )
    parser.add_argument("--pure", nargs="*", default=PURE, help="tests to run with the JIT off")
    parser.add_argument("--compiled", nargs="*", default=COMPILED, help="tests to run with it on")
    arguments = parser.parse_args()
    main(*vars(arguments).values())
