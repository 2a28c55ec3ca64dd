"""A comparison, as lines of text and as JSON."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from compressor.digits import align_columns, plural
from compressor.studies.compare.comparison import Compared, Comparison
from compressor.studies.compare.likeness import Measured

MAX_LISTED = 20  # jobs
HEAD = (
    *("job", "what it is"),
    *("difference, dB", "correlation", "envelope", "rms ratio", "distance, dB"),
)


def list_comparison(found: Comparison) -> Iterator[str]:
    """Yield the record, the table of jobs, and what does not fit."""
    mine, more = found.turned, len(found.jobs) - MAX_LISTED
    rms = (found.curves.spectrum**2).sum() ** 0.5
    turns = f"{plural(len(mine.values), 'revolution')} at {mine.rpm:.4g} rpm, {mine.rate:.6g} Hz"
    yield f"{found.name}: {turns}, {rms:.4g} m/s2 rms up to order {found.orders}"
    yield from (f"read: {text}" for text in found.remarks)
    yield from align_columns([HEAD, *map(list_cells, found.jobs[:MAX_LISTED])], "<<>>>>>")
    if more > 0:
        yield f"and {more} less alike, which --json lists"
    if found.left_out:
        yield f"left out: {plural(found.left_out)} without a sensor's record of two revolutions"
    if found.inside == found.inside:
        share = f"{found.inside:.0%} of crank angles"
        yield f"envelope: inside the range of the {len(found.jobs)} jobs at {share}"
    yield from (f"does not fit: {text}" for text in found.misfits)


def list_cells(job: Compared) -> tuple[str, ...]:
    """Return a job's key, joint, clearance and swept values, and its numbers."""
    like = job.likeness
    numbers = like.difference, like.correlation, like.envelope, like.rms_ratio
    return job.key[:10], job.what, *map(format_number, (*numbers, like.spectral_distance))


def format_number(found: Measured) -> str:
    """Return a number with its standard error, where it has one."""
    error = f" +- {found.error:.2g}" if found.error == found.error else ""
    return f"{found.value:.3f}{error}"


def jsonable_comparison(found: Comparison) -> dict[str, Any]:
    """Return a comparison as JSON says it."""
    mine = found.turned
    head = {"record": found.name, "revolutions": len(mine.values), "rpm": mine.rpm}
    head |= {"rate_Hz": mine.rate, "orders": found.orders, "left_out": found.left_out}
    head |= {"remarks": found.remarks, "envelope_inside": found.inside, "misfits": found.misfits}
    jobs = []
    for job in found.jobs:
        named = {name: getattr(job, name) for name in ("key", "what", "rpm", "orders", "sensor")}
        jobs.append(named | dataclasses.asdict(job.likeness) | curves(job))
    return head | curves(found) | {"jobs": jobs}


def curves(one: Comparison | Compared) -> dict[str, list[float]]:
    """Return the peak and the rms over a revolution."""
    peak, rms = one.curves.peak.tolist(), one.curves.rms.tolist()
    return {"peak_m_per_s2": peak, "rms_m_per_s2": rms}
