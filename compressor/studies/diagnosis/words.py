"""A data set and an identification, as lines of text and as JSON."""

import dataclasses
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from compressor.digits import plural
from compressor.studies.diagnosis.data_card import counts
from compressor.studies.diagnosis.identify import Identification, Identifier


def describe_dataset(data_set: xr.Dataset) -> list[str]:
    """Return the numbers of windows and machines by joint and split, and what was left out."""
    rows = counts(data_set)
    width = max(len(joint) for joint, *_ in rows)
    lines = [f"{'joint':<{width}}  {'split':<5}  {'machines':>8}  {'windows':>8}"]
    lines += [f"{j:<{width}}  {s:<5}  {m:>8,}  {w:>8,}" for j, s, m, w in rows]
    alone = [joint for joint, split, machines, _ in rows if split == "test" and not machines]
    if alone:
        lines.append(f"too few machines to test on: {', '.join(alone)}")
    for reason, count in json.loads(data_set.attrs["left_out"]).items():
        lines.append(f"left out: {count:,} {reason}")
    return lines


def verdict(answer: Identification) -> Iterator[str]:
    """Yield that nothing fits, and what may be done; nothing where something does."""
    if answer.fits:
        return
    yield (f"NOTHING IN THIS STUDY FITS: {answer.p_value:.2%} of its own jobs are as strange "
           "(see the distances below)")  # fmt: skip
    odd = ", ".join(f"{name} ({value:+.1f} sd)" for name, value in answer.odd.items())
    yield f"farthest from what other features foretell: {odd}"
    yield ("what to do: first compare noise with the study's sensor.noise_m_per_s2, and "
           "the unit (g read as m/s2 is a factor of 9.8); then check tacho and sensor; then widen "
           "what the study varies (noise, masses, speed, loads, friction, foundation), and run it "
           "again")  # fmt: skip
    yield "the ranking below is what is least far, and is not to be trusted"


def ranking(answer: Identification) -> Iterator[str]:
    """Yield the table of joints."""
    yield f"{'rank':<5} {'joint':<10} {'probability':>11}  clearance, mm: median [90 % interval]"
    for rank, one in enumerate(answer.candidates, 1):
        yield f"{rank:<5} {one.joint:<10} {one.probability:>11.3f}  {ends(one.clearances)}".rstrip()


def ends(clearances: dict[str, Any]) -> str:
    """Return the clearances with their intervals, by end."""
    return "; ".join(
        f"{side} {found.median:.3f} [{found.low:.3f}, {found.high:.3f}]"
        for side, found in clearances.items()
    )


def grounds(fitted: Identifier, answer: Identification, folder: str) -> Iterator[str]:
    """Yield the jobs and distances on which an answer rests, and its cautions."""
    library = fitted.library
    yield (f"rests on {len(library.keys)} of {plural(library.jobs)} of study {library.study} in "
           f"{folder}; the nearest one is {answer.nearest}")  # fmt: skip
    yield (f"distance from the nearest jobs {answer.near.record:.3g} (usual "
           f"{answer.near.usual:.3g}), of features from what others foretell "
           f"{answer.apart.record:.3g} (usual {answer.apart.usual:.3g}); "
           f"as strange are {answer.p_value:.0%} of its own jobs")  # fmt: skip
    shares = [value for ends in fitted.covered.values() for value in ends.values()]
    tail = f", clearance within its interval in {sum(shares) / len(shares):.0%}" if shares else ""
    yield f"on these jobs, each left out in turn: joint right in {fitted.right:.0%}{tail}"
    left = [
        joint for joint in ("none", "big_end", "small_end", "both") if joint not in fitted.joints
    ]
    if left:
        yield f"not identified, since the study has too few jobs of it: {', '.join(left)}"
    if fitted.equal and "both" in fitted.joints:
        yield "the study has equal clearances at both joints, so it covers equal ones only"
    yield "caution: beside the joints, the study varies these alone; all else, such as the laws of"
    yield "contact and friction, the foundation, the sensor and its noise, is as in its case file:"
    for key, values in library.swept.items():
        if key != "sensor.seed":
            yield f"  {key:<28} {span(values)}"


def span(values: np.ndarray) -> str:
    """Return the reach of a swept key's values."""
    if values.dtype.kind in "iuf":
        return f"{values.min():.4g} to {values.max():.4g}"
    return ", ".join(sorted({str(value) for value in values.tolist()}))


def jsonable_record(record: str, fitted: Identifier, answer: Identification) -> dict[str, Any]:
    """Return an answer as JSON says it."""
    library = fitted.library
    return {
        "record": record, "study": library.study, "jobs": len(library.keys),
        "jobs_of_study": library.jobs, **dataclasses.asdict(answer),
        "study_joint_right": fitted.right, "study_intervals_hold": fitted.covered,
        "equal_clearances": fitted.equal, "joints": list(fitted.joints),
    }  # fmt: skip
