"""The record of parameters that every compiled function reads, and the names of its choices.

All numbers are SI. One scalar numpy record instead of closures or arguments: numba keeps the
machine code of functions that take it in its disk cache.
"""

from enum import IntEnum

import numpy as np

BIG_END = 0
SMALL_END = 1


class Scene(IntEnum):
    """Which joints have clearance, hence what is integrated (physics/README.md, Scenes)."""

    IDEAL = 0
    BIG_END = 1
    SMALL_END = 2
    BOTH = 3


class Load(IntEnum):
    """What presses on the piston (physics/README.md, Loads)."""

    NONE = 0
    TYPICAL = 1
    DESIGN = 2


# the state of each scene: deviations from the ideal motion, then their rates
ROD_AND_CROSSHEAD = ("x deviation, m", "phi deviation, rad", "its rate, m/s", "its rate, rad/s")
STATE_NAMES = {
    Scene.IDEAL: (),
    Scene.BIG_END: ROD_AND_CROSSHEAD,
    Scene.SMALL_END: ROD_AND_CROSSHEAD,
    Scene.BOTH: (
        "x deviation, m", "X deviation, m", "Y deviation, m", "phi deviation, rad",
        "x rate, m/s", "X rate, m/s", "Y rate, m/s", "phi rate, rad/s",
    ),
}  # fmt: skip
# unknowns integrated in each scene
FREEDOMS = {scene: len(names) // 2 for scene, names in STATE_NAMES.items()}
# what contacts carry with them behind these, where a record's laws are chosen ones
CARRIED = (
    "approach speed at the big end, m/s", "approach speed at the small end, m/s",
    "bristles at the big end, m", "bristles at the small end, m",
)  # fmt: skip

FIELDS: list[tuple] = [
    ("scene", "i8"),
    ("load", "i8"),
    ("law", "i8"),  # of contact_laws
    ("friction", "i8"),
    ("freedoms", "i8"),  # positions in a state; two in the ideal scene, zeros
    ("wide", "i8"),  # whether angles may be beyond the series of `small_angle`
    # mechanism
    ("omega", "f8"),  # crank speed, rad/s
    ("crank_radius", "f8"),  # R, m
    ("rod_length", "f8"),  # L, m
    ("rod_mass", "f8"),  # kg
    ("rod_centre", "f8"),  # a: from the big end to the mass centre, m
    ("rod_inertia", "f8"),  # about the mass centre, kg m^2
    ("reciprocating_mass", "f8"),  # crosshead, piston rod and piston, kg
    ("gravity", "f8"),  # along -y, m/s^2
    # contact, per joint: big end, small end
    ("pin_radius", "f8"),  # journal radius R_j, m
    ("clearance", "f8", (2,)),  # radial, m; 0 for an ideal joint
    ("stiffness", "f8", (2,)),  # K, N/m^p
    ("exponent", "f8"),  # p
    ("damping", "f8"),  # C_max, N s/m
    ("full_damping", "f8"),  # d_max, m
    # friction: ADAMS's four numbers
    ("static", "f8"),
    ("dynamic", "f8"),
    ("stiction_velocity", "f8"),  # m/s
    ("friction_velocity", "f8"),  # m/s
    # load
    ("corners", "f8", (3,)),  # crank angles at which phases 1, 2, 3 begin, rad
    ("suction_force", "f8"),  # p_s A, N
    ("discharge_force", "f8"),  # p_d A, N
    ("back_force", "f8"),  # on the piston's other face, N
    ("head_clearance", "f8"),  # s0, m
    ("gas_exponent", "f8"),
    ("spring_stiffness", "f8"),  # N/m
    ("spring_damping", "f8"),  # N s/m
    ("preload", "f8"),  # N
    ("spring_stroke", "f8"),  # piston travel of each dwell of the follower, m
    # what `derive` makes of these: a division takes as long as ten products
    ("crank_ratio", "f8"),  # R / L
    ("per_rod_mass", "f8"),  # 1/kg
    ("per_rod_inertia", "f8"),  # 1/(kg m^2)
    ("per_reciprocating_mass", "f8"),  # 1/kg
    ("per_full_damping", "f8"),  # 1 / d_max, 1/m
    ("per_stiction", "f8"),  # of friction's first rise, from -v_s to v_s, s/m
    ("per_transition", "f8"),  # of its fall, from v_s to v_d, s/m
    # laws other than the default ones
    ("hysteresis", "f8"),  # chi: damping force over elastic force at the approach speed
    ("least_approach", "f8"),  # approach speed below which chi is no longer divided by it, m/s
    ("bristle_stiffness", "f8"),  # LuGre's sigma_0 over the normal force, 1/m
    ("bristle_damping", "f8"),  # sigma_1, s/m
    ("viscous", "f8"),  # sigma_2, s/m
]
# The last field's length tells compiled functions, by its type alone, whether laws were chosen:
# those for the default laws hold nothing of the others.
RECORD = np.dtype([*FIELDS, ("laws", "f8", (1,))], align=True)
CHOSEN = np.dtype([*FIELDS, ("laws", "f8", (2,))], align=True)


def zero(kind: np.dtype) -> np.record:
    """A record of a kind, of zeros, that compiled functions may write."""
    return np.zeros(1, np.dtype((np.record, kind)))[0]


def new_record(chosen: bool = False) -> np.record:
    """A record of zeros, to be filled field by field; `chosen`: for laws but the default ones."""
    return zero(CHOSEN if chosen else RECORD)


def state_names(p: np.record) -> tuple[str, ...]:
    """Names of the numbers of a record's state: deviations, their rates, what contacts carry."""
    names = STATE_NAMES[Scene(int(p["scene"]))]
    return names + CARRIED if names and p["laws"].size > 1 else names


def derive(p: np.record) -> None:
    """Fill the fields of a record that follow from its others."""
    p["freedoms"], p["wide"] = FREEDOMS[Scene(int(p["scene"]))] or 2, 1
    p["crank_ratio"] = p["crank_radius"] / p["rod_length"]
    for name in ("rod_mass", "rod_inertia", "reciprocating_mass", "full_damping"):
        p[f"per_{name}"] = 1.0 / p[name]
    if p["friction"]:
        p["per_stiction"] = 1.0 / (2.0 * p["stiction_velocity"])
        if p["friction_velocity"] > p["stiction_velocity"]:  # else no law reads it
            p["per_transition"] = 1.0 / (p["friction_velocity"] - p["stiction_velocity"])
