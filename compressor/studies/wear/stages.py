"""How long a joint lasts: the hours until its clearance has grown to a limit.

A stage is an ordinary run at the clearances that wear has opened. What rubs in it wears the bores
evenly, by Archard's law, until the next stage.
"""

import hashlib
import json
import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor.analysis import interpolate_hours, rubbing_work, settled_part, settled_revolutions
from compressor.cases import MODEL_VERSION, Case, CaseError, Output, PerJoint, Wear, to_si
from compressor.metrics import JOINTS, METRICS
from compressor.program import PROGRAM
from compressor.reasons import Reason
from compressor.solve import simulate
from compressor.store import Folder, StoreError, read_dataset, write_dataset

FOLDER = "wear"
REMEDY = "delete it: the same command makes it again"
SCHEMA = 2  # of a stage's numbers: a change of what they mean makes them again
MAX_STEP_DEG = 0.3  # of the crank, between the samples by which what rubs is summed
SHOWN = (
    "rms_acceleration", "peak_acceleration", "peak_contact_force", "max_penetration",
    "contact_loss_fraction", "impact_count",
)  # fmt: skip
# beside the stage: dims, unit, long name
NUMBERS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "hours": ((), "h", "operating hours"),
    "clearance": (("joint",), "m", "radial clearance"),
    "rubbing_work": (("joint",), "J", "normal force times sliding in a revolution"),
    "turn": ((), "s", "time of a revolution"),
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
    def bore_area(self) -> np.ndarray:
        """Return the area of each unworn bore (m^2)."""
        pins = [to_si(self.case.machine.pin_radius_mm.at(joint), "mm") for joint in JOINTS]
        around = 2.0 * math.pi * (np.array(pins) + self.clearances)
        return np.asarray(around * to_si(self.wear.bore_length_mm, "mm"))

    @property
    def depth_per_work(self) -> np.ndarray:
        """Return the depth (m) that 1 J wears off a whole bore, by joint: Archard's law."""
        return to_si(self.wear.coefficient_mm3_per_N_m, "mm3/(N m)") / self.bore_area

    def case_at(self, clearances: np.ndarray) -> Case:
        """Return the ordinary case of its motion at clearances (m), (joint,).

        It keeps time series, whose samples are no farther apart than `MAX_STEP_DEG`.
        """
        case, opened = self.case, PerJoint(*(1e3 * clearances).tolist())
        solve = case.solve
        if 360.0 * case.duration / case.turn / case.steps > MAX_STEP_DEG * (1 + 1e-9):
            solve = replace(solve, output_step_deg=MAX_STEP_DEG, output_step_s=None)
        return replace(
            case, clearance_mm=opened, solve=solve, output=Output(), wear=None, body=None,
            sensor=None,
        )  # fmt: skip

    def path(self, folder: Folder) -> Path:
        """Return the path of its file."""
        return Path(folder) / FOLDER / f"{self.key}.nc"

    def over(self, stage: Stage) -> bool:
        """Return whether a stage is the last one: worn out, at the end of its hours, or failed."""
        late = bool(stage["hours"] >= self.most_hours)
        return bool(stage["reason"]) or late or bool((stage["clearance"] >= self.limit).any())


def follow_stage(machine: Worn, hours: float, clearances: np.ndarray) -> Stage:
    """Return the stage at clearances (m) that were worn in some hours: a run, and what it rubs."""
    run: Any = {}
    try:
        run = simulate(machine.case_at(clearances))
        reason, detail = str(run["reason"].values), str(run.attrs.get("detail", ""))
    except CaseError as error:  # such as clearances that exceed the pins
        reason, detail = Reason.INVALID_INPUT, str(error)
    shapes = {name: [len(JOINTS)] * len(METRICS[name].dims) for name in SHOWN}
    found = {name: run[name].values if name in run else math.nan for name in SHOWN}
    work, turn = np.full(len(JOINTS), math.nan), math.nan
    if not reason:
        time = settled_part(run)["time"].values
        work, turn = rubbing_work(run), float(np.ptp(time)) / settled_revolutions(run)
    return {
        "hours": hours, "clearance": clearances, "rubbing_work": work, "turn": turn,
        "reason": reason, "detail": detail,
        **{name: np.broadcast_to(value, shapes[name]) for name, value in found.items()},
    }  # fmt: skip


