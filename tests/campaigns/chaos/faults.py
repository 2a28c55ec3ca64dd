"""Each call by which the program touches its store is refused once, and real limits are met.

Refused are, one by one, the calls of clean runs and of readers, each by the errors that it can
have; beside them stand a tmpfs that is full (of bytes, of files), a file system mounted read-only,
and a limit on the size of files. Whatever refuses: exit code 5 and a named error on stderr (or, if
the call was not needed, success), and the same command then completes the store.
"""

import builtins
import contextlib
import errno
import io
import os
import random
import resource
import shutil
import subprocess
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from chaos.common import (
    FORK,
    Said,
    case_files,
    command,
    complete_store,
    contents,
    differing,
    forked,
    fresh,
    run_here,
)
from chaos.tally import Tally
from compressor.store import merge, netcdf
from compressor.store.batch import encode_batch, publish_batch, read_batch, read_outcomes

KINDS = {  # of calls -> the errors that each of them is refused by
    "write": (errno.ENOSPC, errno.EIO, errno.EFBIG),
    "fsync": (errno.EIO, errno.ENOSPC),
    "close": (errno.EIO,),
    "rename": (errno.EIO, errno.ENOSPC, errno.EROFS),
    "create": (errno.ENOSPC, errno.EROFS, errno.EMFILE),
    "mkdir": (errno.ENOSPC, errno.EROFS),
    "open": (errno.EIO, errno.EACCES, errno.EMFILE),
    "read": (errno.EIO,),
    "unlink": (errno.EIO, errno.EROFS, errno.EACCES),
    "list": (errno.EIO, errno.EACCES),
    "stat": (errno.EIO, errno.EACCES),
}
NAMES = [*KINDS]
OF_OS = {
    "fsync": "fsync", "replace": "rename", "rename": "rename", "mkdir": "mkdir", "open": "open",
    "unlink": "unlink", "remove": "unlink", "listdir": "list", "scandir": "list", "stat": "stat",
}  # fmt: skip
TMPFS = [
    *(f"size={n}" for n in (8192, 16384, 32768, 65536, 98304, 131072, 196608)),
    *(f"size=64m,nr_inodes={n}" for n in (2, 4, 6, 8, 10)),
]
FILE_BYTES = (0, 64, 1024, 8192, 32768)  # limits on the size of one file
RUN = "run CASES -r FOLDER -j 1"
# a command: how the folder is prepared before it, its words
SCENES = {
    "a new store": ("nothing", RUN),
    "a store with leftovers": ("grown", RUN),
    "a damaged store": ("damaged", RUN),
    "status": ("complete", "status -r FOLDER"),
    "verify": ("complete", "verify -r FOLDER"),
    "show": ("complete", "show KEY -r FOLDER"),
    "plan": ("complete", "plan CASES -r FOLDER"),
    "export": ("complete", "export -r FOLDER -o FOLDER/out --series --force"),
}
FEW = ("a store with leftovers", "status")  # scenes of a sample


class Faults:
    """Counts the calls of this process that touch a folder, by kind; refuses one."""

    def __init__(self, folder: Path, kind: str = "", number: int = 0, error: int = 0):
        self.folder, self.kind, self.number, self.error = str(folder), kind, number, error
        self.counts = FORK.Array("q", len(NAMES))

    def hit(self, kind: str, path: Any) -> None:
        """Count a call on a path, or an open file; raise if it is the one to be refused."""
        if isinstance(path, int):
            path = os.readlink(f"/proc/self/fd/{path}")
        path = os.path.abspath(os.fsdecode(path))
        if path == self.folder or path.startswith(self.folder + os.sep):
            self.counts[NAMES.index(kind)] += 1
            if (kind, self.counts[NAMES.index(kind)]) == (self.kind, self.number):
                raise OSError(self.error, os.strerror(self.error), path)

    @contextlib.contextmanager
    def injected(self) -> Iterator[None]:
        """Have the calls of this process pass by here."""

        def seen(kind: str, call: Callable[..., Any]) -> Callable[..., Any]:
            def replaced(path: Any = ".", *args: Any, **more: Any) -> Any:
                self.hit(kind, path)
                return call(path, *args, **more)

            return replaced

        opened = io.open

        def py_open(path: Any, mode: str = "r", *args: Any, **more: Any) -> Any:
            if isinstance(path, int):
                return opened(path, mode, *args, **more)
            self.hit("open" if mode.strip("bt") == "r" else "create", path)
            return Refusing(opened(path, mode, *args, **more), self, path)

        seams: list[tuple[Any, str, Any]] = [
            *((os, name, seen(kind, getattr(os, name))) for name, kind in OF_OS.items()),
            (io, "open", py_open), (builtins, "open", py_open),
            (netcdf.h5py, "File", seen("open", netcdf.h5py.File)),
        ]  # fmt: skip
        with contextlib.ExitStack() as old:
            for module, name, call in seams:
                old.callback(setattr, module, name, getattr(module, name))
                setattr(module, name, call)
            yield


