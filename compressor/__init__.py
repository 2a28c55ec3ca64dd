"""Reciprocating compressor with joint clearance: cases, simulation, studies.

The public calls: `load_cases(path, ...)` reads case files, `simulate(case)` runs one case,
`open_study(folder)` opens what a sweep stored. They are imported when first used, since the
command line must answer `--help` at once. `CompsimError` is the base of all errors that were
foreseen, `CompsimWarning` that of all warnings.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from compressor.program import VERSION as __version__
from compressor.program import CompsimError, CompsimWarning

if TYPE_CHECKING:
    from compressor.cases import Case, load_cases
    from compressor.solve import simulate
    from compressor.store import open_study

__all__ = [
    "Case",
    "CompsimError",
    "CompsimWarning",
    "__version__",
    "load_cases",
    "open_study",
    "simulate",
]

HOMES = {"Case": "cases", "load_cases": "cases", "simulate": "solve", "open_study": "store"}


def __getattr__(name: str) -> Any:
    if name not in HOMES:
        raise AttributeError(f"module 'compressor' has no attribute {name!r}")
    return getattr(import_module(f"compressor.{HOMES[name]}"), name)
