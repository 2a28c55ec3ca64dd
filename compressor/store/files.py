"""Files that are whole or absent, and the folders that hold results.

What the file system refuses is a StoreError, which says where and what to do about it.
"""

import contextlib
import errno
import os
import re
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import ContextVar
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from compressor.program import CompsimError, CompsimWarning, did_you_mean

Folder = str | os.PathLike[str]

HEX20 = "[0-9a-f]{20}"  # a job's key, and the digest of a file's bytes
KEY = re.compile(HEX20)

LEFTOVER_AGE = 3600.0  # s; a temporary file this old belongs to a writer that died

SYNC_THREADS = 4  # a disk needs ms to sync a file, and hardly more for several at once

LOCK_NAME = "writer.lock"
FREE_SPACE_REMEDY = "free some space there, then run the same command again"
IS_FILE = "is a file, where a folder is needed"
ELSEWHERE = "choose another folder"
NO_SYNC = (errno.EINVAL, errno.EOPNOTSUPP, errno.ENOTSUP)  # of a folder, as FUSE and SMB say
NO_LOCKS = "choose a folder on a file system with locks"
FORBIDDEN = f"get the permission to use it, or {ELSEWHERE}"
REMEDIES = {
    errno.ENOSPC: FREE_SPACE_REMEDY,
    errno.EDQUOT: FREE_SPACE_REMEDY,
    errno.EFBIG: FREE_SPACE_REMEDY,
    errno.EACCES: FORBIDDEN,
    errno.EPERM: FORBIDDEN,
    errno.EROFS: FORBIDDEN,
    errno.ENOTDIR: ELSEWHERE,
    errno.ENOLCK: NO_LOCKS,
    errno.ENOSYS: NO_LOCKS,
    errno.EOPNOTSUPP: NO_LOCKS,
    errno.ENOTSUP: NO_LOCKS,
    errno.EMFILE: "allow more open files (ulimit -n)",
}


class StoreError(CompsimError):
    """What is wrong with a store: `path`, `problem`, and `remedy`, what to do about it.

    Raised where a folder has no study, or not the one requested, where files are damaged or of
    another version, and where the disk refuses to read or write.

    >>> import compressor
    >>> try:
    ...     compressor.open_study("results", "waer")
    ... except compressor.StoreError as error:
    ...     print(f"{error.problem}; {error.remedy}")
    holds no study 'waer'; did you mean wear?
    """

    exit_code = 5

    def __init__(self, path: Folder, problem: str, remedy: str):
        self.path, self.problem, self.remedy = os.fspath(path), problem, remedy
        super().__init__(self.path, problem, remedy)

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}; {self.remedy}"


class WrongName(StoreError):
    """A folder, study or job that was named is not there, or may not be used: the caller's slip."""

    exit_code = 2


class StoreWarning(CompsimWarning):
    """What a store lacks that was requested, such as a damaged file; its reader goes on without.

    Its jobs count as missing, and the next run computes them again. To stop instead:

    >>> import warnings
    >>> import compressor
    >>> warnings.simplefilter("error", compressor.StoreWarning)
    """


def system_error(path: Folder, error: OSError) -> StoreError:
    """Return the StoreError that says what the file system refused."""
    remedy = REMEDIES.get(error.errno or 0, "check the disk, then run the same command again")
    return StoreError(path, os.strerror(error.errno) if error.errno else str(error), remedy)


@contextlib.contextmanager
def refusals(path: Folder) -> Iterator[None]:
    """Turn what the file system refuses, there or at a path that it names, into a StoreError."""
    try:
        yield
    except OSError as error:
        named = error.filename if isinstance(error.filename, str) else path
        raise system_error(named, error) from error


def publish(path: Path, data: bytes, pending: bool = False) -> None:
    """Write a whole file under its name, durably, or leave what was there, as `publishing` does.

    Raises StoreError where the disk refuses.
    """
    with publishing(path, pending) as file:
        file.write(data)


