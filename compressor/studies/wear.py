"""How long a joint lasts: the hours until its clearance has grown to a limit.

A stage is an ordinary run at the clearances that wear has opened. What rubs in it wears the bores
evenly, by Archard's law, until the next stage. A machine's stages are one file, which is rewritten
after each of them; the same command goes on from it.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor import analysis, cases, report, solve, store
from compressor.cases import Case
from compressor.metrics import JOINTS
from compressor.program import Progress
from compressor.reasons import Reason
from compressor.studies import frame

FOLDER = "wear"
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
    **frame.metric_numbers(SHOWN),
}

AT_MOST = 100_000  # motions, whose wall time a machine may take
MAX_DRAWN = len(report.style.CYCLE)  # machines in a figure

TEXTS = {"reason": "why it ended early", "detail": "what is known of that"}


@dataclass(frozen=True)
class Worn:
    """One machine whose bores wear, stage by stage (`frame.GrowingRows`)."""

    case: Case
    size = 1

    @property
    def wear(self) -> cases.Wear:
        """Return the keys by which it wears."""
        assert self.case.wear
        return self.case.wear

    @cached_property
    def key(self) -> str:
        return frame.hash_key([self.case.key, self.case.values()["wear"], SCHEMA])

    @property
    def clearances(self) -> np.ndarray:
        """Return the clearances of both joints, unworn (m)."""
        unworn = self.case.clearance_mm
        return np.array([cases.to_si(getattr(unworn, joint), "mm") for joint in JOINTS])

    @property
    def limit(self) -> float:
        """Return the clearance (m) of a joint that is worn out."""
        return cases.to_si(self.wear.limit_mm or math.inf, "mm")

    @property
    def most_hours(self) -> float:
        """Return the hours after which it ends.

        In `hours` the greatest coefficient wears as much as the nominal one does in these.
        """
        return self.wear.hours * self.wear.coefficient_factor

    @property
    def bore_area(self) -> np.ndarray:
        """Return the area of each unworn bore (m^2)."""
        pins = [cases.to_si(self.case.machine.pin_radius_mm.at(joint), "mm") for joint in JOINTS]
        around = 2.0 * math.pi * (np.array(pins) + self.clearances)
        return np.asarray(around * cases.to_si(self.wear.bore_length_mm, "mm"))

    @property
    def depth_per_work(self) -> np.ndarray:
        """Return the depth (m) that 1 J wears off a whole bore, by joint: Archard's law."""
        return cases.to_si(self.wear.coefficient_mm3_per_N_m, "mm3/(N m)") / self.bore_area

    def case_at(self, clearances: np.ndarray) -> Case:
        """Return the ordinary case of its motion at clearances (m), (joint,).

        It keeps time series, whose samples are no farther apart than `MAX_STEP_DEG`.
        """
        case, opened = self.case, cases.PerJoint(*(1e3 * clearances).tolist())
        settings = case.solve
        if 360.0 * case.duration / case.turn / case.steps > MAX_STEP_DEG * (1 + 1e-9):
            settings = replace(settings, output_step_deg=MAX_STEP_DEG, output_step_s=None)
        return replace(
            case, clearance_mm=opened, solve=settings, output=cases.Output(), wear=None, body=None,
            sensor=None,
        )  # fmt: skip

    def path(self, folder: store.Folder) -> Path:
        return Path(folder) / FOLDER / f"{self.key}.nc"

    def over(self, stage: frame.Row) -> bool:
        """Return whether a stage is the last one: worn out, at the end of its hours, or failed."""
        late = bool(stage["hours"] >= self.most_hours)
        return bool(stage["reason"]) or late or bool((stage["clearance"] >= self.limit).any())

    @property
    def cases(self) -> tuple[Case]:
        return (self.case,)

    @property
    def seconds(self) -> float:
        return AT_MOST * self.case.solve.timeout_s

    def count_done(self, rows: Sequence[frame.Row]) -> int:
        """Return 1 if all its stages are there, else 0."""
        return int(bool(rows) and self.over(rows[-1]))

    def make_row(self, rows: Sequence[frame.Row]) -> frame.Row:
        """Run the next stage, or that of unworn bores."""
        return next_stage(self, rows[-1]) if rows else follow_stage(self, 0.0, self.clearances)

    def to_dataset(self, rows: Sequence[frame.Row]) -> xr.Dataset:
        """Return its stages, with the dimension `stage`."""
        found = frame.rows_dataset(rows, "stage", TEXTS, NUMBERS)
        worn = found["clearance"].values - self.clearances
        about = {"units": "m3", "long_name": "volume that is worn off"}
        found["worn_volume"] = ("stage", "joint"), worn * self.bore_area, about
        where = {"joint": ("joint", list(JOINTS), {"long_name": "joint of the rod"})}
        attrs = {"key": self.key, "case": self.case.attributes()["case"]}
        return found.assign_coords(where).assign_attrs(attrs)


