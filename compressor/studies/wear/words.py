"""How bores wear, as lines of text and as JSON."""

import math
from collections.abc import Iterator
from typing import Any

from compressor.studies.wear.run import WornMachine
from compressor.studies.wear.stages import wear_file

HEAD = f"{'worn out after, h':>17}  {'from more to less wear, h':>31}  at the end"


def table(machines: tuple[WornMachine, ...]) -> Iterator[str]:
    """Yield a line for each machine, below a head."""
    names = [" ".join([one.study, *(f"{k}={v}" for k, v in one.point.items())]) for one in machines]
    width = max(map(len, names))
    yield f"{'machine':<{width}}  {HEAD}"
    for name, one in zip(names, machines, strict=True):
        yield f"{name:<{width}}  {wear_ending(one)}"


def wear_ending(one: WornMachine) -> str:
    """Return the end of a machine's wear in a line."""
    found, wear_keys = one.life, one.case.wear
    if not found or not wear_keys:
        return f"failed: {one.reason}"
    factor = wear_keys.coefficient_factor
    low, mid, high = (
        hours(min(times * found.followed, wear_keys.hours), "> ")
        if math.isnan(value)
        else hours(value)
        for value, times in ((found.low, 1.0 / factor), (found.hours, 1.0), (found.high, factor))
    )
    where = f"{1e3 * found.clearance:.3f} mm at {found.joint}"
    return f"{mid:>17}  {f'{low} to {high}':>31}  {where}" + f"; failed: {one.reason}" * bool(
        one.reason
    )


def hours(value: float, sign: str = "") -> str:
    """Return the hours in four digits."""
    return f"{sign}{value:.0f}" if value >= 1000 else f"{sign}{value:.4g}"


def jsonable_wear(one: WornMachine, folder: str) -> dict[str, Any]:
    """Return a machine as JSON says it."""
    found: dict[str, Any] = {"study": one.study, **one.point, "reason": one.reason}
    if one.life:
        numbers = {
            name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in one.life._asdict().items()
        }
        found |= {**numbers, "file": str(wear_file(folder, one.case))}
    return found