@contextlib.contextmanager
def publishing(path: Path, pending: bool = False) -> Iterator[BinaryIO]:
    """Yield a file to write: it has its name, durably, once the block has ended well, or never.

    What stood under the name is left until then. A `pending` file is left under `pending_path` for
    `name_pending`, and is durable once its folder has been synced; amid `sync_later` not before
    that ends. Raises StoreError where the disk refuses.
    """
    own = path.with_name(f".{path.name}.{uuid.uuid4().hex}.tmp")
    temporary = pending_path(path) if pending else own
    make_folder(path.parent)
    try:
        try:
            with open(temporary, "wb") as file:
                yield file
                file.flush()
                later = SYNC_LATER.get() if pending else None
                if later:
                    later(os.dup(file.fileno()), path)
                else:
                    os.fsync(file.fileno())
            if not pending:
                os.replace(temporary, path)
        except BaseException:
            with contextlib.suppress(OSError):
                temporary.unlink()
            raise
        if not pending:
            sync_folder(path.parent)
    except OSError as error:
        raise system_error(path, error) from error


# takes a descriptor, which it closes, and the path that its file will have
SYNC_LATER: ContextVar[Callable[[int, Path], object] | None] = ContextVar("later", default=None)


@contextlib.contextmanager
def sync_later() -> Iterator[None]:
    """Sync the pending files that the block writes in threads, beside what it goes on with.

    They are on disk when it has ended. Raises StoreError then where the disk refused one, which is
    removed: of the block's files none may be relied on.
    """
    syncs: list[Future[None]] = []
    with ThreadPoolExecutor(SYNC_THREADS) as pool:  # waits for its threads, whatever is raised
        before = SYNC_LATER.set(lambda *file: syncs.append(pool.submit(_sync_pending, *file)))
        try:
            yield
        finally:
            SYNC_LATER.reset(before)
    for sync in syncs:
        sync.result()


def _sync_pending(descriptor: int, path: Path) -> None:
    """Sync a file that waits for its name, and close it; remove it where the disk refuses."""
    try:
        os.fsync(descriptor)
    except OSError as error:
        with contextlib.suppress(OSError):
            pending_path(path).unlink()
        raise system_error(path, error) from error
    finally:
        os.close(descriptor)


def pending_path(path: Path) -> Path:
    """Return where a file waits until it gets its name."""
    return path.with_name(f".{path.name}.tmp")


def final_path(path: Path) -> Path:
    """Return what a file that waits will be called; one with its name keeps it."""
    return path.with_name(path.name.removeprefix(".").removesuffix(".tmp"))


def name_pending(paths: Iterable[Path]) -> None:
    """Give files that wait their names; one that has its name stays. Raises StoreError."""
    for path in paths:
        with refusals(path):
            try:
                os.replace(pending_path(path), path)
            except FileNotFoundError:
                if not path.exists():
                    raise


def is_locked(place: Path) -> bool:
    """Return whether a `Writer` is at work in a place; what one that was killed left is no lock."""
    try:
        import fcntl
    except ImportError:  # Windows: nothing is run there
        return False
    try:
        with open(place / LOCK_NAME, "rb") as file:
            if not file.read(1):  # given back: nobody is disturbed by our look
                return False
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            return False
    except BlockingIOError:
        return True
    except OSError:
        return False


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, durably. Raises StoreError."""
    try:
        if not folder.is_dir():
            make_folder(folder.parent)
            folder.mkdir(exist_ok=True)
            sync_folder(folder.parent)
    except FileExistsError as error:
        problem = "is a link that leads nowhere" if folder.is_symlink() else IS_FILE
        raise WrongName(folder, problem, ELSEWHERE) from error
    except OSError as error:
        raise system_error(folder, error) from error


def writable_folder(folder: Folder, make: bool = True) -> None:
    """Raise WrongName unless files may be written to a folder, and make it if wanted.

    Called before there are any files. Raises StoreError where the disk refuses.
    """
    path = Path(folder)
    above = next(place for place in (path, *path.parents, Path()) if place.exists())
    if not above.is_dir():
        raise WrongName(above, IS_FILE, ELSEWHERE)
    if not os.access(above, os.W_OK | os.X_OK):
        raise WrongName(path, f"nothing may be written to {above}", FORBIDDEN)
    if make:
        make_folder(path)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable, where the system and its file system can."""
    if os.name == "nt":  # which opens no folder
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in NO_SYNC:
            raise
    finally:
        os.close(descriptor)


