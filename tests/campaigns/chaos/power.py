"""Power cuts: the file system is cut off while a sweep writes, and what the disk holds is resumed.

The store lies on an ext4 file system in an image file. At a random moment FS_IOC_SHUTDOWN, without
flushing the journal, stops all its writing, as xfstests does. A copy of the image, which has what
had reached the disk, is checked by e2fsck, mounted, compared with what had been acknowledged, and
the sweep is resumed on it. A volatile cache of the disk is not modelled: ext4 has it flushed where
we sync. With fsync taken out of the program acknowledged results are lost.
"""

import contextlib
import fcntl
import itertools
import math
import os
import shutil
import signal
import struct
import time
from functools import cache

from stores_compared import differing

from chaos import common
from compressor.cases.load import load_studies
from compressor.store import merge
from compressor.store.status import verify
from compressor.store.stored import read_store

WHAT = "power cut: ext4 cut off while a sweep writes, its image checked and resumed"
SHUTDOWN = 0x8004587D  # FS_IOC_SHUTDOWN, _IOR('X', 125, __u32) of linux/fs.h
NO_FLUSH = struct.pack("I", 2)  # FS_SHUTDOWN_FLAGS_NOLOGFLUSH
IMAGE_BYTES = 24 << 20
OPTIONS = ("commit=1", "commit=5", "commit=1,data=writeback", "commit=1,nodelalloc")
CONTROL_EVERY = 5  # trials: the power is cut once more, without fsync
LONG = 600.0  # s, of a whole sweep on a busy machine
MAX_SECONDS = 1.5  # from the first acknowledged job to the cut
JOBS = {"metrics": 1000, "series": 21}


def unable(folder):
    """Why power cannot be cut here; "" where it can: the folder then has an `empty.img`."""
    image, tried = folder / "empty.img", folder / "tried.img"
    with open(image, "wb") as file:
        file.truncate(IMAGE_BYTES)
    try:
        common.call("mkfs.ext4", "-q", "-F", "-E", "lazy_itable_init=0,lazy_journal_init=0", image)
        with common.mounted(folder / "tried", "-o", "loop", shutil.copyfile(image, tried)) as disk:
            cut(disk)
        common.call("e2fsck", "-fy", tried, good=(0, 1))
    except (RuntimeError, OSError) as error:
        return str(error)
    return ""


def cut(place):
    """Cut a file system off, at once, without writing what it still holds in memory."""
    root = os.open(place, os.O_RDONLY)
    fcntl.ioctl(root, SHUTDOWN, NO_FLUSH)
    os.close(root)


def next_of(reader, seconds):
    """The keys that are told over a pipe next, none in some seconds."""
    with contextlib.suppress(EOFError):
        return reader.recv() if reader.poll(seconds) else []
    time.sleep(min(seconds, MAX_SECONDS))  # the sweep is over
    return []


@cache
def arranged(folder):
    """The studies, and what an undisturbed sweep stores; compiles what all need."""
    files = [
        common.rods_file(folder, keep, [3 + n / 500 for n in range(JOBS[keep])], keep)
        for keep in JOBS
    ]
    studies = load_studies(*files)
    common.SWEEP.run_job(studies[0].cases[0])
    return studies, common.forked(lambda: swept(studies, folder / "whole"), LONG).result


def swept(studies, store):
    """Run the sweep here; what is stored then."""
    common.run_here(20)
    common.SWEEP.sweep(studies, store, 1)
    return common.whole(store)


def write(studies, store, channel, is_synced, every):
    """In a forked process: run a sweep that tells each acknowledged key over a pipe."""
    with contextlib.suppress(BaseException), open(os.devnull, "w") as nothing:
        os.setpgid(0, 0)
        os.dup2(nothing.fileno(), 2)
        os.fsync = os.fsync if is_synced else lambda descriptor: None
        merge.MAX_SMALL = 3
        numbers = itertools.count(1)

        def stored(keys):
            channel.send(keys)
            if next(numbers) % every == 0:  # more often than the program does
                merge.merge_batches(store)

        common.run_here(20, stored)
        common.SWEEP.sweep(studies, store, 1)


def disturb(place, studies, draw, is_synced):
    """Run a sweep and cut it off; the keys that were acknowledged. The image: `cut.img`."""
    shutil.copyfile(place.parent / "empty.img", place / "disk.img")
    options, wait = draw.choice(OPTIONS), draw.uniform(0, MAX_SECONDS)
    promptly = not is_synced or draw.random() < 0.5  # upon an acknowledgement
    reader, channel = common.FORK.Pipe(duplex=False)
    with common.mounted(place / "disk", "-o", f"loop,{options}", place / "disk.img") as disk:
        arguments = studies, disk / "store", channel, is_synced, draw.choice((8, math.inf))
        child = common.FORK.Process(target=write, args=arguments)
        child.start()
        channel.close()
        told = {*next_of(reader, 60)}
        until = time.monotonic() + wait
        while (left := until - time.monotonic()) > 0:
            told.update(next_of(reader, left))
        told.update(next_of(reader, 5) if promptly else ())
        cut(disk)
        shutil.copyfile(place / "disk.img", place / "cut.img")
        child.join(30)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
    while more := next_of(reader, 0):
        told.update(more)
    return told


def intact(store):
    """The keys of a store's jobs, without those whose batches are damaged."""
    return read_store(store).keys().difference(*(damage.studies for damage in verify(store)))


def cut_once(place, draw, is_synced=True):
    """Cut the power: the acknowledged keys, those lost, and what resuming misses, if synced."""
    studies, expected = arranged(place.parent)
    acknowledged = disturb(place, studies, draw, is_synced)
    common.call("e2fsck", "-fy", place / "cut.img", good=(0, 1))
    with common.mounted(place / "copy", "-o", "loop", place / "cut.img") as disk:
        ended = common.forked(lambda: acknowledged - intact(disk / "store"))
        lost = acknowledged if ended.death else ended.result
        if not is_synced:
            return acknowledged, lost, ""
        again = common.forked(lambda: swept(studies, disk / "store"), LONG)
        return acknowledged, lost, again.death or differing(again.result, expected)


def trial(place, draw, number, counts):
    """Cut the power; now and then see that it costs results where nothing is synced."""
    acknowledged, lost, different = cut_once(place, draw)
    counts["acknowledged results"] += len(acknowledged)
    problems = [f"lost {len(lost)}"] * bool(lost) + [f"not resumed: {different}"] * bool(different)
    if number % CONTROL_EVERY == 1:
        counts["controls without fsync"] += 1
        if not any(cut_once(place, draw, is_synced=False)[1] for _ in range(3)):  # chance to sync
            problems.append("nothing is lost without fsync: the campaign would not notice")
    return "; ".join(problems)
