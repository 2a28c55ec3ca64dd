"""Extreme scenes of the kept oracle: journals in clearances far beyond what is built.

Scene k of a seed is always the same, however many are drawn. Even scenes lie inside the range that
is documented as supported, odd ones in the whole range; each kind has a scrambled Sobol sequence of
its own, over the numbers of `SPANS` and over load, scene, friction's ratio and the start. A span of
None is the same for both kinds. Contact stiffness is drawn in N/m^1.5; with another exponent it is
the one whose force at 0.1 mm, the law's full damping, is the same.

With laws, the same scenes have laws of contact and friction that are drawn as well, each as often
as any other, with the numbers that they read; with features also each of oil, guide, drive, rod and
friction of ideal joints in three of ten, and half of the gas loads are a cylinder's: single or
double acting, with clearance, valve losses and pressures of its own.
"""

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from compressor.cases.conflicts import judged_range
from compressor.cases.swept import design
from compressor.cases.table import table
from compressor.metrics import JOINTS

Span = tuple[float, float]


def _supported(key: str, factor: float = 1.0) -> Span:
    """Return the supported range of a key, as in the table of parameters, times a factor."""
    low, high = judged_range(key)
    return low * factor, high * factor


# name: (unit, whole range, supported range, log-uniform)
SPANS: dict[str, tuple[str, Span, Span | None, bool]] = {
    "clearance_big_end": ("m", (1e-9, 3e-3), _supported("clearance_mm.big_end", 1e-3), True),
    "clearance_small_end": ("m", (1e-9, 3e-3), _supported("clearance_mm.small_end", 1e-3), True),
    "stiffness": (
        "N/m^1.5", (1e6, 1e14), _supported("contact.stiffness_N_per_mm15", 1000.0**1.5), True,
    ),
    "exponent": ("1", _supported("contact.exponent"), None, False),
    "damping": ("1", (1e-2, 1e2), None, True),  # over the paper's; a tenth of the scenes has none
    "friction": ("1", (0.0, 1.0), _supported("friction.static"), False),
    "stiction_velocity": (
        "m/s", (1e-6, 0.1), _supported("friction.stiction_velocity_mm_per_s", 1e-3), True,
    ),
    "rod_mass": ("kg", (1e-3, 400.0), _supported("machine.rod_mass_kg"), True),
    "reciprocating_mass": ("kg", (1e-3, 400.0), _supported("machine.reciprocating_mass_kg"), True),
    "speed": ("rpm", (1.0, 20_000.0), _supported("machine.speed_rpm"), True),
    "pin_radius": ("m", _supported("machine.pin_radius_mm", 1e-3), None, True),
    "rtol": ("1", (1e-10, 1e-2), None, True),
}  # fmt: skip
OTHER_DRAWS = 3 + 3 * len(JOINTS)  # friction's ratio, load, scene; how each journal starts
LOADS = ("none", "gas", "spring")
SCENES = ("big_end", "small_end", "both")
UNDAMPED = 0.1  # share of the scenes
MASS_RATIO = 1e4  # at most
PAPER_DAMPING = 336.0  # N s/mm
FULL_DAMPING = 1e-4  # m
DEEPEST_START = 0.03  # of the pin radius
FORCES = {"none": 0.0, "gas": 3087.0, "spring": 3347.0}  # N, greatest of each load
CRANK = 0.12  # m
SAMPLES = 720  # of the output grid
# (whole range, supported range) of what chosen laws read, drawn evenly in the logarithm
OF_LAWS = {
    "contact.restitution": ((0.05, 1.0), _supported("contact.restitution")),
    "contact.least_approach_mm_per_s": (
        (0.1, 1000.0),
        _supported("contact.least_approach_mm_per_s"),
    ),
    "contact.length_mm": ((1.0, 1000.0), _supported("contact.length_mm")),
    "contact.modulus_GPa": ((0.1, 1000.0), _supported("contact.modulus_GPa")),
    "friction.bristle_stiffness_per_mm": (
        (1.0, 1e5),
        _supported("friction.bristle_stiffness_per_mm"),
    ),
    "friction.bristle_damping_s_per_mm": (
        (1e-4, 0.3),
        _supported("friction.bristle_damping_s_per_mm"),
    ),
    "friction.viscous_s_per_mm": ((1e-6, 1e-2), (1e-5, 1e-3)),
}
LAWS, FEATURES = "laws", "features"
ELASTIC = ("johnson", "liu")  # which need no restitution: half of them have none


@dataclass(frozen=True)
class Budget:
    """How far scenes run, and what each run may cost; `seconds` are more than steps ever need.

    drawn: what is drawn beside their numbers: nothing (""), "laws", or laws and "features".
    """

    drawn: str = ""
    revolutions: float = 0.25
    max_steps: int = 500_000
    seconds: float = 30.0


