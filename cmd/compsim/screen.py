"""What the commands share: exit codes, options, and how they speak on stderr."""

import contextlib
import os
import re
import shlex
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from compsim.results import files, folders

if TYPE_CHECKING:
    from compressor.cases import Study
    from compressor.store import Again

DONE, INTERNAL, USAGE, SOME_FAILED, STORE = 0, 1, 2, 3, 5  # exit codes; 128 + n: signal n
MOST_CAUTIONS = 5  # told of one case file
QUIET_SECONDS = 10.0  # between two lines of progress where stderr is no terminal

CASE_FILE = re.compile(r"^(joint|clearance_mm|load|machine|blocks|regimes)\s*:", re.MULTILINE)
PLACES = (".", "configs")  # where case files are looked for, if none is named
MOST_NEAR = 4  # of them named
MOST_HEAD = 100_000  # bytes of a file that are looked at


class CaseFile(click.ParamType):
    """The path of a case file; where none is given, the error names those nearby."""

    name = "case file"

    def get_missing_message(self, param: Any, ctx: Any) -> str:
        """What could have been named, and how to make one."""
        made = "compsim init writes one to start from"
        near = nearby_case_files()
        if not near:
            return f"Name a case file; {made}"
        more = f" and {len(near) - MOST_NEAR} more" if len(near) > MOST_NEAR else ""
        return f"Name a case file, such as {', '.join(near[:MOST_NEAR])}{more}; {made}"


def nearby_case_files() -> list[str]:
    """The case files here and in `configs`, by their names; what cannot be read is none."""
    found = []
    for place in map(Path, PLACES):
        with contextlib.suppress(OSError):
            for path in sorted([*place.glob("*.yaml"), *place.glob("*.yml")]):
                with contextlib.suppress(OSError):
                    head = path.read_bytes()[:MOST_HEAD].decode(errors="replace")
                    if CASE_FILE.search(head):
                        found.append(str(path))
    return found


configs_argument = click.argument(
    "configs", nargs=-1, required=True, metavar="CONFIG...", type=CaseFile(), shell_complete=files
)
output_option = click.option("-o", "--output", default="results", show_default=True,
                             shell_complete=folders, help="Folder of results.")  # fmt: skip
setting = click.option(
    "--set", "overrides", multiple=True, metavar="KEY=VALUE",
    help="Set a key in all case files, such as machine.speed_rpm=300.",
)  # fmt: skip


def jobs_option(words: str) -> Callable[..., Any]:
    """-j, by default as many as this process may use."""
    return click.option("-j", "--jobs", type=click.IntRange(min=1),
                        show_default="cores available", help=words)  # fmt: skip


only_option = click.option(
    "--only", default="", metavar="COMPARISON",
    help="Only the jobs for which this holds, such as 'clearance_mm < 0.2'; the others stay "
    "missing.",
)  # fmt: skip
MAX_JOBS = 10_000
limit = click.option(
    "--max-jobs", type=click.IntRange(min=1), default=MAX_JOBS, show_default=True,
    help="Refuse a case file that asks for more, before it is expanded.",
)  # fmt: skip

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def one_thread_each() -> None:
    """Keep numeric libraries that load later, here or in workers, to one thread a process."""
    for name in THREADS:
        os.environ.setdefault(name, "1")


