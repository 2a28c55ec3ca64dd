"""Cautions about a case before it runs: natural scales, slips of units, laws left behind.

Natural scales are closed formulas of a case's parameters alone. Forces are bounds; the deepest
contact of random cases is 0.6 to 1.6 times as deep as they say in nine of ten
(tests/analysis/test_cautions.py).

A key looks as if it were given in another unit where every value that it has in a study lies
outside its usual range, and that unit would bring all of them inside. An oddity is reported once a
study. What cannot be simulated at all is refused by `compressor.cases.conflicts`.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from compressor.analysis.cylinder import card_noise, fit_polytrope
from compressor.analysis.machine_numbers import is_own, sample_cases
from compressor.cases import (
    Body,
    Case,
    Study,
    open_card,
    outside_judged,
    paper_notes,
    reads,
    row_of,
    stands_for,
    to_si,
    value_of,
    values_given,
)
from compressor.metrics import JOINTS
from compressor.physics import elastic_form, greatest_load
from compressor.solve import gas_nodes, record

EXPONENTS = (1.0, 1.5)  # that gas is compressed with
MAX_MISFIT = 0.05  # of a card's lines, rms of the pressure's logarithm
MAX_UNLIKE = 0.25  # by which a card's clearance may differ from what is given
MAX_NOISE = 5e-4  # of a card's range of pressure
MAX_FLATTENED = 5e-3  # of it, by which smoothing lowers the peak, beside
PEAKS = 3.0  # times the noise, by which that alone raises a peak


def greatest_force(p: np.record, joint: str) -> float:
    """Return a bound of the force at a joint of the ideal machine (N): inertia and load.

    m R omega^2 (1 + R / L) of what reciprocates, at the big end of the rod as well; they partly
    cancel.
    """
    ratio, centripetal = p["crank_ratio"], p["crank_radius"] * p["omega"] ** 2
    inertia = p["reciprocating_mass"] * centripetal * (1 + ratio)
    if joint == "big_end":
        share = p["rod_centre"] / p["rod_length"]
        inertia += p["rod_mass"] * centripetal * (1 + share * ratio)
    return float(inertia + p["rod_mass"] * p["gravity"] + greatest_load(p))


def dry_record(case: Case) -> np.record:
    """Return the record of a case without its oil: Reynolds' equation would take half a second."""
    return record(replace(case, lubricant=None))


def contact_depths(case: Case) -> Iterator[tuple[float, float]]:
    """Yield each joint's clearance and its penetration at rest under its greatest force (m)."""
    p = dry_record(case)
    for number, joint in enumerate(JOINTS):
        if clearance := p["clearance"][number].item():
            contact = elastic_form(p["stiffness"][number].item(), clearance, p)
            yield clearance, float(contact.static_depth(greatest_force(p, joint)))


METRES, MICROMETRES = {"m": 1e3}, {"µm": 1e-3}
GRAMS, MILLI = {"g": 1e-3}, 1e-3
PRESSURES = {"bar": 0.1, "kPa": 1e-3, "Pa": 1e-6}

# key -> what is usual for it, lowest and highest, and the units it may be mistaken for, as factors.
# Reciprocating compressors from model engines to large process machines, with a margin; a contact
# is from plastic bushings to steel in a conforming bore (Hertz, K = 4/3 sqrt(R) E').
USUAL_KEYS = {
    "clearance_mm": (1e-3, 2.0, METRES | MICROMETRES),
    "machine.crank_radius_mm": (5.0, 1e3, METRES),
    "machine.rod_length_mm": (20.0, 1e4, METRES),
    "machine.speed_rpm": (120.0, 6e3, {"rad/s": 30 / math.pi, "Hz": 60.0}),
    "machine.rod_mass_kg": (0.02, 500.0, GRAMS),
    "machine.rod_inertia_kg_m2": (1e-6, 1e3, {"kg mm2": 1e-6, "kg cm2": 1e-4}),
    "machine.reciprocating_mass_kg": (0.05, 5e3, GRAMS),
    "machine.pin_radius_mm": (1.0, 500.0, METRES),
    "gas.piston_radius_mm": (5.0, 1e3, METRES),
    "gas.head_clearance_mm": (0.1, 200.0, METRES),
    "gas.suction_MPa": (1e-3, 50.0, PRESSURES),
    "gas.discharge_MPa": (0.05, 200.0, PRESSURES),
    "spring.stiffness_N_per_mm": (0.1, 5e3, {"N/m": MILLI, "kN/mm": 1e3}),
    "spring.damping_N_s_per_mm": (1e-4, 10.0, {"N s/m": MILLI}),
    "spring.preload_N": (5.0, 1e6, {"kN": 1e3}),
    "spring.stroke_mm": (2.0, 2e3, METRES),
    "contact.stiffness_N_per_mm15": (
        1e4, 1e7, {"kN/mm^1.5": 1e3, "mN/mm^1.5": MILLI, "N/m^1.5": 1000.0**-1.5}
    ),
    "contact.damping_N_s_per_mm": (0.1, 1e5, {"N s/m": MILLI}),
    "contact.full_damping_mm": (1e-3, 5.0, METRES),
    "friction.stiction_velocity_mm_per_s": (0.1, 1e4, {"m/s": 1e3}),
    "friction.friction_velocity_mm_per_s": (1.0, 1e5, {"m/s": 1e3}),
}  # fmt: skip


