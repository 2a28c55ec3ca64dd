"""Reciprocating compressor with joint clearance: cases, simulation, studies.

Build a case, simulate it, and read a number with its error bar:

>>> import compressor
>>> case = compressor.Case.from_values({
...     "joint": "big_end", "clearance_mm": 0.2,
...     "solve": {"duration_rev": 2, "accuracy": "draft"},
... })
>>> run = compressor.simulate(case)
>>> force = run.peak_contact_force.sel(joint="big_end")
>>> bar = run.peak_contact_force_error.sel(joint="big_end")
>>> print(f"{force / 1e3:.2f} kN, known to {100 * bar / force:.2f} %")
8.81 kN, known to 0.06 %

What a sweep has stored is opened by `open_study`. Case files and `Case` have the units that stand
in the names of their keys, such as `clearance_mm`; all results are SI. Names are imported when they
are first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from compressor.program import VERSION as __version__
from compressor.program import CompsimError, CompsimWarning

if TYPE_CHECKING:
    from compressor.cases import (
        Body,
        Case,
        CaseError,
        CaseFileError,
        Contact,
        Drive,
        Friction,
        Gas,
        Guide,
        Lubricant,
        Machine,
        Offset,
        Output,
        PerJoint,
        Rod,
        Sensor,
        Solve,
        Spring,
        Wear,
        load_cases,
    )
    from compressor.solve import simulate
    from compressor.store import StoreError, StoreWarning, open_study, read_job

__all__ = [
    "Body",
    "Case",
    "CaseError",
    "CaseFileError",
    "CompsimError",
    "CompsimWarning",
    "Contact",
    "Drive",
    "Friction",
    "Gas",
    "Guide",
    "Lubricant",
    "Machine",
    "Offset",
    "Output",
    "PerJoint",
    "Rod",
    "Sensor",
    "Solve",
    "Spring",
    "StoreError",
    "StoreWarning",
    "Wear",
    "__version__",
    "load_cases",
    "open_study",
    "read_job",
    "simulate",
]

HOMES = {  # of what is not in `cases`
    "simulate": "solve",
    "open_study": "store",
    "read_job": "store",
    "StoreError": "store",
    "StoreWarning": "store",
}


def __dir__() -> list[str]:
    return [*__all__]


if not TYPE_CHECKING:  # a type checker would take any name for one of ours

    def __getattr__(name):
        if name not in __all__:
            raise AttributeError(f"module 'compressor' has no attribute {name!r}")
        return getattr(import_module(f"compressor.{HOMES.get(name, 'cases')}"), name)