class Refusing:
    """A file whose writing, reading or closing can be refused; a refused write is a torn one."""

    def __init__(self, file: Any, faults: Faults, path: Any):
        self.file, self.faults, self.path = file, faults, path

    def __getattr__(self, name: str) -> Any:
        return getattr(self.file, name)

    def __iter__(self) -> Any:
        return iter(self.file)

    def __enter__(self) -> "Refusing":
        return self

    def __exit__(self, *error: object) -> None:
        writable = self.file.writable()
        self.file.close()
        if writable:
            self.faults.hit("close", self.path)

    def write(self, data: Any) -> int:
        try:
            self.faults.hit("write", self.path)
        except OSError:
            self.file.write(data[: len(data) // 2])
            self.file.flush()
            raise
        return self.file.write(data)

    def read(self, *args: Any) -> Any:
        self.faults.hit("read", self.path)
        return self.file.read(*args)


def prepare(how: str, complete: Path, place: Path) -> None:
    """Fill a folder: a complete store, or one with jobs missing and leftovers, or damage."""
    if how == "nothing":
        return
    shutil.copytree(complete, place)
    first, *others = sorted((place / "batches").iterdir())
    if how == "damaged":
        first.write_bytes(first.read_bytes()[:-1])
    elif how == "grown":  # and with many small batches, to be merged
        first.rename(leftover := first.with_name(f".{first.name}.tmp"))
        os.utime(leftover, (0, 0))
        for path in others:
            for outcome in read_outcomes(read_batch(path)):
                publish_batch(place, encode_batch([outcome]))


class Campaign:
    """The trials of `campaign`: a complete store to compare with, and a place to try in."""

    def __init__(self, tally: Tally, folder: Path):
        self.tally, self.folder = tally, folder
        self.complete = complete_store(folder)
        self.cases = case_files(folder / "cases")
        self.whole = contents(self.complete)
        self.key = self.whole["series/key"][2][0]

    def say(self, name: str, place: Path, before: Callable[[], Any] | Faults = dict) -> Said:
        """What a scene's command says in a process of its own."""
        words: list[object] = []
        for word in SCENES[name][1].replace("FOLDER", str(place)).split():
            words += self.cases if word == "CASES" else [self.key if word == "KEY" else word]

        def work() -> Said:
            run_here()
            merge.MAX_SMALL = 1
            with before.injected() if isinstance(before, Faults) else contextlib.nullcontext():
                if not isinstance(before, Faults):
                    before()
                return command(*words)

        ended = forked(work)
        return ended.result or Said(-1, "", ended.death)

    def calls(self, name: str) -> dict[str, int]:
        """How many calls of each kind a clean command makes."""
        with fresh(self.folder) as trial:
            prepare(SCENES[name][0], self.complete, trial / "store")
            faults = Faults(trial / "store")
            said = self.say(name, trial / "store", faults)
            assert said.code in (0, 3), said
            return dict(zip(NAMES, faults.counts, strict=True))

    def attempt(self, label: str, name: str, place: Path, before: Any = dict) -> Said:
        """Give a command that is disturbed; how it ended is counted."""
        said = self.say(name, place, before)
        ok, names_it = said.code in (0, 3), said.code in (2, 5) and is_named(said.err)
        if "Traceback" in said.err or not (ok or names_it):
            self.tally.fail(label, f"exit code {said.code}: {said.err}")
        self.tally.counts["calls that were not needed" if ok else "named errors"] += 1
        self.tally.trials += 1
        return said

    def complete_again(self, label: str, name: str, place: Path) -> None:
        """Give the command again, undisturbed: then all is there."""
        again = self.say(name, place)
        found = forked(lambda: contents(place))
        if again.code not in (0, 3):
            self.tally.fail(label, f"given again: exit code {again.code}: {again.err}")
        elif found.death or (different := differing(found.result, self.whole)):
            self.tally.fail(label, f"not completed: {found.death or different}")

    def refuse(self, name: str, kind: str, number: int, error: int) -> None:
        """A trial: refuse one call of a command, then give the command again."""
        label = f"{name}, {kind} {number}, {errno.errorcode[error]}"
        with fresh(self.folder) as trial:
            prepare(SCENES[name][0], self.complete, trial / "store")
            faults = Faults(trial / "store", kind, number, error)
            self.attempt(label, name, trial / "store", faults)
            self.tally.counts["calls that did not come"] += (
                faults.counts[NAMES.index(kind)] < number
            )
            self.complete_again(label, name, trial / "store")

    def mounted(self, name: str, option: str, then: str) -> None:
        """A trial: a command on a tmpfs that is too small, or read-only; then on a better one."""
        label = f"tmpfs {option} {then}, {name}"
        with fresh(self.folder) as trial, tmpfs(trial, option):
            prepare(SCENES[name][0], self.complete, trial / "store")
            if then:
                mount("-o", f"remount,{then}", str(trial))
            said = self.attempt(label, name, trial / "store")
            if then and name in ("status", "verify", "show", "plan") and said.code != 0:
                self.tally.fail(label, f"cannot be read: {said.err}")
            mount("-o", "remount,rw,size=64m,nr_inodes=10000", str(trial))
            self.complete_again(label, name, trial / "store")

    def file_size(self, limit: int) -> None:
        """A trial: a run whose files may not be larger than some bytes."""
        label = f"files of at most {limit} bytes"
        with fresh(self.folder) as trial:
            limited = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (limit, limit))
            self.attempt(label, "a new store", trial / "store", limited)
            self.complete_again(label, "a new store", trial / "store")


def is_named(err: str) -> bool:
    """Whether a message names a place, a problem and a remedy, once."""
    lines = [line for line in err.splitlines() if line.startswith("compsim: /")]
    told = len(lines) == 1 and ": " in lines[0][9:] and "; " in lines[0]
    return told or "damaged file" in err


def mount(*words: str) -> None:
    """Call mount; raises CalledProcessError."""
    subprocess.run(["mount", *words], check=True, capture_output=True)


@contextlib.contextmanager
def tmpfs(place: Path, option: str) -> Iterator[None]:
    """A tmpfs on a folder."""
    mount("-t", "tmpfs", "-o", option, "none", str(place))
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def may_mount(folder: Path) -> bool:
    """Whether file systems can be mounted: by this process, with the programs that are there."""
    try:
        with fresh(folder, "able") as place, tmpfs(place, "size=64k"):
            return True
    except (OSError, subprocess.CalledProcessError):
        return False


def campaign(trials: int, seed: int, folder: Path) -> dict[str, Any]:
    """Refuse every call once by each of its errors, or as many as `trials` allows."""
    names = ("named errors", "calls that were not needed", "calls that did not come")
    what = "an error at each write, fsync, rename, open, ...; full, read-only, limited"
    tally = Tally(what, seed, names)
    tried = Campaign(tally, folder)
    planned: list[Callable[[], None]] = [
        partial(tried.refuse, name, kind, number, error)
        for name in (SCENES if trials > len(SCENES) else FEW)
        for kind, count in tried.calls(name).items()
        for number in range(1, count + 1)
        for error in KINDS[kind]
    ]
    planned += [partial(tried.file_size, limit) for limit in FILE_BYTES]
    if may_mount(folder):
        planned += [partial(tried.mounted, "a new store", option, "") for option in TMPFS]
        planned += [partial(tried.mounted, name, "size=64m", "ro") for name in SCENES]
    else:
        tally.counts["mounts that were not allowed"] += len(SCENES)
    if trials < len(planned):
        planned = random.Random(seed).sample(planned, trials)
    for trial in planned:
        trial()
    return tally.result()
