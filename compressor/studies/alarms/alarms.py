"""Judge alarms by the records of a stored study: when each trips, and how often falsely.

Windows of one draw (a load, a speed, a machine, whatever a study varies beside joint and clearance)
are alike, so that draws count, and not windows. All sound windows set what is usual and the limit
by which worn ones are judged. Sound windows are judged by folds of draws: each by the limit that
the others set.

A limit for a rate of false alarms is that of conformal risk control (Angelopoulos et al. 2022,
arXiv:2208.02814): with n draws and the share f_i of windows of draw i above it, the least limit for
which (sum f_i + 1) / (n + 1) is at most the rate. A new draw then trips at most so often in the
mean over all such n draws, whatever their distribution is. Below 1 / (n + 1) no limit says so: it
then is the greatest score, and the rate 1 / (n + 1).
"""

import json
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
import xarray as xr

from compressor import analysis, cases, report, store
from compressor.metrics import JOINTS
from compressor.program import Progress, no_progress
from compressor.report import style
from compressor.studies import frame
from compressor.studies.alarms import readings

SOUND = "none"  # the joint that is worn in a sound machine
MIN_SOUND = 10  # draws of a sound machine: by fewer of them no limit means anything
DETECTED = 0.9  # share of windows from which on an alarm is said to detect
FOLDS, SEED = 5, 1
MAX_LEVELS, BINS = 12, 6  # clearances of a joint, beyond which they are put together in groups
Z = NormalDist().inv_cdf(0.975)  # of intervals of 95 %
ENDS = ("value", "low", "high")  # of a number and its interval
WEAR_REMEDY = "compsim wear the machine's case file, and name the file, or its folder of results"


def check_draws(source: store.StoredStudy, windows: readings.Windows) -> None:
    """Raise StudyError unless there are enough draws of a sound machine, and a worn one."""
    sound = windows.joints == SOUND
    count = len({*windows.draws[sound].tolist()})
    if count < MIN_SOUND:
        raise frame.StudyError(
            f"study {source.name} has {count} draws of a sound machine (joint: none, or clearances "
            f"up to healthy_clearance_mm), and limits need {MIN_SOUND} at the least, for 1 % of "
            "false alarms 124: draw load and speed, such as machine.speed_rpm: {random: "
            "[700, 780]} with sample: {n: 124}"
        )
    if sound.all():
        raise frame.StudyError(
            f"study {source.name}: none of its jobs with a record is worn: add clearances beyond "
            "healthy_clearance_mm, or a joint, and run it again"
        )


def find_limit(scores: np.ndarray, draws: np.ndarray, rate: float) -> float:
    """Return the least limit for a rate of false alarms, by the scores of sound windows, (n,)."""
    _, place, sizes = np.unique(draws, return_inverse=True, return_counts=True)
    spare = max(rate * (sizes.size + 1) - 1.0, 0.0)
    levels, at = np.unique(scores, return_inverse=True)
    of_level = np.bincount(at, 1.0 / sizes[place], levels.size)
    above = of_level[::-1].cumsum()[::-1] - of_level
    return float(levels[np.flatnonzero(above <= spare + 1e-9)[0]])


def compute_rate(trips: np.ndarray, draws: np.ndarray) -> tuple[float, float, float]:
    """Return how often windows trip, (n,), as the mean over draws of each one's share.

    With Wilson's interval of independent draws (JASA 22, 1927). A draw may trip in part of its
    windows: it then scatters less than one that trips or does not, and the interval is too wide
    rather than too narrow.
    """
    _, place, sizes = np.unique(draws, return_inverse=True, return_counts=True)
    share = min(float((np.bincount(place, trips, sizes.size) / sizes).mean()), 1.0)
    spread = Z**2 / sizes.size
    middle = (share + spread / 2.0) / (1.0 + spread)
    half = Z * math.sqrt(share * (1.0 - share) / sizes.size + spread / 4.0 / sizes.size)
    # of none and of all an end is exact, which rounding would miss
    low = middle - half / (1.0 + spread) if share > 0.0 else 0.0
    high = middle + half / (1.0 + spread) if share < 1.0 else 1.0
    return share, low, high


