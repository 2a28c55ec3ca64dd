"""Compare a record with stored jobs: how alike they are, as rows and as a figure.

Everything follows from the lines of each revolution: its Fourier coefficients at whole orders, up
to the highest order that both records hold. The mean is left out, since accelerometers lose it.
"""

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from compressor import analysis, cases, digits, program, report, store, vibration
from compressor.cases import Case
from compressor.report import style
from compressor.studies import frame

SEGMENTS = 36
FINE = 4  # points on a curve for each cycle of its highest order
MIN_FOR_ERRORS = 3  # revolutions
# weights in the difference, dB, of the mean revolution's orders, of one less both correlations and
# of the logarithm of the ratio of rms: calibrated, and judged by other records (docs/diagnosis.md)
MEAN_ORDERS, MEAN_SHAPE, BURSTS, LEVEL = 0.5, 3.0, 10.0, 3.0
NEAR_DEG = 5  # by which a tacho may be off: shapes and bursts count where they fit best so far off
MIN_LINES = 8  # of a third octave, by which noise is known
QUIET = 1e-4  # share of the loudest third octave below which none is compared
SAME_BAND = 0.5  # dB, to which a third octave of a job is taken as known
UNSAID = {"joint", "clearance_mm", "sensor"}  # swept groups that are told otherwise, or not
MAX_LISTED = 20  # jobs
NEAR = 0.25  # share by which a ratio may differ from one between two units
NEAR_IF_ALL = 2.0  # times, where all jobs' ratios are nearer to that one than to 1
SAME_SPEED = 0.05  # share by which speeds may differ
MISTAKES = {  # ratio of rms -> what was probably mistaken
    9.80665: "m/s2 were perhaps read as g", 1 / 9.80665: "g were perhaps read as m/s2",
    1000.0: "mm/s2 were perhaps read as m/s2", 1e-3: "m/s2 were perhaps read as mm/s2",
}  # fmt: skip
MAX_DRAWN = 3  # jobs
KEY_DIGITS = 10


# ---- how alike two records are ------------------------------------------------------------------


@dataclass(frozen=True)
class Curves:
    """What is drawn of a record.

    mean: m/s2 over `angle` (deg), its mean revolution, (m,); peak, rms: m/s2 of each segment,
    averaged over revolutions, (36,); spectrum: m/s2 rms of the orders 1, 2, ..., (orders,);
    envelopes: m/s2 above order `ORDER` of each revolution, averaged over each degree, (n, 360).
    """

    angle: np.ndarray
    mean: np.ndarray
    peak: np.ndarray
    rms: np.ndarray
    spectrum: np.ndarray
    envelopes: np.ndarray

    @property
    def envelope(self) -> np.ndarray:
        """Return the envelope over crank angle, averaged over revolutions, (360,)."""
        return self.envelopes.mean(axis=0)


def curves(lines: np.ndarray) -> Curves:
    """Return the curves of a record from its lines, (n, orders)."""
    orders = lines.shape[1]
    size = 360 * math.ceil(FINE * orders / 360)
    whole = np.zeros((len(lines), size), complex)  # of the analytic signal
    whole[:, 1 : orders + 1] = lines * (math.sqrt(2.0) * size)
    each = np.fft.ifft(whole, axis=1).real
    whole[:, : analysis.ORDER + 1] = 0.0
    envelopes = np.abs(np.fft.ifft(whole, axis=1)).reshape(len(lines), 360, -1).mean(axis=2)
    angle = np.arange(size) * (360.0 / size)
    levels = np.array([vibration.segment_levels(angle, turn, SEGMENTS) for turn in each])
    peak, rms = levels.mean(axis=0)
    spectrum = np.sqrt(np.mean(np.abs(lines) ** 2, axis=0))
    return Curves(angle, each.mean(axis=0), peak, rms, spectrum, envelopes)


@dataclass(frozen=True)
class Measured:
    """A number with its standard error by the record's revolutions; nan where there are too few."""

    value: float
    error: float


# number of a likeness -> title of its column: difference is of all numbers together, from 0;
# correlation of the mean revolutions and envelope of the envelopes over crank angle are from -1 to
# 1, the same shape, or the same bursts whatever rings in them, at the same angles; rms_ratio is of
# the record over the job
NUMBERS = {
    "difference": "difference, dB", "correlation": "correlation", "envelope": "envelope",
    "rms_ratio": "rms ratio",
}  # fmt: skip
Likeness = dict[str, Measured]


