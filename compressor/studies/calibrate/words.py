"""What was fitted to a record, as lines of text and as JSON."""

from collections.abc import Iterator
from typing import Any

from compressor.studies.calibrate.calibrate import Calibration

POOR_FIT = 1.3  # misfit from which on the machine is said not to be this one


def describe(record: str, config: str, found: Calibration) -> Iterator[str]:
    """Yield what was fitted, how well, and what the record does not determine."""
    fit = found.fit
    yield (f"{config}, fitted to {record}: {found.revolutions} revolutions at "
           f"{60 * found.speed:.6g} rpm, in place of the file's {found.rpm_given:g}; "
           f"orders 1 to {found.orders}")  # fmt: skip
    for place, one in enumerate(found.unknowns):
        low, high = found.interval(place)
        best = one.value(fit.shares[place])
        is_at_end = min(fit.shares[place], 1.0 - fit.shares[place]) < 1e-3
        more = "; at an end of its range: widen it" if is_at_end else ""
        yield f"{one.key}: {best:.4g}, 95 % interval {low:.4g} to {high:.4g}{more}"
    yield (f"the machine explains {fit.explained:.2%} of the mean revolution's mean square; "
           f"noise is {fit.noise:.2g} of it")  # fmt: skip
    if fit.misfit >= POOR_FIT:
        yield (f"THE MACHINE DOES NOT FIT: orders are off by {fit.misfit:.3g} times what a model "
               "may err; intervals are widened by as much")  # fmt: skip
    for group in fit.open_directions:
        keys = " and ".join(found.unknowns[place].key for place in group)
        how = "are not separated" if len(group) > 1 else "is not determined"
        yield f"{keys} {how}: the record narrows their range by less than half"


def jsonable_fit(record: str, found: Calibration) -> dict[str, Any]:
    """Return what was fitted as JSON says it."""
    fit = found.fit
    keys = {}
    for place, one in enumerate(found.unknowns):
        low, high = found.interval(place)
        keys[one.key] = {"value": one.value(fit.shares[place]), "low": low, "high": high}
    return {
        "record": record, "study": found.study, "keys": keys, "misfit": fit.misfit,
        "explained": fit.explained, "noise": fit.noise, "orders": found.orders,
        "revolutions": found.revolutions, "speed_rpm": 60 * found.speed,
        "not_told_apart": [[found.unknowns[p].key for p in group] for group in fit.open_directions],
        "case": found.case.values(),
    }  # fmt: skip
