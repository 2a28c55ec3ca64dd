"""Each call by which the program touches its store is refused once, and real limits are met.

Refused are, one by one, the calls of clean runs and of readers, each by the errors that it can
have; beside them stand a tmpfs that is full (of bytes, of files), a file system mounted read-only,
and a limit on the size of files. Whatever refuses: exit code 5 and a named error on stderr (or, if
the call was not needed, success), and the same command then completes the store.
"""

import builtins
import contextlib
import errno
import fcntl
import io
import multiprocessing
import os
import random
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from chaos.common import (
    Said,
    case_files,
    command,
    complete_store,
    contents,
    forked,
    fresh,
    undrawn,
)
from chaos.tally import Tally
from compressor.store import writer

KINDS = {  # of calls that write -> the errors that each of them is refused by
    "write": (errno.ENOSPC, errno.EIO, errno.EFBIG),
    "fsync": (errno.EIO, errno.ENOSPC),
    "close": (errno.EIO,),
    "rename": (errno.EIO, errno.ENOSPC, errno.EROFS),
    "create": (errno.ENOSPC, errno.EROFS, errno.EMFILE),
    "mkdir": (errno.ENOSPC, errno.EROFS),
}
OTHERS = {  # other calls -> the errors that they are refused by, in turn
    "open": (errno.EIO, errno.EACCES, errno.EMFILE),
    "read": (errno.EIO,),
    "unlink": (errno.EIO, errno.EROFS, errno.EACCES),
    "list": (errno.EIO, errno.EACCES),
    "stat": (errno.EIO, errno.EACCES),
    "lock": (errno.ENOLCK,),
    "truncate": (errno.EIO,),
}
NAMES = [*KINDS, *OTHERS]
TMPFS_BYTES = (8192, 16384, 32768, 65536, 98304, 131072, 196608)
TMPFS_FILES = (2, 4, 6, 8, 10)
SAMPLE = 10  # trials, up to which a run and a reader are the only scenes
FILE_BYTES = (0, 64, 1024, 8192, 32768)  # limits on the size of one file


class Faults:
    """Counts, in this process and its children, the calls that touch a folder; refuses one."""

    def __init__(self, folder: Path, kind: str = "", number: int = 0, error: int = 0):
        self.folder, self.kind, self.number, self.error = str(folder), kind, number, error
        self.counts = multiprocessing.Array("q", len(NAMES))

    def hit(self, kind: str, path: Any) -> None:
        """Count a call on a path, or an open file; raise if it is the one to be refused."""
        if isinstance(path, int):
            path = os.readlink(f"/proc/self/fd/{path}")
        path = os.path.abspath(os.fsdecode(path))
        if path != self.folder and not path.startswith(self.folder + os.sep):
            return
        with self.counts.get_lock():
            place = NAMES.index(kind)
            self.counts[place] += 1
            mine = kind == self.kind and self.counts[place] == self.number
        if mine:
            raise OSError(self.error, os.strerror(self.error), path)

    @contextlib.contextmanager
    def injected(self) -> Iterator[None]:
        """Have the calls of this process, and of those that it forks, pass by here."""
        old = [(module, name, getattr(module, name)) for module, name, _ in self._seams()]
        for module, name, make in self._seams():
            setattr(module, name, make)
        try:
            yield
        finally:
            for module, name, call in old:
                setattr(module, name, call)

    def _seams(self) -> list[tuple[Any, str, Callable[..., Any]]]:
        def seen(kind: str, call: Callable[..., Any]) -> Callable[..., Any]:
            def replaced(path: Any = ".", *args: Any, **more: Any) -> Any:
                self.hit(kind, path)
                return call(path, *args, **more)

            return replaced

        opened, low = io.open, os.open

        def os_open(path: Any, flags: int, *args: Any, **more: Any) -> int:
            self.hit("create" if flags & os.O_CREAT else "open", path)
            return low(path, flags, *args, **more)

        def py_open(path: Any, mode: str = "r", *args: Any, **more: Any) -> Any:
            if isinstance(path, int):
                return opened(path, mode, *args, **more)
            self.hit("open" if mode.strip("bt") == "r" else "create", path)
            return Refusing(opened(path, mode, *args, **more), self, path)

        simple = {
            "fsync": "fsync", "replace": "rename", "rename": "rename", "mkdir": "mkdir",
            "unlink": "unlink", "remove": "unlink", "listdir": "list", "scandir": "list",
            "stat": "stat", "ftruncate": "truncate", "write": "write",
        }  # fmt: skip
        return [
            *((os, name, seen(kind, getattr(os, name))) for name, kind in simple.items()),
            (fcntl, "flock", seen("lock", fcntl.flock)),
            (os, "open", os_open),
            (io, "open", py_open),
            (builtins, "open", py_open),
        ]


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


