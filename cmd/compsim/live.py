"""One line of progress at the foot of a terminal, drawn anew by rich several times a second."""

import sys
from collections.abc import Callable

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task
from rich.text import Text

A_SECOND = 4  # times that the line is drawn
BAR = 24  # columns


class SteadyConsole(Console):
    """A console that leaves the cursor visible, which a process that is killed cannot restore."""

    def show_cursor(self, show: bool = True) -> bool:
        """Leave the cursor as it is."""
        return False


class Words(ProgressColumn):
    """The words of the line, asked for whenever it is drawn."""

    def __init__(self, words: Callable[[], tuple[str, str, str]]):
        super().__init__()
        self.words = words

    def render(self, task: Task) -> Text:
        """Return the counts, failures in red, and the time that is left.

        Cut where the line is too short.
        """
        counts, failed, left = self.words()
        return Text.assemble(counts, (failed, "red"), left, no_wrap=True, overflow="ellipsis")


class ProgressLine:
    """The line, from its making until `stop`, which takes it away."""

    def __init__(self, words: Callable[[], tuple[str, str, str]]):
        console = SteadyConsole(file=sys.stderr)
        columns = (BarColumn(BAR), Words(words)) if console.width > 2 * BAR else (Words(words),)
        self.progress = Progress(
            *columns, console=console, transient=True, refresh_per_second=A_SECOND
        )
        self.task = self.progress.add_task("")
        self.progress.start()

    def show(self, done: int, total: int) -> None:
        """How far the bar is."""
        self.progress.update(self.task, completed=done, total=total)

    def stop(self) -> None:
        """Draw no more, and leave an empty line."""
        self.progress.stop()