def find_onset(clearances: np.ndarray, rates: np.ndarray) -> list[float]:
    """Return the least of rising clearances from which on a rate is `DETECTED` or more, or inf.

    With its interval. rates: (n, 3), by `ENDS`: the interval goes from where their upper ends are
    so on, to where their lower ends are.
    """
    found = []
    for column in (0, 2, 1):
        missed = np.flatnonzero(rates[:, column] < DETECTED)
        begin = missed[-1] + 1 if missed.size else 0
        found.append(float(clearances[begin]) if begin < len(clearances) else math.inf)
    return found


def list_states(windows: readings.Windows) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the states of a study: a worn joint, and the rows of its windows at a clearance.

    In rising order. More than `MAX_LEVELS` clearances of a joint are put together into groups.
    """
    for joint in (*JOINTS, "both"):
        mine = windows.joints == joint
        levels = np.unique(windows.clearances[mine])
        parts = BINS if levels.size > MAX_LEVELS else levels.size
        for group in np.array_split(levels, parts) if parts else ():
            yield joint, mine & np.isin(windows.clearances, group)


def judge_alarms(
    folder: store.Folder, study: str, bands: Sequence[readings.Band] = (),
    noise: Sequence[float] = (0.0,), revolutions: int = 5, false_alarms: float = 0.01,
    progress: Progress = no_progress,
) -> xr.Dataset:  # fmt: skip
    """Return how often each alarm trips in each state of a stored study, and how often falsely.

    bands: of the filters, Hz, none for `default_bands`; noise: rms values (m/s2) of white noise
    that is added to records; revolutions: of a window; false_alarms: the rate that limits are set
    for.

    Dimensions: `alarm` (with its filter), `noise`, `state` (a worn joint and a clearance), `joint`,
    `end` (a value and its 95 % interval by draws, for limits as they were set). Variables: `limit`,
    `detection`, `false_alarms` and `first_clearance` (mm; inf where there is none). Raises
    StudyError, and StoreError where the store cannot be read.
    """
    source, left = store.find_study(folder, study), Counter[str]()
    windows = readings.read_study(folder, source, bands, noise, revolutions, left, progress)
    check_draws(source, windows)
    sound = windows.joints == SOUND
    draws = len({*windows.draws[sound].tolist()})
    return judge_windows(windows, noise, false_alarms).assign_attrs(
        title=f"compsim: alarms of {source.name}", study=source.name, case_file=source.case_file,
        revolutions=revolutions, detected=DETECTED, wanted=false_alarms, sound_draws=draws,
        rate=max(false_alarms, 1.0 / (draws + 1)), clipped=windows.clipped,
        sound_jobs=len({*windows.keys[sound].tolist()}), left_out=json.dumps(+left),
        worn_jobs=len({*windows.keys[~sound].tolist()}),
    )  # fmt: skip


RATES = {  # name -> dims beside alarm and noise, unit, long name
    "limit": ((), "1", "limit, times the usual reading of a sound machine"),
    "detection": (("state", "end"), "1", "share of windows in which the alarm trips"),
    "false_alarms": (("end",), "1", "share of windows of sound machines in which it trips"),
    "first_clearance": (("joint", "end"), "mm", "least clearance from which on it detects"),
}


def judge_windows(
    windows: readings.Windows, noise: Sequence[float], false_alarms: float
) -> xr.Dataset:
    """Return the `RATES` of all alarms whose reading all sound windows have."""
    sound, draws = windows.joints == SOUND, windows.draws
    states = [*list_states(windows)]
    joint_of = np.array([joint for joint, _ in states])
    sizes = [windows.clearances[rows] for _, rows in states]
    middle = np.array([np.median(size) for size in sizes])
    of_joint = {joint: joint_of == joint for joint in joint_of.tolist()}
    order = np.random.default_rng(SEED).permutation(sorted({*draws[sound].tolist()})).tolist()
    fold = np.array([order.index(one) % FOLDS if one in order else -1 for one in draws.tolist()])

    def trip(
        alarm: readings.Alarm, own: readings.Readings, setting: np.ndarray
    ) -> tuple[float, np.ndarray]:
        """Return the limit that sound windows set, and which windows are above it."""
        scores = alarm.score(own, setting)
        limit = find_limit(scores[setting], draws[setting], false_alarms)
        return limit, scores > limit

    def judge(alarm: readings.Alarm, own: readings.Readings) -> dict[str, Any]:
        limit, trips = trip(alarm, own, sound)
        rates = np.array([compute_rate(trips[rows], draws[rows]) for _, rows in states])
        for k in range(FOLDS):
            trips[fold == k] = trip(alarm, own, sound & (fold != k))[1][fold == k]
        false = compute_rate(trips[sound], draws[sound])
        first = [find_onset(middle[at], rates[at]) for at in of_joint.values()]
        return dict(zip(RATES, (limit, rates, false, first), strict=True))

    def is_judged(alarm: readings.Alarm, name: str) -> bool:
        usual = windows.readings[0, name].get(alarm.reading, np.full(sound.shape, math.nan))[sound]
        return bool(np.isfinite(usual).all()) and (name == readings.RECORD or alarm.is_filtered)

    filters = [*dict.fromkeys(name for _, name in windows.readings)]
    listed = [
        (alarm, name) for alarm in readings.ALARMS for name in filters if is_judged(alarm, name)
    ]
    judged = [[judge(alarm, windows.readings[level, name]) for level in range(len(noise))]
              for alarm, name in listed]  # fmt: skip
    found = {
        rate: (("alarm", "noise", *dims), np.array([[one[rate] for one in row] for row in judged]),
               {"units": unit, "long_name": phrase})
        for rate, (dims, unit, phrase) in RATES.items()
    }  # fmt: skip
    size = {"units": "mm", "long_name": "clearance of the worn joint"}
    where = {
        "alarm": [f"{alarm.title}, {name}" if alarm.is_filtered else alarm.title
                  for alarm, name in listed],
        "kind": ("alarm", [alarm.title for alarm, _ in listed]),
        "filter": ("alarm", [name for _, name in listed]),
        "noise": ("noise", np.array(noise, float), {"units": "m/s2", "long_name": "added noise"}),
        "joint": [*of_joint], "end": [*ENDS], "worn_joint": ("state", joint_of),
        "clearance": ("state", middle, size),
        "clearance_low": ("state", np.array([one.min() for one in sizes]), size),
        "clearance_high": ("state", np.array([one.max() for one in sizes]), size),
        "draws": ("state", np.array([len({*draws[rows].tolist()}) for _, rows in states])),
    }  # fmt: skip
    return xr.Dataset(found, where)


def rank_alarms(found: xr.Dataset, joint: str, noise: int = 0) -> list[int]:
    """Return the best filter of each kind of alarm, the first to see a joint's wear first.

    By the least clearance from which on they detect, then by the ends of its interval, then by
    their mean rate over the joint's clearances, then by fewer false alarms.
    """
    mine = found.isel(noise=noise)
    first, low, high = mine["first_clearance"].sel(joint=joint).transpose("end", "alarm").values
    rates = mine["detection"].sel(end="value").transpose("alarm", "state").values
    rate = rates[:, found["worn_joint"].values == joint].mean(axis=1)
    order = np.lexsort([mine["false_alarms"].sel(end="value").values, -rate, low, high, first])
    kinds = found["kind"].values.tolist()
    best: dict[str, int] = {}
    for place in order.tolist():
        best.setdefault(kinds[place], place)
    return [*best.values()]


def read_wear(place: str | Path) -> xr.Dataset:
    """Return the stages of a file of `compsim wear`, or of the only one of a folder of results.

    Raises StudyError, and StoreError for a damaged file.
    """
    path = Path(place)
    if path.is_dir():
        files = sorted({*path.glob("*.nc"), *path.glob("wear/*.nc")})
        if len(files) != 1:
            raise frame.StudyError(f"{path} has {len(files)} wear runs: {WEAR_REMEDY}")
        path = files[0]
    try:
        run = store.read_dataset(path, WEAR_REMEDY)
    except OSError as error:
        raise frame.StudyError(f"{path}: {error.strerror}: {WEAR_REMEDY}") from error
    if not {"hours", "clearance"} <= {*run.variables} or "case" not in run.attrs:
        raise frame.StudyError(f"{path} holds no wear run: {WEAR_REMEDY}")
    return run


def add_hours(found: xr.Dataset, run: xr.Dataset) -> xr.Dataset:
    """Return a result with `hours` from each alarm to the end of a wear run; 0: it does not lead.

    The end is where the first joint is worn out, which may be the other one; nan of all where none
    is within the run's hours. The interval carries that of the clearance and the factor of the
    coefficient of wear, by which all hours grow or shrink together. run: of `read_wear`.
    """
    case = cases.Case.from_attribute(run.attrs["case"])
    hours, opened = run["hours"].values, 1e3 * run["clearance"].transpose("joint", "stage").values
    wear = case.wear or cases.Wear()

    def hours_at(joint: str, clearance: float) -> float:
        return analysis.interpolate_hours(hours, opened[JOINTS.index(joint)], clearance)

    end = min(hours_at(joint, wear.limit_mm or math.inf) for joint in JOINTS)
    end = end if end <= wear.hours else math.nan
    first, factor = found["first_clearance"], wear.coefficient_factor
    lead = np.full(first.shape, math.nan)
    for index in np.ndindex(first.shape[:-1]):
        joint = str(found["joint"].values[index[-1]])
        if joint in JOINTS:
            value, low, high = (max(end - hours_at(joint, one), 0.0) for one in first.values[index])
            # the low end of the clearance is seen the earliest
            lead[index] = value, high / factor, low * factor
    what = {"units": "h", "long_name": "hours from the alarm to a worn-out joint"}
    return found.assign(hours=(first.dims, lead, what)).assign_attrs(wear_end=end)


def list_rows(found: xr.Dataset) -> list[tuple[str, ...]]:
    """Return the table, its head first: by joint and noise, the first to see wear first.

    Each alarm has its best filter; an end beyond the study's greatest clearance has a >.
    """
    hours = ["hours before the limit"] * ("hours" in found)
    rows: list[tuple[str, ...]] = [
        (
            "joint",
            "noise, m/s2",
            "alarm",
            "limit / usual",
            "false alarms, %",
            "detects from, mm",
            *hours,
        )
    ]
    for joint in found["joint"].values.tolist():
        greatest = found["clearance_high"].values[found["worn_joint"].values == joint].max()
        for level, noise in enumerate(found["noise"].values.tolist()):
            for place in rank_alarms(found, joint, level):
                one = found.isel(alarm=place, noise=level).sel(joint=joint)
                if noise and one["kind"].item() == readings.BODY_VELOCITY:
                    continue
                row: tuple[str, ...] = (
                    joint, f"{noise:g}", one["alarm"].item(), f"{one['limit'].item():.3g}",
                    show_interval(100.0 * one["false_alarms"].values, "{:.2g}"),
                    show_interval(one["first_clearance"].values, "{:.3g}", greatest),
                )  # fmt: skip
                if hours:
                    row += (show_interval(one["hours"].values, "{:.4g}"),)
                rows.append(row)
    return rows


def show_interval(numbers: np.ndarray, form: str, greatest: float = math.inf) -> str:
    """Return a value with its interval; of what a study's greatest clearance does not reach, >."""
    if np.isnan(numbers).any():
        return "-"
    value, low, high = (
        form.format(one) if math.isfinite(one) else f"> {form.format(greatest)}" for one in numbers
    )
    return f"{value} [{low}, {high}]"