@dataclass(frozen=True)
class Scene:
    """A command on a prepared folder: `prepare` fills it, `words` follow `compsim`."""

    name: str
    prepare: Callable[[Path, Path], None]  # gets a complete store, and the folder to be made
    words: Callable[[Path, list[Path]], list[object]]  # of a folder and the case files
    reads: bool = False  # whether it only reads


def nothing(complete: Path, place: Path) -> None:
    """A folder that is not there yet."""


def copied(complete: Path, place: Path) -> None:
    """A complete store."""
    shutil.copytree(complete, place)


def grown(complete: Path, place: Path) -> None:
    """A store with some jobs missing, and what dead writers left."""
    shutil.copytree(complete, place)
    victim = next(iter(sorted((place / "jobs").iterdir())))
    unnamed = place / "jobs" / f".{'0' * 20}-{'0' * 20}.h5.tmp"
    unnamed.write_bytes(victim.read_bytes())
    victim.unlink()
    leftover = place / "rows" / ".old.tmp"
    leftover.write_bytes(b"torn")
    for path in (unnamed, leftover):
        os.utime(path, (0, 0))


def damaged(complete: Path, place: Path) -> None:
    """A store with a damaged segment."""
    shutil.copytree(complete, place)
    path = next(iter(sorted((place / "rows").iterdir())))
    path.write_bytes(path.read_bytes()[:-1])


def run(folder: Path, cases: list[Path]) -> list[object]:
    return ["run", *cases, "-r", folder, "-j", 1]


def shards(folder: Path, cases: list[Path]) -> list[object]:
    return [*run(folder, cases), "--shard", "1/1"]


def inspect(*words: str) -> Callable[[Path, list[Path]], list[object]]:
    return lambda folder, cases: [*words, "-r", folder]


SCENES = (
    Scene("a new store", nothing, run),
    Scene("a store with leftovers", grown, run),
    Scene("a damaged store", damaged, run),
    Scene("a new shard", nothing, shards),
    Scene("status", copied, inspect("status"), reads=True),
    Scene("verify", copied, inspect("verify"), reads=True),
    Scene("show", copied, inspect("show", "KEY"), reads=True),
    Scene("plan", copied, lambda folder, cases: ["plan", *cases, "-r", folder], reads=True),
    Scene("report", copied, lambda folder, cases: ["report", "-r", folder, "-o", folder / "page"]),
)


class Campaign:
    """The trials of `campaign`: a complete store to compare with, and a place to try in."""

    def __init__(self, tally: Tally, folder: Path):
        self.tally, self.folder = tally, folder
        self.complete = complete_store(folder)
        self.cases = case_files(folder / "cases")
        self.whole = forked(lambda: contents(self.complete)).result
        self.key = self.whole["series/key"][2][0]

    def say(self, *words: object, faults: Faults | None = None) -> Said:
        """What a command says in a process of its own."""

        def work() -> Said:
            writer.MAX_SMALL_AT_END = 1  # so that each run merges
            undrawn()
            with faults.injected() if faults else contextlib.nullcontext():
                return command(*words)

        ended = forked(work)
        return ended.result or Said(-1, "", ended.death)

    def words(self, scene: Scene, place: Path) -> list[object]:
        """A scene's command."""
        return [self.key if w == "KEY" else w for w in scene.words(place, self.cases)]

    def calls(self, scene: Scene) -> dict[str, int]:
        """How many calls of each kind a clean command makes."""
        with fresh(self.folder, "trial") as trial:
            place = trial / "store"
            scene.prepare(self.complete, place)
            faults = Faults(place)
            said = self.say(*self.words(scene, place), faults=faults)
            assert said.code in (0, 3), said
            return dict(zip(NAMES, faults.counts, strict=True))

    def refuse(self, scene: Scene, kind: str, number: int, error: int) -> None:
        """A trial: refuse one call of a command, then give the command again."""
        label = f"{scene.name}, {kind} {number}, {errno.errorcode[error]}"
        with fresh(self.folder, "trial") as trial:
            place = trial / "store"
            scene.prepare(self.complete, place)
            faults = Faults(place, kind, number, error)
            said = self.say(*self.words(scene, place), faults=faults)
            if faults.counts[NAMES.index(kind)] < number:
                self.tally.counts["calls that did not come"] += 1
            self.judge(label, said)
            self.complete_again(label, scene, place)

    def judge(self, label: str, said: Said) -> None:
        """Count how a disturbed command ended."""
        self.tally.trials += 1
        if "Traceback" in said.err or said.code not in (0, 2, 3, 5):
            self.tally.fail(label, f"exit code {said.code}: {said.err}")
        elif said.code in (2, 5) and not (named(said.err) or "damaged file" in said.err):
            self.tally.fail(label, f"unnamed: {said.err}")
        else:
            self.tally.counts[
                "named errors" if said.code in (2, 5) else "calls that were not needed"
            ] += 1

    def complete_again(self, label: str, scene: Scene, place: Path) -> None:
        """Give the command again, undisturbed: then all is there."""
        again = self.say(*self.words(scene, place))
        if again.code not in (0, 3):
            self.tally.fail(label, f"given again: exit code {again.code}: {again.err}")
            return
        found = forked(lambda: contents(place))
        if found.result != self.whole:
            self.tally.fail(label, f"not completed: {found.death or differing(found, self.whole)}")

    # ---- real limits ------------------------------------------------------------------------

    def small_tmpfs(self, option: str) -> None:
        """A trial: run into a tmpfs that is too small, make it larger, run again."""
        with fresh(self.folder, "trial") as trial, mounted(trial, option):
            place = trial / "store"
            self.judge(f"tmpfs {option}", self.say(*run(place, self.cases)))
            mount("-o", "remount,size=64m,nr_inodes=10000", str(trial))
            self.complete_again(f"tmpfs {option}", SCENES[0], place)

    def read_only(self, scene: Scene) -> None:
        """A trial: a command on a file system that is mounted read-only."""
        with fresh(self.folder, "trial") as trial, mounted(trial, "size=64m"):
            place = trial / "store"
            scene.prepare(self.complete, place)
            mount("-o", "remount,ro", str(trial))
            said = self.say(*self.words(scene, place))
            self.judge(f"read-only, {scene.name}", said)
            if scene.reads and said.code != 0:
                self.tally.fail(f"read-only, {scene.name}", f"cannot be read: {said.err}")
            mount("-o", "remount,rw", str(trial))
            self.complete_again(f"read-only, {scene.name}", scene, place)

    def file_size(self, limit: int) -> None:
        """A trial: a run whose files may not be larger than some bytes."""
        with fresh(self.folder, "trial") as trial:
            place = trial / "store"
            label = f"files of at most {limit} bytes"
            self.judge(label, limited(limit, run(place, self.cases)))
            self.complete_again(label, SCENES[0], place)


