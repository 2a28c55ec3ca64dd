"""A data set and an identification, as lines of text and as JSON."""

import dataclasses
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from compressor.digits import align_columns, plural
from compressor.studies.diagnosis.data_card import counts
from compressor.studies.diagnosis.identify import Identification, Identifier

RANKING = ("rank", "joint", "probability", "clearance, mm: median [90 % interval]")


def list_windows(data_set: xr.Dataset) -> Iterator[str]:
    """Yield the numbers of windows and machines by joint and split, and what was left out."""
    rows = [(joint, split, f"{m:,}", f"{w:,}") for joint, split, m, w in counts(data_set)]
    yield from align_columns([("joint", "split", "machines", "windows"), *rows], "<<>>")
    alone = [joint for joint, split, machines, _ in rows if (split, machines) == ("test", "0")]
    if alone:
        yield f"too few machines to test on: {', '.join(alone)}"
    for reason, count in json.loads(data_set.attrs["left_out"]).items():
        yield f"left out: {count:,} {reason}"


def list_joints(fitted: Identifier, answer: Identification, folder: str) -> Iterator[str]:
    """Yield the ranking of joints, that nothing fits where nothing does, and what it rests on."""
    if not answer.fits:
        yield from list_misfit(answer)
    rows = []
    for rank, one in enumerate(answer.candidates, 1):
        ends = [
            f"{side} {found.median:.3f} [{found.low:.3f}, {found.high:.3f}]"
            for side, found in one.clearances.items()
        ]
        rows.append((str(rank), one.joint, f"{one.probability:.3f}", "; ".join(ends)))
    yield from align_columns([RANKING, *rows], "<<>")
    yield from list_grounds(fitted, answer, folder)


def list_misfit(answer: Identification) -> Iterator[str]:
    """Yield that nothing fits, and what may be done."""
    strange = f"{answer.p_value:.2%} of its own jobs are as strange"
    yield f"NOTHING IN THIS STUDY FITS: {strange} (see the distances below)"
    odd = ", ".join(f"{name} ({value:+.1f} sd)" for name, value in answer.odd.items())
    yield f"farthest from what other features foretell: {odd}"
    yield (
        "what to do: first compare noise with the study's sensor.noise_m_per_s2, and the unit (g "
        "read as m/s2 is a factor of 9.8); then check tacho and sensor; then widen what the study "
        "varies (noise, masses, speed, loads, friction, foundation), and run it again"
    )
    yield "the ranking below is what is least far, and is not to be trusted"


def list_grounds(fitted: Identifier, answer: Identification, folder: str) -> Iterator[str]:
    """Yield the jobs and distances on which an answer rests, and its cautions."""
    library, near, apart = fitted.library, answer.near, answer.apart
    jobs = f"{len(library.keys)} of {plural(library.jobs)} of study {library.study} in {folder}"
    yield f"rests on {jobs}; the nearest one is {answer.nearest}"
    yield (
        f"distance from the nearest jobs {near.record:.3g} (usual {near.usual:.3g}), of features "
        f"from what others foretell {apart.record:.3g} (usual {apart.usual:.3g}); as strange are "
        f"{answer.p_value:.0%} of its own jobs"
    )
    shares = [value for ends in fitted.covered.values() for value in ends.values()]
    tail = f", clearance within its interval in {sum(shares) / len(shares):.0%}" if shares else ""
    yield f"on these jobs, each left out in turn: joint right in {fitted.right:.0%}{tail}"
    known = ("none", "big_end", "small_end", "both")
    if left := [joint for joint in known if joint not in fitted.joints]:
        yield f"not identified, since the study has too few jobs of it: {', '.join(left)}"
    if fitted.equal and "both" in fitted.joints:
        yield "the study has equal clearances at both joints, so it covers equal ones only"
    yield "caution: beside the joints, the study varies these alone; all else, such as the laws of"
    yield "contact and friction, the foundation, the sensor and its noise, is as in its case file:"
    swept = {key: span(values) for key, values in library.swept.items() if key != "sensor.seed"}
    yield from align_columns((f"  {key:<28}", text) for key, text in swept.items())


def span(values: np.ndarray) -> str:
    """Return the reach of a swept key's values."""
    if values.dtype.kind in "iuf":
        return f"{values.min():.4g} to {values.max():.4g}"
    return ", ".join(sorted({str(value) for value in values.tolist()}))


def jsonable_record(record: str, fitted: Identifier, answer: Identification) -> dict[str, Any]:
    """Return an answer as JSON says it."""
    library = fitted.library
    return {
        "record": record,
        "study": library.study,
        "jobs": len(library.keys),
        "jobs_of_study": library.jobs,
        **dataclasses.asdict(answer),
        "study_joint_right": fitted.right,
        "study_intervals_hold": fitted.covered,
        "equal_clearances": fitted.equal,
        "joints": fitted.joints,
    }