class Caution(NamedTuple):
    """What is odd about a study: the key it is about, the words for the first of `jobs` of `of`."""

    key: str
    message: str
    jobs: int
    of: int


def slips(cases: Sequence[Case]) -> list[Caution]:
    """Return the keys of a study's cases whose values all look like another unit's."""
    found = []
    for key, (usual_low, usual_high, units) in USUAL_KEYS.items():
        read = [values for case in cases if (values := values_of(case, key))]
        values = sorted({value for several in read for value in several})
        if not (other := other_unit(key, values)):
            continue
        row, ends = row_of(key), (values[0], values[-1])
        unit = (row.unit if row else "").replace("^p", "^1.5")
        given = " to ".join(dict.fromkeys(f"{one:g}" for one in ends))
        meant = " to ".join(dict.fromkeys(f"{one * units[other]:.4g}" for one in ends))
        text = f"{given} {unit}, where {usual_low:g} to {usual_high:g} is usual; read as {other}: "
        found.append(Caution(key, f"{text}{meant} {unit}", len(read), len(cases)))
    return found


def values_of(case: Case, key: str) -> list[float]:
    """Return the values of a key that a simulation reads; of clearances, those of worn joints."""
    if not reads(case, key):
        return []
    if key == "contact.stiffness_N_per_mm15" and case.contact.exponent != 1.5:
        return []  # its unit depends on the exponent
    found = [value_of(case, part) for part in stands_for(key) or (key,)]
    return [float(value) for value in dict.fromkeys(found) if value]


def other_unit(key: str, values: Sequence[float]) -> str:
    """Return the unit in which unusual values would all be usual, "" where there is none."""
    low, high, units = USUAL_KEYS[key]

    def is_usual(value: float) -> bool:  # limits may come from a conversion, and count
        return low * (1 - 1e-9) <= value <= high * (1 + 1e-9)

    if not values or any(value <= 0 or is_usual(value) for value in values):
        return ""
    row, middle = row_of(key), sum(map(math.log, values)) / len(values)
    default = float(row.default) if row and row.default else math.sqrt(low * high)
    return min(
        (name for name in units if all(is_usual(value * units[name]) for value in values)),
        key=lambda name: abs(middle + math.log(units[name] / default)),
        default="",
    )


SHALLOW_CLEARANCES = 2.0  # clearances: forces are bounds, and the paper's 0.1 mm is not meant
UNEVEN_ROD = 0.02  # of the rod's length: its centre is so far from the middle
# times a uniform bar's: the rods of three textbooks' exercises have 1.2, 1.9 and 2.0 times that,
# which is 0.43 to 0.89 of m a b, that of two masses at the bores
HEAVY_ENDS = 2.0
LONGEST_CRANK = 0.35  # of the rod's length; 0.15 to 0.3 is usual
MAX_JOBS = 500  # of a study that are looked at, beside the first and the last
NEAR_BUCKLING = 0.5  # of Euler's load; beyond it a rod bends by more than its inertia requires
NEAR_RESONANCE = 0.1  # of an order's frequency: nearer, the body's motion is a resonance's

Remarks = Iterator[tuple[str, str]]  # of a case: a key, and what is odd about it