def named(err: str) -> bool:
    """Whether a message names a place, a problem and a remedy."""
    lines = [line for line in err.splitlines() if line.startswith("compsim: /")]
    return len(lines) == 1 and ": " in lines[0][9:] and "; " in lines[0]


def differing(found: Any, whole: dict[str, Any]) -> str:
    """The names of what differs."""
    names = found.result.keys() | whole.keys()
    return str([n for n in sorted(names) if found.result.get(n) != whole.get(n)])


def limited(limit: int, words: list[object]) -> Said:
    """What a command says whose process may write no larger file."""

    def set_limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    call = [sys.executable, "-B", "-m", "compsim", *map(str, words)]
    with subprocess.Popen(
        call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=set_limit
    ) as process:
        out, err = process.communicate(timeout=120)
    return Said(process.returncode, out, err)


def mount(*words: str) -> None:
    """Call mount; raises CalledProcessError."""
    subprocess.run(["mount", *words], check=True, capture_output=True)


def may_mount(folder: Path) -> bool:
    """Whether file systems can be mounted: by this process, with the programs that are there."""
    try:
        with fresh(folder, "able") as place, mounted(place, "size=64k"):
            return True
    except (OSError, subprocess.CalledProcessError):
        return False


@contextlib.contextmanager
def mounted(place: Path, option: str) -> Iterator[None]:
    """A tmpfs on a folder."""
    mount("-t", "tmpfs", "-o", option, "none", str(place))
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def campaign(trials: int, seed: int, folder: Path) -> dict[str, Any]:
    """Refuse every call once by each of its errors, or as many as `trials` allows."""
    names = ("named errors", "calls that were not needed", "calls that did not come")
    what = "an error at each write, fsync, rename, open, ...; full, read-only, limited"
    tally = Tally(what, seed, names)
    tried = Campaign(tally, folder)
    planned: list[Callable[[], None]] = []
    for scene in SCENES if trials > SAMPLE else (SCENES[1], SCENES[4]):
        for kind, count in tried.calls(scene).items():
            planned += [
                partial(tried.refuse, scene, kind, number, error)
                for number in range(1, count + 1)
                for error in KINDS.get(kind) or [OTHERS[kind][number % len(OTHERS[kind])]]
            ]
    planned += [partial(tried.file_size, limit) for limit in FILE_BYTES]
    if may_mount(folder):
        options = [f"size={n}" for n in TMPFS_BYTES]
        options += [f"size=64m,nr_inodes={n}" for n in TMPFS_FILES]
        planned += [partial(tried.small_tmpfs, option) for option in options]
        planned += [partial(tried.read_only, scene) for scene in SCENES]
    else:
        tally.counts["mounts that were not allowed"] += len(SCENES)
    if trials < len(planned):
        planned = random.Random(seed).sample(planned, trials)
    for trial in planned:
        trial()
    return tally.result()