def measure_likeness(record: np.ndarray, job: np.ndarray, mine: Curves, other: Curves) -> Likeness:
    """Return the `NUMBERS` of a record and a job by their lines, (n, orders) each, and curves.

    Errors are of the jackknife: each revolution of the record is left out in turn (Efron and Stein,
    Annals of Statistics 9, 1981), from three on.
    """

    def compare(kept: np.ndarray) -> tuple[float, ...]:
        return _compare(record[kept], job, mine.envelopes[kept].mean(axis=0), other.envelope)

    count = len(record)
    found, errors = compare(np.full(count, True)), np.full(len(NUMBERS), math.nan)
    if count >= MIN_FOR_ERRORS:
        left = np.array([compare(np.arange(count) != k) for k in range(count)])
        errors = np.sqrt((count - 1) / count * ((left - left.mean(axis=0)) ** 2).sum(axis=0))
    return dict(zip(NUMBERS, map(Measured, found, errors.tolist()), strict=True))


def _compare(
    record: np.ndarray, job: np.ndarray, envelope: np.ndarray, others: np.ndarray
) -> tuple[float, ...]:
    """Return the `NUMBERS` by lines, (n, orders) each, and envelopes, (360,); nan of a silent one.

    The difference is the distance of the third octaves of orders with their level, of all
    revolutions and of the mean one; one less the correlation of the mean revolutions and one less
    that of the envelopes, where they are greatest within `NEAR_DEG`; and the ratio of the mean
    revolutions' rms. White noise is taken out of all powers.
    """
    mean, other_mean = record.mean(axis=0), job.mean(axis=0)
    powers = [float((np.abs(lines) ** 2).sum()) / len(lines) for lines in (record, job)]
    bursts, other_bursts = envelope - envelope.mean(), others - others.mean()
    shape = math.sqrt(float((np.abs(mean) ** 2).sum() * (np.abs(other_mean) ** 2).sum()))
    size = math.sqrt(float((bursts**2).sum() * (other_bursts**2).sum()))
    if not shape:
        return (math.nan,) * len(NUMBERS)
    product, ratio = mean * other_mean.conj(), math.sqrt(powers[0] / powers[1])
    correlation = float(product.real.sum()) / shape
    if not size:  # nothing above `ORDER`
        return math.nan, correlation, math.nan, ratio
    alike = float((_near_turns(record.shape[1]) @ product).real.max()) / shape
    near = range(-NEAR_DEG, NEAR_DEG + 1)
    same = max(float(bursts @ np.roll(other_bursts, degree)) for degree in near) / size
    (whole, one), (other_whole, other) = _band_powers(record), _band_powers(job)
    sums = [float(np.maximum(powers_of[0], 0.0).sum()) for powers_of in (one, other)]
    level = 0.5 * abs(math.log(sums[0] / sums[1])) if min(sums) > 0.0 else 0.0
    difference = (
        _bands_apart(whole, other_whole) + MEAN_ORDERS * _bands_apart(one, other)
        + MEAN_SHAPE * (1.0 - alike) + BURSTS * (1.0 - same) + LEVEL * level
    )  # fmt: skip
    return difference, correlation, float(bursts @ other_bursts) / size, ratio


@lru_cache(maxsize=4)
def _near_turns(orders: int) -> np.ndarray:
    """Return what turns lines by each tenth of a degree within `NEAR_DEG`, (angles, orders)."""
    shifts = np.radians(np.linspace(-NEAR_DEG, NEAR_DEG, 20 * NEAR_DEG + 1))
    return np.exp(1j * np.outer(shifts, np.arange(1, orders + 1)))


Powers = tuple[np.ndarray, np.ndarray]  # of third octaves, and their standard deviations by noise


def _band_powers(lines: np.ndarray) -> tuple[Powers, Powers]:
    """Return the mean squares of third octaves without noise: of all revolutions, of the mean one.

    lines: (n, orders). White noise makes all lines alike: it is the mean of the third octaves that
    are as quiet as the quietest one, within their scatter.
    """
    count, orders = lines.shape
    band = third_octaves(orders)
    wide = np.bincount(band)
    whole = np.bincount(band, np.mean(np.abs(lines) ** 2, axis=0))
    mean = np.bincount(band, np.abs(lines.mean(axis=0)) ** 2)
    scatter = 1.0 / np.sqrt(count * wide)
    a_line = whole / wide
    known = wide >= min(MIN_LINES, wide.max())
    least = int(np.argmin(np.where(known, a_line * (1.0 + 2.0 * scatter), math.inf)))
    alike = known & (a_line <= a_line[least] * (1.0 + 3.0 * (scatter + scatter[least])))
    noise = float(whole[alike].sum() / wide[alike].sum())
    one = whole - noise * wide, noise * np.sqrt(wide / count)
    return one, (mean - noise / count * wide, noise / count * np.sqrt(wide))