def is_supported(number: int) -> bool:
    """Return whether a scene lies inside the range that is documented as supported."""
    return number % 2 == 0


def values(number: int, seed: int, budget: Budget = Budget()) -> dict[str, Any]:
    """Return the scene `number` of a seed as the values of a case file."""
    point = iter(_points(seed, number % 2, 1 << (number // 2).bit_length())[number // 2])
    found = _numbers(point, is_supported(number))
    ratio, load, joint = next(point), LOADS[_which(point)], SCENES[_which(point)]
    exponent = found["exponent"]
    stiffness = found["stiffness"] * FULL_DAMPING ** (1.5 - exponent)
    force = found["reciprocating_mass"] * CRANK * (found["speed"] * math.pi / 30) ** 2
    depth = ((force + FORCES[load]) / stiffness) ** (1 / exponent)  # at rest
    worn = [one for one in JOINTS if joint in (one, "both")]
    offset: dict[str, float] = {}
    for one in JOINTS:
        draws = next(point), next(point), next(point)
        if one in worn:
            deepest = min(depth, DEEPEST_START * found["pin_radius"])
            offset |= _start(one, draws, found[f"clearance_{one}"], deepest)
    stiction = 1e3 * found["stiction_velocity"]
    scene: dict[str, Any] = {
        "name": f"stress-{seed}-{number}",
        "load": load,
        "joint": joint,
        "clearance_mm": {one: 1e3 * found[f"clearance_{one}"] for one in worn},
        "initial_offset_mm": offset,
        "machine": {
            "speed_rpm": found["speed"],
            "rod_mass_kg": found["rod_mass"],
            "reciprocating_mass_kg": found["reciprocating_mass"],
            "pin_radius_mm": 1e3 * found["pin_radius"],
        },
        "contact": {
            "stiffness_N_per_mm15": stiffness / 1000.0**exponent,
            "exponent": exponent,
            "damping_N_s_per_mm": PAPER_DAMPING * found["damping"],
        },
        "friction": {
            "static": found["friction"],
            "dynamic": found["friction"] * (0.3 + 0.7 * ratio),
            "stiction_velocity_mm_per_s": stiction,
            "friction_velocity_mm_per_s": 10.0 * stiction,
        },
    }
    if budget.drawn:
        draw = random.Random(f"{seed} {number}")
        for group in ("contact", "friction"):
            scene[group] |= choose_law(group, draw, is_supported(number))
        if budget.drawn == FEATURES:
            scene |= features(scene, draw, is_supported(number))
    return _round_numbers(scene) | {
        "output": {"keep": "series"},
        "solve": {
            "duration_rev": budget.revolutions,
            "settle_rev": 0.0,
            "output_step_deg": 360.0 * budget.revolutions / SAMPLES,
            "rtol": float(f"{found['rtol']:.2g}"),
            "horizon": False,  # whether numbers can be judged is the judge's to find out
            "max_steps": budget.max_steps,
            "timeout_s": budget.seconds,
        },
    }


def choose_law(group: str, draw: random.Random, inside: bool) -> dict[str, Any]:
    """Return a law of contact or friction, with the parameters that any law reads."""
    found: dict[str, Any] = {"law": draw.choice(table()[f"{group}.law"].choices)}
    for key, (whole, narrow) in OF_LAWS.items():
        low, high = narrow if inside else whole
        value = low * (high / low) ** draw.random()
        if key.startswith(group):
            found[key.partition(".")[2]] = value
    if found["law"] in ELASTIC and draw.random() < 0.5:
        del found["restitution"]
    return found


@cache
def _points(seed: int, kind: int, count: int) -> list[list[float]]:
    """Return at least `count` points of a kind of scene.

    The first ones do not depend on the count.
    """
    return design("sobol", count, len(SPANS) + OTHER_DRAWS, 2 * seed + kind)


def _numbers(point: Iterator[float], inside: bool) -> dict[str, float]:
    """Return the numbers of `SPANS` at a point of the unit cube."""
    found = {}
    for name, (_, whole, narrow, log) in SPANS.items():
        low, high = narrow if inside and narrow else whole
        u = next(point)
        if name == "damping":
            share = (u - UNDAMPED) / (1.0 - UNDAMPED)
            found[name] = low * (high / low) ** share if share >= 0.0 else 0.0
        else:
            found[name] = low * (high / low) ** u if log else low + u * (high - low)
    rod = found["rod_mass"]
    mass = max(found["reciprocating_mass"], rod / MASS_RATIO)
    found["reciprocating_mass"] = min(mass, rod * MASS_RATIO)
    return found


def _which(point: Iterator[float]) -> int:
    """Return one of three."""
    return int(3 * next(point))


def _start(
    joint: str, draws: tuple[float, float, float], clearance: float, deepest: float
) -> dict[str, float]:
    """Return a journal's initial offset (mm): none, within the clearance, or in the bearing."""
    kind, size, turn = draws
    if kind < 1 / 3:
        return {}
    depth = deepest * 10.0 ** (-3.0 * size)
    radius = 1e3 * (clearance * size if kind < 2 / 3 else clearance + depth)
    angle = 2 * math.pi * turn
    return {f"{joint}_x": radius * math.cos(angle), f"{joint}_y": radius * math.sin(angle)}


def _round_numbers(value: Any) -> Any:
    """Return the numbers to five digits, so that a case can be written into a file."""
    if isinstance(value, dict):
        return {key: _round_numbers(item) for key, item in value.items()}
    return float(f"{value:.5g}") if isinstance(value, float) else value


FEATURE_SHARE = 0.3  # of the scenes that have each feature
# group -> key -> (whole range, supported range), in the case file's units
RANGES = {
    "lubricant": {
        "viscosity_mPa_s": ((0.1, 1e4), judged_range("lubricant.viscosity_mPa_s")),
        "last_share": ((0.002, 0.3), judged_range("lubricant.last_share")),
    },
    "guide": {
        "clearance_mm": ((1e-3, 1.0), judged_range("guide.clearance_mm")),
        "friction": ((1e-3, 0.5), judged_range("guide.friction")),
        "crosshead_length_mm": ((20.0, 500.0), judged_range("guide.crosshead_length_mm")),
        "crosshead_height_mm": ((20.0, 500.0), judged_range("guide.crosshead_height_mm")),
        "stiffness_N_per_mm15": ((1e3, 1e7), judged_range("guide.stiffness_N_per_mm15")),
    },
    "drive": {
        "flywheel_kg_m2": ((0.1, 1e3), judged_range("drive.flywheel_kg_m2")),
        "slope_N_m_s": ((0.1, 1e5), judged_range("drive.slope_N_m_s")),
    },
    "rod": {
        "youngs_modulus_GPa": ((10.0, 1e3), judged_range("rod.youngs_modulus_GPa")),
        "depth_mm": ((5.0, 200.0), judged_range("rod.depth_mm")),
        "width_mm": ((5.0, 200.0), judged_range("rod.width_mm")),
        "damping_ratio": ((1e-4, 0.3), judged_range("rod.damping_ratio")),
    },
}
CYLINDER_SHARE = 0.5  # of the scenes with a gas load
# drawn evenly, alike in all scenes: a gas load is smooth but where a valve opens or closes
CYLINDERS = {
    "piston_radius_mm": (30.0, 100.0),
    "suction_MPa": (0.1, 1.0),
    "pressure_ratio": (1.3, 5.0),
    "exponent": (1.05, 1.67),
    "clearance_percent": (4.0, 40.0),
    "valve_loss_percent": (0.0, 10.0),
    "rod_diameter_mm": (10.0, 50.0),
}
LENGTHS = ((0.15, 0.99), (0.4, 0.99))  # of a bearing over its diameter
LUGRE = "lugre"


def features(scene: dict[str, Any], draw: random.Random, inside: bool) -> dict[str, Any]:
    """Return the groups that a scene has besides, as far as they are drawn.

    scene: the scene so far.
    """
    found: dict[str, Any] = {}
    for group, keys in RANGES.items():
        if draw.random() < FEATURE_SHARE:
            found[group] = {key: _draw_number(spans, draw, inside) for key, spans in keys.items()}
    if "guide" in found and draw.random() < 0.3:  # ideal, with friction
        found["guide"]["clearance_mm"] = 0.0
    if "lubricant" in found:
        length = _draw_number(LENGTHS, draw, inside) * 2.0 * scene["machine"]["pin_radius_mm"]
        found["lubricant"]["bearing_length_mm"] = length
    if draw.random() < FEATURE_SHARE and scene["friction"]["law"] != LUGRE:
        found["friction"] = scene["friction"] | {"ideal_joints": True}
    if scene["load"] == "gas" and draw.random() < CYLINDER_SHARE:
        found["gas"] = choose_cylinder(draw)
    return found


def choose_cylinder(draw: random.Random) -> dict[str, Any]:
    """Return a gas load with ends, clearance, valve losses and pressures of its own."""
    found: dict[str, Any] = {
        key: draw.uniform(*span) for key, span in CYLINDERS.items() if key != "pressure_ratio"
    }
    found["discharge_MPa"] = found["suction_MPa"] * draw.uniform(*CYLINDERS["pressure_ratio"])
    found["action"] = draw.choice(table()["gas.action"].choices)
    if found["action"] == "single":
        del found["rod_diameter_mm"]
    return found


def _draw_number(
    spans: tuple[tuple[float, float], tuple[float, float]], draw: random.Random, inside: bool
) -> float:
    """Return a number, evenly in its logarithm."""
    low, high = spans[inside]
    return float(low * (high / low) ** draw.random())
