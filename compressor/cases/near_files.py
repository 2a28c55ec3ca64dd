"""What is said of a path that is no case file: which files are near, or what it is instead."""

import shlex
from itertools import islice
from pathlib import Path

from compressor.program import did_you_mean

SUFFIXES = (".yaml", ".yml")
RESULTS = (b"\x89HDF", b"CDF\x01", b"CDF\x02", b"CDF\x05")  # how HDF5 and netCDF files begin
START = "compsim init writes a case file to start from"
MOST_LOOKED_AT = 1000  # entries of a folder
MOST_NAMES = 5


def unreadable(path: str, error: OSError | ValueError) -> str:
    """Return why a file cannot be read, and what to do about it."""
    message = f"cannot be read: {getattr(error, 'strerror', None) or error}"
    if isinstance(error, FileNotFoundError):
        return f"{message}; {_instead(Path(path))}"
    if isinstance(error, IsADirectoryError):
        inside = case_files(Path(path))
        line = f"compsim run {shlex.quote(path.rstrip('/'))}/*.yaml"
        return f"{message}; {f'it holds case files: {line}' if inside else 'give a case file'}"
    return message


def no_text(data: bytes) -> str:
    """Return what is said of a file that is no text in UTF-8."""
    if data.startswith(RESULTS):
        return "is a file of results (netCDF or HDF5); a case file is YAML text"
    return "is not UTF-8 text"


def case_files(folder: Path) -> list[Path]:
    """Return the case files in a folder, by their names."""
    try:
        entries = sorted(islice(folder.iterdir(), MOST_LOOKED_AT))
    except OSError:
        return []
    return [path for path in entries if path.suffix in SUFFIXES and path.is_file()]


def _instead(path: Path) -> str:
    """Return what to give in place of a file that is not there."""
    if "*" in path.name:
        return f"no file has such a name; {START}"
    found = {path.stem: path for path in [*case_files(Path("configs")), *case_files(path.parent)]}
    near = did_you_mean(path.stem, found, found)
    if near or not found:
        return near or START
    names = [*map(str, found.values())]
    return f"there are {', '.join(names[:MOST_NAMES])}{', …' * (len(names) > MOST_NAMES)}"
