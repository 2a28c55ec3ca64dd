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
import os
import random
import select
import shutil
import signal
import struct
import time

from chaos.common import (
    FORK,
    SWEEP,
    Tally,
    call,
    case_file,
    differing,
    forked,
    fresh,
    mounted,
    run_here,
    whole,
)
from compressor.cases.load import load_studies
from compressor.store import merge
from compressor.store.status import verify
from compressor.store.stored import read_store

SHUTDOWN = 0x8004587D  # FS_IOC_SHUTDOWN, _IOR('X', 125, __u32) of linux/fs.h
NO_FLUSH = struct.pack("I", 2)  # FS_SHUTDOWN_FLAGS_NOLOGFLUSH
IMAGE_BYTES = 24 << 20
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


def unable(image):
    """Why power cannot be cut here; "" where it can: then `image` is an empty file system."""
    with open(image, "wb") as file:
        file.truncate(IMAGE_BYTES)
    try:
        call("mkfs.ext4", "-q", "-F", "-E", "lazy_itable_init=0,lazy_journal_init=0", image)
        with fresh(image.parent) as trial:
            shutil.copyfile(image, trial / "disk.img")
            with mounted(trial / "disk", "-o", "loop", trial / "disk.img") as disk:
                cut(disk)
            call("e2fsck", "-fy", trial / "disk.img", good=(0, 1))
    except (RuntimeError, OSError) as error:
        return str(error)
    return ""


def cut(place):
    """Cut a file system off, at once, without writing what it still holds in memory."""
    root = os.open(place, os.O_RDONLY)
    try:
        fcntl.ioctl(root, SHUTDOWN, NO_FLUSH)
    finally:
        os.close(root)


def fsync_less(control, real=os.fsync):
    """An fsync that does less than it says."""

    def fsync(descriptor):
        is_folder = os.path.isdir(f"/proc/self/fd/{descriptor}")
        if control == "no fsync of folders" and not is_folder:
            real(descriptor)

    return fsync


def next_of(reader, seconds):
    """What is told over a pipe next, or nothing in some seconds."""
    if not select.select([reader], [], [], seconds)[0]:
        return ""
    data = os.read(reader, 1 << 20)
    if not data:
        time.sleep(min(seconds, MAX_SECONDS))  # the sweep is over
    return data.decode()


class Campaign:
    """The trials of `campaign`: the studies, an undisturbed store, an `empty` file system."""

    def __init__(self, tally, folder, empty):
        self.tally, self.folder, self.empty = tally, folder, empty
        files = [case_file(folder, name, **values) for name, values in STUDIES.items()]
        self.studies = load_studies(*files)
        SWEEP.run_job(self.studies[0].cases[0])  # compiles what all need
        self.whole = forked(lambda: self.swept(folder / "whole"), 600).result

    def swept(self, store):
        """Run the sweep here; what is stored then."""
        run_here(20)
        SWEEP.sweep(self.studies, store, 1)
        return whole(store)

    def write(self, store, channel, control, every):
        """In a forked process: run a sweep that tells each acknowledged key over a pipe."""
        with contextlib.suppress(BaseException), open(os.devnull, "w") as nothing:
            os.setpgid(0, 0)
            os.dup2(nothing.fileno(), 2)
            os.fsync = fsync_less(control) if control else os.fsync
            merge.MAX_SMALL = 3
            count = 0

            def stored(keys):
                nonlocal count
                count += 1
                os.write(channel, "".join(f"{key}\n" for key in keys).encode())
                if every and count % every == 0:  # more often than the program does
                    merge.merge_batches(store)

            run_here(20, stored)
            SWEEP.sweep(self.studies, store, 1)

    def disturb(self, trial, rng, control):
        """Run a sweep and cut it off; the keys that were acknowledged. The image: `cut.img`."""
        shutil.copyfile(self.empty, trial / "disk.img")
        options, wait = rng.choice(OPTIONS), rng.uniform(0, MAX_SECONDS)
        promptly = bool(control) or rng.random() < 0.5  # upon an acknowledgement
        reader, channel = os.pipe()
        with mounted(trial / "disk", "-o", f"loop,{options}", trial / "disk.img") as disk:
            arguments = disk / "store", channel, control, rng.choice((0, 8))
            child = FORK.Process(target=self.write, args=arguments)
            child.start()
            os.close(channel)
            told = next_of(reader, 60)
            until = time.monotonic() + wait
            while (left := until - time.monotonic()) > 0:
                told += next_of(reader, left)
            told += next_of(reader, 5) if promptly else ""
            cut(disk)
            shutil.copyfile(trial / "disk.img", trial / "cut.img")
            child.join(30)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)
                self.tally.counts["writers that had to be killed"] += 1
        with open(reader, encoding="ascii") as file:
            return set((told + file.read()).split())

    def trial(self, number, control=""):
        """Cut the power once; whether an acknowledged result is lost."""
        rng = random.Random(f"{self.tally.seed} {number} {control}")
        with fresh(self.folder) as trial:
            acknowledged = self.disturb(trial, rng, control)
            call("e2fsck", "-fy", trial / "cut.img", good=(0, 1))
            with mounted(trial / "copy", "-o", "loop", trial / "cut.img") as disk:
                ended = forked(lambda: acknowledged - intact(disk / "store"))
                lost = acknowledged if ended.death else ended.result
                if control:
                    return bool(lost)
                again = forked(lambda: self.swept(disk / "store"))
                different = again.death or differing(again.result, self.whole)
                problems = [f"lost {len(lost)}: {ended.death}"] if lost else []
                problems += [f"not resumed: {different}"] if different else []
                self.tally.counts["acknowledged results"] += len(acknowledged)
                self.tally.note(f"trial {number}", "; ".join(problems))
        return bool(lost)


def intact(store):
    """The keys of a store's jobs, without those whose batches are damaged."""
    return read_store(store).keys().difference(*(damage.studies for damage in verify(store)))


def campaign(trials, seed, folder):
    """Cut the power so often; and see that it costs results where fsync is taken out."""
    what = "power cut: ext4 cut off while a sweep writes, its image checked and resumed"
    tally = Tally(what, seed, ("acknowledged results",))
    if reason := unable(folder / "empty.img"):
        return tally.result() | {"skipped": reason}
    tried = Campaign(tally, folder, folder / "empty.img")
    for number in range(trials):
        tried.trial(number)
    for control in CONTROLS if trials >= CONTROL_EVERY else CONTROLS[:1]:
        made = max(1, trials // CONTROL_EVERY)
        lost = sum(tried.trial(number, control) for number in range(made))
        tally.counts |= {f"controls, {control}": made, f"of these lost, {control}": lost}
        if not lost:
            tally.note(f"controls, {control}", "nothing is lost: the campaign would not notice")
    return tally.result()
