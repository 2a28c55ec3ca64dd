"""How long a joint lasts: the hours until its clearance has grown to a limit."""

import hashlib
import json
import math
import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor.analysis import interpolate_hours
from compressor.cases import MODEL_VERSION, Case, Wear, to_si
from compressor.metrics import JOINTS, METRICS
from compressor.program import PROGRAM
from compressor.solve import (
    Cuts,
    Metrics,
    Solution,
    initial_state,
    merge_turns,
    metrics,
    passed_time,
    revolutions,
    run_at_tolerance,
    run_until_balanced,
)
from compressor.store import Folder, StoreError, read_dataset, write_dataset

FOLDER = "wear"
REMEDY = "delete it: the same command makes it again"
SCHEMA = 1  # of a stage's numbers: a change of what they mean makes them again
SHOWN = (
    "rms_acceleration", "peak_acceleration", "peak_contact_force", "max_penetration",
    "contact_loss_fraction", "impact_count",
)  # fmt: skip
# beside the stage: dims, unit, long name
NUMBERS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "hours": ((), "h", "operating hours"),
    "worn_depth": (("joint", "angle"), "m", "what is worn off the bore"),
    "rubbing_work": (("joint", "angle"), "J", "pressing times sliding in a revolution, by sector"),
    "rubbing_spread": (("joint",), "J", "standard deviation of it over the revolutions"),
    "turn": ((), "s", "time of a revolution"),
    "end_state": (("number",), "1", "motion at the end, as the solver holds it, in SI"),
    **{name: (METRICS[name].dims, METRICS[name].unit, METRICS[name].phrase) for name in SHOWN},
}

Stage = dict[str, Any]


@dataclass(frozen=True)
class Worn:
    """One machine whose bores wear."""

    case: Case

    @property
    def wear(self) -> Wear:
        """Return the keys by which it wears."""
        assert self.case.wear
        return self.case.wear

    @cached_property
    def key(self) -> str:
        """Return the hash of what decides the numbers."""
        identity = [self.case.key, self.case.values()["wear"], SCHEMA]
        return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:20]

    @property
    def clearances(self) -> np.ndarray:
        """Return the clearances of both joints, unworn (m)."""
        unworn = self.case.clearance_mm
        return np.array([to_si(getattr(unworn, joint), "mm") for joint in JOINTS])

    @property
    def limit(self) -> float:
        """Return the clearance (m) of a joint that is worn out."""
        return to_si(self.wear.limit_mm or math.inf, "mm")

    @property
    def most_hours(self) -> float:
        """Return the hours after which it ends.

        In `hours` the greatest coefficient wears as much as the nominal one does in these.
        """
        return self.wear.hours * self.wear.coefficient_factor

    @property
    def sector_area(self) -> np.ndarray:
        """Return the area of a bore's sector, by joint (m^2)."""
        pins = [to_si(self.case.machine.pin_radius(joint), "mm") for joint in JOINTS]
        radius = np.array(pins) + self.clearances
        width = 2.0 * math.pi / self.wear.sectors * radius
        return np.asarray(width * to_si(self.wear.bore_length_mm, "mm"))

    @property
    def depth_per_work(self) -> np.ndarray:
        """Return the depth (m) that 1 J wears off a sector, by joint: Archard's law."""
        return to_si(self.wear.coefficient_mm3_per_N_m, "mm3/(N m)") / self.sector_area

    def path(self, folder: Folder) -> Path:
        """Return the path of its file."""
        return Path(folder) / FOLDER / f"{self.key}.nc"

    def over(self, stage: Stage) -> bool:
        """Return whether a stage is the last one: worn out, at the end of its hours, or failed."""
        opened = self.clearances + stage["worn_depth"].max(axis=1)  # m
        late = bool(stage["hours"] >= self.most_hours)
        return bool(stage["reason"]) or late or bool((opened >= self.limit).any())


class WearRun(NamedTuple):
    """A motion on bores that are given.

    `work`: pressing times sliding, J a revolution, by joint and node of the bore; `spread`: its
    standard deviation over the revolutions, by joint; `turn`: time of a revolution, s; `state`: the
    motion at the end; `reason`, `detail`: why it stopped early, empty if it did not.
    """

    work: np.ndarray
    spread: np.ndarray
    turn: float
    metrics: Metrics
    state: np.ndarray
    reason: str = ""
    detail: str = ""


