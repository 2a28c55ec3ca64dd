"""The modelling trade: what each feature of the model changes in the answer, and costs in time.

A feature is one row of a table: whether a case pays for it, the case without it, and the case with
it. `trade` quotes them all; `compressor.measure.explain` those that a case pays for.
"""

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from compressor.cases import ACCURACY, Case, Output
from compressor.measure.work_precision import (
    Progress,
    complete,
    faulty,
    grid_values,
    solved,
    stored_values,
)
from compressor.metrics import JOINTS
from compressor.physics import exact_motion, series_motion
from compressor.program import PROGRAM
from compressor.solve import simulate

GRAVITY = 9.81  # m/s2
SMALL_CLEARANCE = 0.001  # mm, in the joint that was ideal
EXACT = "fine"  # accuracy at which answers are compared


@dataclass(frozen=True)
class Feature:
    """One feature of the model: the key that sets it, and cases with and without it.

    `add` gives None where a case has no use for the feature, or cannot have it; `off` and `on`
    name a case that is changed so, and `neutral` is how a case file leaves the feature out.
    """

    name: str
    key: str
    paid: Callable[[Case], bool]
    remove: Callable[[Case], Case]
    add: Callable[[Case], Case | None]
    off: str
    on: str
    neutral: str


@dataclass(frozen=True)
class Effect:
    """What a change of the model does: relative changes, and the ratio of wall times.

    nan where a number has no meaning; `reason` is that of a run that failed.
    """

    change_peak_acceleration: float = math.nan
    change_peak_contact_force: float = math.nan
    change_acceleration: float = math.nan
    time_ratio: float = math.nan
    reason: str = ""


def without_clearance(case: Case, joint: str) -> Case:
    """A case of two faulty joints with one of them ideal, and concentric at the start."""
    other = next(name for name in JOINTS if name != joint)
    centred = {f"{joint}_x": 0.0, f"{joint}_y": 0.0}
    return replace(case, joint=other, initial_offset_mm=replace(case.initial_offset_mm, **centred))


def with_clearance(case: Case, joint: str) -> Case | None:
    """A case of one faulty joint with a small clearance in the other, `joint`."""
    if len(faulty(case)) != 1 or faulty(case) == [joint]:
        return None
    widths = replace(case.clearance_mm, **{joint: SMALL_CLEARANCE})
    return replace(case, joint="both", clearance_mm=widths)


def clearance_feature(joint: str) -> Feature:
    """A second joint's clearance, which doubles the freedoms."""
    return Feature(
        f"clearance of the {joint.replace('_', ' ')}",
        f"clearance_mm.{joint}",
        lambda case: len(faulty(case)) == 2,
        lambda case: without_clearance(case, joint),
        lambda case: with_clearance(case, joint),
        f"ideal {joint.replace('_', ' ')}",
        f"{1000 * SMALL_CLEARANCE:g} µm in the ideal joint",
        f"joint: {next(name for name in JOINTS if name != joint)}",
    )


def changed(case: Case, group: str, **values: Any) -> Case:
    """A case with some values of a group replaced."""
    return replace(case, **{group: replace(getattr(case, group), **values)})


FEATURES = (
    Feature(
        "friction",
        "friction",
        lambda case: bool(case.friction and (case.friction.static or case.friction.dynamic)),
        lambda case: replace(case, friction=None),
        lambda case: replace(case, friction=Case().friction),
        "no friction",
        "friction",
        "friction: false",
    ),
    Feature(
        "spring damping",
        "spring.damping_N_s_per_mm",
        lambda case: case.load == "design" and case.spring.damping_N_s_per_mm > 0,
        lambda case: changed(case, "spring", damping_N_s_per_mm=0.0),
        lambda case: None if case.load != "design" else changed(
            case, "spring", damping_N_s_per_mm=type(case.spring)().damping_N_s_per_mm
        ),
        "no spring damping",
        "spring damping",
        "spring.damping_N_s_per_mm: 0",
    ),
    Feature(
        "gravity",
        "machine.gravity_m_per_s2",
        lambda case: case.machine.gravity_m_per_s2 > 0,
        lambda case: changed(case, "machine", gravity_m_per_s2=0.0),
        lambda case: changed(case, "machine", gravity_m_per_s2=GRAVITY),
        "no gravity",
        f"gravity {GRAVITY:g} m/s²",
        "machine.gravity_m_per_s2: 0",
    ),
    Feature(
        "back pressure",
        "gas.back_pressure_MPa",
        lambda case: case.load == "typical" and case.gas.back_pressure_MPa > 0,
        lambda case: changed(case, "gas", back_pressure_MPa=0.0),
        lambda case: None,
        "no back pressure",
        "back pressure",
        "gas.back_pressure_MPa: 0",
    ),
    Feature(
        "load",
        "load",
        lambda case: case.load != "none",
        lambda case: replace(case, load="none"),
        lambda case: None,
        "no load",
        "a load",
        "load: none",
    ),
    *map(clearance_feature, JOINTS),
)  # fmt: skip


def comparable(case: Case) -> Case:
    """A case solved so exactly that only its model tells in its answer."""
    return solved(case, "auto", min(case.rtol, ACCURACY[EXACT].rtol))


