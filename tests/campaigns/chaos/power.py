"""Power cuts: the file system is cut off while a sweep writes, and what the disk holds is resumed.

The store lies on an ext4 file system in an image file. At a random moment FS_IOC_SHUTDOWN, without
flushing the journal, stops all its writing at once, as a power cut would (xfstests does the same);
the image is then what had reached the disk, and is copied. The copy is checked by e2fsck, mounted,
compared with all that had been acknowledged, and the sweep is resumed on it. A disk that keeps
written blocks in a volatile cache is not modelled: ext4 asks it to flush them where we sync.

The campaign proves itself: with fsync taken out of the program, of files and folders or of folders
alone, acknowledged results are lost.
"""

import contextlib
import fcntl
import json
import os
import random
import select
import shutil
import signal
import struct
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from chaos.common import SOLVE, contents, forked, fresh
from chaos.tally import Tally
from compressor.cases.load import load_studies
from compressor.cases.study import Study
from compressor.store import writer
from compressor.store.reader import read_store
from compressor.sweep.sweep import sweep

SHUTDOWN = 0x8004587D  # FS_IOC_SHUTDOWN, _IOR('X', 125, __u32) of linux/fs.h
NO_FLUSH = 2  # FS_SHUTDOWN_FLAGS_NOLOGFLUSH
IMAGE_BYTES = 24 << 20
TOOLS = ("mkfs.ext4", "e2fsck", "mount", "umount")
OPTIONS = ("commit=1", "commit=5", "commit=1,data=writeback", "commit=1,nodelalloc")
CONTROLS = ("no fsync", "no fsync of folders")
CONTROL_EVERY = 5  # trials; each control. A sample has the first alone: it never fails to lose
MAX_SECONDS = 1.5  # from the first acknowledged job to the cut
STUDIES = {
    "rows": {
        "joint": "big_end", "clearance_mm": {"linspace": [0.05, 0.3, 251]},
        "machine": {"rod_mass_kg": [4, 4.5, 5, 5.5]}, "output": {"keep": "metrics"},
    },
    "series": {"joint": "small_end", "clearance_mm": {"linspace": [0.1, 0.3, 21]}},
}  # fmt: skip


def unable(image: Path) -> str:
    """Why power cannot be cut here; "" where it can: then `image` is an empty file system."""
    if os.geteuid() != 0:
        return "only root may mount an image"
    absent = [tool for tool in TOOLS if not shutil.which(tool)]
    if absent:
        return f"{', '.join(absent)} not installed"
    with open(image, "wb") as file:
        file.truncate(IMAGE_BYTES)
    try:
        call("mkfs.ext4", "-q", "-F", "-E", "lazy_itable_init=0,lazy_journal_init=0", image)
        with fresh(image.parent, "able") as trial:
            shutil.copyfile(image, trial / "disk.img")
            with mounted(trial / "disk.img", trial / "disk", "commit=5") as disk:
                cut(disk)
    except (RuntimeError, OSError) as error:
        return str(error)
    return ""


def studies(folder: Path) -> list[Study]:
    """The studies that are run: a thousand quick jobs, and some with time series."""
    for name, values in STUDIES.items():
        text = json.dumps(values | {"solve": SOLVE})
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return load_studies(*(folder / f"{name}.yaml" for name in STUDIES))


@contextlib.contextmanager
def mounted(image: Path, place: Path, options: str) -> Iterator[Path]:
    """An image's file system on a folder."""
    place.mkdir()
    call("mount", "-o", f"loop,{options}", image, place)
    try:
        yield place
    finally:
        call("umount", place)


def call(*words: object, good: tuple[int, ...] = (0,)) -> None:
    """Call a program; raises RuntimeError with what it says."""
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode not in good:
        raise RuntimeError(f"{words[0]}: {done.returncode}: {done.stdout}{done.stderr}")


def write(wanted: list[Study], store: Path, channel: int, control: str, rng: random.Random) -> None:
    """In a forked process: run a sweep that tells each acknowledged key over a pipe."""
    if rng.random() < 0.5:  # write and merge more often than the program does
        writer.MAX_AGE, writer.MAX_SMALL, writer.MAX_SMALL_AT_END = 0.05, 5, 2
    if control:
        os.fsync = without(control)
    flush = writer.Writer.flush

    def told(self: writer.Writer) -> list[str]:
        keys = flush(self)
        os.write(channel, "".join(f"{key}\n" for key in keys).encode())
        return keys

    writer.Writer.flush = told  # type: ignore[method-assign]
    sweep(wanted, store, 1)


def without(control: str) -> Any:
    """An fsync that does less than it says."""
    real = os.fsync

    def fsync(descriptor: int) -> None:
        is_folder = os.path.isdir(f"/proc/self/fd/{descriptor}")
        if control == "no fsync of folders" and not is_folder:
            real(descriptor)

    return fsync


