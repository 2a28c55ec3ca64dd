"""The features of the model, each a row: whether a case pays for it, cases with and without it."""

import math
import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from compressor.cases import ACCURACY, Case, Output, PerJoint
from compressor.metrics import JOINTS, METRICS
from compressor.physics import exact_motion, series_motion
from compressor.solve import simulate
from compressor.studies.tradeoff.work_precision import (
    complete,
    faulty,
    grid_values,
    pin_span,
    solve_by_method,
    stored_values,
)

GRAVITY = 9.81  # m/s2
SMALL_CLEARANCE = 0.001  # mm, in the joint that was ideal
PLAY = 0.05  # mm, of the crosshead in its guide
RESTITUTION = 0.9  # of a law that damps by it, where the case has none
STEEL = ("steel", "steel")  # where a law needs materials, and the case has none
# words of a case file -> the laws' names
CONTACT_LAWS = {
    "impact": "IMPACT (ADAMS)",
    "hertz": "Hertz",
    "lankarani_nikravesh": "Lankarani-Nikravesh",
    "flores": "Flores",
    "johnson": "Johnson",
    "liu": "Liu",
}
FRICTION_LAWS = {
    "adams": "ADAMS",
    "coulomb_tanh": "Coulomb (tanh)",
    "threlfall": "Threlfall",
    "ambrosio": "Ambrósio",
    "lugre": "LuGre",
}
UNDAMPED = ("impact", "hertz")  # laws that no restitution damps


@dataclass(frozen=True)
class ModelFeature:
    """One feature of the model: the key that sets it, and cases with and without it.

    `add` gives None where a case has no use for the feature, or cannot have it; `off` and `on`
    name a case that is changed so, and `neutral` is how a case file leaves the feature out.
    `is_choice`: it is another model of the same machine, no other machine.
    """

    name: str
    key: str
    paid: Callable[[Case], bool]
    remove: Callable[[Case], Case]
    add: Callable[[Case], Case | None]
    off: str
    on: str
    neutral: str
    is_choice: bool = False


def without_clearance(case: Case, joint: str) -> Case:
    """Return a case with one of two faulty joints ideal, and concentric at the start."""
    other = next(name for name in JOINTS if name != joint)
    centred = {f"{joint}_x": 0.0, f"{joint}_y": 0.0}
    return replace(case, joint=other, initial_offset_mm=replace(case.initial_offset_mm, **centred))


def with_clearance(case: Case, joint: str) -> Case | None:
    """Return a case of one faulty joint with a small clearance in the other, `joint`."""
    if len(faulty(case)) != 1 or faulty(case) == [joint]:
        return None
    widths = replace(case.clearance_mm, **{joint: SMALL_CLEARANCE})
    return replace(case, joint="both", clearance_mm=widths)


def clearance_feature(joint: str) -> ModelFeature:
    """Return a second joint's clearance, which doubles the freedoms."""
    return ModelFeature(
        f"clearance of the {joint.replace('_', ' ')}",
        f"clearance_mm.{joint}",
        lambda case: len(faulty(case)) == 2,
        lambda case: without_clearance(case, joint),
        lambda case: with_clearance(case, joint),
        f"ideal {joint.replace('_', ' ')}",
        f"{1000 * SMALL_CLEARANCE:g} µm in the ideal joint",
        f"joint: {next(name for name in JOINTS if name != joint)}",
    )


def with_values(case: Case, group: str, **values: Any) -> Case:
    """Return a case with some values of a group replaced."""
    return replace(case, **{group: replace(getattr(case, group), **values)})


def contact_feature(law: str) -> ModelFeature:
    """Return another contact law than ADAMS's."""
    return ModelFeature(
        f"contact law {law}",
        "contact.law",
        lambda case: case.contact.law == law and bool(faulty(case)),
        lambda case: with_contact(case, "impact") or case,
        lambda case: with_contact(case, law),
        f"contact law: {CONTACT_LAWS['impact']}",
        f"contact law: {CONTACT_LAWS[law]}",
        "contact.law: impact",
        is_choice=True,
    )