class Screen:
    """Progress on stderr: one line, rewritten, on a terminal; elsewhere a line now and then."""

    def __init__(self, quiet: bool, things: str = "jobs", alike: bool = True):
        self.quiet, self.live = quiet, sys.stderr.isatty()
        self.things, self.alike = things, alike
        self.done = self.total = self.width = 0
        self.began = self.told = time.monotonic()
        self.before: int | None = None

    def __call__(self, done: int, total: int, remark: str) -> None:
        """Take note of a sweep's progress (`compressor.sweep.sweep.Progress`)."""
        self.done, self.total = done, total
        if self.before in (None, done):
            self.before, self.began = done, time.monotonic()
        text = f"{done} of {total} {self.things}, {100 * done // total} %{self.time_left()}"
        if self.quiet:
            return
        if remark:
            self.end()
            say(remark)
        if self.live:
            say(f"\r{text:<{self.width}}", end="")
            self.width = len(text)
        elif not remark and time.monotonic() - self.told > QUIET_SECONDS:
            self.told = time.monotonic()
            say(text)

    def time_left(self) -> str:
        """A guess from the jobs that this run has done, where all take about the same time."""
        here = self.done - (self.before or 0)
        if not self.alike or not here or self.done == self.total:
            return ""
        seconds = (time.monotonic() - self.began) / here * (self.total - self.done)
        return f", {duration(seconds)} left"

    def end(self) -> None:
        """Leave the line of progress behind."""
        if self.width and not self.quiet:
            say(f"\r{'':<{self.width}}\r", end="")
            self.width = 0


def say(text: str, end: str = "\n") -> None:
    """Write to stderr; nobody may be there to read it."""
    with contextlib.suppress(OSError):
        print(text, end=end, file=sys.stderr, flush=True)


def run_commands(studies: "Iterable[Again]", folder: str) -> list[str]:
    """The commands that run the missing jobs of studies, one for those with the same overrides."""
    found: dict[tuple[str, ...], list[Again]] = {}
    for study in dict.fromkeys(studies):
        found.setdefault(study.overrides, []).append(study)
    commands = []
    for overrides, group in found.items():
        words = ["compsim", "run", *(study.case_file for study in group), "-o", folder]
        words += [word for text in overrides for word in ("--set", text)]
        jobs = max(study.jobs for study in group)
        words += ["--max-jobs", str(jobs)] if jobs > MAX_JOBS else []
        commands.append(shlex.join(words))
    return commands


def caution(studies: "Sequence[Study]") -> None:
    """Say once what is odd about case files, in a few lines however many jobs they have."""
    from compressor.solve import cautions

    for study in studies:
        found = cautions(study)
        for one in found[:MOST_CAUTIONS]:
            share = "" if one.of == 1 else f" ({one.jobs} of {one.of} jobs looked at)"
            say(f"{study.path}: warning: {one.key}: {one.message}{share}")
        if len(found) > MOST_CAUTIONS:
            say(f"{study.path}: and {plural(len(found) - MOST_CAUTIONS, 'more warning')}")


def tell_changes(studies: "Sequence[Study]", folder: str) -> None:
    """Say which stored studies have jobs that their case files no longer ask for."""
    from compressor.store import changes

    for one in changes(folder, studies):
        text = (
            f"{one.study}: had {plural(one.before)}, this file asks for {one.now}, {one.shared} of "
            "them as before"
        )
        if one.older_model:
            text += f" (those were made by version {one.older_model} of the model)"
        if one.former:
            text += (
                f"; {one.finished} finished before stay{'s' * (one.finished == 1)} stored, in the "
                f"study {one.former}: "
                f"compsim export {one.former} -i {shlex.quote(folder)} -o {one.former}.csv"
            )
        say(text)


def duration(seconds: float) -> str:
    """Seconds as people say them."""
    if seconds < 100:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60:02d} min"


def plural(count: int, thing: str = "job") -> str:
    """A number of things in words: 1 job, 2 jobs."""
    return f"{count} {thing}" + ("s" if count != 1 else "")


def all_stored(count: int, folder: str, thing: str = "job") -> str:
    """That there is nothing to run."""
    every = f"the {thing} is" if count == 1 else f"all {count} {thing}s are"
    return f"nothing to do: {every} stored in {folder}"


def stored_before(count: int) -> str:
    """That some of what was asked for was there already; "" for none."""
    return f", {count} {'was' if count == 1 else 'were'} stored before" if count else ""


as_json = click.option("--json", "as_json", is_flag=True, help="The same as JSON.")


def size(count: float) -> str:
    """Bytes as people say them."""
    for unit in ("B", "kB", "MB"):
        if count < 999.5:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.4g} GB"
