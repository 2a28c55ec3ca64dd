"""Cautions about a case before it runs: natural scales, slips of units, laws left behind.

Natural scales of a case before it runs: depths, times and steps, from its parameters alone. Closed
formulas, tens of microseconds a case. Forces are the sum of the greatest load and inertia, hence
bounds; the deepest contact of the random cases (tests/campaigns/random_cases.py) is 0.6 to 1.6
times as deep as they say in nine of ten (tests/solve/test_scales.py).

Numbers that look as if they were given in another unit than their key's. The rule: a key is
reported where every value that it has in a study lies outside its usual range, and another unit of
the same quantity would bring all of them inside. A sweep that reaches into the usual range is meant
as it stands, however odd its ends are.

Nothing here is refused: an oddity is reported once a study, before it runs. What
cannot be simulated at all is refused by `compressor.cases.conflicts`.
"""

import math
import random
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from compressor.cases import (
    Body,
    Case,
    Study,
    open_card,
    outside_judged,
    paper_notes,
    reads,
    row_of,
    to_si,
    with_ideal_joints,
)
from compressor.metrics import JOINTS
from compressor.physics import STABILITY_LIMIT, Scene, elastic_form, greatest_load, steepest
from compressor.solve.measured_gas import card_noise, fit_polytrope, sensed_noise
from compressor.solve.request import greatest_depth
from compressor.solve.run import COMPILED, closed_form
from compressor.solve.run_metrics import metrics
from compressor.solve.si_record import record, scene

# Attempts of a step for each radian of the contact's ringing at rtol 1; measured on random cases.
PER_RADIAN = {"big_end": 0.3, "small_end": 0.5, "both": 0.7}
# of the steps that stability requires: joints are not in contact, or deep, always
STABILITY_SHARE = 0.5
ORDER = 5
STEP_SECONDS = {"big_end": 3.5e-6, "small_end": 3.5e-6, "both": 4.5e-6}  # of compiled methods
EXPONENTS = (1.0, 1.5)  # that gas is compressed with
LEAST_PRESSURE = 0.07  # MPa, absolute, that a compressor takes in; less is a vacuum pump
MAX_MISFIT = 0.05  # of a card's lines, rms of the pressure's logarithm
MAX_UNLIKE = 0.25  # by which a card's clearance may differ from what is given
MAX_NOISE = 5e-4  # of a card's range of pressure
SCIPY_SECONDS = 2.5e-4  # of a step of SciPy's methods, with its tally


@dataclass(frozen=True)
class JointScales:
    """Natural scales of a joint's contact under a force (SI)."""

    joint: str
    clearance: float  # m
    force: float  # N
    penetration: float  # m, at rest under the force
    damping_ratio: float  # of the lighter body on the contact at rest; above 1 it does not ring
    swing_frequency: float  # Hz, of the journal swinging about the line of the force in its bore
    friction_rate: float  # 1/s: dmu/dv F / m where it is greatest; 1.5 mu_s F / (m v_s) of ADAMS's
    explicit_step: float  # s, the stability limit by the fastest of stiffness, damping, friction
    limited_by: str
    implicit_step: float  # s: the contact's own time scale, which no method can do without


def greatest_force(p: np.record, joint: str) -> float:
    """Return a bound of the force at a joint of the ideal machine (N): inertia and load.

    m R omega^2 (1 + R / L) of what reciprocates, at the big end m R omega^2 (1 + a R / L^2) of the
    rod as well, and the load's greatest value; in the machine they partly cancel.
    """
    ratio, centripetal = p["crank_ratio"], p["crank_radius"] * p["omega"] ** 2
    inertia = p["reciprocating_mass"] * centripetal * (1 + ratio)
    if joint == "big_end":
        share = p["rod_centre"] / p["rod_length"]
        inertia += p["rod_mass"] * centripetal * (1 + share * ratio)
    return float(inertia + p["rod_mass"] * p["gravity"] + greatest_load(p))


