"""Compare a record with stored jobs: their numbers, and what does not fit."""

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compressor.cases import Case, points
from compressor.program import CompsimError, Progress, no_progress
from compressor.store import (
    Folder,
    find_record,
    find_study,
    job_record,
    read_store,
    read_studies,
    report_job,
)
from compressor.studies.compare.likeness import (
    SWING,
    Curves,
    Likeness,
    compare_lines,
    curves,
    share_inside,
)
from compressor.studies.frame import Revolutions, by_revolutions
from compressor.vibration import RecordError

UNSAID = {"joint", "clearance_mm", "sensor"}  # swept groups that are told otherwise, or not
SAME_SPEED = 0.01  # share by which speeds may differ, beyond which forces do by 2 %
SAME_RATE = 1e-3  # share by which sampling rates may differ: an order of a thousand stays
FEW = 5  # revolutions, below which the mean revolution is noisy
MIN_SHIFT, MIN_GAIN = 2.0, 0.1  # degrees and correlation from which a shift is named
FAR = 3.0  # ratio of rms beyond which the level is named
NEAR = 0.25  # share by which a ratio may differ from one between two units
MISTAKES = {  # ratio of rms -> what was probably mistaken
    9.80665: "m/s2 were perhaps read as g", 1 / 9.80665: "g were perhaps read as m/s2",
    1000.0: "mm/s2 were perhaps read as m/s2", 1e-3: "m/s2 were perhaps read as mm/s2",
}  # fmt: skip


class CompareError(CompsimError):
    """A comparison that cannot be made."""

    exit_code = 2


@dataclass(frozen=True)
class Compared:
    """A job beside the record.

    what: its joint, clearance and swept values, in words; rpm, rate: of its record, rate in Hz;
    sensor: where it sits and what it measures along, in words; orders: the highest order that both
    hold, up to which they are compared.
    """

    key: str
    what: str
    rpm: float
    rate: float
    sensor: str
    orders: int
    likeness: Likeness
    curves: Curves


@dataclass(frozen=True)
class Comparison:
    """A record beside jobs, the most alike first.

    remarks: how a file was read; key: of a record that is a stored job's, else ""; orders: the
    highest that the record holds; left_out: jobs without a record that can be used; inside: share
    of crank angle at which the record's envelope lies in the range of the jobs', nan of a single
    job; misfits: sentences on what does not fit.
    """

    name: str
    key: str
    remarks: tuple[str, ...]
    turned: Revolutions
    curves: Curves
    orders: int
    jobs: tuple[Compared, ...]
    left_out: int
    inside: float
    misfits: tuple[str, ...]


def compare_record(
    name: str,
    words: Sequence[str],
    folder: Folder,
    hints: Mapping[str, Any],
    progress: Progress = no_progress,
) -> Comparison:
    """Return a record, a file or a stored job's, beside the jobs that words name.

    words: beginnings of jobs' keys, and names of studies, in which a record's own job is left out;
    hints: of `find_record`. Raises RecordError, StoreError, and CompareError where no job is left
    or orders are too few.
    """
    key, record = find_record(name, folder, hints)
    mine = by_revolutions(record)
    _check_orders(mine.highest, name)
    own = {mine.highest: curves(mine.lines(mine.highest))}  # by the highest order
    stored = read_store(folder).warned()
    wanted = dict(_wanted_jobs(words, folder, key))
    jobs = []
    for number, (one, swept) in enumerate(wanted.items()):
        progress(number, len(wanted), "")
        other, case = job_record(stored, one), stored.case_at(int(stored.rows.find([one])[0]))
        if other is not None and case is not None and case.sensor:
            with contextlib.suppress(RecordError):  # too short, or all zero
                jobs.append(_compare_job(mine, own, by_revolutions(other), one, case, swept))
    if not jobs:
        text = f"none of the {len(wanted)} jobs has a sensor's record of two revolutions"
        raise CompareError(f"{text}: run them with body: true, sensor: true and series kept")
    jobs.sort(key=lambda job: np.nan_to_num(job.likeness.difference.value, nan=math.inf))
    curve = own[mine.highest]
    several = np.array([job.curves.envelope for job in jobs])
    inside = share_inside(curve.envelope, several) if len(jobs) > 1 else math.nan
    return Comparison(
        name, key, record.remarks, mine, curve, mine.highest, tuple(jobs),
        len(wanted) - len(jobs), inside,
        tuple(find_misfits(mine, jobs, is_file=not key)),
    )  # fmt: skip


