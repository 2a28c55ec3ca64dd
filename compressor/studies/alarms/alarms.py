"""Judge alarms by the records of a stored study: when each trips, and how often falsely."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from compressor.program import PROGRAM, Progress, no_progress
from compressor.store import Folder, find_study
from compressor.studies.alarms.detection import (
    FOLDS,
    First,
    Rate,
    compute_rate,
    find_limit,
    first_clearance,
    share_out,
)
from compressor.studies.alarms.readings import ALARMS, RECORD, Alarm, Readings, band_name
from compressor.studies.alarms.windows import AlarmOptions, Windows, check_draws, read_study

MAX_LEVELS = 12  # clearances of a joint that stay as they are; more of them are put together
BINS = 6  # into as many groups of equal size
# of the limit, times a sound machine's usual reading, over which the curves go
FACTORS = np.concatenate([np.arange(0.8, 2.0, 0.02), np.geomspace(2.0, 1e4, 100)])


@dataclass(frozen=True)
class State:
    """A worn joint with a clearance, or a range of them: the rows of its windows, (n,) boolean.

    clearance: the middle one, mm; a sound machine's is nan.
    """

    joint: str
    clearance: float
    low: float
    high: float
    rows: np.ndarray


def judge_alarms(
    folder: Folder,
    study: str,
    options: AlarmOptions | None = None,
    progress: Progress = no_progress,
) -> xr.Dataset:
    """Return how often each alarm trips in each state of a stored study, and how often falsely.

    Dimensions: `alarm` (with its filter), `noise` (m/s2), `state` (a worn joint and a clearance),
    `joint`, `factor` (of a limit over a sound machine's usual reading). Variables: `detection` and
    `false_alarms` with `_low` and `_high` ends of 95 % intervals by draws, for limits as they were
    set; `first_clearance` (mm) with its interval, inf where there is none; `limit_low` and
    `limit_high`, the ends of the limits; and `curve_detection` and `curve_false_alarms` over the
    factor. Raises AlarmsError, and StoreError where the store cannot
    be read.
    """
    options = options or AlarmOptions()
    source = find_study(folder, study)
    windows = read_study(folder, source, options, progress)
    check_draws(source, windows)
    found = judge_windows(windows, options)
    return found.assign_attrs(
        title=f"compsim: alarms of {source.name}", program=PROGRAM, study=source.name,
        case_file=source.case_file, jobs=source.jobs, machine=json.dumps(windows.values),
        swept=json.dumps([axis.key for axis in source.axes]),
        left_out=json.dumps(windows.left_out), clipped=windows.clipped,
    )  # fmt: skip


def list_states(windows: Windows) -> Iterator[State]:
    """Yield the states of a study: each worn joint with its clearances, in rising order.

    More than `MAX_LEVELS` clearances of a joint are put together into `BINS` groups.
    """
    for joint in ("big_end", "small_end", "both"):
        mine = windows.joints == joint
        levels = np.unique(windows.clearances[mine])
        groups = np.array_split(levels, BINS) if levels.size > MAX_LEVELS else levels[:, None]
        for group in groups:
            if group.size:
                rows = mine & np.isin(windows.clearances, group)
                middle = float(np.median(windows.clearances[rows]))
                yield State(joint, middle, float(group[0]), float(group[-1]), rows)


@dataclass(frozen=True)
class AlarmPerformance:
    """How an alarm did: rates by state, of false alarms, limits, curves, and what is seen first.

    limits: by fold, and of all sound windows; detection: rates by factor, (states, factors), and
    false_curve, (factors,); first: by joint.
    """

    rates: list[Rate]
    false: Rate
    limits: list[float]
    detection: np.ndarray
    false_curve: np.ndarray
    first: dict[str, First]


def judge_windows(windows: Windows, options: AlarmOptions) -> xr.Dataset:
    """Return the rates of all alarms by windows that have been read."""
    states = list(list_states(windows))
    sound = windows.is_sound
    folds = share_out(windows.draws, sound, FOLDS, options.seed)
    listed = [
        (alarm, name)
        for alarm in ALARMS
        for name in (RECORD, *map(band_name, windows.bands if alarm.is_filtered else ()))
        if is_known(alarm, windows.readings[0, name], sound)
    ]
    performances = [
        [
            judge_alarm(alarm, windows.readings[level, name], windows, states, folds, options)
            for level in range(len(options.noise))
        ]
        for alarm, name in listed
    ]
    judged = {alarm.title for alarm, _ in listed}
    fewest = min(len({*windows.draws[sound & (folds != k)].tolist()}) for k in range(FOLDS))
    found = as_dataset(listed, states, performances, options)
    return found.assign_attrs(
        false_alarms=options.false_alarms, factor=options.factor or math.nan, folds=FOLDS,
        attainable=max(options.false_alarms, 1.0 / (fewest + 1)), detected=options.detected,
        seed=options.seed, revolutions=options.revolutions, windows=int(sound.size),
        sound_draws=len({*windows.draws[sound].tolist()}),
        sound_jobs=len({*windows.keys[sound].tolist()}),
        worn_jobs=len({*windows.keys[~sound].tolist()}),
        not_judged=json.dumps([one.title for one in ALARMS if one.title not in judged]),
    )  # fmt: skip


def is_known(alarm: Alarm, readings: Readings, sound: np.ndarray) -> bool:
    """Return whether all sound windows have the reading of an alarm."""
    return alarm.reading in readings and bool(np.isfinite(readings[alarm.reading][sound]).all())


def judge_alarm(
    alarm: Alarm,
    readings: Readings,
    windows: Windows,
    states: Sequence[State],
    folds: np.ndarray,
    options: AlarmOptions,
) -> AlarmPerformance:
    """Return how an alarm does: each fold is judged by a limit that the others' windows set.

    The last fold, of draws without sound windows, is judged by the limit of all sound windows.
    """
    sound, draws = windows.is_sound, windows.draws
    trips = np.zeros(sound.size)
    by_factor = np.zeros((sound.size, FACTORS.size))
    limits = []
    for fold in range(FOLDS + 1):
        setting, judged = sound & (folds != fold), folds == fold
        scores = alarm.score(readings, setting)
        limits.append(
            options.factor or find_limit(scores[setting], draws[setting], options.false_alarms)
        )
        trips[judged] = scores[judged] > limits[-1]
        by_factor[judged] = scores[judged, None] > FACTORS
    rates = [compute_rate(trips[one.rows], draws[one.rows]) for one in states]
    weights = np.array([draw_weights(rows, draws) for rows in (*(s.rows for s in states), sound)])
    curves = np.minimum(weights @ by_factor, 1.0)
    first = {}
    for joint in dict.fromkeys(one.joint for one in states):
        mine = [(one.clearance, rate) for one, rate in zip(states, rates, strict=True)
                if one.joint == joint]  # fmt: skip
        clearances, of_joint = zip(*mine, strict=True)
        first[joint] = first_clearance(clearances, of_joint, options.detected)
    false = compute_rate(trips[sound], draws[sound])
    return AlarmPerformance(rates, false, limits, curves[:-1], curves[-1], first)


def draw_weights(rows: np.ndarray, draws: np.ndarray) -> np.ndarray:
    """Return weights of windows, (n,), whose sum over trips is the mean of each draw's share."""
    _, place, sizes = np.unique(draws[rows], return_inverse=True, return_counts=True)
    weights = np.zeros(rows.size)
    weights[rows] = 1.0 / (sizes[place] * sizes.size)
    return weights


def as_dataset(
    listed: Sequence[tuple[Alarm, str]],
    states: Sequence[State],
    performances: Sequence[Sequence[AlarmPerformance]],
    options: AlarmOptions,
) -> xr.Dataset:
    """Return performances, by alarm and noise, as a Dataset."""
    joints = list(dict.fromkeys(one.joint for one in states))

    def stack(value: Any) -> np.ndarray:
        return np.array([[value(one) for one in row] for row in performances], float)

    share = {"units": "1"}
    found: dict[str, Any] = {}
    for end, name in (("", "share"), ("_low", "low"), ("_high", "high")):
        which = {"": "", "_low": "lower", "_high": "upper"}[end]
        side = f"{which} end of the 95 % interval, for limits as they were set, of the " * bool(end)
        found[f"detection{end}"] = (
            ("alarm", "noise", "state"),
            stack(lambda one, name=name: [getattr(rate, name) for rate in one.rates]),
            share | {"long_name": f"{side}share of windows in which the alarm trips"},
        )
        found[f"false_alarms{end}"] = (
            ("alarm", "noise"), stack(lambda one, name=name: getattr(one.false, name)),
            share | {"long_name": f"{side}share of windows of sound machines in which it trips"},
        )  # fmt: skip
        of_first = "clearance" if name == "share" else name
        found[f"first_clearance{end}"] = (
            ("alarm", "noise", "joint"),
            stack(lambda one, name=of_first: [getattr(one.first[j], name) for j in joints]),
            {"units": "mm", "long_name": f"{side}least clearance from which on it detects"},
        )
    for end, pick in (("low", min), ("high", max)):
        found[f"limit_{end}"] = (
            ("alarm", "noise"), stack(lambda one, pick=pick: pick(one.limits)),
            share | {"long_name": "limit over the usual reading of a sound machine, the "
                     f"{'least' if end == 'low' else 'greatest'} of the folds and of all"},
        )  # fmt: skip
    found["curve_detection"] = (
        ("alarm", "noise", "state", "factor"), stack(lambda one: one.detection),
        share | {"long_name": "share of windows in which the alarm trips, by its limit"},
    )  # fmt: skip
    found["curve_false_alarms"] = (
        ("alarm", "noise", "factor"), stack(lambda one: one.false_curve),
        share | {"long_name": "share of windows of sound machines in which it trips, by its limit"},
    )  # fmt: skip
    draws = [rate.draws for rate in performances[0][0].rates]
    found["draws"] = ("state", np.array(draws), {"units": "1", "long_name": "draws of a state"})
    found["sound_draws"] = performances[0][0].false.draws
    words = {
        "kind": ("alarm", [alarm.name for alarm, _ in listed], {"long_name": "what it reads"}),
        "title": ("alarm", [alarm.title for alarm, _ in listed], {"long_name": "in words"}),
        "filter": ("alarm", [name for _, name in listed], {"long_name": "filter of the record"}),
        "worn_joint": ("state", [one.joint for one in states], {"long_name": "worn joint"}),
    }
    clearance = {"units": "mm", "long_name": "clearance of the worn joint, the middle one"}
    numbers = {
        "clearance": ("state", [one.clearance for one in states], clearance),
        "clearance_low": ("state", [one.low for one in states],
                          clearance | {"long_name": "least clearance of a state"}),
        "clearance_high": ("state", [one.high for one in states],
                           clearance | {"long_name": "greatest clearance of a state"}),
        "noise": ("noise", list(options.noise),
                  {"units": "m/s2", "long_name": "rms of the white noise that was added"}),
        "factor": ("factor", FACTORS,
                   {"units": "1", "long_name": "limit over a sound machine's usual reading"}),
    }  # fmt: skip
    names = [f"{alarm.title}, {name}" if alarm.is_filtered else alarm.title
             for alarm, name in listed]  # fmt: skip
    return xr.Dataset(found, {"alarm": names, "joint": joints, **words, **numbers})


def rank_alarms(found: xr.Dataset, joint: str, noise: int = 0) -> list[int]:
    """Return the alarms of a result, the first to see a joint's wear first.

    By the least clearance from which on they detect, then by the ends of its interval, then by
    their mean rate over the joint's clearances, then by fewer false alarms.
    """
    mine = found.isel(noise=noise)
    firsts = mine.sel(joint=joint)
    rates = mine["detection"].values[:, found["worn_joint"].values == joint].mean(axis=1)
    columns = [
        *(firsts[f"first_clearance{end}"].values for end in ("", "_high", "_low")),
        -rates, mine["false_alarms"].values,
    ]  # fmt: skip
    return np.lexsort(columns[::-1]).tolist()


def best_of_each(found: xr.Dataset, joint: str, noise: int = 0) -> list[int]:
    """Return the best filter of each kind of alarm, in the order of `rank_alarms`."""
    kinds = found["kind"].values.tolist()
    ranked = rank_alarms(found, joint, noise)
    first: dict[str, int] = {}
    for place in ranked:
        first.setdefault(kinds[place], place)
    return list(first.values())