def compare(base: Case, other: Case, repeats: int) -> Effect:
    """What another model changes in the joints that the base has clearance in.

    Answers are compared at `EXACT`; the ratio of times is the median over `repeats` pairs of runs
    in turn, each case by its own method and tolerance.
    """
    runs = [simulate(comparable(case)) for case in (base, other)]
    timed = [replace(case, output=Output("metrics")) for case in (base, other)]
    ratios = []
    for _ in range(repeats):
        ours, others = (simulate(case)["seconds"].item() for case in timed)
        ratios.append(others / ours)
    for run in runs:
        if not complete(run):
            return Effect(reason=run["reason"].item())
    peak, force, apart = changes(*[stored_values(run, faulty(base)) for run in runs])
    return Effect(peak, force, apart, statistics.median(ratios))


def changes(
    values: Mapping[str, np.ndarray], others: Mapping[str, np.ndarray]
) -> tuple[float, float, float]:
    """Relative changes of peak acceleration and contact force, signed, and L2 of acceleration."""
    peak = others["peak_acceleration"] / values["peak_acceleration"] - 1
    forces = others["peak_contact_force"] / values["peak_contact_force"] - 1
    force = forces[np.abs(forces).argmax()]
    a, b = values["acceleration"], others["acceleration"]
    return float(peak), float(force), float(np.linalg.norm(b - a) / np.linalg.norm(a))


def series_kinematics(case: Case) -> tuple[Effect, float]:
    """The paper's series (Eq. 3-4) in place of the exact ideal motion, and its error of place.

    Never simulated with: the effect is on the ideal machine's acceleration; the second number is
    the greatest error of displacement as a share of the smallest clearance.
    """
    machine = case.machine
    lengths = machine.crank_radius_mm / 1000, machine.rod_length_mm / 1000
    theta = np.linspace(0, 2 * np.pi, 3601)
    x, _, a = exact_motion(theta, *lengths, case.omega)
    series_x, _, series_a = series_motion(theta, *lengths, case.omega)
    peak = np.abs(series_a).max() / np.abs(a).max() - 1
    apart = np.linalg.norm(series_a - a) / np.linalg.norm(a)
    clearance = min(getattr(case.clearance_mm, joint) for joint in faulty(case)) / 1000
    share = float(np.abs(series_x - x).max() / clearance)
    return Effect(float(peak), change_acceleration=float(apart)), share


def output_grid(case: Case) -> Effect:
    """Peaks read from the output grid, 0.1 ms in the paper, in place of the dense solution."""
    run = simulate(comparable(case))
    if not complete(run):
        return Effect(reason=run["reason"].item())
    joints = faulty(case)
    peak, force, _ = changes(stored_values(run, joints), grid_values(run, joints))
    return Effect(peak, force)


def variants(case: Case) -> dict[str, Case]:
    """The models that a case is compared with: features toggled, and the other load, by name."""
    found = {}
    for feature in FEATURES:
        if feature.key == "load":
            continue
        if feature.paid(case):
            found[feature.off] = feature.remove(case)
        elif added := feature.add(case):
            found[feature.on] = added
    other = {"design": "typical", "typical": "design"}.get(case.load)
    if other:
        found[f"{other} load"] = replace(case, load=other)
    return found


SERIES, GRID = "series kinematics (Eq. 3-4)", "peaks from the output grid"


def trade(
    cases: Mapping[str, Case],
    repeats: int = 9,
    progress: Progress = lambda done, total, remark: None,
) -> xr.Dataset:
    """What each change of the model does to each case; dims (scene, change), nan where it cannot.

    `place_error` is that of the series kinematics as a share of the clearance. Each case needs a
    joint with clearance.
    """
    toggled = {name: variants(case) for name, case in cases.items()}
    names = [*dict.fromkeys(change for found in toggled.values() for change in found), GRID, SERIES]
    rows: dict[tuple[str, str], Effect] = {}
    place = []
    total, done = sum(map(len, toggled.values())), 0
    for scene, case in cases.items():
        for change, other in toggled[scene].items():
            rows[scene, change] = compare(case, other, repeats)
            done += 1
            progress(done, total, "")
        rows[scene, GRID] = output_grid(case)
        rows[scene, SERIES], share = series_kinematics(case)
        place.append(share)
    return labelled(list(cases), names, rows, place)


MEANINGS = {
    "change_peak_acceleration": "relative change of peak acceleration",
    "change_peak_contact_force": "relative change of peak contact force where it changes most",
    "change_acceleration": "relative L2 change of acceleration",
    "time_ratio": "wall time over that of the case itself",
}


def labelled(
    scenes: Sequence[str], names: Sequence[str], rows: Mapping, place: Sequence[float]
) -> xr.Dataset:
    """Effects as a Dataset; what does not apply is nan."""
    dims, shape = ("scene", "change"), (len(scenes), len(names))
    variables: dict[str, tuple] = {}
    for field, phrase in MEANINGS.items():
        values = [getattr(rows.get((s, n)), field, np.nan) for s in scenes for n in names]
        attrs = {"units": "1", "long_name": phrase}
        variables[field] = (dims, np.reshape(values, shape), attrs)
    reasons = [getattr(rows.get((s, n)), "reason", "") for s in scenes for n in names]
    attrs = {"long_name": "why a run failed, by a stable name"}
    variables["reason"] = (dims, np.reshape(np.array(reasons, object), shape), attrs)
    phrase = "greatest error of the series' displacement over the smallest clearance"
    variables["place_error"] = ("scene", list(place), {"units": "1", "long_name": phrase})
    coordinates = {
        "scene": ("scene", np.array(scenes, object), {"long_name": "case"}),
        "change": ("change", np.array(names, object), {"long_name": "change of the model"}),
    }
    attrs = {"title": "what the model's features change and cost", "compared_at": EXACT,
             "program": PROGRAM}  # fmt: skip
    return xr.Dataset(variables, coordinates, attrs)