def wear_bores(case: Case, worn: np.ndarray, state: np.ndarray | None) -> WearRun:
    """Follow a case over its span on worn bores, and measure what rubs after it has settled.

    worn: (joint, sector), m; state: the motion to begin with, at top dead centre, or None for the
    case's own. The span is in whole revolutions.
    """
    deadline = time.monotonic() + case.solve.timeout_s
    ends = revolutions(case.settle, case.duration, case.turn)

    def run_at(rtol: float) -> tuple[Solution, float]:
        left = max(deadline - time.monotonic(), 0.0)
        run = run_at_tolerance(case, rtol, left, False, Cuts(ends), state, worn)
        return run, case.duration / case.turn

    run = run_until_balanced(case.rtol, run_at)
    p, turns = run.p, run.turns
    if run.reason or not turns:
        nothing = np.full((len(JOINTS), worn.shape[1]), np.nan)
        start = initial_state(case, p) if state is None else state
        return WearRun(nothing, nothing[:, 0], np.nan, {}, start, run.reason, run.detail)
    slid = np.array([turn["slid"] for turn in turns])
    whole = merge_turns(turns)
    work = whole["worn"][:, : worn.shape[1]] / len(turns)
    times, states = run.trajectory.times, run.trajectory.states
    began, ended = passed_time(p, times, states)[[0, -1]]
    turn = case.turn * float(ended - began) / case.duration
    return WearRun(work, slid.std(axis=0), turn, metrics(p, whole), states[-1])


def first_stage(machine: Worn) -> Stage:
    """Return the stage of unworn bores."""
    unworn = np.zeros((len(JOINTS), machine.wear.sectors))
    return new_stage(0.0, unworn, wear_bores(machine.case, unworn, None))


def new_stage(hours: float, worn: np.ndarray, motion: WearRun) -> Stage:
    """Return the stage of a motion on bores that were worn in some hours."""
    found = {name: motion.metrics.get(name, math.nan) for name in SHOWN}
    shapes = {name: [len(JOINTS)] * len(METRICS[name].dims) for name in SHOWN}
    return {
        "hours": hours, "worn_depth": worn, "rubbing_work": motion.work,
        "rubbing_spread": motion.spread, "turn": motion.turn, "end_state": motion.state,
        "reason": motion.reason, "detail": motion.detail,
        **{name: np.broadcast_to(value, shapes[name]) for name, value in found.items()},
    }  # fmt: skip


def next_stage(machine: Worn, stage: Stage) -> Stage:
    """Return the stage after one that is not the last; by the midpoint rule."""
    rate = machine.depth_per_work[:, np.newaxis] * stage["rubbing_work"]  # m a revolution
    left = (machine.most_hours - stage["hours"]) * 3600.0 / stage["turn"]
    fastest = float(rate.max())
    step = to_si(machine.wear.step_mm, "mm")
    span = min(step / fastest, left) if fastest > 0.0 else left  # revolutions
    midway = wear_bores(machine.case, stage["worn_depth"] + 0.5 * span * rate, stage["end_state"])
    if midway.reason:
        return stage | {"reason": midway.reason, "detail": midway.detail}
    hours = stage["hours"] + span * midway.turn / 3600.0
    # midway a turn may take another time, but the last stage must not end short of most_hours
    hours = machine.most_hours if span == left else hours
    worn = stage["worn_depth"] + span * machine.depth_per_work[:, np.newaxis] * midway.work
    return new_stage(hours, worn, wear_bores(machine.case, worn, midway.state))


