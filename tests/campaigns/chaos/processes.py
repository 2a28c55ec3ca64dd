"""Runs of `compsim` in sessions of their own: watched on a terminal, killed, searched for orphans.

A run is the real command, `python -m compsim`, or a fork of this process that calls its `main`:
that starts in milliseconds, and can be prepared (slow disks, jobs poisoned).
"""

import contextlib
import os
import pty
import re
import select
import signal
import sys
import time
from functools import cache, partial
from pathlib import Path

from compsim.cli import main
from stores_compared import contents

from chaos.common import FOREIGN, FORK, SWEEP, fresh, rods_file
from compressor.sweep.worker import Workers

PROGRESS = re.compile(rb"(\d+) of \d+ jobs, \d+ %")
JOBS = {"metrics": (100, 600), "series": (24, 24)}  # of `start`, and of its real command
MASSES = [3 + n / 500 for n in range(24)]  # of the first rods of `start`, kg


class Run:
    """A run of `compsim` in a folder, with a terminal for its progress.

    real: the command itself; else a fork, in which `prepare` is called first.
    """

    def __init__(self, arguments, folder, real=False, prepare=lambda: None):
        self.master, slave = pty.openpty()
        self.terminal = b""
        self.child = FORK.Process(target=become, args=(arguments, folder, slave, real, prepare))
        self.child.start()
        self.pid = self.child.pid
        os.close(slave)

    def watch(self, seconds):
        """Take in what the terminal shows, for so long, or until the run ends; whether it runs."""
        until = time.monotonic() + seconds
        self.read()
        while self.child.is_alive() and time.monotonic() < until:
            self.read(min(0.005, max(0.0, until - time.monotonic())))
        return self.child.is_alive()

    def read(self, patience=0.0):
        """What the terminal shows; nothing where nobody has it open any more."""
        while select.select([self.master], [], [], patience)[0]:
            try:
                self.terminal += os.read(self.master, 1 << 16)
            except OSError:
                time.sleep(patience)
                return
            patience = 0.0

    def send(self, number, whole=False):
        """Send a signal to itself alone, or to each of its session."""
        for pid in members(self.pid) if whole else [self.pid]:
            with contextlib.suppress(ProcessLookupError):  # it may have ended
                os.kill(pid, number)

    def finish(self, seconds=120.0, orphans=5.0):
        """Wait for its end, and that of all it started; its exit code, or what went wrong."""
        if late := self.watch(seconds):
            self.send(signal.SIGKILL, whole=True)
            self.watch(5.0)
        deadline = time.monotonic() + orphans
        while (left := members(self.pid)) and time.monotonic() < deadline:
            self.read(0.01)
        for pid in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.read()
        os.close(self.master)
        if late or left:
            return f"{late=} by {seconds:g} s, {len(left)} processes outlived it by {orphans:g} s"
        return self.child.exitcode

    def told(self):
        """How many stored jobs its progress has told of: those that it has acknowledged."""
        return int((PROGRESS.findall(self.terminal) or [0])[-1])

    def text(self):
        """All that its terminal has shown."""
        return self.terminal.decode(errors="replace").replace("\r\n", "\n")


def start(folder, keep, is_real=False):
    """Start a sweep in a folder, to its subfolder `out`."""
    rods_file(folder, "rods", [3 + n / 500 for n in range(JOBS[keep][is_real])], keep)
    return Run(["run", "rods.yaml", "-j", "2", "-r", "out"], folder, is_real, hurried)


def hurried():
    """Have a fork's workers store all the time, on a slow disk: that is what kills should hit."""
    SWEEP.Workers = partial(Workers, target_seconds=0.02)
    SWEEP.store_outcomes = store_slowly


def store_slowly(folder, outcomes, real=SWEEP.store_outcomes, fsync=os.fsync):
    """Store a batch, in a worker, on a disk that takes its time."""
    os.fsync = lambda descriptor: (time.sleep(0.02), fsync(descriptor))
    return real(folder, outcomes)


@cache
def undisturbed(folder, keep, is_real=False):
    """The seconds of a sweep that nobody disturbs, and what it stores: key -> digest."""
    with fresh(folder) as place:
        began, run = time.monotonic(), start(place, keep, is_real)
        code = run.finish(600)  # it may have to compile
        assert code == 0, f"{code}: {run.text()[-500:]}"
        return time.monotonic() - began, contents(place / "out", FOREIGN)


def become(arguments, folder, terminal, real, prepare):
    """Make a forked child the run: session, folder, streams, command; never returns."""
    os.setsid()
    os.chdir(folder)
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream, source in enumerate((nothing, nothing, terminal)):
        os.dup2(source, stream)
    os.closerange(3, 1024)
    if real:
        os.execv(sys.executable, [sys.executable, "-m", "compsim", *arguments])
    sys.stdout, sys.stderr = open(1, "w"), open(2, "w", buffering=1)
    prepare()
    sys.exit(main(arguments))


def members(session):
    """The processes of a session that are no zombies."""
    found = []
    for name in os.listdir("/proc"):
        if name.isdecimal():
            with contextlib.suppress(OSError):
                fields = Path("/proc", name, "stat").read_text().rpartition(")")[2].split()
                if int(fields[3]) == session and fields[0] not in "ZX":
                    found.append(int(name))
    return found
