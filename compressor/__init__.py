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
from compressor.program import CompsimError as CompsimError
from compressor.program import CompsimWarning as CompsimWarning

if TYPE_CHECKING:
    from compressor.cases import Body as Body
    from compressor.cases import Case as Case
    from compressor.cases import CaseError as CaseError
    from compressor.cases import CaseFileError as CaseFileError
    from compressor.cases import Contact as Contact
    from compressor.cases import Drive as Drive
    from compressor.cases import Friction as Friction
    from compressor.cases import Gas as Gas
    from compressor.cases import Guide as Guide
    from compressor.cases import Lubricant as Lubricant
    from compressor.cases import Machine as Machine
    from compressor.cases import Offset as Offset
    from compressor.cases import Output as Output
    from compressor.cases import PerJoint as PerJoint
    from compressor.cases import Rod as Rod
    from compressor.cases import Sensor as Sensor
    from compressor.cases import Solve as Solve
    from compressor.cases import Spring as Spring
    from compressor.cases import Wear as Wear
    from compressor.cases import load_cases as load_cases
    from compressor.solve import simulate as simulate
    from compressor.store import StoreError as StoreError
    from compressor.store import StoreWarning as StoreWarning
    from compressor.store import open_study as open_study
    from compressor.store import read_job as read_job

# names that are imported when they are first used, by package
HOMES = {
    "cases": (
        "Body", "Case", "CaseError", "CaseFileError", "Contact", "Drive", "Friction", "Gas",
        "Guide", "Lubricant", "Machine", "Offset", "Output", "PerJoint", "Rod", "Sensor", "Solve",
        "Spring", "Wear", "load_cases",
    ),
    "solve": ("simulate",),
    "store": ("StoreError", "StoreWarning", "open_study", "read_job"),
}  # fmt: skip
HOME = {name: package for package, names in HOMES.items() for name in names}
__all__ = ["CompsimError", "CompsimWarning", "__version__", *HOME]


def __dir__() -> list[str]:
    return [*__all__]


if not TYPE_CHECKING:  # a type checker would take any name for one of ours

    def __getattr__(name):
        if name not in HOME:
            raise AttributeError(f"module 'compressor' has no attribute {name!r}")
        return getattr(import_module(f"compressor.{HOME[name]}"), name)
