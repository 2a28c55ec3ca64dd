"""Disks that are full or read-only, as a command meets them.

A small file system in memory (tmpfs) has too few bytes or files at every stage of a run or an
export, or is mounted read-only. Whatever it refuses: exit code 5 and a named error on stderr (or,
if it was not needed, success), and the same command then completes the store. Errors of single
calls are in `tests/store/test_damage.py`.
"""

import os
import random
import shutil

from chaos import common
from compressor.store import merge
from compressor.store.batch import encode_batch, publish_batch, read_outcomes

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
    first, *others = sorted((store / "batches").iterdir())
    if how == "damaged":
        first.write_bytes(first.read_bytes()[:-1])
    elif how == "grown":  # and with many small batches, to be merged
        first.rename(leftover := first.with_name(f".{first.name}.{32 * '0'}.tmp"))
        os.utime(leftover, (0, 0))
        for path in others:
            for outcome in read_outcomes(path):
                publish_batch(store, encode_batch([outcome]))


def say(words):
    """What a command says in a process of its own."""

    def work():
        common.run_here()
        merge.MAX_SMALL = 1
        return common.command(*words)

    ended = common.forked(work)
    return ended.result or common.Said(-1, "", ended.death)


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
        options = {"ro": "ro", "pages": f"size={room}",
                   "files": f"size=64m,nr_inodes={files + more}"}  # fmt: skip
        common.call("mount", "-o", f"remount,{options[kind]}", disk)
        said, problem = say(words), ""
        is_ok = said.code in (0, 3)
        is_told = is_ok or (name not in READERS and said.code in (2, 5) and is_named(said.err))
        counts["limits that were not met" if is_ok else "named errors"] += 1
        common.call("mount", "-o", f"remount,rw,{AMPLE}", disk)
        again, found = say(words), common.forked(lambda: common.whole(store))
    if "Traceback" in said.err or not is_told:
        problem = f"exit code {said.code}: {said.err}"
    elif again.code not in (0, 3):
        problem = f"given again: exit code {again.code}: {again.err}"
    elif different := found.death or common.differing(found.result, expected):
        problem = f"not completed: {different}"
    return problem and f"{name} on tmpfs, {kind} {more}: {problem}"


def is_named(err):
    """Whether a message names a place, a problem and a remedy, once."""
    lines = [line for line in err.splitlines() if line.startswith("compsim: /")]
    told = len(lines) == 1 and ": " in lines[0][9:] and "; " in lines[0]
    return told or "damaged file" in err
