"""Compare a record with stored jobs: their numbers, as rows and as a figure."""

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from compressor.cases import Case, points
from compressor.digits import align_columns, plural
from compressor.program import CompsimError, Progress, no_progress
from compressor.report import (
    BLACK,
    CYCLE,
    GREY,
    LineStyle,
    PlotlyFigure,
    as_csv,
    fill,
    make_grid,
    render,
)
from compressor.store import (
    Folder,
    find_record,
    find_study,
    job_record,
    publish,
    read_store,
    read_studies,
    report_job,
)
from compressor.studies.compare.likeness import (
    SEGMENTS,
    SWING,
    Curves,
    Likeness,
    Measured,
    compare_lines,
    curves,
    share_inside,
)
from compressor.studies.frame import Revolutions, by_revolutions
from compressor.vibration import RecordError

UNSAID = {"joint", "clearance_mm", "sensor"}  # swept groups that are told otherwise, or not
NEAR = 0.25  # share by which a ratio may differ from one between two units
MISTAKES = {  # ratio of rms -> what was probably mistaken
    9.80665: "m/s2 were perhaps read as g", 1 / 9.80665: "g were perhaps read as m/s2",
    1000.0: "mm/s2 were perhaps read as m/s2", 1e-3: "m/s2 were perhaps read as mm/s2",
}  # fmt: skip
NUMBERS = {  # of a likeness -> title of its column
    "difference": "difference, dB", "correlation": "correlation", "envelope": "envelope",
    "rms_ratio": "rms ratio", "spectral_distance": "distance, dB",
}  # fmt: skip
MAX_LISTED = 20  # jobs
MAX_DRAWN = 3  # jobs with a line of their own; the others are in the range alone
KEY_DIGITS = 10
RECORD = LineStyle(BLACK, linewidth=1.3, zorder=3.0)
CAPTION = (
    "The record (black) beside the jobs most alike: (a) mean revolution; (b) peak and, paler, rms "
    "of each 10 degrees, on average over revolutions; (c) rms of the orders; (d) envelope above "
    f"order {SWING}, in the range of all jobs."
)


class CompareError(CompsimError):
    """A comparison that cannot be made."""

    exit_code = 2


@dataclass(frozen=True)
class Compared:
    """A job beside the record.

    what: its joint, clearance and swept values, in words; rpm: of its record; sensor: where it sits
    and what it measures along, in words; orders: the highest order that both hold, up to which they
    are compared.
    """

    key: str
    what: str
    rpm: float
    sensor: str
    orders: int
    likeness: Likeness
    curves: Curves


@dataclass(frozen=True)
class Comparison:
    """A record beside jobs, the most alike first.

    remarks: how a file was read, and which unit it was perhaps written in; orders: the highest that
    the record holds; left_out: jobs without a record that can be used; inside: share of crank angle
    at which the record's envelope lies in the range of the jobs', nan of a single job.
    """

    name: str
    remarks: tuple[str, ...]
    turned: Revolutions
    curves: Curves
    orders: int
    jobs: tuple[Compared, ...]
    left_out: int
    inside: float


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
    check_orders(mine.highest, name)
    own = {mine.highest: curves(mine.lines(mine.highest))}  # by the highest order
    stored = read_store(folder, warn=True)
    wanted = dict(wanted_jobs(words, folder, key))
    jobs = []
    for number, (one, swept) in enumerate(wanted.items()):
        progress(number, len(wanted), "")
        other, case = job_record(stored, one), stored.case_at(int(stored.find([one])[0]))
        if other is None or case is None or not case.sensor:
            continue
        with contextlib.suppress(RecordError):  # too short, or all zero
            theirs = by_revolutions(other)
            orders = min(mine.highest, theirs.highest)
            check_orders(orders, f"job {one}")
            lines, others = mine.lines(orders), theirs.lines(orders)
            own[orders] = own.get(orders) or curves(lines)
            drawn = curves(others)
            place = f"{case.sensor.place} along {case.sensor.direction}"
            likeness = compare_lines(lines, others, own[orders], drawn)
            what = describe_job(case, swept)
            jobs.append(Compared(one, what, theirs.rpm, place, orders, likeness, drawn))
    if not jobs:
        text = f"none of the {len(wanted)} jobs has a sensor's record of two revolutions"
        raise CompareError(f"{text}: run them with body: true, sensor: true and series kept")
    jobs.sort(key=lambda job: np.nan_to_num(job.likeness.difference.value, nan=math.inf))
    curve = own[mine.highest]
    several = np.array([job.curves.envelope for job in jobs])
    inside = share_inside(curve.envelope, several) if len(jobs) > 1 else math.nan
    ratio = jobs[0].likeness.rms_ratio.value
    unit = [f"the rms is {ratio:.3g} times the job's: {text}; check --unit"
            for size, text in MISTAKES.items() if abs(ratio / size - 1.0) <= NEAR]  # fmt: skip
    return Comparison(
        name, (*record.remarks, *unit), mine, curve, mine.highest, tuple(jobs),
        len(wanted) - len(jobs), inside,
    )  # fmt: skip


def check_orders(orders: int, what: str) -> None:
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


