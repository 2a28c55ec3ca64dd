"""Disks that are full or read-only, as a command meets them.

A small file system in memory (tmpfs) has too few bytes or files for a command, or is read-only.
Whatever it refuses: exit code 5 and a named error (or, if it was not needed, success), and the same
command then completes the store. Errors of single calls are in `tests/store/test_damage.py`.
"""

import os
import random
import re
import shutil

import numpy as np
from stores_compared import differing

from chaos import common
from compressor.store import merge
from compressor.store.batch import encode_batch, publish_batch
from compressor.store.stored import read_store

WHAT = "a disk that is full at any byte or file, or read-only"
TMPFS = ("-t", "tmpfs")
AMPLE = "size=64m,nr_inodes=10000"
RUN = "run CASES -r FOLDER -j 1"
# a command: how the folder is prepared before it, its words
SCENES = {
    "a new store": ("nothing", RUN),
    "a store with leftovers": ("grown", RUN),
    "a damaged store": ("damaged", RUN),
    "export": ("complete", "export -r FOLDER -o FOLDER/out.csv --force"),
    "status": ("complete", "status -r FOLDER"),
    "verify": ("complete", "verify -r FOLDER"),
    "show": ("complete", "show KEY -r FOLDER"),
    "plan": ("complete", "plan CASES -r FOLDER"),
}
READERS = ("status", "verify", "show", "plan")
NAMED = re.compile("(?m)^compsim: /.*: .*; ")  # a place, a problem and a remedy
# room of a tmpfs beyond what is there; a complete store has 70 kB
ROOM = [("pages", n) for n in range(0, 40, 2)] + [("files", n) for n in range(12)]
PLANNED = [(name, "ro", 0) for name in SCENES]
PLANNED += [(name, *room) for name in SCENES if name not in READERS for room in ROOM]
random.Random(1).shuffle(PLANNED)


def unable(folder):
    """Why nothing can be mounted here, "" where it can."""
    try:
        with common.mounted(folder / "try", *TMPFS, "none"):
            return ""
    except (OSError, RuntimeError) as error:
        return str(error)


def prepare(how, complete, store):
    """Fill a folder: complete, with jobs missing and leftovers, or damaged."""
    if how == "nothing":
        return
    shutil.copytree(complete, store)
    first, *_ = sorted((store / "batches").iterdir())
    if how == "damaged":
        first.write_bytes(first.read_bytes()[:-1])
    elif how == "grown":  # and with many small batches, to be merged
        first.rename(leftover := first.with_name(f".{first.name}.{32 * '0'}.tmp"))
        os.utime(leftover, (0, 0))
        stored = read_store(store)
        for outcome in stored.outcomes(np.arange(len(stored))):
            publish_batch(store, encode_batch([outcome]))


def say(words):
    """What a command says in a process of its own."""

    def work():
        common.run_here()
        merge.MAX_SMALL = 1
        return common.command(*words)

    result, death = common.forked(work)
    return result or common.Said(-1, "", death)


def trial(place, draw, number, counts):
    """Give a command on a tmpfs that is too small, or read-only; then on a better one."""
    name, kind, more = PLANNED[number % len(PLANNED)]
    complete, cases, expected = common.complete_store(place.parent)
    how, text = SCENES[name]
    with common.mounted(place / "disk", *TMPFS, "-o", AMPLE, "none") as disk:
        store, known = disk / "store", {"CASES": cases, "KEY": expected["series"].keys[:1]}
        prepare(how, complete, store)
        words = text.replace("FOLDER", str(store)).split()
        words = [one for word in words for one in known.get(word, [word])]
        used = os.statvfs(disk)
        pages, files = used.f_blocks - used.f_bfree, used.f_files - used.f_ffree
        room = max(pages + more, 1) * used.f_frsize  # 0 would be without a limit
        limits = {"ro": "ro", "pages": f"size={room}", "files": f"nr_inodes={files + more}"}
        common.call("mount", "-o", f"remount,{limits[kind]}", disk)
        said = say(words)
        is_ok = said.code in (0, 3)
        is_named = len(NAMED.findall(said.err)) == 1 or "damaged file" in said.err
        is_told = is_ok or (name not in READERS and said.code in (2, 5) and is_named)
        counts["limits that were not met" if is_ok else "named errors"] += 1
        common.call("mount", "-o", f"remount,rw,{AMPLE}", disk)
        again, found = say(words), common.forked(lambda: common.whole(store))
    problem = found.death or differing(found.result, expected)
    if "Traceback" in said.err or not is_told:
        problem = str(said)
    elif again.code not in (0, 3):
        problem = f"given again: {again}"
    return problem and f"{name} on tmpfs, {kind} {more}: {problem}"
