"""The group of a case file that says how bores wear."""

from dataclasses import dataclass, replace
from functools import partial

from compressor.cases.groups import PerJoint
from compressor.cases.parameter import documented, parameter

value = partial(parameter, identity=False)  # of no single run


@documented
@dataclass(frozen=True)
class Wear:
    """How the rod's bores wear in joints with clearance; a case's `wear`, None: they stay round.

    `compsim wear` follows them over operating hours, by Archard's law on a bore divided into
    sectors. A single run has an unworn bore. `True` stands for the defaults:

    >>> import compressor
    >>> case = compressor.Case.from_values({"joint": "both", "clearance_mm": 0.1, "wear": True})
    >>> case.wear.limit_mm  # twice the greater clearance
    0.2
    """

    coefficient_mm3_per_N_m: float = value(
        1e-8, "mm3/(N m)", (0, 1.0),
        "assumed: of oiled metals, for which tables give 1e-9 to 1e-6 (Archard, J. Appl. Phys. 24, "
        "1953, defines it)",
        "volume that is worn off for each N m of pressing and sliding", above=True,
    )  # fmt: skip
    coefficient_factor: float = value(
        2.0, "", (1, 1e6), "assumed", "how many times smaller or greater the coefficient may be"
    )
    limit_mm: float | None = value(
        None, "mm", (0, 1e4), "assumed: twice the greater clearance",
        "clearance at the deepest place, at which a joint counts as worn out", above=True,
        optional=True,
    )  # fmt: skip
    hours: float = value(
        50000.0, "h", (0, 1e9), "ours", "operating hours after which it ends at the latest",
        above=True,
    )  # fmt: skip
    step_mm: float = value(
        0.01, "mm", (0, 1e4), "ours: tests/results/README.md, Wear",
        "wear at the deepest place for which one motion stands", above=True,
    )  # fmt: skip
    bore_length_mm: float = value(
        20.0, "mm", (0, 1e4), "assumed: as long as wide", "length of the bores", above=True
    )
    sectors: int = value(
        72, "", (24, 180), "ours: tests/results/README.md, Wear",
        "that a bore is divided into by angle", kind="integer",
    )  # fmt: skip


def filled_wear(wear: Wear, clearance_mm: PerJoint) -> Wear:
    """Return the wear with its limit, by the clearances of both joints."""
    most = max(clearance_mm.big_end, clearance_mm.small_end)
    return wear if wear.limit_mm or not most else replace(wear, limit_mm=2.0 * most)
