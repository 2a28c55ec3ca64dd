"""Runs of `compsim` in sessions of their own: watched on a terminal, killed, searched for orphans.

A run is the real command, `python -m compsim`, or a fork of this process that calls its `main`:
that starts in milliseconds, since all is imported, and can be prepared (slow clocks made fast, jobs
poisoned).
"""

import contextlib
import os
import pty
import re
import select
import signal
import sys
import termios
import time
import traceback
from multiprocessing import resource_tracker
from pathlib import Path

from compsim.cli import main
from joblib.externals.loky.backend import resource_tracker as loky_tracker

PROGRESS = re.compile(rb"(\d+) of \d+ jobs, \d+ %")
MIN_FILES = 3  # the first descriptor that is no standard stream
MAX_FILES = 1024


class Run:
    """A run of `compsim` in a folder, with a terminal for its progress.

    real: the command itself; else a fork, in which `prepare` is called first.
    """

    def __init__(self, arguments, folder, real=False, prepare=lambda: None):
        self.master, slave = pty.openpty()
        mode = termios.tcgetattr(slave)
        mode[1] &= ~termios.OPOST  # lines end as they were written
        termios.tcsetattr(slave, termios.TCSANOW, mode)
        self.terminal, self.code = b"", None
        self.pid = os.fork()
        if not self.pid:
            become(arguments, folder, slave, real, prepare)
        os.close(slave)

    def watch(self, seconds):
        """Take in what the terminal shows, for so long, or until the run ends; whether it runs."""
        until = time.monotonic() + seconds
        self.read()
        while self.runs() and time.monotonic() < until:
            self.read(min(0.005, max(0.0, until - time.monotonic())))
        return self.runs()

    def read(self, patience=0.0):
        """What the terminal shows; nothing where nobody has it open any more."""
        while select.select([self.master], [], [], patience)[0]:
            try:
                self.terminal += os.read(self.master, 1 << 16)
            except OSError:
                time.sleep(patience)
                return
            patience = 0.0

    def runs(self):
        """Whether it has not ended."""
        if self.code is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.code = os.waitstatus_to_exitcode(status)
        return self.code is None

    def workers(self):
        """Its child processes that run."""
        return [pid for pid, parent in members(self.pid).items() if parent == self.pid]

    @contextlib.contextmanager
    def held(self):
        """Stop all its processes for a while, so that it does not end while one looks at it."""
        self.send(signal.SIGSTOP, whole=True)
        try:
            yield
        finally:
            self.send(signal.SIGCONT, whole=True)

    def kill(self, whole=False):
        """SIGKILL, of itself alone or of the whole session at once."""
        self.send(signal.SIGKILL, whole)

    def send(self, number, whole):
        """Send a signal to itself alone, or to the whole session at once."""
        with contextlib.suppress(ProcessLookupError):  # it may have ended
            (os.killpg if whole else os.kill)(self.pid, number)

    def kill_one(self, pid):
        """SIGKILL of one of its processes."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)

    def orphans(self, seconds):
        """Processes of its session that still run so long after its end, which are killed then."""
        deadline = time.monotonic() + seconds
        while (left := members(self.pid)) and time.monotonic() < deadline:
            self.read(0.01)
        for pid in left:
            self.kill_one(pid)
        self.read()
        return list(left)

    def finish(self, seconds=120.0, orphans=5.0):
        """Wait for its end, and that of all it started; its exit code, or what went wrong."""
        late = self.watch(seconds)
        if late:
            self.kill(whole=True)
            self.watch(5.0)
        left = self.orphans(orphans)
        os.close(self.master)
        if late:
            return f"ran for more than {seconds:g} s"
        return f"{len(left)} processes outlived it by {orphans:g} s" if left else self.code

    def told(self):
        """How many stored jobs its progress has told of: those that it has acknowledged."""
        found = PROGRESS.findall(self.terminal)
        return int(found[-1]) if found else 0

    def text(self):
        """All that its terminal has shown."""
        return self.terminal.decode(errors="replace")


def become(arguments, folder, terminal, real, prepare):
    """Make a forked child the run: session, folder, streams, command; never returns."""
    code = 70
    try:
        os.setsid()
        os.chdir(folder)
        nothing = os.open(os.devnull, os.O_RDWR)
        for stream, source in enumerate((nothing, nothing, terminal)):
            os.dup2(source, stream)
        os.closerange(MIN_FILES, MAX_FILES)
        for tracker in (resource_tracker, loky_tracker):
            tracker._resource_tracker._fd = None  # it is our parent's
        if real:
            os.execv(sys.executable, [sys.executable, "-m", "compsim", *arguments])
        sys.stdout, sys.stderr = open(1, "w"), open(2, "w", buffering=1)
        prepare()
        code = main(arguments)
        sys.stdout.flush()
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def members(session):
    """The processes of a session that are no zombies: number -> parent's number."""
    found = {}
    for name in os.listdir("/proc"):
        if name.isdecimal():
            with contextlib.suppress(OSError):
                fields = Path("/proc", name, "stat").read_text().rpartition(")")[2].split()
                if int(fields[3]) == session and fields[0] not in "ZX":
                    found[int(name)] = int(fields[1])
    return found