def wanted_jobs(
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


# ---- as rows ------------------------------------------------------------------------------------


def list_comparison(found: Comparison) -> Iterator[str]:
    """Yield the record and the table of jobs."""
    mine, more = found.turned, len(found.jobs) - MAX_LISTED
    rms = (found.curves.spectrum**2).sum() ** 0.5
    turns = f"{plural(len(mine.values), 'revolution')} at {mine.rpm:.4g} rpm, {mine.rate:.6g} Hz"
    yield f"{found.name}: {turns}, {rms:.4g} m/s2 rms up to order {found.orders}"
    yield from (f"read: {text}" for text in found.remarks)
    rows = [("job", "what it is", "rpm", *NUMBERS.values())]
    for job in found.jobs[:MAX_LISTED]:
        numbers = (format_number(getattr(job.likeness, name)) for name in NUMBERS)
        rows.append((job.key[:KEY_DIGITS], job.what, f"{job.rpm:.4g}", *numbers))
    yield from align_columns(rows, "<<" + ">" * (1 + len(NUMBERS)))
    if more > 0:
        yield f"and {more} less alike, which --json lists"
    if found.left_out:
        yield f"left out: {plural(found.left_out)} without a sensor's record of two revolutions"
    if not math.isnan(found.inside):
        share = f"{found.inside:.0%} of crank angles"
        yield f"envelope: inside the range of the {len(found.jobs)} jobs at {share}"


def format_number(found: Measured) -> str:
    """Return a number with its standard error, where it has one."""
    return f"{found.value:.3f}" + ("" if math.isnan(found.error) else f" +- {found.error:.2g}")


def jsonable_comparison(found: Comparison) -> dict[str, Any]:
    """Return a comparison as JSON says it, with peak and rms over a revolution."""

    def levels(one: Comparison | Compared) -> dict[str, list[float]]:
        peak, rms = one.curves.peak.tolist(), one.curves.rms.tolist()
        return {"peak_m_per_s2": peak, "rms_m_per_s2": rms}

    mine, named = found.turned, ("key", "what", "rpm", "orders", "sensor")
    return {
        "record": found.name, "revolutions": len(mine.values), "rpm": mine.rpm,
        "rate_Hz": mine.rate, "orders": found.orders, "left_out": found.left_out,
        "remarks": found.remarks, "envelope_inside": found.inside, **levels(found),
        "jobs": [{name: getattr(job, name) for name in named} | asdict(job.likeness) | levels(job)
                 for job in found.jobs],
    }  # fmt: skip


# ---- the figure ---------------------------------------------------------------------------------


def draw_comparison(found: Comparison) -> PlotlyFigure:
    """Return the four panels of a comparison, the record's curves in black."""
    drawing, grid = make_grid(2, 2, 7.4)
    shown = [(found.name, found.curves, RECORD), *(
        (f"{job.key[:KEY_DIGITS]}: {job.what}", job.curves, line)
        for job, line in zip(found.jobs[:MAX_DRAWN], CYCLE, strict=False)
    )]  # fmt: skip
    (mean, segments), (orders, envelope) = grid
    degrees = np.arange(360) + 0.5
    if len(found.jobs) > 1:
        several = np.array([job.curves.envelope for job in found.jobs])
        around = np.concatenate([degrees, degrees[::-1]])
        edge = np.concatenate([several.min(axis=0), several.max(axis=0)[::-1]])
        envelope.fill(around, edge, fill(GREY, 0.5), f"range of {len(several)} jobs", listed=False)
    steps = np.repeat(np.arange(SEGMENTS + 1) * (360.0 / SEGMENTS), 2)[1:-1]
    for name, one, line in shown:
        mean.plot(one.angle, one.mean, line, name)
        segments.plot(steps, np.repeat(one.peak, 2), line, name)
        faint = replace(line, alpha=0.45)
        segments.plot(steps, np.repeat(one.rms, 2), faint, f"{name}, rms", listed=False)
        orders.plot(np.arange(1, one.spectrum.size + 1), one.spectrum, line, name)
        envelope.plot(degrees, one.envelope, line, name)
    for panel in (mean, segments, envelope):
        panel.x.title, panel.x.dtick = "crank angle (deg)", 60
        panel.span("x", 0.0, 360.0)
    mean.y.title = "mean revolution (m/s²)"
    segments.y.title = "peak and rms of 10° segments (m/s²)"
    orders.x.title, orders.y.title = "order of the speed", "rms of an order (m/s²)"
    orders.x.type = orders.y.type = "log"
    orders.span("x", 1.0, found.orders)
    envelope.y.title = f"envelope above order {SWING} (m/s²)"
    for panel in (segments, envelope):
        panel.span("y", low=0.0)
    for panel, letter in zip(grid.flat, "abcd", strict=True):
        panel.title = f"({letter})"
    return drawing.figure()


def write_figure(figure: PlotlyFigure, output: str, kind: str) -> None:
    """Write a figure as a picture, or its numbers as CSV."""
    data = as_csv(figure).encode() if kind == ".csv" else render(figure, kind[1:])
    publish(Path(output), data)