def joint_scales(p: np.record, joint: str, force: float) -> JointScales:
    """Return the scales of a joint with clearance under a force (N).

    p: the case's record; joint: `big_end` or `small_end`. A journal that the force holds against
    its bore can roll to and fro on the wall, on a circle of radius e, clearance and penetration. It
    swings like a pendulum, at sqrt(F / (m e)); m is what the rod's end weighs across the force, the
    other end being held: (J + m_r l^2) / L^2, l from the mass centre to the other end.
    """
    number = JOINTS.index(joint)
    clearance, stiffness = p["clearance"][number].item(), p["stiffness"][number].item()
    contact = elastic_form(stiffness, clearance, p)
    mass = min(p["rod_mass"], p["reciprocating_mass"]).item()
    depth = float(contact.static_depth(force))
    natural = math.sqrt(contact.tangent(depth) / mass)
    friction = 0.0
    if p["friction"]:
        friction = steepest(p) * force / mass
    rates = {
        "contact stiffness": natural,
        "contact damping": contact.damping(depth) / mass,
        "friction": friction,
    }
    fastest = max(rates, key=rates.__getitem__)
    swing = math.sqrt(force / (across(p, joint) * (clearance + depth)))
    return JointScales(
        joint, clearance, force, depth, contact.damping(depth) / (2.0 * mass * natural),
        swing / (2.0 * math.pi), friction, STABILITY_LIMIT / rates[fastest], fastest,
        1.0 / natural,
    )  # fmt: skip


def across(p: np.record, joint: str) -> float:
    """Return the mass (kg) of a rod's end that moves across the rod, the other end being held."""
    centre, length = p["rod_centre"].item(), p["rod_length"].item()
    lever = length - centre if joint == "big_end" else centre
    return (p["rod_inertia"].item() + p["rod_mass"].item() * lever**2) / length**2


def dry_record(case: Case) -> np.record:
    """Return the record of a case without its oil: Reynolds' equation would take half a second."""
    return record(replace(case, lubricant=None))


def contact_scales(case: Case) -> Iterator[JointScales]:
    """Yield the scales of each joint with clearance under its greatest force."""
    if scene(case) == Scene.IDEAL:
        return
    p = dry_record(case)
    for joint, clearance in zip(JOINTS, p["clearance"], strict=True):
        if clearance > 0:
            yield joint_scales(p, joint, greatest_force(p, joint))


def expected_cost(case: Case, joints: Sequence[JointScales]) -> tuple[float, float]:
    """Return about how many steps a run of a case attempts, and how long they take (s)."""
    steps = expected_steps(case, joints)
    return steps, expected_seconds(case, steps)


def expected_steps(case: Case, joints: Sequence[JointScales]) -> float:
    """Return about how many steps a run of a case attempts.

    Good to a factor of four in random cases. As many as accuracy requires while the contact rings,
    or as stability does where that is not more than the stiff partner's: a few a radian. 0 where
    nothing is integrated. Far from the defaults only its order of magnitude holds.
    """
    if not joints:
        return 0.0
    joint = joints[0].joint if len(joints) == 1 else "both"
    radians = case.duration / min(one.implicit_step for one in joints)
    accurate = PER_RADIAN[joint] * case.rtol ** (-1.0 / ORDER)
    stable = STABILITY_SHARE * case.duration / min(one.explicit_step for one in joints)
    return max(radians * accurate, min(stable, radians * max(accurate, 2.0)))


def expected_seconds(case: Case, steps: float) -> float:
    """Return about how long so many steps take (s), without error bars, on a machine of 2024."""
    if steps == 0:
        return 0.0
    joint = case.joint if case.joint in STEP_SECONDS else "both"
    return steps * (STEP_SECONDS[joint] if case.solve.method in COMPILED else SCIPY_SECONDS)


METRES, MICROMETRES = {"m": 1e3}, {"µm": 1e-3}
GRAMS, MILLI = {"g": 1e-3}, 1e-3


class Usual(NamedTuple):
    """What is usual for a key, in its unit, and the units it may be mistaken for, as factors."""

    low: float
    high: float
    units: dict[str, float]

    def holds(self, value: float) -> bool:
        """Return whether a value is usual; limits may come from a conversion, and count."""
        return self.low * (1 - 1e-9) <= value <= self.high * (1 + 1e-9)