def _bands_apart(record: Powers, job: Powers) -> float:
    """Return the rms difference of third octaves in dB, each weighted by how well it is known."""
    (one, noise), (other, others) = record, job
    low = 2.0 * (noise + others) + QUIET * max(one.max(), other.max())
    heard = (one > low) | (other > low)
    if not heard.any():
        return 0.0
    first, second = np.maximum(one, low)[heard], np.maximum(other, low)[heard]
    scale = 10.0 / math.log(10.0)
    unsure = (scale * noise[heard] / first) ** 2 + (scale * others[heard] / second) ** 2
    weight = 1.0 / (unsure + SAME_BAND**2)
    return math.sqrt(float(weight @ (scale * np.log(first / second)) ** 2 / weight.sum()))


def third_octaves(orders: int) -> np.ndarray:
    """Return the third octave of each of the orders 1, 2, ..., from 0, (orders,).

    Middle orders are 2^(k/3), edges a sixth of an octave beside them; those without an order are
    left out.
    """
    place = np.round(3.0 * np.log2(np.arange(1, orders + 1))).astype(int)
    return np.unique(place, return_inverse=True)[1]


# ---- a record beside jobs -----------------------------------------------------------------------


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

    remarks: how a file was read, and what was perhaps mistaken; orders: the highest that
    the record holds; left_out: jobs without a record that can be used.
    """

    name: str
    remarks: tuple[str, ...]
    turned: vibration.Revolutions
    curves: Curves
    orders: int
    jobs: tuple[Compared, ...]
    left_out: int


def compare_record(
    name: str,
    words: Sequence[str],
    folder: store.Folder,
    hints: Mapping[str, Any],
    progress: program.Progress = program.no_progress,
) -> Comparison:
    """Return a record, a file or a stored job's, beside the jobs that words name.

    words: beginnings of jobs' keys, and names of studies, in which a record's own job is left out;
    hints: of `find_record`. Raises RecordError, StoreError, and StudyError where no job is left
    or orders are too few.
    """
    key, record = store.find_record(name, folder, hints)
    mine = vibration.by_revolutions(record)
    check_orders(mine.highest, name)
    own = {mine.highest: curves(mine.lines(mine.highest))}  # by the highest order
    stored = store.read_store(folder, warn=True)
    wanted = dict(wanted_jobs(words, folder, key))
    jobs = []
    for one, swept in program.report_progress([*wanted.items()], progress):
        other, case = store.job_record(stored, one), stored.case_at(int(stored.find([one])[0]))
        if other is None or case is None or not case.sensor:
            continue
        with contextlib.suppress(vibration.RecordError):  # too short, or all zero
            theirs = vibration.by_revolutions(other)
            orders = min(mine.highest, theirs.highest)
            check_orders(orders, f"job {one}")
            lines, others = mine.lines(orders), theirs.lines(orders)
            own[orders] = own.get(orders) or curves(lines)
            drawn = curves(others)
            place = f"{case.sensor.place} along {case.sensor.direction}"
            likeness = measure_likeness(lines, others, own[orders], drawn)
            what = describe_job(case, swept)
            jobs.append(Compared(one, what, theirs.rpm, place, orders, likeness, drawn))
    if not jobs:
        text = f"none of the {len(wanted)} jobs has a sensor's record of two revolutions"
        raise frame.StudyError(f"{text}: run them with body: true, sensor: true and series kept")
    jobs.sort(key=lambda job: np.nan_to_num(job.likeness["difference"].value, nan=math.inf))
    mistakes = () if key else find_mistakes(mine.rpm, jobs)  # a stored job's are known to be none
    remarks = (*record.remarks, *mistakes)
    return Comparison(
        name, remarks, mine, own[mine.highest], mine.highest, tuple(jobs),
        len(wanted) - len(jobs),
    )  # fmt: skip


def find_mistakes(rpm: float, jobs: Sequence[Compared]) -> Iterator[str]:
    """Yield what was perhaps mistaken of a record: its unit, its speed; jobs: most alike first."""
    ratios = np.array([job.likeness["rms_ratio"].value for job in jobs])
    for size, text in MISTAKES.items():
        is_near = abs(ratios[0] / size - 1.0) <= NEAR
        away = np.abs(np.log(ratios / size))
        all_nearer = bool((away < np.abs(np.log(ratios))).all())
        if is_near or (all_nearer and away[0] <= math.log(NEAR_IF_ALL)):
            yield f"the rms is {ratios[0]:.3g} times the job's: {text}; check --unit"
    nearest = min((job.rpm for job in jobs), key=lambda one: abs(one - rpm))
    if abs(rpm / nearest - 1.0) > SAME_SPEED:
        yield (
            f"it turns at {rpm:.4g} rpm, and the nearest job at {nearest:.4g} rpm: check the "
            "tacho, --rpm and --time-unit"
        )


def check_orders(orders: int, what: str) -> None:
    """Raise StudyError where a sampling rate holds too few orders."""
    if orders <= analysis.ORDER:
        text = f"{what}: the sampling rate holds the orders up to {orders} alone"
        raise frame.StudyError(
            f"{text}: record with more than {analysis.ORDER + 1} times 2.56 samples a turn"
        )


def describe_job(case: Case, swept: Mapping[str, Any]) -> str:
    """Return a job's joint and clearance, and other values that its study sweeps, in words."""
    ends = () if case.joint == "none" else analysis.faulty_joints(case.joint)
    words = [f"{end} {getattr(case.clearance_mm, end):g} mm" for end in ends] or ["no clearance"]
    others = {key: value for key, value in swept.items() if key.split(".")[0] not in UNSAID}
    return ", ".join([*words, *(f"{key} {value}" for key, value in others.items())])