def follow_stage(machine: Worn, hours: float, clearances: np.ndarray) -> frame.Row:
    """Return the stage at clearances (m) that were worn in some hours: a run, and what it rubs."""
    row: frame.Row = {"hours": hours, "clearance": clearances, "turn": math.nan,
                      "rubbing_work": np.full(len(JOINTS), math.nan)}  # fmt: skip
    try:
        run = solve.simulate(machine.case_at(clearances))
    except cases.CaseError as error:  # such as clearances that exceed the pins
        nothing = {n: np.full([len(JOINTS)] * len(NUMBERS[n][0]), math.nan) for n in SHOWN}
        return row | nothing | {"reason": Reason.INVALID_INPUT, "detail": str(error)}
    row |= {name: run[name].values for name in SHOWN}
    row |= {"reason": str(run["reason"].values), "detail": str(run.attrs.get("detail", ""))}
    if not row["reason"]:
        time = analysis.settled_part(run)["time"].values
        row["turn"] = float(np.ptp(time)) / analysis.settled_revolutions(run)
        row["rubbing_work"] = analysis.rubbing_work(run)
    return row


def next_stage(machine: Worn, stage: frame.Row) -> frame.Row:
    """Return the stage after one that is not the last; by the midpoint rule."""
    opened, rate = stage["clearance"], machine.depth_per_work * stage["rubbing_work"]
    left = (machine.most_hours - stage["hours"]) * 3600.0 / stage["turn"]
    fastest = float(rate.max())  # m a revolution
    step = cases.to_si(machine.wear.step_mm, "mm")
    span = min(step / fastest, left) if fastest > 0.0 else left  # revolutions
    midway = follow_stage(machine, math.nan, opened + 0.5 * span * rate)
    if midway["reason"]:
        return stage | {"reason": midway["reason"], "detail": midway["detail"]}
    hours = stage["hours"] + span * midway["turn"] / 3600.0
    # midway a turn may take another time, but the last stage must not end short of most_hours
    hours = machine.most_hours if span == left else hours
    opened = opened + span * machine.depth_per_work * midway["rubbing_work"]
    return follow_stage(machine, hours, opened)


def open_wear(folder: store.Folder, case: Case) -> xr.Dataset:
    """Return the wear of a case's bores from a folder of results, as far as it was run.

    Dims: `stage`, `joint`; `hours` and `clearance` (m) by stage, with the metrics of the motion at
    such clearances. Raises StoreError where there is nothing of it.
    """
    worn = Worn(case)
    rows = frame.stored_rows(worn, folder)
    if not rows:
        raise store.StoreError(worn.path(folder), "is not there", "compsim wear the case file")
    return worn.to_dataset(rows)


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
    reached = [
        analysis.interpolate_hours(hours, clearance, machine.limit) for clearance in opened.T
    ]
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


@dataclass(frozen=True)
class WornMachine:
    """How a machine of a study has worn; `point`: its swept values, `stages`: that are stored.

    `reason`, `detail`: why it ended early, if it did. `life`: None where no stage is stored.
    """

    study: str
    point: dict[str, Any]
    worn: Worn
    stages: xr.Dataset | None
    life: Life | None
    reason: str = ""
    detail: str = ""


def check_wear(studies: Sequence[cases.Study]) -> None:
    """Raise StudyError unless each case wears, and is measured over whole revolutions."""
    for study, case in ((one, case) for one in studies for case in one.cases):
        if case.joint == "none":
            raise frame.StudyError(
                f"{study.path}: joint: none has no bore that wears: leave none out"
            )
        if not case.wear:
            remedy = "write wear: true, or keys of it (compsim schema)"
            raise frame.StudyError(f"{study.path}: has no wear: {remedy}")
        if case.solve.duration_rev == "auto":
            continue
        turns = (case.duration - case.settle) / case.turn
        if abs(turns - round(turns)) > 1e-9 or turns < 1.0 - 1e-9:
            raise frame.StudyError(
                f"{study.path}: solve.duration_rev: {turns:g} after settle_rev must be whole "
                "revolutions, one at least"
            )


def run_wear(
    studies: Sequence[cases.Study],
    folder: store.Folder,
    workers: int,
    progress: Progress,
    rerun: bool = False,
) -> tuple[list[WornMachine], int]:
    """Follow and store the wear of all cases of studies, as far as it is missing.

    Return the machines, and how many of them were complete before. rerun: machines that failed go
    on from their last good stage. Progress counts machines. Raises StoreError and WorkersFailed;
    whatever ends it early, what was stored stays, and the same call goes on.
    """
    store.writable_folder(folder)
    listed = [
        (study.name, point, Worn(case))
        for study in studies
        for point, case in zip(cases.points(study), study.cases, strict=True)
    ]
    done, lost = frame.run_rows([worn for _, _, worn in listed], folder, workers, progress, rerun)
    return [worn_machine(*one, folder, lost.get(one[2].key)) for one in listed], done


