"""Files that are whole or absent, and the folders that hold results.

What the file system refuses is a StoreError, which says where and what to do about it.
"""

import contextlib
import errno
import os
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

from compressor.program import CompsimError, CompsimWarning

Folder = str | os.PathLike[str]

LEFTOVERS = f"**/.*.{32 * '[0-9a-f]'}.tmp"  # what `publish` calls its files, and nobody else
LEFTOVER_AGE = 3600.0  # s; a temporary file this old belongs to a writer that died

FREE_SPACE_REMEDY = "free some space there, then run the same command again"
IS_FILE = "is a file, where a folder is needed"
ELSEWHERE = "choose another folder"
NO_SYNC = (errno.EINVAL, errno.EOPNOTSUPP, errno.ENOTSUP)  # of a folder, as FUSE and SMB say
FORBIDDEN = f"get the permission to use it, or {ELSEWHERE}"
REMEDIES = {
    errno.ENOSPC: FREE_SPACE_REMEDY,
    errno.EDQUOT: FREE_SPACE_REMEDY,
    errno.EFBIG: FREE_SPACE_REMEDY,
    errno.EACCES: FORBIDDEN,
    errno.EPERM: FORBIDDEN,
    errno.EROFS: FORBIDDEN,
    errno.ENOTDIR: ELSEWHERE,
    errno.ENAMETOOLONG: ELSEWHERE,
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


class FolderLost(StoreError):
    """A folder of results that was removed, replaced or damaged while a run wrote to it."""

    def __init__(self, folder: Folder):
        problem = "was removed, replaced or damaged, at least in part, while the run wrote to it"
        super().__init__(folder, problem, "run the same command again, in a folder that stays")


class StoreWarning(CompsimWarning):
    """What a store lacks that was requested, such as a damaged file; its reader goes on without.

    Jobs of a batch count as missing, and the next run computes them again. To stop instead:

    >>> import warnings
    >>> import compressor
    >>> warnings.simplefilter("error", compressor.StoreWarning)
    """


def system_error(path: Folder, error: OSError) -> StoreError:
    """Return the StoreError that says what the file system refused."""
    remedy = REMEDIES.get(error.errno or 0, "check the disk, then run the same command again")
    return StoreError(path, os.strerror(error.errno) if error.errno else str(error), remedy)


@contextlib.contextmanager
def refusals(path: Path, named: bool = True) -> Iterator[None]:
    """Turn what the file system refuses into a StoreError of a path, or of one that it names."""
    try:
        yield
    except OSError as error:
        other = error.filename if named and isinstance(error.filename, str) else path
        raise system_error(other, error) from error


def publish(path: Path, data: bytes, durable: bool = True, make: bool = True) -> None:
    """Write a whole file under its name, or leave what was there.

    durable: a power cut leaves it there, too, which takes the disk a while. make: also its folder.
    Raises StoreError where the disk refuses.
    """
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex}.tmp")
    if make:
        make_folder(path.parent)
    with refusals(path, named=False):
        try:
            with open(temporary, "wb") as file:
                file.write(data)
                if durable:
                    file.flush()
                    os.fsync(file.fileno())
            os.replace(temporary, path)
        except BaseException:
            with contextlib.suppress(OSError):
                temporary.unlink()
            raise
        if durable:
            sync_folder(path.parent)


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


def discard_leftovers(folder: Path) -> None:
    """Remove the temporary files of writers that died long ago, from all folders in a folder.

    Not where a link leads: others may write there. Raises OSError.
    """
    for path in folder.glob(LEFTOVERS):  # which follows no link
        with contextlib.suppress(OSError):
            if time.time() - path.stat().st_mtime > LEFTOVER_AGE:
                path.unlink()