def wanted_jobs(
    words: Sequence[str], folder: store.Folder, own: str
) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield keys and swept values of the jobs that words name, of studies without the own one."""
    studies = {study.name: study for study in store.read_studies(folder)}
    for word in words:
        if study := studies.get(word):
            pairs = zip(study.keys, cases.points(study), strict=True)
            yield from ((key, swept) for key, swept in pairs if key != own)
        else:
            yield store.report_job(folder, word).key, {}


def list_comparison(found: Comparison) -> Iterator[str]:
    """Yield the record and the table of jobs."""
    mine, more = found.turned, len(found.jobs) - MAX_LISTED
    rms = (found.curves.spectrum**2).sum() ** 0.5
    turns = digits.plural(len(mine.values), "revolution")
    yield (f"{found.name}: {turns} at {mine.rpm:.4g} rpm, {mine.rate:.6g} Hz, "
           f"{rms:.4g} m/s2 rms up to order {found.orders}")  # fmt: skip
    yield from (f"read: {text}" for text in found.remarks)
    rows = [("job", "what it is", "rpm", *NUMBERS.values())]
    for job in found.jobs[:MAX_LISTED]:
        numbers = map(format_number, job.likeness.values())
        rows.append((job.key[:KEY_DIGITS], job.what, f"{job.rpm:.4g}", *numbers))
    yield from digits.align_columns(rows, "<<" + ">" * (1 + len(NUMBERS)))
    if more > 0:
        yield f"and {more} less alike, which --json lists"
    if found.left_out:
        left = digits.plural(found.left_out)
        yield f"left out: {left} without a sensor's record of two revolutions"


def format_number(found: Measured) -> str:
    """Return a number with its standard error, where it has one."""
    return f"{found.value:.3f}" + ("" if math.isnan(found.error) else f" +- {found.error:.2g}")


def jsonable_comparison(found: Comparison) -> dict[str, Any]:
    """Return a comparison as JSON says it."""
    mine, named = found.turned, ("key", "what", "rpm", "orders", "sensor")
    return {
        "record": found.name, "revolutions": len(mine.values), "rpm": mine.rpm,
        "rate_Hz": mine.rate, "orders": found.orders, "left_out": found.left_out,
        "remarks": found.remarks,
        "jobs": [{name: getattr(job, name) for name in named}
                 | {name: asdict(one) for name, one in job.likeness.items()}
                 for job in found.jobs],
    }  # fmt: skip


# ---- the figure ---------------------------------------------------------------------------------

RECORD = style.LineStyle(style.BLACK, linewidth=1.3, zorder=3.0)
CAPTION = (
    "The record (black) beside the jobs most alike: (a) mean revolution; (b) peak and, paler, rms "
    "of each 10 degrees, on average over revolutions; (c) rms of the orders; (d) envelope above "
    f"order {analysis.ORDER}."
)


def draw_comparison(found: Comparison) -> report.PlotlyFigure:
    """Return the four panels of a comparison, the record in black, what is more alike on top."""
    drawing, grid = report.make_grid(2, 2, 7.4)
    shown = [("record", found.curves, RECORD), *(
        (f"{job.key[:KEY_DIGITS]}: {job.what}", job.curves, replace(line, zorder=2.9 - 0.1 * rank))
        for rank, (job, line) in enumerate(zip(found.jobs[:MAX_DRAWN], style.CYCLE, strict=False))
    )]  # fmt: skip
    (mean, segments), (orders, envelope) = grid
    degrees = np.arange(360) + 0.5
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
    envelope.y.title = f"envelope above order {analysis.ORDER} (m/s²)"
    for panel in (segments, envelope):
        panel.span("y", low=0.0)
    for panel, letter in zip(grid.flat, "abcd", strict=True):
        panel.title = f"({letter})"
    return drawing.figure()
