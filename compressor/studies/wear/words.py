"""How bores wear, as lines of text and as JSON."""

import math
from collections.abc import Iterable
from typing import Any

from compressor.digits import align_columns
from compressor.studies.wear.run import WornMachine
from compressor.studies.wear.stages import wear_file

HEAD = ("machine", "worn out after, h", "from more to less wear, h", "at the end")


def list_machines(machines: Iterable[WornMachine]) -> list[str]:
    """Return a line for each machine, below a head."""
    return align_columns([HEAD, *map(list_cells, machines)], "<>><")


def list_cells(one: WornMachine) -> tuple[str, ...]:
    """Return the name of a machine, its hours, their range, and its wear at the end."""
    name = " ".join([one.study, *(f"{key}={value}" for key, value in one.point.items())])
    failed = f"failed: {one.reason}" if one.reason else ""
    found, keys = one.life, one.case.wear
    if not found or not keys:
        return name, "", "", failed
    factor = keys.coefficient_factor
    low, mid, high = (
        # not worn out in the hours that were followed, or are followed at most
        f"> {hours(min(times * found.followed, keys.hours))}" if math.isnan(value) else hours(value)
        for value, times in ((found.low, 1.0 / factor), (found.hours, 1.0), (found.high, factor))
    )
    end = f"{1e3 * found.clearance:.3f} mm at {found.joint}"
    return name, mid, f"{low} to {high}", "; ".join(filter(None, (end, failed)))


def hours(value: float) -> str:
    """Return the hours in four digits."""
    return f"{value:.0f}" if value >= 1000 else f"{value:.4g}"


def jsonable_wear(one: WornMachine, folder: str) -> dict[str, Any]:
    """Return a machine as JSON says it."""
    found: dict[str, Any] = {"study": one.study, **one.point, "reason": one.reason}
    if one.life:
        found |= {**one.life._asdict(), "file": str(wear_file(folder, one.case))}
    return found
