"""The features of the model, each a row: whether a case pays for it, cases with and without it."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from compressor.cases import Case
from compressor.measure.work_precision import faulty
from compressor.metrics import JOINTS

GRAVITY = 9.81  # m/s2
SMALL_CLEARANCE = 0.001  # mm, in the joint that was ideal
PLAY = 0.05  # mm, of the crosshead in its guide
# contact laws with what they need beside their name, for steel
STEEL = {"materials": ("steel", "steel"), "stiffness_N_per_mm15": None, "length_mm": 20.0}
LAWS: dict[str, dict[str, Any]] = {
    "hertz": {},
    "lankarani_nikravesh": {"restitution": 0.9},
    "flores": {"restitution": 0.9},
    "johnson": STEEL,
    "liu": STEEL,
}
FRICTION_LAWS = ("coulomb_tanh", "threlfall", "ambrosio", "lugre")
# groups that a case may name: name, key, the case without and with it
MECHANISM = (
    ("oil film", "lubricant", "dry joints", "oil film"),
    ("friction of the guide", "guide", "ideal guide", "friction of the guide"),
    ("speed that gives way", "drive", "steady speed", "speed that gives way"),
    ("elastic rod", "rod", "rigid rod", "elastic rod"),
)


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


def contact_feature(law: str) -> Feature:
    """Another contact law than ADAMS's."""
    return Feature(
        f"contact law {law}",
        "contact.law",
        lambda case: case.contact.law == law,
        lambda case: replace(case, contact=Case().contact),
        lambda case: with_contact(case, law),
        "contact law impact",
        f"contact law {law}",
        "contact.law: impact",
    )


def with_contact(case: Case, law: str) -> Case | None:
    """A case of ADAMS's contact law with another one; None of another case."""
    if case.contact.law != "impact" or not faulty(case):
        return None
    return changed(case, "contact", law=law, **LAWS[law])


def friction_feature(law: str) -> Feature:
    """Another friction law than ADAMS's."""
    return Feature(
        f"friction law {law}",
        "friction.law",
        lambda case: bool(case.friction and case.friction.law == law),
        lambda case: changed(case, "friction", law=None),
        lambda case: with_friction(case, law),
        "friction law adams",
        f"friction law {law}",
        "friction.law: adams",
    )


def with_friction(case: Case, law: str) -> Case | None:
    """A case of ADAMS's friction law with another one; None of another case."""
    if not case.friction or case.friction.law or not faulty(case):
        return None
    return changed(case, "friction", law=law)


def named(key: str, value: Any) -> Any:
    """The group that a case file's value stands for."""
    worn = {"joint": "both", "clearance_mm": 0.1}  # for a group that needs it
    return getattr(Case.from_values({**worn, key: value}), key)


def with_group(case: Case, key: str, group: Any) -> Case:
    """A case with another group, or without it."""
    groups: dict[str, Any] = {key: group}
    return replace(case, **groups)


def group_feature(name: str, key: str, off: str, on: str) -> Feature:
    """A group of the mechanism that a case may name; added, it has its defaults."""
    return Feature(
        name,
        key,
        lambda case: getattr(case, key) is not None,
        lambda case: with_group(case, key, None),
        lambda case: with_group(case, key, named(key, True)),
        off,
        on,
        f"no {key}",
    )


def rubbing(case: Case) -> Case | None:
    """A case whose ideal joints rub as its worn ones do; None where none is ideal."""
    if not case.friction or case.friction.law == "lugre" or len(faulty(case)) == len(JOINTS):
        return None
    return changed(case, "friction", ideal_joints=True)


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
    *map(contact_feature, LAWS),
    *map(friction_feature, FRICTION_LAWS),
    Feature(
        "play of the guide",
        "guide.clearance_mm",
        lambda case: bool(case.guide and case.guide.clearance_mm > 0),
        lambda case: changed(case, "guide", clearance_mm=0.0),
        lambda case: None if case.guide else with_group(
            case, "guide", named("guide", {"clearance_mm": PLAY})
        ),
        "guide without play",
        f"{1000 * PLAY:g} µm of play in the guide",
        "guide.clearance_mm: 0",
    ),
    Feature(
        "friction of ideal joints",
        "friction.ideal_joints",
        lambda case: bool(case.friction and case.friction.ideal_joints),
        lambda case: changed(case, "friction", ideal_joints=None),
        rubbing,
        "ideal joints without friction",
        "friction of ideal joints",
        "friction.ideal_joints: false",
    ),
    *(group_feature(*row) for row in MECHANISM),
)  # fmt: skip