def worn_machine(
    study: str,
    point: dict[str, Any],
    worn: Worn,
    folder: store.Folder,
    lost: tuple[str, str] | None,
) -> WornMachine:
    """Return a machine of a study by its stored stages; lost: why its worker was, if it was."""
    kept = frame.stored_rows(worn, folder)
    if not kept:
        return WornMachine(study, point, worn, None, None, *(lost or ("", "")))
    stages, last = worn.to_dataset(kept), kept[-1]
    why = lost or (last["reason"], last["detail"])
    return WornMachine(study, point, worn, stages, life(worn, stages), *why)


HEAD = ("machine", "worn out after, h", "from more to less wear, h", "at the end")


def table(machines: Iterable[WornMachine]) -> Iterator[tuple[str, ...]]:
    """Yield a row for each machine below a head: its hours, their range, and its end."""
    yield HEAD
    for one in machines:
        failed = f"failed: {one.reason}" if one.reason else ""
        found, keys = one.life, one.worn.wear
        if not found:
            yield name_of(one), "", "", failed
            continue
        factor = keys.coefficient_factor
        low, mid, high = (
            # not worn out in the hours that were followed, or are followed at most
            f"> {hours(min(times * found.followed, keys.hours))}"
            if math.isnan(value)
            else hours(value)
            for value, times in ((found.low, 1 / factor), (found.hours, 1.0), (found.high, factor))
        )
        end = f"{1e3 * found.clearance:.3f} mm at {found.joint}"
        yield name_of(one), mid, f"{low} to {high}", "; ".join(filter(None, (end, failed)))


def name_of(one: WornMachine) -> str:
    """Return the study of a machine and its swept values."""
    return " ".join([one.study, *(f"{key}={value}" for key, value in one.point.items())])


def hours(value: float) -> str:
    """Return the hours in four digits."""
    return f"{value:.0f}" if value >= 1000 else f"{value:.4g}"


def to_row(one: WornMachine, folder: store.Folder) -> dict[str, Any]:
    """Return a machine as JSON says it."""
    found: dict[str, Any] = {"study": one.study, **one.point, "reason": one.reason}
    if one.life:
        found |= {**one.life._asdict(), "file": str(one.worn.path(folder))}
    return found


def draw_wear(machines: Iterable[WornMachine], title: str = "") -> report.PlotlyFigure:
    """Return two panels: clearance and greatest force of each machine's worst joint by hours.

    Of the first machines that have a life. Shaded: with the least and the greatest coefficient.
    """
    drawing, grid = report.make_grid(1, 2, 3.6)
    opening, force = grid.flat
    alive = [one for one in machines if one.life]
    drawn = alive[:MAX_DRAWN]
    last = 1e-9
    for one, line in zip(drawn, report.style.CYCLE, strict=False):
        assert one.stages is not None
        assert one.life
        stages, factor = one.stages.sel(joint=one.life.joint), one.worn.wear.coefficient_factor
        at, opened = stages["hours"].values, 1e3 * stages["clearance"].values
        opening.plot(at, opened, line)
        around = np.concatenate([at / factor, at[::-1] * factor])
        opening.fill(
            around, np.concatenate([opened, opened[::-1]]), report.style.fill(line.color, 0.15)
        )
        peaks = 1e-3 * stages["peak_contact_force"].values
        force.plot(at, peaks, line, f"{name_of(one)}, {one.life.joint.replace('_', ' ')}")
        last = max(last, float(at[-1]))
    for limit in {1e3 * one.worn.limit for one in drawn if math.isfinite(one.worn.limit)}:
        opening.rule(report.style.LineStyle(report.style.BLACK, linewidth=0.8), y=limit)
        opening.write("limit", 0.02 * last, limit, shift=(0, 2))
    opening.x.title = force.x.title = "operating hours"
    opening.span("x", 0.0, last)
    opening.y.title = "clearance (mm)"
    force.y.title = "greatest contact force (kN)"
    force.span("y", low=0.0)
    for panel, letter in zip(grid.flat, "ab", strict=True):
        panel.title = f"({letter})"
        panel.rule(report.style.LineStyle(report.style.GREY, linewidth=0.5, zorder=0), y=0.0)
    some = f"the first {len(drawn)} of {len(alive)} machines" * (len(drawn) < len(alive))
    return drawing.figure(": ".join(filter(None, (title, some))))