def discard_leftovers(folder: Folder) -> None:
    """Remove the temporary files of writers that died long ago, from the folders in a folder.

    Not where a link leads: others may write there. Raises StoreError.
    """
    with refusals(folder):
        leftovers = [*Path(folder).glob("*/.*.tmp")]
    for path in leftovers:
        if path.parent.is_symlink():
            continue
        with contextlib.suppress(OSError):
            if time.time() - path.stat().st_mtime > LEFTOVER_AGE:
                path.unlink()


MAX_LOOKED_AT = 1000  # entries of a folder in which results are sought
MAX_NAMES = 5  # that are listed
MAKE = "make one: compsim run CONFIG..."
# results of studies without jobs -> what they are, and the command that reads them
STUDY_RESULTS = {
    "follow/*.nc": ("how machines move along a key", "compsim follow CONFIG --over ... reports it"),
    "wear/*.nc": ("how machines have worn", "compsim wear CONFIG... reports them"),
}


def holds_results(folder: Folder) -> bool:
    """Return whether a folder holds a study, of jobs or of another kind."""
    patterns = ("studies/*.json", *STUDY_RESULTS)
    try:
        return any(any(Path(folder).glob(pattern)) for pattern in patterns)
    except OSError:
        return False


def no_results(folder: Folder) -> WrongName:
    """Return the error about a folder that holds no study of jobs, with what was probably meant."""
    place = Path(folder)
    if place.is_file():
        if place.suffix in (".yaml", ".yml"):
            remedy = f"compsim run {folder} makes one, in results"
            return WrongName(folder, "is a case file, where a folder of results is needed", remedy)
        return WrongName(
            folder, "is a file, where a folder of results is needed", remedy_for(place)
        )
    if not place.exists():
        return WrongName(folder, "there is no such folder of results", remedy_for(place))
    for pattern, (content, remedy) in STUDY_RESULTS.items():
        if any(place.glob(pattern)):
            return WrongName(folder, f"holds no study of jobs, only {content}", remedy)
    return WrongName(folder, "holds no study", remedy_for(place))


def remedy_for(place: Path) -> str:
    """Return what to name in place of this folder: a near one that holds results, or a new run."""
    above = place.absolute().parent
    inside = [*found_in(place)]
    if inside:
        return f"did you mean {' or '.join(str(one) for one in inside[:MAX_NAMES])}?"
    beside = {
        one.name: place.parent / one.name for one in found_in(above) if one.name != place.name
    }
    near = did_you_mean(place.name, beside, beside)
    if near:
        return near
    if holds_results(above):
        return f"did you mean {place.parent}?"
    if beside:
        return f"there are results in {list_few([*map(str, beside.values())])}; or {MAKE}"
    return f"choose the folder of a sweep, or {MAKE}"


def found_in(folder: Path) -> Iterator[Path]:
    """Yield the folders in a folder that hold results, in their order."""
    try:
        entries = sorted(islice(folder.iterdir(), MAX_LOOKED_AT))
    except OSError:
        return
    yield from (one for one in entries if one.is_dir() and holds_results(one))


def list_few(names: list[str]) -> str:
    """Return a few names, and whether there are more."""
    return ", ".join(names[:MAX_NAMES]) + (", …" if len(names) > MAX_NAMES else "")