def check_machine(case: Case) -> Remarks:
    """Yield a default inertia that few rods have, and a stroke given as the crank radius."""
    machine, key = case.machine, "machine.rod_inertia_kg_m2"
    centre = machine.rod_centre_mm or 0.0
    radius, length = machine.crank_radius_mm, machine.rod_length_mm
    apart = machine.rod_mass_kg * centre * (length - centre) / 1e6
    bar = replace(machine, rod_inertia_kg_m2=None).rod_inertia_kg_m2 or 0.0
    if abs(centre / length - 0.5) > UNEVEN_ROD and machine.rod_inertia_kg_m2 == bar < apart:
        yield key, (
            f"{bar:.3g} kg m2 is the default, of a uniform bar, whose centre is in its middle, and "
            f"that of yours is not: drawn rods have up to {HEAVY_ENDS:g} times as much, and at "
            f"most {apart:.3g}, with all mass in their bores; it moves the forces across the rod"
        )  # fmt: skip
    if (machine.rod_inertia_kg_m2 or 0.0) > apart > 0.0:
        yield key, (
            f"{machine.rod_inertia_kg_m2:.4g} kg m2 is more than {apart:.3g}, with all mass in the "
            "rod's bores; it is about the rod's mass centre"
        )  # fmt: skip
    if radius > LONGEST_CRANK * length:
        yield "machine.crank_radius_mm", (
            f"{radius:g} mm is {radius / length:.2g} of the rod's length, more than the usual "
            f"{LONGEST_CRANK:g}: the crank radius is half the stroke"
        )  # fmt: skip


def check_body(case: Case) -> Remarks:
    """Yield what decides the levels of a body of one's own, and nobody gave or measured."""
    body, speed, key = case.body, case.machine.speed_rpm / 60.0, "body.casing_mass_kg"
    if body is None or body.mass_kg == Body().mass_kg:
        return
    default = replace(body, casing_mass_kg=None).casing_mass_kg
    if reads(case, key) and body.casing_mass_kg == default:
        yield key, (
            f"{default:g} kg is the default, a 25th of the body: levels of the sensor "
            "go as its inverse, so that they compare states of one machine, and set no alarm in "
            "m/s²; compsim calibrate finds it by a record"
        )  # fmt: skip
    if not case.counterweight:
        yield "machine.balance", (
            "nothing balances what turns with the crank, and the body moves by all of it: give the "
            "counterweight that a machine has, here or as counterweight_kg_mm"
        )  # fmt: skip
    for axis, order in itertools.product("xy", (1, 2)):
        key, turning = f"frequency_{axis}_Hz", order * speed
        natural = getattr(body, key)
        if abs(natural - turning) < NEAR_RESONANCE * turning:
            yield f"body.{key}", (
                f"{natural:g} Hz is near {turning:.3g} Hz, order {order} of the speed: "
                "the body's velocity is a resonance's, and follows its frequency and damping, "
                "which have to be measured"
            )  # fmt: skip


def check_depth(case: Case) -> Remarks:
    """Yield penetrations beside which a clearance is small."""
    for lengths in contact_depths(case):
        clearance, depth = (1000 * length for length in lengths)
        if depth > SHALLOW_CLEARANCES * clearance:
            yield "clearance_mm", (
                f"{clearance:g} mm is less than the contact gives way, about {depth:.2g} mm: the "
                "joint acts as a spring more than as a gap; check the stiffness "
                "(contact.materials), or raise the clearance"
            )  # fmt: skip


def check_rod(case: Case) -> Remarks:
    """Yield an elastic rod that would buckle."""
    if case.rod is None:
        return
    p = dry_record(case)
    euler = math.pi**2 * float(p["bending_stiffness"]) * float(p["rod_length"])
    force = greatest_force(p, "small_end")
    if force > NEAR_BUCKLING * euler:
        near = "come near" if force < euler else "are above"
        text = f"forces of up to about {force:.3g} N {near} Euler's load, {euler:.3g} N"
        yield "rod.depth_mm", f"{text}: this rod is linear and does not buckle"


def check_cards(case: Case) -> Remarks:
    """Yield what the samples of a card are, and whether they fit its cylinder."""
    for end in case.gas.cards if case.load == "gas" else ():
        texts = [text for text in (*_tell_samples(case, end), _tell_fit(case, end)) if text]
        if texts:
            yield f"gas.indicator.{end}", "; ".join(texts)


def _tell_samples(case: Case, end: str) -> Iterator[str]:
    """Yield a card's revolutions, where its pressures begin, its noise, what smoothing takes."""
    card, noise = open_card(case.gas.cards[end], end), card_noise(case, end)
    span = max(card.pressures) - min(card.pressures)
    if card.revolutions > 1:
        yield (
            f"{card.revolutions} revolutions were averaged; they scatter by {card.scatter:.2g} MPa "
            f"(rms), {100 * card.scatter / (span or math.inf):.2g} % of the card's range"
        )
    if card.is_gauge and case.gas.ambient_MPa is None:
        text = "its gauge pressures count from 1 atmosphere, 1.01325 bar"
        yield f"{text}; set gas.ambient_MPa for another"
    if noise > MAX_NOISE * span:
        force = to_si(noise, "MPa") * math.pi * to_si(case.gas.piston_radius_mm, "mm") ** 2
        yield (
            f"noise or rounding of its samples is about {noise:.2g} MPa (rms), {force:.3g} N on "
            f"the piston; smoothed over {case.gas.smooth_deg or 0.0:g} degrees: gas.smooth_deg"
        )
    top = max(card.pressures) + card.is_gauge * case.gas.ambient
    taken = top - float(gas_nodes(case, end)[:, 0].max()) / to_si(1.0, "MPa")
    if case.gas.smooth_deg and taken - PEAKS * noise > MAX_FLATTENED * span:
        yield (
            f"smoothing over {case.gas.smooth_deg:g} degrees lowers its peak by {taken:.3g} MPa, "
            f"{100 * taken / span:.2g} % of its range, and so the loads: set a smaller "
            "gas.smooth_deg"
        )