def _compare_job(
    mine: Revolutions,
    own: dict[int, Curves],
    turned: Revolutions,
    key: str,
    case: Case,
    swept: Mapping[str, Any],
) -> Compared:
    """Return a job beside the record.

    own: the record's curves by the highest order; swept: values of its study, by key.
    """
    orders = min(mine.highest, turned.highest)
    _check_orders(orders, f"job {key}")
    lines, others = mine.lines(orders), turned.lines(orders)
    if orders not in own:
        own[orders] = curves(lines)
    drawn = curves(others)
    likeness = compare_lines(lines, others, own[orders], drawn)
    place = f"{case.sensor.place} along {case.sensor.direction}" if case.sensor else ""
    what = describe_job(case, swept)
    return Compared(key, what, turned.rpm, turned.rate, place, orders, likeness, drawn)


def _check_orders(orders: int, what: str) -> None:
    """Raise CompareError where a sampling rate holds too few orders."""
    if orders <= SWING:
        text = f"{what}: the sampling rate holds the orders up to {orders} alone"
        raise CompareError(f"{text}: record with more than {SWING + 1} times 2.56 samples a turn")


def describe_job(case: Case, swept: Mapping[str, Any]) -> str:
    """Return a job's joint and clearance, and other values that its study sweeps, in words."""
    ends = {"none": (), "both": ("big_end", "small_end")}.get(case.joint, (case.joint,))
    words = [f"{end} {getattr(case.clearance_mm, end):g} mm" for end in ends] or ["no clearance"]
    others = {key: value for key, value in swept.items() if key.split(".")[0] not in UNSAID}
    return ", ".join([*words, *(f"{key} {value}" for key, value in others.items())])


def _wanted_jobs(
    words: Sequence[str], folder: Folder, own: str
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield keys and swept values of the jobs that words name, of studies without the own one."""
    names = {study.name for study in read_studies(folder)}
    for word in words:
        if word in names:
            study = find_study(folder, word)
            pairs = zip(study.keys, points(study), strict=True)
            yield from ((key, swept) for key, swept in pairs if key != own)
        else:
            yield report_job(folder, word).key, {}


def find_misfits(record: Revolutions, jobs: Sequence[Compared], is_file: bool) -> Iterator[str]:
    """Yield a sentence for what does not fit between a record and jobs, the most alike first."""
    best = jobs[0]
    likeness = best.likeness
    if abs(record.rpm / best.rpm - 1.0) > SAME_SPEED:
        more = (record.rpm / best.rpm) ** 2
        yield (
            f"speed: {record.rpm:.4g} rpm, and the job has {best.rpm:.4g}: forces of inertia "
            f"are {more:.3g} times as large; run it at machine.speed_rpm: {record.rpm:.4g}"
        )
    if abs(record.rate / best.rate - 1.0) > SAME_RATE:
        yield (f"sampling rate: {record.rate:.6g} Hz, and the job has {best.rate:.6g}: what only "
               "the faster one holds is left out")  # fmt: skip
    if len(record.values) < FEW:
        yield (f"length: {len(record.values)} revolutions: noise falls by their root alone; "
               f"record {FEW} or more")  # fmt: skip
    ratio = likeness.rms_ratio.value
    meant = [text for size, text in MISTAKES.items() if abs(ratio / size - 1.0) <= NEAR]
    if meant:
        yield f"unit: the rms is {ratio:.3g} times the job's: {meant[0]}; check --unit"
    elif not 1.0 / FAR <= ratio <= FAR:
        yield (f"level: the rms is {ratio:.3g} times the job's: check unit and full scale, then "
               "masses, foundation and the sensor's place")  # fmt: skip
    gain = likeness.shifted - likeness.correlation.value
    if abs(likeness.shift_deg) >= MIN_SHIFT and gain >= MIN_GAIN:
        yield (
            f"crank angle: most alike ({likeness.shifted:.2f}) where the record comes "
            f"{likeness.shift_deg:+.1f} degrees later: a hint to check the tacho (--tacho-deg), "
            "no measurement of its angle"
        )
    if is_file:
        places = " or ".join(dict.fromkeys(job.sensor for job in jobs))
        yield (f"place: the jobs' sensor is at the {places}; a file does not say where its sensor "
               "was")  # fmt: skip
