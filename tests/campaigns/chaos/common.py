"""What the campaigns share: a small store, commands in forked processes, what a store holds."""

import contextlib
import dataclasses
import faulthandler
import json
import os
import pickle
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import click.utils
from compsim import cli

from compressor.cases.load import load_studies
from compressor.report import report
from compressor.report.figures import pictures
from compressor.store.reader import open_study
from compressor.store.status import standings, verify
from compressor.sweep import plan as forecast
from compressor.sweep.sweep import sweep


def undrawn():
    """Let reports draw nothing, which takes seconds, and copy no library."""
    report.draw_sweep = lambda *args: []
    pictures.render_kinds = lambda *args: [b"drawn"] * 2
    report.publish_library = lambda *args: None


SECONDS = 60.0  # in which a trial must end; what hangs takes for ever
SOLVE = {"duration_rev": 0.02, "settle_rev": 0, "output_step_deg": 0.72, "accuracy": "draft",
         "error_bars": False}  # fmt: skip
STUDIES = {
    "series": {"joint": "big_end", "clearance_mm": [0.1, 0.2]},
    "metrics": {
        "joint": "small_end", "clearance_mm": [0.1, 0.2, 0.3], "machine": {"rod_mass_kg": [4, 5]},
        "output": {"keep": "metrics"},
    },
    "failing": {
        "joint": "both", "clearance_mm": 0.1, "solve": {"max_steps": 3},
        "output": {"keep": "metrics"},
    },
}  # fmt: skip
TIMINGS = {"seconds"}  # what differs between two runs of a job


class Ended(NamedTuple):
    """How a forked process ended: what its work gave, or how it died."""

    result: Any
    death: str  # "" where it gave a result
    seconds: float  # of processor time, its children's included: other processes do not count


class Said(NamedTuple):
    """What a command said."""

    code: int
    out: str
    err: str


def complete_store(folder: Path) -> Path:
    """A store with all jobs of `STUDIES`; loads and compiles all that forked processes need."""
    store = folder / "complete"
    sweep(load_studies(*case_files(folder / "cases")), store, 1)
    contents(store)
    studies = load_studies(*case_files(folder / "cases"))
    forecast.forecast(studies, folder / "new", 1).with_times(1, str)
    return store


def case_files(folder: Path) -> list[Path]:
    """The case files of `STUDIES` in a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, values in STUDIES.items():
        text = json.dumps(values | {"solve": SOLVE | values.get("solve", {})})
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return [folder / f"{name}.yaml" for name in STUDIES]


def forked(work: Callable[[], Any], seconds: float = SECONDS) -> Ended:
    """Do some work in a process of its own, which may crash or hang."""
    reader, writer = os.pipe()
    began = time.monotonic()
    child = os.fork()
    if not child:
        _child(work, writer)
    os.close(writer)
    data, late = _received(reader, began + seconds)
    os.close(reader)
    if late:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
    _, status, used = os.wait4(child, 0)
    took = used.ru_utime + used.ru_stime
    if late:
        return Ended(None, f"hangs: {seconds:.0f} s", took)
    code = os.waitstatus_to_exitcode(status)
    if code:
        return Ended(None, signal.Signals(-code).name if code < 0 else f"exit code {code}", took)
    result, error = pickle.loads(data)
    return Ended(result, error, took)


def _child(work: Callable[[], Any], writer: int) -> None:
    """The forked process: never returns."""
    code = 1
    faulthandler.disable()  # of pytest: a death is reported as `Ended.death`
    try:
        os.setpgid(0, 0)
        try:
            answer = (work(), "")
        except Exception:
            answer = (None, traceback.format_exc())
        with open(writer, "wb") as file:
            file.write(pickle.dumps(answer))
        code = 0
    finally:
        os._exit(code)


def _received(reader: int, until: float) -> tuple[bytes, bool]:
    """All bytes of a pipe, and whether they took too long."""
    data = b""
    while (left := until - time.monotonic()) > 0:
        if select.select([reader], [], [], left)[0]:
            part = os.read(reader, 1 << 20)
            data += part
            if not part:
                return data, False
    return data, True


def command(*arguments: object) -> Said:
    """What a command says, run in this process, which is a forked one."""
    click.utils.should_strip_ansi = lambda *args: False  # as on a terminal
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)
        sys.stderr = open(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)
        code = cli.main([str(argument) for argument in arguments])
        sys.stdout.flush()
        sys.stderr.flush()
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read().decode(errors="backslashreplace"))
    return Said(code, *texts)


def contents(folder: Path) -> dict[str, Any]:
    """All that readers find in a store, to the bit, but for timings; `damage`: what `verify` says.

    Raises what they raise, and RuntimeError where they only warn.
    """
    found: dict[str, Any] = {"damage": [str(damage) for damage in verify(folder)]}
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        for standing in standings(folder):
            study = open_study(folder, standing.study).load()
            found[standing.study] = dataclasses.replace(standing, written="")  # when: a timing
            for name, item in study.variables.items():
                if name not in TIMINGS:
                    values = item.values
                    plain = values.tolist() if values.dtype.kind in "OU" else values.tobytes()
                    found[f"{standing.study}/{name}"] = (item.dims, values.shape, plain)
    return found


@contextlib.contextmanager
def fresh(folder: Path, name: str) -> Iterator[Path]:
    """An empty folder for a trial, gone after it."""
    place = folder / name
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    try:
        yield place
    finally:
        shutil.rmtree(place, ignore_errors=True)