def list_numbers(found: xr.Dataset) -> list[str]:
    """Return what was judged, and how, as labelled numbers."""
    attrs = found.attrs
    return [
        f"study: {attrs['study']}",
        f"sound machines: {attrs['sound_jobs']} jobs of {attrs['sound_draws']} draws",
        f"worn machines: {attrs['worn_jobs']} jobs",
        f"windows: {attrs['revolutions']} revolutions",
        f"limits: for {100 * attrs['rate']:.2g} % of false alarms",
        f"detects: trips in {DETECTED:.0%} of windows, from that clearance on",
    ]


def list_warnings(found: xr.Dataset) -> Iterator[str]:
    """Yield what makes a result less than it seems."""
    attrs = found.attrs
    for reason, count in json.loads(attrs["left_out"]).items():
        yield f"left out: {count} {reason}"
    if attrs["clipped"]:
        yield f"clipped: {attrs['clipped']} jobs; raise sensor.range_m_per_s2"
    if attrs["rate"] > attrs["wanted"] * (1.0 + 1e-9):
        yield (f"{attrs['sound_draws']} sound draws allow no limit for {100 * attrs['wanted']:.2g} "
               f"% of false alarms: {math.ceil(1.0 / attrs['wanted']) - 1} are needed")  # fmt: skip
    absent = [one.title for one in readings.ALARMS if one.title not in found["kind"].values]
    if absent:
        yield f"not judged, since not all sound records have it: {', '.join(absent)}"
    needed = math.ceil(Z**2 * DETECTED / (1.0 - DETECTED))
    if (few := int(found["draws"].min())) < needed:
        yield f"a clearance has {few} draws: to be sure that it is detected takes {needed}"