def _tell_fit(case: Case, end: str) -> str:
    """Return how a card's compression and expansion misfit its gas and clearance volume, or ""."""
    fit = fit_polytrope(case, end)
    if fit is None:
        return ""
    misfit, clearance, exponent = fit
    if misfit > MAX_MISFIT:
        says = "its compression and expansion fit no polytropic lines, whatever the clearance"
    else:
        says = (
            f"compression and expansion fit a clearance of {100 * clearance:.3g} % at an exponent "
            f"of {exponent:.3g}"
        )
    if misfit > MAX_MISFIT or not EXPONENTS[0] <= exponent <= EXPONENTS[1]:
        return (
            f"{says}: are its pressures of the unit that the column says, absolute or gauge, its "
            "angle 0 at top dead centre, the stroke the machine's?"
        )
    stroke, key = 2 * case.machine.crank_radius_mm, case.gas.clearance_key(end)
    given, row = case.gas.clearance(end, stroke) / stroke, row_of(key)
    is_given = row is not None and value_of(case, key) != row.default
    is_unlike = is_given and abs(clearance / given - 1) > MAX_UNLIKE
    return f"{says}, and {key} gives {100 * given:.3g} %" if is_unlike else ""


def check_friction(case: Case) -> Remarks:
    """Yield wear, which a run leaves out, and coefficients that friction rarely has."""
    if case.wear:
        yield "wear", "compsim wear alone reads it: a run has the clearances that are given"
    friction = case.friction
    if friction and friction.law in ("adams", "lugre") and friction.static < friction.dynamic:
        text = f"{friction.static:g} is below the dynamic one, {friction.dynamic:g}"
        yield "friction.static", f"{text}: friction grows as bodies slide"


Check = Callable[[Case], Any]  # that gives `Remarks`, or a dictionary of them
CHECKS: tuple[Check, ...] = (
    check_machine, outside_judged, paper_notes, check_body, check_depth, check_rod, check_cards,
    check_friction,
)  # fmt: skip


def remarks(case: Case) -> Iterator[tuple[Check, str, str]]:
    """Yield what is odd about a case by itself, nothing about the defaults: check, key, words."""
    for check in CHECKS:
        for key, message in dict(check(case)).items():
            yield check, key, message


def tell_cylinder(study: Study, cases: Sequence[Case]) -> Iterator[Caution]:
    """Yield the paper's bore, where a study does not give one beside its own stroke or rod."""
    lengths = ("machine.crank_radius_mm", "machine.rod_length_mm")
    own = [case for case in cases if case.load == "gas" and is_own(case, lengths)]
    given = {key for block in study.fixed for key in values_given(block)}
    given |= {axis.key for axis in study.axes}
    if own and given.isdisjoint(("gas.bore_mm", "gas.piston_radius_mm")):
        text = f"{2 * own[0].gas.piston_radius_mm:g} mm is the paper's, beside a stroke or a rod of"
        yield Caution("gas.bore_mm", f"{text} your own: give yours", len(own), len(cases))


def cautions(study: Study) -> list[Caution]:
    """Return what is odd about the selected jobs of a study, a `Caution` for each oddity.

    A key whose values look like another unit's has that remark alone, and no forces are told then.
    """
    cases = sample_cases(study, MAX_JOBS)
    units = {one.key: one for one in slips(cases)}
    found: dict[tuple[Check, str], Caution] = {}
    for case in cases:
        for check, key, message in remarks(case):
            one = found.get((check, key), Caution(key, message, 0, len(cases)))
            found[check, key] = one._replace(jobs=one.jobs + 1)
    told = []
    for (check, key), one in sorted(found.items(), key=lambda item: -item[1].jobs):
        if key in units and check is outside_judged:
            message = f"{units[key].message}; {one.message}"
            units[key] = units[key]._replace(message=message)
        elif key not in units and not (units and check is check_depth):
            told.append(one)
    return [*units.values(), *tell_cylinder(study, cases), *told]