def first_stage(machine: Worn) -> Stage:
    """Return the stage of unworn bores."""
    return follow_stage(machine, 0.0, machine.clearances)


def next_stage(machine: Worn, stage: Stage) -> Stage:
    """Return the stage after one that is not the last; by the midpoint rule."""
    opened, rate = stage["clearance"], machine.depth_per_work * stage["rubbing_work"]
    left = (machine.most_hours - stage["hours"]) * 3600.0 / stage["turn"]
    fastest = float(rate.max())  # m a revolution
    step = to_si(machine.wear.step_mm, "mm")
    span = min(step / fastest, left) if fastest > 0.0 else left  # revolutions
    midway = follow_stage(machine, math.nan, opened + 0.5 * span * rate)
    if midway["reason"]:
        return stage | {"reason": midway["reason"], "detail": midway["detail"]}
    hours = stage["hours"] + span * midway["turn"] / 3600.0
    # midway a turn may take another time, but the last stage must not end short of most_hours
    hours = machine.most_hours if span == left else hours
    opened = opened + span * machine.depth_per_work * midway["rubbing_work"]
    return follow_stage(machine, hours, opened)


def stages_dataset(machine: Worn, stages: list[Stage]) -> xr.Dataset:
    """Return the stages of a machine, with the dimension `stage`."""
    found: dict[str, tuple] = {}
    for name, phrase in (("reason", "why it ended early"), ("detail", "what is known of that")):
        texts = np.array([stage[name] for stage in stages], object)
        found[name] = ("stage",), texts, {"long_name": phrase}
    for name, (dims, unit, phrase) in NUMBERS.items():
        values = np.array([stage[name] for stage in stages], float)
        found[name] = ("stage", *dims), values, {"units": unit, "long_name": phrase}
    worn = found["clearance"][1] - machine.clearances
    about = {"units": "m3", "long_name": "volume that is worn off"}
    found["worn_volume"] = ("stage", "joint"), worn * machine.bore_area, about
    where = {"joint": ("joint", list(JOINTS), {"long_name": "joint of the rod"})}
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

    Dims: `stage`, `joint`; `hours` and `clearance` (m) by stage, with the metrics of the motion at
    such clearances. Raises StoreError where there is nothing of it.
    """
    path = wear_file(folder, case)
    if not path.exists():
        raise StoreError(path, "is not there", "compsim wear the case file")
    return read_dataset(path, REMEDY)


class Life(NamedTuple):
    """Hours until the first joint is worn out, nan where that is after the last stage.

    low, high: with the greatest and the least coefficient; `joint`: that is worn out, or is the
    nearest to it; `clearance`: there at the end (m); `followed`: the hours of the last stage.
    """

    hours: float
    low: float
    high: float
    joint: str
    clearance: float
    followed: float


def life(machine: Worn, stages: xr.Dataset) -> Life:
    """Return the life of a machine, by straight lines between its stages."""
    opened = stages["clearance"].transpose("stage", "joint").values
    hours = stages["hours"].values
    reached = [interpolate_hours(hours, clearance, machine.limit) for clearance in opened.T]
    worst = int(np.argmin(reached)) if np.isfinite(reached).any() else int(opened[-1].argmax())
    found, factor, most = reached[worst], machine.wear.coefficient_factor, machine.wear.hours
    return Life(
        found if found <= most else math.nan,
        found / factor if found <= factor * most else math.nan,
        found * factor if found * factor <= most else math.nan,
        str(stages["joint"].values[worst]),
        float(opened[-1, worst]),
        float(hours[-1]),
    )
