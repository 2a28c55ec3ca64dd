"""Reciprocating compressor with joint clearance: cases, simulation, studies.

The public calls: `load_cases(path, ...)` reads case files, `simulate(case)` runs one case,
`open_study(folder)` opens what a sweep stored. They are imported when first used, since the
command line must answer `--help` at once. `CompsimError` is the base of all errors that were
foreseen, `CompsimWarning` that of all warnings.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compressor.cases import Case, load_cases
    from compressor.solve.simulate import simulate
    from compressor.store import open_study

__version__ = "0.1.0"
__all__ = ["Case", "CompsimError", "CompsimWarning", "load_cases", "open_study", "simulate"]

HOMES = {"Case": "cases", "load_cases": "cases", "simulate": "solve", "open_study": "store"}


class CompsimError(Exception):
    """An error that was foreseen: its text says what is wrong and what to do about it.

    exit_code: what the command line ends with; prefix: what it prints before the text.
    """

    exit_code = 1
    prefix = "compsim: "


class CompsimWarning(UserWarning):
    """What was asked for and is not there; the program goes on without it."""


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module 'compressor' has no attribute {name!r}")
    return getattr(import_module(f"compressor.{HOMES[name]}"), name)


def library_versions(*names: str) -> dict[str, str]:
    """The installed version of each distribution by name; raises PackageNotFoundError."""
    from importlib import metadata

    return {name: metadata.version(name) for name in names}