# Ours: reciprocating compressors from model engines to large process machines, with a margin. A
# contact is from plastic bushings to steel in a conforming bore (Hertz, K = 4/3 sqrt(R) E').
USUAL = {
    "clearance_mm": Usual(1e-3, 2.0, METRES | MICROMETRES),
    "machine.crank_radius_mm": Usual(5.0, 1e3, METRES),
    "machine.rod_length_mm": Usual(20.0, 1e4, METRES),
    "machine.speed_rpm": Usual(120.0, 6e3, {"rad/s": 30 / math.pi, "Hz": 60.0}),
    "machine.rod_mass_kg": Usual(0.02, 500.0, GRAMS),
    "machine.reciprocating_mass_kg": Usual(0.05, 5e3, GRAMS),
    "machine.pin_radius_mm": Usual(1.0, 500.0, METRES),
    "gas.piston_radius_mm": Usual(5.0, 1e3, METRES),
    "gas.head_clearance_mm": Usual(0.1, 200.0, METRES),
    "gas.suction_MPa": Usual(1e-3, 50.0, {"bar": 0.1, "kPa": 1e-3, "Pa": 1e-6}),
    "gas.discharge_MPa": Usual(0.05, 200.0, {"bar": 0.1, "kPa": 1e-3, "Pa": 1e-6}),
    "spring.stiffness_N_per_mm": Usual(0.1, 5e3, {"N/m": MILLI, "kN/mm": 1e3}),
    "spring.damping_N_s_per_mm": Usual(1e-4, 10.0, {"N s/m": MILLI}),
    "spring.preload_N": Usual(5.0, 1e6, {"kN": 1e3}),
    "spring.stroke_mm": Usual(2.0, 2e3, METRES),
    "contact.stiffness_N_per_mm15": Usual(
        1e4, 1e7, {"kN/mm^1.5": 1e3, "mN/mm^1.5": MILLI, "N/m^1.5": 1000.0**-1.5}
    ),
    "contact.damping_N_s_per_mm": Usual(0.1, 1e5, {"N s/m": MILLI}),
    "contact.full_damping_mm": Usual(1e-3, 5.0, METRES),
    "friction.stiction_velocity_mm_per_s": Usual(0.1, 1e4, {"m/s": 1e3}),
    "friction.friction_velocity_mm_per_s": Usual(1.0, 1e5, {"m/s": 1e3}),
}


class Slip(NamedTuple):
    """A key whose values look like another unit's, with its caution."""

    key: str
    message: str
    jobs: int  # that read the key


def slips(cases: Sequence[Case]) -> list[Slip]:
    """Return the keys of a study's cases whose values all look like another unit's."""
    look_alikes = []
    for key, usual in USUAL.items():
        read = [values for case in cases if (values := values_of(case, key))]
        values = sorted({value for several in read for value in several})
        unit = other_unit(key, usual, values)
        if unit:
            look_alikes.append(Slip(key, describe_slip(key, usual, values, unit), len(read)))
    return look_alikes


def values_of(case: Case, key: str) -> list[float]:
    """Return the values of a key that a simulation reads; of clearances, those of worn joints."""
    group, _, name = key.partition(".")
    if not reads(case, key):
        return []
    if not name:  # what both joints share
        worn = (getattr(getattr(case, group), joint) for joint in JOINTS)
        return [value for value in worn if value]
    if name == "stiffness_N_per_mm15" and case.contact.exponent != 1.5:
        return []  # its unit depends on the exponent
    owner = getattr(case, group)
    value = getattr(owner, name) if owner is not None else None
    return [] if value is None else [float(value)]


def other_unit(key: str, usual: Usual, values: Iterable[float]) -> str:
    """Return the unit in which unusual values would all be usual, "" where there is none.

    Of several, the one that brings them nearest to the key's default.
    """
    values = [*values]
    if not values or any(usual.holds(value) or value <= 0 for value in values):
        return ""
    fitting = [
        name for name, factor in usual.units.items() if all(usual.holds(v * factor) for v in values)
    ]
    row = row_of(key)
    default = float(row.default) if row and row.default else math.sqrt(usual.low * usual.high)
    middle = sum(map(math.log, values)) / len(values)
    return min(
        fitting,
        key=lambda name: abs(middle + math.log(usual.units[name] / default)),
        default="",
    )