# ---- the figure and the file --------------------------------------------------------------------

FILE = "alarms.nc"
MAX_KINDS = 6  # kinds of alarm that have a line: the first to see wear
CAPTION = (
    "Share of windows in which an alarm trips, by clearance, at the first level of noise, each "
    "kind with its best filter; dashed: the share from which on it detects."
)


def draw_alarms(found: xr.Dataset, title: str = "") -> report.PlotlyFigure:
    """Return a panel a joint: the share of windows in which alarms trip, by clearance.

    Of the first level of noise, and of the kinds that see wear first over all joints.
    """
    joints = found["joint"].values.tolist()
    drawing, grid = report.make_grid(1, len(joints), 3.6)
    kinds = found["kind"].values
    best = {joint: {kinds[place]: place for place in rank_alarms(found, joint)} for joint in joints}
    first = sorted(
        best[joints[0]], key=lambda kind: sum([*one].index(kind) for one in best.values())
    )
    for panel, joint in zip(grid.flat, joints, strict=True):
        mine = found.isel(noise=0, state=np.flatnonzero(found["worn_joint"].values == joint))
        for kind, line in zip(first[:MAX_KINDS], style.CYCLE, strict=False):
            shares = mine["detection"].isel(alarm=best[joint][kind]).sel(end="value").values
            look = replace(line, marker="circle", markersize=3.5)
            panel.plot(mine["clearance"].values, shares, look, kind)
        panel.rule(style.LineStyle(style.GREY, (3.7, 1.6), 0.8), y=DETECTED)
        panel.title = f"({'abc'[joints.index(joint)]}) {joint.replace('_', ' ')}"
        panel.x.title = "clearance (mm)"
        panel.span("y", -0.02, 1.04)
    grid.flat[0].y.title = "windows in which it trips"
    return drawing.figure(title)
