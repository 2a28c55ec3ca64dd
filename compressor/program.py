"""The program: its version, its errors, the libraries it runs with, where its machine code is."""

import contextlib
import ctypes
import functools
import gc
import hashlib
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from importlib import metadata
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

VERSION = "0.1.0"  # the one place; CHANGELOG.md says what has changed
PROGRAM = f"compsim {VERSION}"  # as stored results name it
COMPILED = Path(__file__).parent / "physics"  # the sources that are compiled
CODE_VARIABLE = "NUMBA_CACHE_DIR"
# that keep numeric libraries to so many threads
THREAD_VARIABLES = (
    "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
    "BLIS_NUM_THREADS", "NUMBA_NUM_THREADS", "NUMEXPR_NUM_THREADS",
)  # fmt: skip
PR_SET_PDEATHSIG = 1  # linux/prctl.h
MAX_WORD_LENGTH = 100  # characters of a word that others are compared with


Thing = TypeVar("Thing")
Progress = Callable[[int, int, str], None]  # things done, things in all, a remark or ""


def no_progress(done: int, total: int, remark: str) -> None:
    """Report progress to nobody."""


def duration(seconds: float) -> str:
    """Return the seconds as people say them."""
    if seconds < 100:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60:02d} min"


def report_progress(things: Sequence[Thing], progress: Progress) -> Iterator[Thing]:
    """Yield things, and report how many are done."""
    for number, thing in enumerate(things):
        progress(number, len(things), "")
        yield thing
    progress(len(things), len(things), "")


@contextlib.contextmanager
def work_beside(work: Callable[[], Thing]) -> Iterator[Callable[[], Thing]]:
    """Have a copy of this process do some work meanwhile; yield what waits for its result.

    All is done here, where that is called, with one core, beside threads, whose locks a copy would
    take along, in a process that may have no children, where the system makes no copies, and where
    the copy dies. What work raises is raised here.
    """
    affinity = getattr(os, "sched_getaffinity", None)
    cores = len(affinity(0)) if affinity else os.cpu_count() or 1
    is_free = threading.active_count() == 1 and not multiprocessing.current_process().daemon
    can_copy = cores > 1 and is_free and "fork" in multiprocessing.get_all_start_methods()
    here, there = multiprocessing.Pipe(duplex=False)

    def result() -> Thing:
        with contextlib.suppress(EOFError, OSError):
            return here.recv()
        return work()

    copy = copy_beside(_send_result, work, here, there) if can_copy else contextlib.nullcontext()
    with here, copy:
        there.close()
        yield result


@contextlib.contextmanager
def copy_beside(target: Callable[..., None], *args: Any) -> Iterator[None]:
    """Have a copy of this process do something meanwhile, if there can be one; then kill it."""
    copy = None
    with contextlib.suppress(OSError, ValueError):  # too many processes; there are no copies
        copy = multiprocessing.get_context("fork").Process(target=target, args=args)
        copy.start()
    try:
        yield
    finally:
        if copy and copy.pid:
            copy.kill()
            copy.join()


def die_with_parent() -> None:
    """Have the system kill this process when its parent dies, even amid compiled code (Linux)."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def _send_result(work: Callable[[], Any], here: Connection, there: Connection) -> None:
    """Send what work returns; Ctrl-C, or the end of who waits for it, ends this silently."""
    die_with_parent()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    here.close()  # so that sending fails where nobody is left to receive
    gc.freeze()  # else each collection looks at what lives as long as the copy
    with contextlib.suppress(Exception):  # which the work raises again where it is waited for
        there.send(work())


class CompsimError(Exception):
    """An error that was foreseen: its text says what is wrong and what to do about it.

    The base of CaseError, CaseFileError, StoreError and all others. exit_code: what the command
    line ends with; prefix: what it prints before the text.

    >>> import compressor
    >>> try:
    ...     compressor.open_study("nowhere")
    ... except compressor.CompsimError as error:
    ...     print(error.exit_code, type(error).__name__)
    2 WrongName
    """

    exit_code = 2
    prefix = "compsim: "


class CompsimWarning(UserWarning):
    """What was requested and is missing; the program goes on without it.

    The base of StoreWarning and all others. To stop at any of them:

    >>> import warnings
    >>> import compressor
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", compressor.CompsimWarning)
    """


_FILTERS = threading.RLock()


@contextlib.contextmanager
def ignore_warnings(message: str = "") -> Iterator[None]:
    """Ignore the warnings of others that begin with a message, all of them by default.

    Filters belong to the process: threads take turns, or one would restore the other's.
    """
    with _FILTERS, warnings.catch_warnings():
        warnings.filterwarnings("ignore", message)
        warnings.filterwarnings("default", category=CompsimWarning)
        yield


def printable(text: str) -> str:
    """Return text in which no character can steer a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def did_you_mean(word: str, known: Iterable[str], texts: Mapping[str, object] | None = None) -> str:
    """Return what an unknown word probably meant, as `did you mean A?`; "" without a guess.

    texts: what to print for each known word, itself by default. A path or a file's name stands for
    its stem, too; upper and lower case are the same.
    """
    names = {name.casefold(): name for name in known}
    whole = word[:MAX_WORD_LENGTH].casefold()
    spellings = (whole, Path(whole).stem)
    near = [one for one in spellings if one in names]
    near += [one for spelling in spellings for one in get_close_matches(spelling, names, 1)]
    return f"did you mean {(texts or {}).get(names[near[0]], names[near[0]])}?" if near else ""


def library_versions(*names: str) -> dict[str, str]:
    """Return the installed version of each distribution by name. Raises PackageNotFoundError."""
    return {name: metadata.version(name) for name in names}


def sources_hash(folder: Path) -> str:
    """Return the hash of all Python sources in a folder and below: 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def machine_code_folder() -> Path:
    """Return the folder of machine code, named by a hash of the sources and numba's version.

    It is in NUMBA_CACHE_DIR if that is set, else beside the sources, else in the user's cache.
    Raises CompsimError where nothing can be written. Numba itself would go on using a caller's old
    code after a change of what it calls in another file, and may read another version's halfway
    through its own.
    """
    named = os.environ.get(CODE_VARIABLE)
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # as it is, homeless
    usual = (COMPILED / "__pycache__", Path(cache) / "compsim")
    for place in (Path(named).absolute() / "compsim",) if named else usual:
        if place.is_absolute() and _can_write(place):
            return place / f"numba-{sources_hash(COMPILED)}-{metadata.version('numba')}"
    where = named or f"beside {COMPILED} or in the user's cache"
    text = f"nothing can be written to {where}, where machine code would be kept"
    raise CompsimError(f"{text}: set {CODE_VARIABLE} to a folder that stays")


@functools.cache
def _can_write(folder: Path) -> bool:
    """Return whether files can be written to a folder, which is made; by trying it once.

    Permissions say nothing of a full disk, of /proc, or of a link that leads nowhere.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(100_000))  # as the machine code of a small function, about
    except OSError:
        return False
    return True