def describe_slip(key: str, usual: Usual, values: Sequence[float], other: str) -> str:
    """Return the caution about values that look like another unit's."""
    row, factor = row_of(key), usual.units[other]
    unit = (row.unit if row else "").replace("^p", "^1.5")
    low, high = values[0], values[-1]
    if low == high:
        given, verb, them = f"{low:g} {unit}", "is", f"it is {low * factor:.4g} {unit}"
    else:
        given, verb = f"{low:g} to {high:g} {unit}", "are"
        them = f"they are {low * factor:.4g} to {high * factor:.4g} {unit}"
    range_ = f"{usual.low:g} to {usual.high:g}"
    return f"{given} {verb} unusual ({range_} is usual); read as {other}, {them}"


SHALLOW_CLEARANCES = 2.0  # clearances: forces are bounds, and the paper's 0.1 mm is not meant
UNEVEN_ROD = 0.02  # of the rod's length: its centre is so far from the middle
# times a uniform bar's: the rods of three textbooks' exercises have 1.2, 1.9 and 2.0 times that,
# which is 0.43 to 0.89 of m a b, that of two masses at the bores
HEAVY_ENDS = 2.0
LONGEST_CRANK = 0.35  # of the rod's length; 0.15 to 0.3 is usual
MIN_STICTION = 0.1  # mm/s: below it, friction all but sticks
MAX_JOBS = 500  # of a study that are looked at
SHORT_BUDGET = 4.0  # a budget this many times below what is expected; so far is that to be trusted
NEAR_BUCKLING = 0.5  # of Euler's load; beyond it a rod bends by more than its inertia requires
TURN_PIECES = 8  # of the quadrature over a revolution of the ideal machine
DENSITIES = 1000.0, 20_000.0  # kg/m3, of what rods are made of


class Remark(NamedTuple):
    """What is odd about a case: the key it is about, and why."""

    key: str
    message: str
    kind: str  # the same for all cases with the same oddity


@dataclass(frozen=True)
class Caution:
    """One oddity of a study, with the words for the first job that has it."""

    key: str
    message: str
    jobs: int  # that have it
    of: int  # jobs looked at


def remarks(case: Case) -> Iterator[Remark]:
    """Yield what is odd about a case by itself; nothing about the defaults."""
    joints = list(contact_scales(case))
    yield from _inertias(case)
    yield from _proportions(case)
    for key, text in outside_judged(case.values()).items():
        yield Remark(key, text, "judged")
    for key, note in paper_notes(case).items():
        yield Remark(key, note, "default")
    yield from _casing(case)
    yield from _foundation(case)
    for joint in joints:
        yield from _depths(case, joint)
    yield from _rod(case)
    yield from _drive(case)
    yield from _cards(case)
    gas = case.gas
    alone = gas.crank_clearance_percent is not None and gas.clearance_percent is None
    if alone and case.load == "gas" and gas.action == "double" and not gas.is_measured:
        text = f"of the crank end alone: the head end has {gas.head_clearance_mm:g} mm"
        yield Remark("gas.crank_clearance_percent", text, "clearance")
    if case.wear:
        yield Remark(
            "wear", "compsim wear alone reads it: a run has the clearances that are given", "unread"
        )
    friction = case.friction
    if friction and friction.law in (None, "lugre") and friction.static < friction.dynamic:
        text = f"{friction.static:g} is below the dynamic one, {friction.dynamic:g}"
        yield Remark("friction.static", f"{text}: friction grows as bodies slide", "coefficients")
    if joints and friction and 0 < friction.stiction_velocity_mm_per_s < MIN_STICTION:
        key = "friction.stiction_velocity_mm_per_s"
        slow = f"{friction.stiction_velocity_mm_per_s:g} mm/s, below {MIN_STICTION:g} mm/s"
        yield Remark(key, f"{slow}: friction all but sticks, and steps get short", "stiction")
    yield from _budgets(case, joints)


