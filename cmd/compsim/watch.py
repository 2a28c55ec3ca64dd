"""`compsim run --watch`: a report that is kept fresh while a sweep runs, by a process of its own.

The process reads how the sweep stands, a line of JSON for each page that it is to write, and
answers each by a line. When nothing more can come, since the sweep has ended, was interrupted or
killed, it writes the page once more as `compsim report` does, which no longer loads itself again,
and ends.
"""

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from types import TracebackType
from typing import IO, TYPE_CHECKING, Any

from compressor.studies import page_additions
from compsim.screen import say

if TYPE_CHECKING:
    from compressor.sweep import SweepProgress

SECONDS = 5.0  # between two pages, and before the first
REDRAW_FACTOR = 20.0  # times what drawing takes: how long until figures are drawn again
NICENESS = 5  # of the process: jobs go first
MAX_DEATHS = 3  # of the process, before it is given up


class PageWatch:
    """A watch that keeps the page of a run fresh; a context manager around the sweep.

    How the run stands is written again every few seconds, and figures are drawn as often as costs
    jobs little: drawing has a twentieth of one core.

    Raises WrongName or StoreError at once where the report's folder cannot be made or written.
    """

    def __init__(self, results: str, report: str, command: str, quiet: bool = False):
        self.settings = {"results": os.path.abspath(results), "report": report, "command": command}
        self.page = os.path.join(report, "index.html")
        self.quiet = quiet
        self.process: subprocess.Popen[str] | None = None
        self.answers: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self.idle, self.due = True, time.monotonic() + SECONDS
        self.draw_due = self.due
        self.deaths = 0
        self.problems: set[str] = set()

    def __enter__(self) -> "PageWatch":
        from compressor.store import writable_folder

        writable_folder(self.settings["report"])
        if not self.quiet:
            say(f"{self.page} is kept fresh until the run has ended")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Have the ordinary page written."""
        if error is not None:
            again = "" if isinstance(error, Exception) else "; Ctrl-C again ends at once"
            say(f"writing {self.page} once more{again}")
        self.read_answers()
        while self.deaths < MAX_DEATHS and not self.finished():
            pass

    def update(self, now: "SweepProgress") -> None:
        """Have a page written if it is time; called several times a second."""
        self.read_answers()
        if not self.idle or time.monotonic() < self.due or self.deaths >= MAX_DEATHS:
            return
        running = {
            "done": now.done, "failed": now.failed, "total": now.total, "eta_s": now.left,
            "every_s": SECONDS, "at": time.strftime("%H:%M:%S"),
        }  # fmt: skip
        order = {"draw": time.monotonic() >= self.draw_due, "running": running}
        self.idle = False
        with contextlib.suppress(BrokenPipeError):  # heard of when it is waited for
            self.pipe().write(json.dumps(order) + "\n")
            self.pipe().flush()

    def pipe(self) -> IO[str]:
        """Return the input of the process, which is started where there is none."""
        if self.process is None:
            self.process = start_process(self.settings)
            threading.Thread(target=self.collect_answers, args=[self.process], daemon=True).start()
        assert self.process.stdin
        return self.process.stdin

    def collect_answers(self, process: "subprocess.Popen[str]") -> None:
        """Read answers of a process until it ends: in a thread."""
        assert process.stdout
        for line in process.stdout:
            self.answers.put(json.loads(line))
        self.answers.put({"ended": process.wait()})

    def read_answers(self, wait: bool = False) -> dict[str, Any]:
        """Act on the answers that have come; with `wait`, on the next one, which is returned."""
        answer: dict[str, Any] = {}
        with contextlib.suppress(queue.Empty):
            while True:
                answer = self.answers.get(block=wait)
                self.act_on(answer)
                if wait:
                    break
        return answer

    def act_on(self, answer: dict[str, Any]) -> None:
        """Act on an answer: a page was written, or not, or the process has ended."""
        self.idle = True
        if "ended" in answer:
            self.process = None
            if code := answer["ended"]:
                self.deaths += 1
                end = signal.Signals(-code).name if code < 0 else f"exit code {code}"
                self.report_problem(f"what writes it ended with {end}")
        self.due = time.monotonic() + SECONDS
        if answer.get("drawn", True):
            self.draw_due = time.monotonic() + REDRAW_FACTOR * answer.get("seconds", 0.0)
        if answer.get("problem"):
            self.report_problem(answer["problem"])

    def report_problem(self, problem: str) -> None:
        """Report once what is wrong with the page."""
        if problem not in self.problems:
            self.problems.add(problem)
            say(f"{self.page} is not fresh: {problem}; the run does not depend on it")

    def finished(self) -> bool:
        """Return whether the process has written the ordinary page and has ended."""
        process = self.process
        with contextlib.suppress(BrokenPipeError):
            self.pipe().close()  # which starts a process where none has begun, or it has died
        process = process or self.process
        assert process
        if not self.idle:
            process.send_signal(signal.SIGINT)  # leave the page that is being written
        while "ended" not in (answer := self.read_answers(wait=True)):
            pass
        return not answer["ended"]


def start_process(settings: dict[str, str]) -> "subprocess.Popen[str]":
    """Return the process, in a session of its own: Ctrl-C is for the run."""
    return subprocess.Popen(
        [sys.executable, "-m", "compsim.watch", json.dumps(settings)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        start_new_session=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
    )  # fmt: skip


# ---- the process --------------------------------------------------------------------------------


class PageOutdated(BaseException):
    """The end of a page that is out of date; no handler of errors shall catch it."""


class PageWriter:
    """A writer of pages; SIGINT makes it leave the one that is being written."""

    def __init__(self, settings: dict[str, str]):
        self.settings = settings
        self.writing = False
        self.shown: Any = None  # how the run stood on the page that lies there
        signal.signal(signal.SIGINT, self.leave)

    def leave(self, *_: object) -> None:
        """Raise PageOutdated if a page is being written; called by the signal."""
        if self.writing:
            self.writing = False
            raise PageOutdated

    def write(self, running: dict[str, Any] | None, draw: bool = True) -> dict[str, Any]:
        """Write a page, the ordinary one if nothing is running, and return the answer.

        draw: figures and tables, too, and not only how the run stands.
        """
        answer: dict[str, Any] = {"drawn": draw or self.shown is None}
        began = spent()
        try:
            from compressor.report import Running, restate, write_report  # loads matplotlib, once

            began = spent()
            self.writing = running is not None
            drawn = (
                running["at"] if running and answer["drawn"] else self.shown and self.shown.drawn
            )
            now = Running(**running, drawn=drawn) if running else None
            if now and not answer["drawn"]:
                restate(self.settings["report"], self.shown, now)
            else:
                write_report(
                    self.settings["results"], self.settings["report"], self.settings["command"],
                    page_additions({}), now,
                )  # fmt: skip
            self.shown = now
        except PageOutdated:
            answer["left"] = True
        except Exception as error:
            answer["problem"] = f"{type(error).__name__}: {error}".splitlines()[0]
        self.writing = False
        return answer | {"seconds": spent() - began}


def spent() -> float:
    """Return the seconds of processor time of this process and of those that it has waited for."""
    return sum(os.times()[:4])


def main(settings: str) -> None:
    """Write a page for each line of input, and the last one when no more can come."""
    os.nice(NICENESS)
    writer = PageWriter(json.loads(settings))
    for line in sys.stdin:
        answer(writer.write(**json.loads(line)))
    answer(writer.write(None))


def answer(words: dict[str, Any]) -> None:
    """Answer the run, if it is still there."""
    with contextlib.suppress(OSError):
        print(json.dumps(words), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
