"""A comparison, as lines of text and as JSON."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from compressor.digits import plural
from compressor.studies.compare.comparison import Compared, Comparison
from compressor.studies.compare.likeness import Measured

MOST = 20  # jobs that are listed
COLUMNS = ("difference, dB", "correlation", "envelope", "rms ratio", "distance, dB")


def list_comparison(found: Comparison) -> Iterator[str]:
    """Yield the record, the table of jobs, and what does not fit."""
    mine = found.turned
    rms = (found.curves.spectrum**2).sum() ** 0.5
    yield (f"{found.name}: {plural(len(mine.spectra), 'revolution')} at {mine.rpm:.4g} rpm, "
           f"{mine.rate:.6g} Hz, {rms:.4g} m/s2 rms up to order {found.orders}")  # fmt: skip
    yield from (f"read: {text}" for text in found.remarks)
    width = max(len("what it is"), *(len(job.what) for job in found.jobs[:MOST]))
    yield f"{'job':<12}{'what it is':<{width}}" + "".join(f"{one:>18}" for one in COLUMNS)
    for job in found.jobs[:MOST]:
        yield job_line(job, width)
    if len(found.jobs) > MOST:
        yield f"and {len(found.jobs) - MOST} less alike, which --json lists"
    if found.left_out:
        yield f"left out: {plural(found.left_out)} without a sensor's record of two revolutions"
    if found.inside == found.inside:
        yield (f"envelope: inside the range of the {len(found.jobs)} jobs at {found.inside:.0%} of "
               "crank angles")  # fmt: skip
    for text in found.misfits:
        yield f"does not fit: {text}"


def job_line(job: Compared, width: int) -> str:
    """Return a job's joint, clearance and swept values, padded to a width, and its numbers."""
    like = job.likeness
    numbers = (
        like.difference, like.correlation, like.envelope, like.rms_ratio, like.spectral_distance,
    )  # fmt: skip
    columns = "".join(f"{number(one):>18}" for one in numbers)
    return f"{job.key[:10]:<12}{job.what:<{width}}{columns}"


def number(found: Measured) -> str:
    """Return a number with its standard error, where it has one."""
    error = f" +- {found.error:.2g}" if found.error == found.error else ""
    return f"{found.value:.3f}{error}"


def jsonable_comparison(found: Comparison) -> dict[str, Any]:
    """Return a comparison as JSON says it."""
    mine = found.turned
    return {
        "record": found.name, "revolutions": len(mine.spectra), "rpm": mine.rpm,
        "rate_Hz": mine.rate, "orders": found.orders, "left_out": found.left_out,
        "remarks": list(found.remarks),
        "envelope_inside": found.inside, "misfits": list(found.misfits),
        "peak_m_per_s2": found.curves.peak.tolist(), "rms_m_per_s2": found.curves.rms.tolist(),
        "jobs": [
            {
                "key": job.key, "what": job.what, "rpm": job.rpm, "orders": job.orders,
                "sensor": job.sensor,
                **dataclasses.asdict(job.likeness),
                "peak_m_per_s2": job.curves.peak.tolist(),
                "rms_m_per_s2": job.curves.rms.tolist(),
            }
            for job in found.jobs
        ],
    }  # fmt: skip