def stages_dataset(machine: Worn, stages: list[Stage]) -> xr.Dataset:
    """Return the stages of a machine, with the dimension `stage`."""
    found: dict[str, tuple] = {}
    for name, phrase in (("reason", "why it ended early"), ("detail", "what is known of that")):
        texts = np.array([stage[name] for stage in stages], object)
        found[name] = ("stage",), texts, {"long_name": phrase}
    for name, (dims, unit, phrase) in NUMBERS.items():
        values = np.array([stage[name] for stage in stages], float)
        found[name] = ("stage", *dims), values, {"units": unit, "long_name": phrase}
    worn = found["worn_depth"][1]
    deepest = machine.clearances + worn.max(axis=2)
    about = {"units": "m", "long_name": "clearance at the deepest place"}
    found["clearance"] = ("stage", "joint"), np.where(machine.clearances > 0.0, deepest, 0.0), about
    about = {"units": "m3", "long_name": "volume that is worn off"}
    found["worn_volume"] = ("stage", "joint"), worn.sum(axis=2) * machine.sector_area, about
    angles = 2.0 * math.pi / machine.wear.sectors * np.arange(machine.wear.sectors)
    about = {"units": "rad", "long_name": "of a place on the bore from the rod's axis, towards the "
            "small end, counter-clockwise"}  # fmt: skip
    where = {
        "angle": ("angle", angles, about),
        "joint": ("joint", list(JOINTS), {"long_name": "joint of the rod"}),
    }
    attrs = {"key": machine.key, "program": PROGRAM, "model_version": MODEL_VERSION}
    attrs["case"] = machine.case.attributes()["case"]
    return xr.Dataset(found, where, attrs)


def read_kept_stages(machine: Worn, path: Path) -> list[Stage]:
    """Return the stages of an earlier run, none where there is no file. Raises StoreError."""
    if not path.exists():
        return []
    found = read_dataset(path, REMEDY)
    names = {*NUMBERS, "reason", "detail"}
    if found.attrs.get("key") != machine.key or not names <= {*found.variables}:
        raise StoreError(path, "does not hold the machine that its name says", REMEDY)
    columns = {name: found[name].values for name in names}
    stages = [
        {name: column[n] for name, column in columns.items()} for n in range(found.sizes["stage"])
    ]
    for stage in stages:
        stage["reason"], stage["detail"] = str(stage["reason"]), str(stage["detail"])
    return stages


def write(machine: Worn, folder: Folder, stages: list[Stage]) -> None:
    """Store the stages of a machine. Raises StoreError."""
    write_dataset(machine.path(folder), stages_dataset(machine, stages))


def wear_file(folder: Folder, case: Case) -> Path:
    """Return the path at which the stages of a case with wear are stored."""
    return Worn(case).path(folder)


def open_wear(folder: Folder, case: Case) -> xr.Dataset:
    """Return the wear of a case's bores from a folder of results, as far as it was run.

    Dims: `stage`, `joint`, `angle` of a place on the bore; `hours` and `worn_depth` (m) by stage,
    with the metrics of the motion on such bores. Raises StoreError where there is nothing of it.
    """
    path = wear_file(folder, case)
    if not path.exists():
        raise StoreError(path, "is not there", "compsim wear the case file")
    return read_dataset(path, REMEDY)


class Life(NamedTuple):
    """Hours until the first joint is worn out, nan where that is after the last stage.

    low, high: with the greatest and the least coefficient; `joint`: that is worn out, or is the
    nearest to it; `clearance`, `angle`: there at the end (m), and of the deepest place (rad);
    `followed`: the hours of the last stage.
    """

    hours: float
    low: float
    high: float
    joint: str
    clearance: float
    angle: float
    followed: float


def life(machine: Worn, stages: xr.Dataset) -> Life:
    """Return the life of a machine, by straight lines between its stages."""
    opened = stages["clearance"].transpose("stage", "joint").values
    hours = stages["hours"].values
    reached = [interpolate_hours(hours, clearance, machine.limit) for clearance in opened.T]
    worst = int(np.argmin(reached)) if np.isfinite(reached).any() else int(opened[-1].argmax())
    found, factor, most = reached[worst], machine.wear.coefficient_factor, machine.wear.hours
    deepest = stages["worn_depth"].isel(stage=-1, joint=worst)
    return Life(
        found if found <= most else math.nan,
        found / factor if found <= factor * most else math.nan,
        found * factor if found * factor <= most else math.nan,
        str(stages["joint"].values[worst]),
        float(opened[-1, worst]),
        float(stages["angle"].values[int(deepest.values.argmax())]),
        float(hours[-1]),
    )