def with_contact(case: Case, law: str) -> Case | None:
    """Return a case with another contact law; None for its own law, or without any contact.

    What the law needs and the case does not have is a default: its stiffness, steel on steel, a
    joint as long as wide, a restitution of 0.9.
    """
    contact = case.contact
    if contact.law == law or not faulty(case):
        return None
    values: dict[str, Any] = {"law": law}
    if law not in UNDAMPED:
        values["restitution"] = contact.restitution or RESTITUTION
    known = contact.materials or contact.modulus_GPa
    if law in ("johnson", "liu"):
        values["length_mm"] = contact.length_mm or bearing_length(case)
        if not known:
            values |= {"materials": STEEL, "stiffness_N_per_mm15": None}
    elif not (contact.materials or contact.stiffness_N_per_mm15):
        values["stiffness_N_per_mm15"] = type(contact)().stiffness_N_per_mm15
    return with_values(case, "contact", **values)


def bearing_length(case: Case) -> PerJoint[float] | float:
    """Return the length of a case's bearings (mm): of its oil film, or as long as wide."""
    if case.lubricant:
        return case.lubricant.bearing_length_mm
    return 2.0 * min(case.machine.pin_radius_mm.at(joint) for joint in JOINTS)


def friction_feature(law: str) -> ModelFeature:
    """Return another friction law than ADAMS's."""
    return ModelFeature(
        f"friction law {law}",
        "friction.law",
        lambda case: bool(case.friction and case.friction.law == law),
        lambda case: with_values(case, "friction", law=None),
        lambda case: with_friction(case, law),
        f"friction law: {FRICTION_LAWS['adams']}",
        f"friction law: {FRICTION_LAWS[law]}",
        "friction.law: adams",
        is_choice=True,
    )


def with_friction(case: Case, law: str) -> Case | None:
    """Return a case with another friction law; None for its own law, or where nothing rubs."""
    if not case.friction or case.friction.law == law or not faulty(case):
        return None
    if law == "lugre" and case.friction.ideal_joints:  # which have no bristles
        return None
    return with_values(case, "friction", law=law)


def with_oil(case: Case) -> Case | None:
    """Return a case with an oil film in its bearings; None without any clearance."""
    if not faulty(case):
        return None
    film = group_of_value("lubricant", True)
    return replace(case, lubricant=replace(film, bearing_length_mm=bearing_length(case)))


def with_elastic_rod(case: Case) -> Case:
    """Return a case with an elastic steel bar as its rod, of the section that has the rod's mass.

    The default section is that of the default rod; another one is as wide to its depth.
    """
    machine, usual = case.machine, Case().machine
    mass = machine.rod_mass_kg / usual.rod_mass_kg
    scale = (mass * usual.rod_length_mm / machine.rod_length_mm) ** 0.5
    bar = group_of_value("rod", True)
    size = {name: round(scale * getattr(bar, name), 2) for name in ("depth_mm", "width_mm")}
    return replace(case, rod=replace(bar, **size))


def with_play(case: Case) -> Case:
    """Return a case with play of the crosshead in its guide."""
    if case.guide:
        return with_values(case, "guide", clearance_mm=PLAY)
    guide = group_of_value("guide", {"clearance_mm": PLAY})  # filled in for the default machine
    return with_group(case, "guide", replace(guide, crosshead_inertia_kg_m2=None))


def group_of_value(key: str, value: Any) -> Any:
    """Return the group that a case file's value stands for."""
    worn = {"joint": "both", "clearance_mm": 0.1}  # for a group that needs it
    return getattr(Case.from_values({**worn, key: value}), key)


def with_group(case: Case, key: str, group: Any) -> Case:
    """Return a case with another group, or without it."""
    groups: dict[str, Any] = {key: group}
    return replace(case, **groups)