def _inertias(case: Case) -> Iterator[Remark]:
    """Yield an inertia that no distribution of the rod's mass between its ends has."""
    machine = case.machine
    most = machine.rod_mass_kg * (machine.rod_length_mm / 1000) ** 2
    if (machine.rod_inertia_kg_m2 or 0.0) > most:
        text = f"{machine.rod_inertia_kg_m2:g} kg m2 is more than all mass a rod apart, {most:.3g}"
        yield Remark("machine.rod_inertia_kg_m2", text, "unit")
    centre = machine.rod_centre_mm or 0.0
    apart = machine.rod_mass_kg * centre * (machine.rod_length_mm - centre) / 1e6
    bar = replace(machine, rod_inertia_kg_m2=None).rod_inertia_kg_m2 or 0.0
    uneven = abs(centre / machine.rod_length_mm - 0.5) > UNEVEN_ROD
    if uneven and machine.rod_inertia_kg_m2 == bar < apart:
        text = (
            f"{bar:.3g} kg m2 is the default, of a uniform bar, whose centre is in its middle, and "
            f"that of yours is not: drawn rods have up to {HEAVY_ENDS:g} times as much, and at "
            f"most {apart:.3g}, with all mass in their bores; it moves the forces across the rod"
        )
        yield Remark("machine.rod_inertia_kg_m2", text, "default")


def _casing(case: Case) -> Iterator[Remark]:
    """Yield that the level of a sensor goes as the inverse of a mass that nobody gave."""
    body, usual, key = case.body, Body(), "body.casing_mass_kg"
    if body is None or not reads(case, key) or body.mass_kg == usual.mass_kg:
        return
    if body.casing_mass_kg == replace(body, casing_mass_kg=None).casing_mass_kg:
        text = (
            f"{body.casing_mass_kg:g} kg is the default, a 25th of the body: levels of the sensor "
            "go as its inverse, so that they compare states of one machine, and set no alarm in "
            "m/s²; compsim calibrate finds it by a record"
        )
        yield Remark(key, text, "default")


NEAR_RESONANCE = 0.1  # of an order's frequency: nearer, the body's motion is a resonance's


def _foundation(case: Case) -> Iterator[Remark]:
    """Yield what decides a body's velocity: no counterweight, and a resonance with order 1 or 2."""
    body, speed = case.body, case.machine.speed_rpm / 60.0
    if body is None or body.mass_kg == Body().mass_kg:
        return
    if not case.counterweight:
        text = (
            "nothing balances what turns with the crank, and the body moves by all of it: give the "
            "counterweight that a machine has, here or as counterweight_kg_mm"
        )
        yield Remark("machine.balance", text, "default")
    for axis in "xy":
        natural = getattr(body, f"frequency_{axis}_Hz")
        for order in (1, 2):
            if abs(natural - order * speed) < NEAR_RESONANCE * order * speed:
                text = (
                    f"{natural:g} Hz is near {order * speed:.3g} Hz, order {order} of the speed: "
                    "the body's velocity is a resonance's, and follows its frequency and damping, "
                    "which have to be measured"
                )
                yield Remark(f"body.frequency_{axis}_Hz", text, "resonance")


def _proportions(case: Case) -> Iterator[Remark]:
    """Yield a crank that is long for its rod, as where the stroke is given as the crank radius."""
    radius, length = case.machine.crank_radius_mm, case.machine.rod_length_mm
    if radius > LONGEST_CRANK * length:
        text = (
            f"{radius:g} mm is {radius / length:.2g} of the rod's length, more than the usual "
            f"{LONGEST_CRANK:g}: the crank radius is half the stroke"
        )
        yield Remark("machine.crank_radius_mm", text, "proportion")


