"""Progress on stderr: a line that rich redraws on a terminal, elsewhere one now and then."""

import os
import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING

from compressor.program import duration
from compsim.screen import plural, say, say_wrapped

if TYPE_CHECKING:
    from rich.progress import Progress

    from compressor.sweep import SweepProgress

# of lines where stderr is no terminal: until the first, and between two others
FIRST_SECONDS, QUIET_SECONDS, QUIET_SHARE = 1.0, 10.0, 0.05
MIN_DONE_FOR_ETA = 5  # things done that a guess of the time rests on
BAR_WIDTH = 24  # columns


class ProgressReporter:
    """A reporter of how many things are done, until the end of its `with`.

    things: what is counted; alike: each takes about as long; folder: where those done are stored,
    which is said if this ends early; open: called once, before the first is done. A
    terminal that cannot draw (TERM=dumb), or shall not (NO_COLOR), is taken for a log.
    """

    def __init__(
        self,
        quiet: bool,
        things: str = "jobs",
        alike: bool = True,
        folder: str = "",
        open: Callable[[], object] | None = None,
    ):
        drawing = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
        self.quiet, self.live = quiet, sys.stderr.isatty() and drawing
        self.things, self.alike, self.folder, self.open = things, alike, folder, open
        self.done = self.total = self.failed = 0
        self.began = self.logged = time.monotonic()  # logged: when a line was last written
        self.logged_done = -1
        # how many were done, and when: at the start, at the first end (it had waited for all to
        # start), at the last one
        self.ends: list[tuple[int, float]] = []
        self.known: tuple[float, bool, float] | None = None  # s left, at least, since when
        self.line: Progress | None = None

    def __enter__(self) -> "ProgressReporter":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Report the end, and where those done are stored if it comes early."""
        self.end()
        if error and self.folder and self.total:
            stored = f"{self.done} of {plural(self.total, self.things.removesuffix('s'))}"
            verb = "is" if self.total == 1 else "are"
            say(f"{stored} {verb} stored in {self.folder}; the same command goes on from there")

    def end(self) -> None:
        """Remove the line of progress; in a log, end with how far it came."""
        if self.line:
            self.line.stop()
            self.line = None
        elif 0 <= self.logged_done != self.done and not self.quiet:
            say(self.words())

    def __call__(self, done: int, total: int, remark: str) -> None:
        """Report progress (`compressor.program.Progress`)."""
        if not self.ends or done < self.ends[0][0]:
            self.ends = [(done, 0.0)]
        elif done > self.ends[-1][0]:
            self.ends[2:] = [(done, time.monotonic())]
        self.done, self.total = done, total
        if self.quiet:
            return
        if remark:
            say_wrapped(remark)
        elif self.open:
            self.open()
            self.open = None
        if self.live:
            self.draw()
        else:
            self.log()

    def show_sweep(self, now: "SweepProgress") -> None:
        """Report the progress of a sweep, which knows best how long it will take."""
        self.alike, self.failed = False, now.failed
        self.known = None if now.left is None else (now.left, now.at_least, time.monotonic())
        if self.total and not self.quiet and not self.live:
            self.log()

    def words(self, failed: str = "{}") -> str:
        """Return how many are done, how many failed (as this writes it), and the time left."""
        things = self.things if self.total != 1 else self.things.removesuffix("s")
        share = f", {100 * self.done // self.total} %" if self.total else ""
        bad = failed.format(f", {self.failed} failed") if self.failed else ""
        return f"{self.done} of {self.total} {things}{share}{bad}{self.time_left()}"

    def __str__(self) -> str:
        """Return the words as rich draws them: failures in red."""
        return self.words("[red]{}[/red]")

    def time_left(self) -> str:
        """Return a guess of the time that is left, "" as long as too little is known for one."""
        if self.done == self.total:
            return ""
        now = time.monotonic()
        if self.known:
            seconds, at_least, since = self.known
            return f", {'over ' * at_least}{format_guess(seconds - (now - since))} left"
        if not self.alike or len(self.ends) < 3:
            return ""
        (first, began), (last, ended) = self.ends[1:]
        if last - first < MIN_DONE_FOR_ETA or ended - began < FIRST_SECONDS:
            return ""
        ahead = (ended - began) / (last - first) * (self.total - last)
        return f", {format_guess(ahead - (now - ended))} left"

    def draw(self) -> None:
        """Show the line of progress on a terminal."""
        self.line = self.line or start_line(self)
        self.line.update(self.line.task_ids[0], completed=self.done, total=self.total)

    def log(self) -> None:
        """Write a line where the last one was long ago: the longer, the longer this has lasted."""
        now = time.monotonic()
        wait = FIRST_SECONDS
        if self.logged_done >= 0:
            wait = max(QUIET_SECONDS, QUIET_SHARE * (now - self.began))
        if self.done < self.total and now - self.logged >= wait:
            self.logged, self.logged_done = now, self.done
            say(self.words())


def start_line(words: object) -> "Progress":
    """Return a line that rich draws at the foot of a terminal, with words in it as they are then.

    Its `stop` takes it away.
    """
    # a tenth of a second
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn
    from rich.table import Column

    class SteadyConsole(Console):
        """A console that leaves the cursor visible, which a killed process cannot restore."""

        def show_cursor(self, show: bool = True) -> bool:
            return False

    console = SteadyConsole(file=sys.stderr)
    text = TextColumn(
        "{task.fields[words]}", table_column=Column(no_wrap=True, overflow="ellipsis")
    )
    columns = (BarColumn(BAR_WIDTH), text) if console.width > 2 * BAR_WIDTH else (text,)
    line = Progress(*columns, console=console, transient=True, refresh_per_second=4)
    line.add_task("", words=words)
    line.start()
    return line


def format_guess(seconds: float) -> str:
    """Return seconds that are a guess."""
    return duration(seconds) if seconds >= 1 else "under 1 s"