def group_feature(
    name: str, key: str, off: str, add: Callable[[Case], Case | None], is_choice: bool = False
) -> ModelFeature:
    """Return a group of the mechanism that a case may name."""
    return ModelFeature(
        name,
        key,
        lambda case: getattr(case, key) is not None,
        lambda case: with_group(case, key, None),
        add,
        off,
        name,
        f"no {key}",
        is_choice,
    )


def with_defaults(key: str, case: Case) -> Case:
    """Return a case with a group of the mechanism, as its defaults are."""
    return with_group(case, key, group_of_value(key, True))


def rubbing(case: Case) -> Case | None:
    """Return a case whose ideal joints rub as its worn ones do; None where none is ideal."""
    if not case.friction or case.friction.law == "lugre" or len(faulty(case)) == len(JOINTS):
        return None
    return with_values(case, "friction", ideal_joints=True)


FEATURES = (
    ModelFeature(
        "friction",
        "friction",
        lambda case: bool(case.friction and (case.friction.static or case.friction.dynamic)),
        lambda case: replace(case, friction=None),
        lambda case: replace(case, friction=Case().friction),
        "no friction",
        "friction",
        "friction: false",
    ),
    ModelFeature(
        "spring damping",
        "spring.damping_N_s_per_mm",
        lambda case: case.load == "spring" and case.spring.damping_N_s_per_mm > 0,
        lambda case: with_values(case, "spring", damping_N_s_per_mm=0.0),
        lambda case: None if case.load != "spring" else with_values(
            case, "spring", damping_N_s_per_mm=type(case.spring)().damping_N_s_per_mm
        ),
        "no spring damping",
        "spring damping",
        "spring.damping_N_s_per_mm: 0",
    ),
    ModelFeature(
        "gravity",
        "machine.gravity_m_per_s2",
        lambda case: case.machine.gravity_m_per_s2 > 0,
        lambda case: with_values(case, "machine", gravity_m_per_s2=0.0),
        lambda case: with_values(case, "machine", gravity_m_per_s2=GRAVITY),
        "no gravity",
        f"gravity {GRAVITY:g} m/s²",
        "machine.gravity_m_per_s2: 0",
    ),
    ModelFeature(
        "back pressure",
        "gas.back_pressure_MPa",
        lambda case: case.load == "gas" and (case.gas.back_pressure_MPa or 0.0) > 0,
        lambda case: with_values(case, "gas", back_pressure_MPa=0.0),
        lambda case: None,
        "no back pressure",
        "back pressure",
        "gas.back_pressure_MPa: 0",
    ),
    ModelFeature(
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
    *(contact_feature(law) for law in CONTACT_LAWS if law != "impact"),
    *(friction_feature(law) for law in FRICTION_LAWS if law != "adams"),
    ModelFeature(
        "play of the guide",
        "guide.clearance_mm",
        lambda case: bool(case.guide and case.guide.clearance_mm > 0),
        lambda case: with_values(case, "guide", clearance_mm=0.0),
        with_play,
        "guide without play",
        f"{1000 * PLAY:g} µm of play in the guide",
        "guide.clearance_mm: 0",
        is_choice=True,
    ),
    ModelFeature(
        "friction of ideal joints",
        "friction.ideal_joints",
        lambda case: bool(case.friction and case.friction.ideal_joints),
        lambda case: with_values(case, "friction", ideal_joints=None),
        rubbing,
        "ideal joints without friction",
        "friction of ideal joints",
        "friction.ideal_joints: false",
    ),
    group_feature("oil film", "lubricant", "dry joints", with_oil, is_choice=True),
    group_feature(
        "friction of the guide", "guide", "ideal guide", partial(with_defaults, "guide")
    ),
    group_feature(
        "speed that gives way", "drive", "steady speed", partial(with_defaults, "drive")
    ),
    group_feature("elastic rod", "rod", "rigid rod", with_elastic_rod, is_choice=True),
)  # fmt: skip


EXACT = "fine"  # accuracy at which answers are compared


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


def comparable(case: Case) -> Case:
    """Return a case solved so exactly that only its model decides its answer."""
    return solve_by_method(case, "auto", min(case.rtol, ACCURACY[EXACT].rtol))


def compare(base: Case, other: Case, repeats: int, known: xr.Dataset | None = None) -> Effect:
    """Return the effect of another model on the joints in which the base has clearance.

    Answers are compared at `EXACT` and over the base's revolutions; the ratio of times is the
    median over `repeats` pairs of runs in turn, each case by its own method and tolerance. known:
    the base's run to compare with, where it was made before.
    """
    known = simulate(comparable(base)) if known is None else known
    base, other = pin_span(base, known), pin_span(other, known)
    runs = [known, simulate(comparable(other))]
    # a body moves in time series; it changes neither the run nor the time of its solution
    timed = [
        replace(case, body=None, sensor=None, output=Output("metrics")) for case in (base, other)
    ]
    ratios = []
    for _ in range(repeats):
        ours, others = (simulate(case)["seconds"].item() for case in timed)
        ratios.append(others / ours)
    for run in runs:
        if not complete(run):
            return Effect(reason=run["reason"].item())
    joints = faulty(base) or [*JOINTS]
    peak, force, difference = changes(*[stored_values(run, joints) for run in runs])
    return Effect(peak, force, difference, statistics.median(ratios))


def changes(
    values: Mapping[str, np.ndarray], others: Mapping[str, np.ndarray]
) -> tuple[float, float, float]:
    """Return the relative changes of peak acceleration, contact force and acceleration.

    The first two are signed, of peaks; the last one is in L2.
    """
    peak = others["peak_acceleration"] / values["peak_acceleration"] - 1
    forces = others["peak_contact_force"] / values["peak_contact_force"] - 1
    force = forces[np.abs(forces).argmax()]
    a, b = values["acceleration"], others["acceleration"]
    return float(peak), float(force), float(np.linalg.norm(b - a) / np.linalg.norm(a))


SERIES_ERRORS = {  # of the paper's series (Eq. 3-4) in place of the exact ideal motion
    "place_error": "greatest error of the series' displacement over the smallest clearance",
    "acceleration_error": "relative L2 error of the series' acceleration",
}


def series_errors(case: Case) -> tuple[float, float]:
    """Return the errors of the series kinematics of a case, by `SERIES_ERRORS`.

    No run uses the series: both errors are those of the ideal machine.
    """
    machine = case.machine
    lengths = machine.crank_radius_mm / 1000, machine.rod_length_mm / 1000
    theta = np.linspace(0, 2 * np.pi, 3601)
    x, _, a = exact_motion(theta, *lengths, case.omega)
    series_x, _, series_a = series_motion(theta, *lengths, case.omega)
    clearance = min(getattr(case.clearance_mm, joint) for joint in faulty(case)) / 1000
    place = float(np.abs(series_x - x).max() / clearance)
    return place, float(np.linalg.norm(series_a - a) / np.linalg.norm(a))


def read_from_grid(run: xr.Dataset, with_series: xr.Dataset) -> xr.Dataset:
    """Return a run with peaks as its output grid (0.1 ms in the paper) shows them.

    with_series: the same run with its time series. Metrics that no grid gives are nan; bars are 0,
    since the grid changes the run's own numbers.
    """
    values = grid_values(with_series, JOINTS) if complete(with_series) else {}
    found = {
        name: run[name].copy(data=values[name]) if name in values else run[name] * math.nan
        for name in METRICS
    }
    found |= {f"{name}_error": 0.0 * run[f"{name}_error"] for name in METRICS}
    return run.assign(found | {"seconds": math.nan})