def _depths(case: Case, joint: JointScales) -> Iterator[Remark]:
    """Yield the penetrations for which the contact law is not meant."""
    depth, clearance = 1000 * joint.penetration, 1000 * joint.clearance
    most, limit = greatest_depth(dry_record(case))
    if joint.penetration > most:
        text = (
            f"forces of about {joint.force:.3g} N press {depth:.3g} mm deep, more than {limit}, at "
            "which a run stops: check stiffness, masses, speed and their units"
        )
        cylinder = case.contact.length_mm is not None
        key = "contact.length_mm" if cylinder else "contact.stiffness_N_per_mm15"
        yield Remark(key, text, "deep")
        return
    if depth > SHALLOW_CLEARANCES * clearance:
        text = f"{clearance:g} mm is less than the contact gives way, about {depth:.2g} mm"
        yield Remark(
            "clearance_mm",
            f"{text}: the joint acts as a spring more than as a gap; check the "
            "stiffness (contact.materials), or raise the clearance",
            "shallow",
        )


def _rod(case: Case) -> Iterator[Remark]:
    """Yield an elastic rod that would buckle, or whose mass is not that of its section."""
    rod, machine = case.rod, case.machine
    if rod is None:
        return
    p = dry_record(case)
    euler = math.pi**2 * float(p["bending_stiffness"]) * float(p["rod_length"])
    force = greatest_force(p, "small_end")
    if force > NEAR_BUCKLING * euler:
        near = "come near" if force < euler else "are above"
        text = f"forces of up to about {force:.3g} N {near} Euler's load, {euler:.3g} N"
        yield Remark("rod.depth_mm", f"{text}: this rod is linear and does not buckle", "buckling")
    volume = machine.rod_length_mm * rod.depth_mm * rod.width_mm / 1e9
    density = machine.rod_mass_kg / volume
    if not DENSITIES[0] <= density <= DENSITIES[1]:
        text = f"{machine.rod_mass_kg:g} kg in {rod.width_mm:g} x {rod.depth_mm:g} x "
        text += f"{machine.rod_length_mm:g} mm are {density:.3g} kg/m3: check mass and section"
        yield Remark("machine.rod_mass_kg", text, "density")


def _drive(case: Case) -> Iterator[Remark]:
    """Yield a motor that cannot bear the load, by the mean torque of the ideal machine."""
    drive = case.drive
    if drive is None or case.load == "none":
        return
    p, turn = record(with_ideal_joints(case, features=False)), case.turn
    tally = closed_form(p, np.array([0.0, turn]), 0.0, TURN_PIECES).tally
    needed, slope = metrics(p, tally)["mean_crank_torque"], drive.slope_N_m_s
    most = drive.torque_N_m + slope * case.omega
    if needed > 0.0 and needed > most:
        text = f"the load takes {needed:.3g} N m on average, more than the motor ever gives, "
        yield Remark("drive.torque_N_m", f"{text}{most:.3g} N m: the crank will stall", "load")


def _cards(case: Case) -> Iterator[Remark]:
    """Yield what is odd about measured cards: scatter, noise, pressures, clearance, exponent."""
    for end, path in case.gas.cards.items() if case.load == "gas" else ():
        card = open_card(path, end)
        key = "gas.indicator" if end == "head" else "gas.crank_indicator"
        if card.revolutions > 1:
            range_of = max(card.pressures) - min(card.pressures) or math.inf
            text = f"{card.revolutions} revolutions were averaged; they scatter by "
            text += f"{card.scatter:.2g} MPa (rms), {100 * card.scatter / range_of:.2g} % of the "
            yield Remark(key, f"{text}card's range", "scatter")
        if card.is_gauge and case.gas.ambient_MPa is None:
            text = "its gauge pressures count from 1 atmosphere, 1.01325 bar"
            yield Remark(key, f"{text}; set gas.ambient_MPa for another", "gauge")
        least = min(card.pressures)
        if least < LEAST_PRESSURE and not card.is_gauge:
            text = f"its least pressure is {least:.2g} MPa absolute, below the {LEAST_PRESSURE:g} "
            text += "that compressors take in: gauge pressures have a g behind the unit of their "
            yield Remark(key, f"{text}column, as in pressure_barg", "vacuum")
        yield from _card_fit(case, end, key)
        yield from _card_noise(case, end, key)


