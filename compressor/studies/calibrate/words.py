"""What was fitted to a record, as lines of text and as JSON."""

from collections.abc import Iterator
from typing import Any

from compressor.studies.calibrate.calibrate import Calibration

POOR_FIT = 1.3  # misfit from which on the machine is said not to be this one


def list_fit(record: str, config: str, found: Calibration) -> Iterator[str]:
    """Yield what was fitted, how well, and what the record does not determine."""
    fit, rpm = found.fit, f"{60 * found.speed:.6g} rpm, in place of the file's {found.rpm_given:g}"
    turns = f"{found.revolutions} revolutions at {rpm}; orders 1 to {found.orders}"
    yield f"{config}, fitted to {record}: {turns}"
    for place, one in enumerate(found.unknowns):
        low, high = found.interval(place)
        share = fit.shares[place]
        more = "; at an end of its range: widen it" if min(share, 1.0 - share) < 1e-3 else ""
        yield f"{one.key}: {one.value(share):.4g}, 95 % interval {low:.4g} to {high:.4g}{more}"
    explained = f"{fit.explained:.2%} of the mean revolution's mean square"
    yield f"the machine explains {explained}; noise is {fit.noise:.2g} of it"
    if fit.misfit >= POOR_FIT:
        times = f"{fit.misfit:.3g} times what a model may err; intervals are widened by as much"
        yield f"THE MACHINE DOES NOT FIT: orders are off by {times}"
    for group in fit.open_directions:
        keys = " and ".join(found.unknowns[place].key for place in group)
        how = "are not separated" if len(group) > 1 else "is not determined"
        yield f"{keys} {how}: the record narrows their range by less than half"


def jsonable_fit(record: str, found: Calibration) -> dict[str, Any]:
    """Return what was fitted as JSON says it."""
    fit, keys = found.fit, {}
    for place, one in enumerate(found.unknowns):
        low, high = found.interval(place)
        keys[one.key] = {"value": one.value(fit.shares[place]), "low": low, "high": high}
    return {
        "record": record,
        "study": found.study,
        "keys": keys,
        "misfit": fit.misfit,
        "explained": fit.explained,
        "noise": fit.noise,
        "orders": found.orders,
        "revolutions": found.revolutions,
        "speed_rpm": 60 * found.speed,
        "not_told_apart": [[found.unknowns[p].key for p in group] for group in fit.open_directions],
        "case": found.case.values(),
    }
