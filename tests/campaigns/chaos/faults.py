"""Disks that are full or read-only, as a command meets them.

A small file system in memory (tmpfs) has too few bytes or files at every stage of a run or an
export, or is mounted read-only. Whatever it refuses: exit code 5 and a named error on stderr (or,
if it was not needed, success), and the same command then completes the store. Errors of single
calls are in `tests/store/test_damage.py`.
"""

import os
import random
import shutil

from chaos.common import (
    Said,
    Tally,
    call,
    command,
    complete_store,
    differing,
    forked,
    fresh,
    mounted,
    run_here,
    whole,
)
from compressor.store import merge
from compressor.store.batch import read_outcomes, write_batch

# of a tmpfs beyond what is there; a complete store has 70 kB
ROOM = [("pages", n) for n in range(0, 40, 2)] + [("files", n) for n in range(12)]
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


class Campaign:
    """The trials of `campaign`: a complete store to compare with, and a place to try in."""

    def __init__(self, tally, folder):
        self.tally, self.folder = tally, folder
        self.complete, self.cases = complete_store(folder)
        self.whole = whole(self.complete)
        self.key = self.whole["series"].keys[0]

    def prepare(self, name, store):
        """Fill a folder for a scene: complete, with jobs missing and leftovers, or damaged."""
        how = SCENES[name][0]
        if how == "nothing":
            return
        shutil.copytree(self.complete, store)
        first, *others = sorted((store / "batches").iterdir())
        if how == "damaged":
            first.write_bytes(first.read_bytes()[:-1])
        elif how == "grown":  # and with many small batches, to be merged
            first.rename(leftover := first.with_name(f".{first.name}.{32 * '0'}.tmp"))
            os.utime(leftover, (0, 0))
            for path in others:
                for outcome in read_outcomes(path):
                    write_batch(store, [outcome])

    def say(self, name, store):
        """What a scene's command says in a process of its own."""
        words = []
        for word in SCENES[name][1].replace("FOLDER", str(store)).split():
            words += self.cases if word == "CASES" else [self.key if word == "KEY" else word]

        def work():
            run_here()
            merge.MAX_SMALL = 1
            return command(*words)

        ended = forked(work)
        return ended.result or Said(-1, "", ended.death)

    def trial(self, name, kind, more=0):
        """Give a command on a tmpfs that is too small, or read-only; then on a better one."""
        with fresh(self.folder) as place, mounted(place, *TMPFS, "-o", AMPLE, "none"):
            store, problem = place / "store", ""
            self.prepare(name, store)
            used = os.statvfs(place)
            pages, files = used.f_blocks - used.f_bfree, used.f_files - used.f_ffree
            options = {"ro": "ro", "pages": f"size={(pages + more) * used.f_frsize}",
                       "files": f"size=64m,nr_inodes={files + more}"}  # fmt: skip
            call("mount", "-o", f"remount,{options[kind]}", place)
            said = self.say(name, store)
            is_ok = said.code in (0, 3)
            is_told = is_ok or (name not in READERS and said.code in (2, 5) and is_named(said.err))
            if "Traceback" in said.err or not is_told:
                problem = f"exit code {said.code}: {said.err}"
            self.tally.counts["limits that were not met" if is_ok else "named errors"] += 1
            call("mount", "-o", f"remount,rw,{AMPLE}", place)
            again, found = self.say(name, store), forked(lambda: whole(store))
            if not problem and again.code not in (0, 3):
                problem = f"given again: exit code {again.code}: {again.err}"
            if not problem and (different := found.death or differing(found.result, self.whole)):
                problem = f"not completed: {different}"
            self.tally.note(f"{name} on tmpfs, {kind} {more}", problem)


def is_named(err):
    """Whether a message names a place, a problem and a remedy, once."""
    lines = [line for line in err.splitlines() if line.startswith("compsim: /")]
    told = len(lines) == 1 and ": " in lines[0][9:] and "; " in lines[0]
    return told or "damaged file" in err


def campaign(trials, seed, folder):
    """Meet each limit in each scene, or in as many as `trials` allows."""
    what = "a disk that is full at any byte or file, or read-only"
    tally = Tally(what, seed, ("named errors", "limits that were not met"))
    try:
        with fresh(folder) as place, mounted(place, *TMPFS, "none"):
            pass
    except (OSError, RuntimeError) as error:
        return tally.result() | {"skipped": str(error)}
    planned = [(name, "ro") for name in SCENES]
    planned += [(name, *room) for name in SCENES if name not in READERS for room in ROOM]
    tried = Campaign(tally, folder)
    for words in random.Random(seed).sample(planned, min(trials, len(planned))):
        tried.trial(*words)
    return tally.result()