def _card_fit(case: Case, end: str, key: str) -> Iterator[Remark]:
    """Yield a card whose compression and expansion do not fit its gas and clearance volume."""
    fit = fit_polytrope(case, end)
    if fit is None:
        return
    doubt = "are its pressures of the unit that the column says, absolute or gauge, its angle 0 at "
    doubt += "top dead centre, the stroke the machine's?"
    stroke, given_by = 2 * case.machine.crank_radius_mm, case.gas.clearance_key(end)
    given = case.gas.clearance(end, stroke) / stroke
    value, row = getattr(case.gas, given_by.removeprefix("gas.")), row_of(given_by)
    is_given = row is not None and value != row.default
    misfit, clearance, exponent = fit
    says = f"compression and expansion fit a clearance of {100 * clearance:.3g} % at an "
    says += f"exponent of {exponent:.3g}"
    if misfit > MAX_MISFIT:
        text = "its compression and expansion fit no polytropic lines, whatever the clearance"
        yield Remark(key, f"{text}: {doubt}", "fit")
    elif not EXPONENTS[0] <= exponent <= EXPONENTS[1]:
        yield Remark(key, f"{says}: {doubt}", "fit")
    elif is_given and abs(clearance / given - 1) > MAX_UNLIKE:
        yield Remark(key, f"{says}, and {given_by} gives {100 * given:.3g} %", "fit")


def _card_noise(case: Case, end: str, key: str) -> Iterator[Remark]:
    """Yield noise of a card, which a run makes vibration of."""
    noise, card = card_noise(case, end), open_card(case.gas.cards[end], end)
    if noise <= MAX_NOISE * (max(card.pressures) - min(card.pressures)):
        return
    force = to_si(noise, "MPa") * math.pi * to_si(case.gas.piston_radius_mm, "mm") ** 2
    text = f"noise or rounding of its samples is about {noise:.2g} MPa (rms), {force:.3g} N on the "
    text += "piston"
    level = sensed_noise(case, end)
    if level > 0.0:
        text += f", and makes about {level:.2g} m/s2 (rms) at the sensor of the sound machine"
    smoothed = case.gas.smooth_deg or 0.0
    yield Remark(key, f"{text}; smoothed over {smoothed:g} degrees: gas.smooth_deg", "noise")


def _budgets(case: Case, joints: list[JointScales]) -> Iterator[Remark]:
    """Yield the budgets that are likely to run out."""
    solve, (steps, seconds) = case.solve, expected_cost(case, joints)
    if steps > SHORT_BUDGET * solve.max_steps:
        text = f"{solve.max_steps} steps, but about {steps:.1g} are expected"
        yield Remark("solve.max_steps", text, "steps")
    if seconds > SHORT_BUDGET * solve.timeout_s:
        text = f"{solve.timeout_s:g} s, but about {seconds:.1g} s are expected"
        yield Remark("solve.timeout_s", text, "seconds")


def cautions(study: Study, most: int = MAX_JOBS) -> list[Caution]:
    """Return what is odd about the selected jobs of a study, a `Caution` for each oddity.

    A key whose values look like another unit's has that remark alone, with the judged range where
    it leaves that. Of more than `most` jobs as many are looked at, drawn evenly and always the
    same, so that a large sweep takes no longer.
    """
    numbers: Sequence[int] = study.selected
    if len(numbers) > most:
        numbers = sorted(random.Random(0).sample(numbers, most))
    cases = [study.cases[number] for number in numbers]
    units = {one.key: Caution(one.key, one.message, one.jobs, len(cases)) for one in slips(cases)}
    messages: dict[tuple[str, str], list[str]] = {}
    for case in cases:
        reasons = {(one.key, one.kind): one.message for one in remarks(case)}
        for oddity, message in reasons.items():
            messages.setdefault(oddity, []).append(message)
    others = []
    for (key, kind), texts in sorted(messages.items(), key=lambda item: -len(item[1])):
        if key not in units:
            others.append(Caution(key, texts[0], len(texts), len(cases)))
        elif kind == "judged":
            both = f"{units[key].message}; {texts[0]}"
            units[key] = replace(units[key], message=both)
    return [*units.values(), *others]