def next_of(reader: int, seconds: float) -> str:
    """What is told over a pipe next, or nothing in some seconds."""
    if not select.select([reader], [], [], seconds)[0]:
        return ""
    data = os.read(reader, 1 << 20)
    if not data:
        time.sleep(min(seconds, MAX_SECONDS))  # the sweep is over
    return data.decode()


def cut(place: Path) -> None:
    """Cut a file system off, at once, without writing what it still holds in memory."""
    root = os.open(place, os.O_RDONLY)
    try:
        fcntl.ioctl(root, SHUTDOWN, struct.pack("I", NO_FLUSH))
    finally:
        os.close(root)


class Campaign:
    """The trials of `campaign`: the studies, an undisturbed store, an `empty` file system."""

    def __init__(self, tally: Tally, folder: Path, empty: Path):
        self.tally, self.folder, self.empty = tally, folder, empty
        self.studies = studies(folder)
        sweep(self.studies, folder / "whole", 1)
        self.whole = contents(folder / "whole")

    def disturbed(self, trial: Path, rng: random.Random, control: str) -> set[str]:
        """Run a sweep and cut it off; the keys that were acknowledged. The image: `cut.img`."""
        shutil.copyfile(self.empty, trial / "disk.img")
        options = rng.choice(OPTIONS)
        wait = rng.uniform(0, MAX_SECONDS)
        promptly = bool(control) or rng.random() < 0.5  # upon an acknowledgement
        reader, channel = os.pipe()
        with mounted(trial / "disk.img", trial / "disk", options) as disk:
            child = os.fork()
            if not child:
                with contextlib.suppress(BaseException), open(os.devnull, "w") as nothing:
                    os.setpgid(0, 0)
                    os.dup2(nothing.fileno(), 2)
                    write(self.studies, disk / "store", channel, control, rng)
                os._exit(0)
            os.close(channel)
            told = next_of(reader, 60)
            until = time.monotonic() + wait
            while (left := until - time.monotonic()) > 0:
                told += next_of(reader, left)
            told += next_of(reader, 5) if promptly else ""
            cut(disk)
            shutil.copyfile(trial / "disk.img", trial / "cut.img")
            self.end(child)
        with open(reader, encoding="ascii") as file:
            return set((told + file.read()).split())

    def end(self, child: int) -> None:
        """Wait for a process that meets a dead disk, and for its workers."""
        until = time.monotonic() + 30
        while time.monotonic() < until and os.waitpid(child, os.WNOHANG) == (0, 0):
            time.sleep(0.01)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child, signal.SIGKILL)
            self.tally.counts["writers that had to be killed"] += 1

    def trial(self, number: int, control: str = "") -> bool:
        """Cut the power once; whether an acknowledged result is lost."""
        rng = random.Random(f"{self.tally.seed} {number} {control}")
        with fresh(self.folder, "trial") as trial:
            acknowledged = self.disturbed(trial, rng, control)
            call("e2fsck", "-fy", trial / "cut.img", good=(0, 1))
            with mounted(trial / "cut.img", trial / "copy", "commit=5") as disk:
                store = disk / "store"
                ended = forked(lambda: acknowledged - intact(store))
                lost = acknowledged if ended.death else ended.result
                if control:
                    return bool(lost)
                self.tally.trials += 1
                self.tally.counts["acknowledged results"] += len(acknowledged)
                if lost:
                    self.tally.fail(f"trial {number}", f"lost {len(lost)}: {ended.death}")
                again = forked(lambda: (sweep(self.studies, store, 1), contents(store))[1])
                if again.death:
                    self.tally.fail(f"trial {number}", f"not resumed: {again.death}")
                elif differing := [n for n in self.whole if again.result.get(n) != self.whole[n]]:
                    self.tally.fail(f"trial {number}", f"differs after resuming: {differing}")
        return bool(lost)


def intact(store: Path) -> set[str]:
    """The keys of a store's jobs, without those whose time series are damaged."""
    if not store.exists():
        return set()
    rows = read_store(store).rows
    keys = (key.decode() for key in rows.columns["key"])
    return {key for position, key in enumerate(keys) if rows.intact(position)}


def campaign(trials: int, seed: int, folder: Path) -> dict[str, Any]:
    """Cut the power so often; and see that it costs results where fsync is taken out."""
    what = "power cut: ext4 cut off while a sweep writes, its image checked and resumed"
    tally = Tally(what, seed, ("acknowledged results",))
    if reason := unable(folder / "empty.img"):
        return tally.result() | {"skipped": reason}
    tried = Campaign(tally, folder, folder / "empty.img")
    for number in range(trials):
        tried.trial(number)
    for control in CONTROLS if trials >= CONTROL_EVERY else CONTROLS[:1]:
        tally.counts[f"controls, {control}"] = tally.counts[f"of these lost, {control}"] = 0
        for number in range(max(1, trials // CONTROL_EVERY)):
            tally.counts[f"controls, {control}"] += 1
            tally.counts[f"of these lost, {control}"] += tried.trial(number, control)
        if not tally.counts[f"of these lost, {control}"]:
            tally.fail(f"controls, {control}", "nothing is lost: the campaign would not notice")
    return tally.result()
