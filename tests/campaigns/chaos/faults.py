"""Disks that are full or read-only, and limits on the size of files, as a command meets them.

A small file system in memory (tmpfs) has too few bytes or files at every stage of a run or an
export, or is mounted read-only; or files may not be larger than some bytes. Whatever refuses: exit
code 5 and a named error on stderr (or, if it was not needed, success), and the same command then
completes the store. Errors of single calls are in `tests/store/test_damage.py`.
"""

import contextlib
import os
import random
import resource
import shutil
import subprocess
from functools import partial

from chaos.common import (
    Said,
    Tally,
    command,
    complete_store,
    differing,
    forked,
    fresh,
    run_here,
    whole,
)
from compressor.store import merge
from compressor.store.batch import read_batch, read_outcomes, write_batch

# of a tmpfs beyond what is there; a complete store has 70 kB
ROOM = [("pages", n) for n in range(0, 40, 2)] + [("files", n) for n in range(12)]
AMPLE = "size=64m,nr_inodes=10000"
FILE_BYTES = (0, *(1 << n for n in range(5, 18)))  # limits on the size of one file
RUN = "run CASES -r FOLDER -j 1"
# a command: how the folder is prepared before it, its words
SCENES = {
    "a new store": ("nothing", RUN),
    "a store with leftovers": ("grown", RUN),
    "a damaged store": ("damaged", RUN),
    "export": ("complete", "export -r FOLDER -o FOLDER/out --series --force"),
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
            first.rename(leftover := first.with_name(f".{first.name}.tmp"))
            os.utime(leftover, (0, 0))
            for path in others:
                for outcome in read_outcomes(read_batch(path)):
                    write_batch(store, [outcome])

    def say(self, name, store, disturb=contextlib.nullcontext):
        """What a scene's command says in a process of its own."""
        words = []
        for word in SCENES[name][1].replace("FOLDER", str(store)).split():
            words += self.cases if word == "CASES" else [self.key if word == "KEY" else word]

        def work():
            run_here()
            merge.MAX_SMALL = 1
            with disturb():
                return command(*words)

        ended = forked(work)
        return ended.result or Said(-1, "", ended.death)

    def attempt(self, label, name, trial, disturb=contextlib.nullcontext, mend=lambda: None):
        """Give a command that is disturbed, then again, undisturbed: then all is there."""
        store, problem = trial / "store", ""
        said = self.say(name, store, disturb)
        is_ok = said.code in (0, 3)
        if "Traceback" in said.err or not (is_ok or (said.code in (2, 5) and is_named(said.err))):
            problem = f"exit code {said.code}: {said.err}"
        self.tally.counts["limits that were not met" if is_ok else "named errors"] += 1
        mend()
        again, found = self.say(name, store), forked(lambda: whole(store))
        if not problem and again.code not in (0, 3):
            problem = f"given again: exit code {again.code}: {again.err}"
        if not problem and (different := found.death or differing(found.result, self.whole)):
            problem = f"not completed: {different}"
        self.tally.note(label, problem)
        return said

    def mounted(self, name, kind, more=0):
        """A trial: a command on a tmpfs that is too small, or read-only; then on a better one."""
        with fresh(self.folder) as trial, tmpfs(trial, AMPLE):
            self.prepare(name, trial / "store")
            used = os.statvfs(trial)
            pages, files = used.f_blocks - used.f_bfree, used.f_files - used.f_ffree
            options = {"ro": "ro", "pages": f"size={(pages + more) * used.f_frsize}",
                       "files": f"size=64m,nr_inodes={files + more}"}  # fmt: skip
            mount("-o", f"remount,{options[kind]}", str(trial))
            better = partial(mount, "-o", f"remount,rw,{AMPLE}", str(trial))
            label = f"{name} on tmpfs, {kind} {more}"
            said = self.attempt(label, name, trial, mend=better)
            if name in READERS and said.code != 0:
                self.tally.note(label, f"cannot be read: {said.err}")

    def file_size(self, name, limit):
        """A trial: a run whose files may not be larger than some bytes."""

        def limited():
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
            return contextlib.nullcontext()

        with fresh(self.folder) as trial:
            self.prepare(name, trial / "store")
            self.attempt(f"{name}, files of at most {limit} bytes", name, trial, limited)


def is_named(err):
    """Whether a message names a place, a problem and a remedy, once."""
    lines = [line for line in err.splitlines() if line.startswith("compsim: /")]
    told = len(lines) == 1 and ": " in lines[0][9:] and "; " in lines[0]
    return told or "damaged file" in err


def mount(*words):
    """Call mount; raises CalledProcessError."""
    subprocess.run(["mount", *words], check=True, capture_output=True)


@contextlib.contextmanager
def tmpfs(place, option):
    """A tmpfs on a folder."""
    mount("-t", "tmpfs", "-o", option, "none", str(place))
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def may_mount(folder):
    """Whether file systems can be mounted: by this process, with the programs that are there."""
    try:
        with fresh(folder) as place, tmpfs(place, "size=64k"):
            return True
    except (OSError, subprocess.CalledProcessError):
        return False


def campaign(trials, seed, folder):
    """Meet each limit in each scene, or in as many as `trials` allows."""
    what = "a disk that is full at any byte or file, or read-only; files of limited size"
    tally = Tally(what, seed, ("named errors", "limits that were not met"))
    tried = Campaign(tally, folder)
    writing = [name for name in SCENES if name not in READERS]
    planned = [partial(tried.file_size, name, limit) for name in writing for limit in FILE_BYTES]
    if may_mount(folder):
        planned += [partial(tried.mounted, name, "ro") for name in SCENES]
        planned += [partial(tried.mounted, name, *room) for name in writing for room in ROOM]
    else:
        tally.counts["mounts that were not allowed"] += len(SCENES)
    for trial in random.Random(seed).sample(planned, min(trials, len(planned))):
        trial()
    return tally.result()
