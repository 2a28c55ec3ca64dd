"""The program: its version, its errors, the libraries it runs with, where its machine code is."""

import hashlib
import os
from importlib import metadata
from pathlib import Path

VERSION = "0.1.0"
PROGRAM = f"compsim {VERSION}"  # as stored results name it
COMPILED = Path(__file__).parent / "physics"  # the sources that are compiled


class CompsimError(Exception):
    """An error that was foreseen: its text says what is wrong and what to do about it.

    The base of CaseError, CaseFileError, StoreError and all others. exit_code: what the command
    line ends with; prefix: what it prints before the text.

    >>> import compressor
    >>> try:
    ...     compressor.open_study("nowhere")
    ... except compressor.CompsimError as error:
    ...     print(error.exit_code, type(error).__name__)
    5 StoreError
    """

    exit_code = 1
    prefix = "compsim: "


class CompsimWarning(UserWarning):
    """What was asked for and is not there; the program goes on without it.

    The base of StoreWarning and all others. To stop at any of them:

    >>> import warnings
    >>> import compressor
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", compressor.CompsimWarning)
    """


def library_versions(*names: str) -> dict[str, str]:
    """The installed version of each distribution by name; raises PackageNotFoundError."""
    return {name: metadata.version(name) for name in names}


def sources_hash(folder: Path) -> str:
    """Hash of all Python sources in a folder and below: 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def machine_code_folder() -> Path:
    """Where machine code is kept: beside the sources, or under the user's cache folder.

    The folder is named by a hash of the sources: numba itself would go on using a caller's old code
    after a change of what it calls in another file.
    """
    beside = COMPILED / "__pycache__"
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "compsim"
    base = beside if os.access(beside if beside.exists() else COMPILED, os.W_OK) else user
    return base / f"numba-{sources_hash(COMPILED)}"
