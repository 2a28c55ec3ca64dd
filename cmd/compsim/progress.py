"""Progress on stderr: rich's line on a terminal, elsewhere a line now and then."""

import math
import os
import sys
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from compressor.digits import plural
from compressor.program import duration
from compsim import screen

if TYPE_CHECKING:
    from compressor.cases import Study

# of lines where stderr is no terminal: until the first, and between two others
FIRST_SECONDS, QUIET_SECONDS, QUIET_SHARE = 1.0, 10.0, 0.05
BAR_WIDTH = 24  # columns


class ProgressReporter:
    """A reporter of how many things are done, until the end of its `with`.

    things: what is counted; folder: where those done are stored, which is said if this ends early;
    open: called once, before the first is done. A terminal that cannot draw (TERM=dumb), or shall
    not (NO_COLOR), is taken for a log.
    """

    def __init__(
        self, quiet: bool, things: str = "jobs", folder: str = "", open: Callable | None = None
    ):
        from rich.console import Console  # a tenth of a second
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
        from rich.table import Column

        drawing = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
        self.live = sys.stderr is not None and sys.stderr.isatty() and drawing
        self.quiet, self.things, self.folder, self.open = quiet, things, folder, open
        self.done = self.total = self.failed = 0
        self.began = self.logged = time.monotonic()  # logged: when a line was last written
        self.logged_done = -1
        console = Console(file=sys.stderr)
        narrow = console.width <= 2 * BAR_WIDTH
        text = TextColumn("{task.description}", table_column=Column(no_wrap=True))
        columns = [*([] if narrow else [BarColumn(BAR_WIDTH)]), text, TimeRemainingColumn()]
        self.line = Progress(
            *columns,
            console=console,
            transient=True,
            refresh_per_second=4,
            get_time=time.monotonic,
            speed_estimate_period=math.inf,  # jobs may take longer than rich's half a minute
        )
        self.task = self.line.add_task("", total=None)

    @property
    def seconds(self) -> float:
        """Return the wall time since this began."""
        return time.monotonic() - self.began

    def __enter__(self) -> "ProgressReporter":
        return self

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        """Report the end, and where those done are stored if it comes early."""
        if self.line.live.is_started:
            self.line.stop()
        if self.logged_done not in (-1, self.done):
            screen.say(self.words())
        if error and self.folder and self.total:
            from compressor.store import FolderLost

            if isinstance(error, FolderLost):
                return
            total = plural(self.total, self.things.removesuffix("s"))
            # at least: a worker may just have stored more
            stored = f"at least {self.done} of {total} {'is' if self.total == 1 else 'are'} stored"
            screen.say(f"{stored} in {self.folder}; the same command goes on from there")

    def __call__(self, done: int, total: int, remark: str) -> None:
        """Report progress (`compressor.program.Progress`)."""
        self.done, self.total = done, total
        if self.quiet:
            return
        if remark:
            screen.say_wrapped(remark)
        elif self.open:
            self.open()
            self.open = None
        words = self.words("[red]{}[/red]")
        self.line.update(self.task, completed=done, total=total, description=words)
        if self.live:
            self.line.start()
        else:
            self.log()

    def count_failed(self, failed: int) -> None:
        """Say from now on how many of those done have failed."""
        self.failed = failed

    def words(self, failed: str = "{}") -> str:
        """Return how many are done, and how many failed, as this writes it."""
        things = self.things if self.total != 1 else self.things.removesuffix("s")
        share = f", {100 * self.done // self.total} %" if self.total else ""
        bad = failed.format(f", {self.failed} failed") if self.failed else ""
        return f"{self.done} of {self.total} {things}{share}{bad}"

    def log(self) -> None:
        """Write a line where the last one was long ago: the longer, the longer this has lasted."""
        now = time.monotonic()
        wait = FIRST_SECONDS
        if self.logged_done >= 0:
            wait = max(QUIET_SECONDS, QUIET_SHARE * (now - self.began))
        if self.done < self.total and now - self.logged >= wait:
            self.logged, self.logged_done = now, self.done
            left = self.line.tasks[0].time_remaining
            screen.say(self.words() + (f", about {duration(left)} left" if left else ""))


def read_cases(paths: Sequence[str], quiet: bool = False, **how: Any) -> "list[Study]":
    """Return the studies of case files, as `load_studies` does, and report its progress."""
    from compressor.cases import load_studies

    with ProgressReporter(quiet, "cases read") as progress:
        return load_studies(*paths, progress=progress, **how)
