"""What does not fit together in a case whose values are each in range, and keys nobody reads.

Keys that a case does not read: the one rule, which `keys_read` applies to jobs of files. Who reads
a key stands in the table of parameters (`read`). Where a file gives a key and none of the jobs it
is given for reads it, the file's author believes in what does not count.
"""

import contextlib
import itertools
import math
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from compressor.cases.card import DRIVING, CardError, open_card, taken_work
from compressor.cases.checks import TWICE, row_of, stands_for, value_of
from compressor.cases.comparison import condition
from compressor.cases.groups import CRANK_END, ENDS
from compressor.cases.laws import CYLINDRICAL, READ_BY, RESTITUTING
from compressor.cases.optional_groups import MAX_RATIO, MIN_RATIO
from compressor.cases.parameter import IMPLAUSIBLE, LED
from compressor.cases.table import GROUPS, READ, WORDS, table
from compressor.cases.yaml_reader import Problem, is_number
from compressor.metrics import AXES, JOINTS

Case = Any  # that of `compressor.cases.case`, which needs these rules


# what two materials make, and so facts, too
OF_MATERIALS = ("contact.modulus_GPa", "contact.stiffness_N_per_mm15", "contact.geometry")
# what is part of a job's key only where the job reads it: facts, and what follows from them
FACT_KEYS = [key for key, row in table().items() if row.fact or key in OF_MATERIALS]


def needs_of_given(key: str, given: Container[str]) -> list[tuple[str, str]]:
    """Return which of the `conditions` must hold where a file gives one value of a key.

    Of a fact none but that there is gas, and that a rod's single action is meant. given: the dotted
    keys of the file.
    """
    strict = ["load == gas"] if "gas.action" in given else ["load == gas", CRANK_END]
    row = row_of(key)
    return [one for one in conditions(key) if not (row and row.fact) or one[1] in strict]


@cache
def conditions(key: str) -> list[tuple[str, str]]:
    """Return what holds where a case reads a key, each with what is unread where it does not.

    A key by part is read where one of the parts is.
    """
    group = key.partition(".")[0]
    whole = READ.get(group, ())
    if key in GROUPS:
        return [(key, one) for one in whole]
    rows = [table()[part] for part in stands_for(key) or (key,)]
    rows = rows[:1] if key == LED else rows
    shared = [one for one in rows[0].read if all(one in row.read for row in rows)]
    # of each part one, which may have alternatives of its own, or of none
    own = " or ".join(one for row in rows for one in row.read if one not in shared)
    either = [" or ".join(dict.fromkeys(own.split(" or ")))] if own else []
    return [(group if one in whole else key, one) for one in (*shared, *either)]


def reads(case: Case, key: str) -> bool:
    """Return whether a case reads a key."""
    return all(condition(one)(case) for _, one in conditions(key))


def is_off(key: str, value: Any) -> bool:
    """Return whether a value says that there is none of something, as is so by default."""
    row = row_of(key)
    return not value and not (row and row.default)


def problem_of(key: str, needed: str) -> Problem:
    """Return the problem of a key or group that nothing reads."""
    what = "group" if key in GROUPS else "key"
    remedy = f"set that, or leave the {what} out"
    return Problem(key, f"nothing reads this {what}: it needs {needed}; {remedy}")


def unread_values(
    case: Case, values: Mapping[str, Any], given: Container[str]
) -> Iterator[Problem]:
    """Yield a problem for each key of one case that it does not read.

    values: those that the case has to read, of all `given`, by dotted key. A value that the case
    would have without it passes, so that `Case.values` reads back; a group that a case has only if
    it is named does not, whatever its values.
    """
    for key, value in values.items():
        for unread, needed in needs_of_given(key, given):
            if condition(needed)(case):
                continue
            named = unread in WORDS and WORDS[unread]
            off = is_off(key, value) and (key == unread or not named)
            if not off and (named or value != default_in(case, key)):
                yield problem_of(unread, needed)
            break


def default_in(case: Case, key: str) -> Any:
    """Return the value that a case would have of a key if it were not given."""
    row = row_of(key)
    group, _, name = key.rpartition(".")
    within = getattr(case, group, None) if row else None
    if row is None or row.default is not None or within is None:
        return row.default if row else None
    without: Any = {group: replace(within, **{name: None})}
    return getattr(getattr(replace(case, **without), group), name)


def outside_judged(case: Case) -> dict[str, str]:
    """Return the keys that a case reads with values outside the judged range, with a sentence each.

    A sentence continues the key: "262 kg is outside the range that the program was judged on, 0.1
    to 200 kg".
    """
    found = {}
    for key, row in table().items():
        value: Any = value_of(case, key) if row.judged else None
        if row.judged is None or not is_number(value) or is_off(key, value):
            continue
        if key == "contact.stiffness_N_per_mm15" and case.contact.exponent != 1.5:
            continue  # the stiffness has another unit
        low, high = row.judged
        is_inside = low * (1 - 1e-9) <= value <= high * (1 + 1e-9)
        if not is_inside and reads(case, key) and (value or key != "guide.friction"):
            unit = f" {row.unit}".replace("^p", "^1.5").rstrip()
            whole = key.rpartition(".")[0]
            is_shared = stands_for(whole) and value_of(case, whole) is not None
            found[whole if is_shared else key] = (
                f"{value:g}{unit} is outside the range that the program was judged on, "
                f"{low:g} to {high:g}{unit}"
            )
    return found


Rules = Iterator[tuple[str, str]]  # of a case: a key, and what does not fit of it
MIN_BAR_INERTIA = 1.0 - 1e-9  # of a uniform bar's inertia, which an elastic rod has at least
# One key, and the other whose place it takes; a case gives one of the two.
IN_PLACE_OF = (
    ("solve.duration_s", "solve.duration_rev"),
    ("solve.output_step_s", "solve.output_step_deg"),
    ("solve.rtol", "solve.accuracy"),
    ("contact.materials", "contact.stiffness_N_per_mm15"),
    ("contact.materials", "contact.modulus_GPa"),
    ("gas.clearance_percent.head", "gas.head_clearance_mm"),
    ("machine.balance", "machine.counterweight_kg_mm"),
)
# keys that decide where the corners of the gas cycle lie
OF_CORNERS = (
    "machine.crank_radius_mm", "machine.rod_length_mm", "gas.head_clearance_mm", "gas.suction_MPa",
    "gas.discharge_MPa", "gas.exponent",
)  # fmt: skip
MIN_SAMPLES = 4  # of a sensor, in a revolution
MAX_MOVING_SHARE = 0.1  # the moving parts' share of a body's mass
MAX_BACK_ACTION = 0.3  # of a force that a body's motion may change at the speed's first two orders
MAX_STAGE_RATIO = 11.0  # of a stage's pressures; more may be bar for MPa
MAX_REVOLUTIONS_TOLD = 1e9  # revolutions, more than any run has
SETTLING_REV = 3.0  # that `settle_rev: auto` compares at least


@cache
def given_conflicts(joint: str, given: frozenset[str]) -> Sequence[Problem]:
    """Return what is missing beside a joint, and keys of which a case gives one; given: dotted."""
    needed = [f"clearance_mm.{one}" for one in JOINTS if joint in (one, "both")]
    what = f"is needed with joint: {joint}; give it in mm, such as 0.2"
    return [Problem(key, what) for key in needed if key not in given] + [
        Problem(one, TWICE.format(other))
        for one, other in IN_PLACE_OF
        if one in given and other in given
    ]


def machine_rules(case: Case) -> Rules:
    """Yield a default inertia out of its range, and lengths with which the mechanism locks."""
    machine, play = case.machine, _play(case)
    key, inertia = "machine.rod_inertia_kg_m2", machine.rod_inertia_kg_m2
    if message := table()[key].check(inertia):
        yield key, f"m L^2 / 12 of the rod: {message}"
    if machine.crank_radius_mm + play >= machine.rod_length_mm:
        is_play = machine.crank_radius_mm < machine.rod_length_mm
        loose = f" and {play:g} mm of clearance" if is_play else ""
        yield (
            "machine.crank_radius_mm",
            f"the crank, {machine.crank_radius_mm:g} mm{loose}, must be shorter than the rod, "
            f"{machine.rod_length_mm:g} mm, or the mechanism locks",
        )
    if (machine.rod_centre_mm or 0) > machine.rod_length_mm:
        yield (
            "machine.rod_centre_mm",
            f"{machine.rod_centre_mm:g} mm: the mass centre lies beyond the rod's small end, at "
            f"{machine.rod_length_mm:g} mm",
        )


def clearance_rules(case: Case) -> Rules:
    """Yield clearances that do not fit the pin or its journal's start."""
    for joint in JOINTS:
        key, clearance = f"clearance_mm.{joint}", getattr(case.clearance_mm, joint)
        if not clearance:
            continue
        pin = case.machine.pin_radius_mm.at(joint)
        if clearance > pin:
            told = f"; {clearance:g} µm are {clearance / 1000:g} mm" * (clearance >= 1.0)
            yield key, f"{clearance:g} mm exceeds the pin radius, {pin:g} mm: lower it{told}"
        shift = math.hypot(*(getattr(case.initial_offset_mm, f"{joint}_{axis}") for axis in AXES))
        if clearance < shift - IMPLAUSIBLE * pin:
            yield (
                f"initial_offset_mm.{joint}_x",
                f"shifts the journal by {shift:g} mm, {shift - clearance:.3g} mm into its bearing, "
                f"more than a tenth of the pin radius; lower it, or raise {key}",
            )


def load_rules(case: Case) -> Rules:
    """Yield what does not fit the stroke, or together in a cylinder."""
    gas, stroke = case.gas, 2 * case.machine.crank_radius_mm
    if case.load == "spring" and case.spring.stroke_mm >= stroke:
        yield (
            "spring.stroke_mm",
            f"{case.spring.stroke_mm:g} mm must be less than the piston's stroke, {stroke:g} mm",
        )
    if case.load != "gas":
        return
    if gas.presses("crank"):
        rod, bore = gas.rod_diameter_mm, 2 * gas.piston_radius_mm
        if rod is None:
            text = f"is needed with action: {gas.action}; give it in mm, such as {bore / 4:g}"
            yield "gas.rod_diameter_mm", text
        elif rod >= bore:
            yield "gas.rod_diameter_mm", f"{rod:g} mm must be less than the bore, {bore:g} mm"
    yield from card_rules(case) if gas.is_measured else cycle_rules(case)


def cycle_rules(case: Case) -> Rules:
    """Yield clearances and pressures with which an ideal cycle has no corners."""
    gas, play, stroke = case.gas, _play(case), 2 * case.machine.crank_radius_mm
    for end in filter(gas.presses, ENDS):
        clearance, each = gas.clearance(end, stroke), gas.clearance_percent
        if each and end == "crank" and each.crank is None:
            text = f"is needed with action: {gas.action} and a clearance of the head"
            yield "gas.clearance_percent.crank", text
        elif clearance <= play:
            cover = "head" if end == "head" else "cover at the crank end"
            key, remedy = gas.clearance_key(end), "raise it"
            if "percent" in key and clearance < 0.01 * stroke:
                remedy += "; it is in per cent of the swept volume: 17, not 0.17"
            yield (
                key,
                f"{clearance:g} mm does not exceed the clearances, {play:g} mm in all: the piston "
                f"would reach the cylinder {cover}, where the gas force has no bound; {remedy}",
            )
    if gas.unloaded not in (None, "none") and not gas.presses(gas.unloaded):
        text = f"no gas presses in the {gas.unloaded} end with action: {gas.action}"
        yield "gas.unloaded", text
    if gas.discharge_MPa <= gas.suction_MPa:
        text = f"{gas.discharge_MPa:g} MPa must exceed suction_MPa, {gas.suction_MPa:g} MPa"
        yield "gas.discharge_MPa", text
    elif gas.switching == "exact":
        suction, discharge = gas.open_pressures
        growth, told = (discharge / suction) ** (1 / gas.exponent), ""
        if gas.discharge_MPa > MAX_STAGE_RATIO * gas.suction_MPa:
            told = (
                f"; suction_MPa {gas.suction_MPa:g} and discharge_MPa {gas.discharge_MPa:g} are "
                "absolute and in MPa: 7 bar is 0.7"
            )
        for end in gas.compressing_ends:
            clearance = gas.clearance(end, stroke)
            if clearance * growth >= stroke + clearance:
                yield (
                    gas.clearance_key(end),
                    f"the gas left at the {end} never expands to the suction pressure; "
                    f"lower it, or the pressure ratio{told}",
                )
    elif gas.is_cylinder or any(value_of(case, key) != table()[key].default for key in OF_CORNERS):
        yield (
            "gas.switching",
            "the printed corners hold for the paper's geometry and pressures only; "
            "set switching: exact",
        )


def card_rules(case: Case) -> Rules:
    """Yield a card that is missing, or of an engine: each end in which gas presses has one."""
    for end in filter(case.gas.presses, ENDS):
        if end not in case.gas.cards:
            yield (
                f"gas.indicator.{end}",
                f"is needed with action: {case.gas.action}, the other end being measured; write "
                "indicator: {head: head.csv, crank: crank.csv}; a file of both may stand twice",
            )
            continue
        with contextlib.suppress(CardError):  # of a file that is gone, which a run tells
            card = open_card(case.gas.cards[end], end)
            lengths = case.machine.crank_radius_mm, case.machine.rod_length_mm
            if lengths[0] < lengths[1] and (share := taken_work(card, end, *lengths)) < DRIVING:
                yield (
                    f"gas.indicator.{end}",
                    f"the gas would drive the machine: it gives {-share:.2g} times pressure range "
                    f"and stroke in a revolution; is it the {'crank' if end == 'head' else 'head'} "
                    "end's card, or its angle not 0 at top dead centre?",
                )


def time_rules(case: Case) -> Rules:
    """Yield durations, output steps and settling times that do not divide each other."""
    solve = case.solve
    span_key = "solve.duration_s" if solve.duration_s is not None else "solve.duration_rev"
    step_key = "solve.output_step_s" if solve.output_step_s is not None else "solve.output_step_deg"
    steps, duration = case.steps, case.duration
    if not steps <= 1e8:  # which may be inf, or nan
        yield step_key, f"makes {steps:.3g} samples; at most 1e8: lengthen it"
    elif round(steps) < 1:
        yield step_key, f"is longer than the duration, {duration:g} s: shorten it"
    elif abs(steps - round(steps)) > 1e-6 * max(1.0, 1e-3 * steps):
        yield (
            step_key,
            f"the duration is {steps:.6g} output steps, not a whole number of them: "
            "choose a step that divides it",
        )
    if solve.settle_rev == "auto" and duration < SETTLING_REV * case.turn * (1 - 1e-12):
        text = f"auto compares {SETTLING_REV:g} revolutions; lengthen {span_key}"
        yield "solve.settle_rev", text
    if solve.duration_rev == "auto" or (solve.settle_rev == "auto" and solve.duration_s is None):
        each = steps * case.turn / duration
        if abs(each - round(each)) > 1e-6:
            text = f"a revolution is {each:.6g} output steps; auto needs a whole number of them"
            yield step_key, text
    if case.settle >= duration * (1 - 1e-12):
        yield (
            "solve.settle_rev",
            f"{solve.settle_rev:g} revolutions leave nothing of a run of "
            f"{duration / case.turn:g}; lengthen {span_key}, or shorten settle_rev",
        )


def body_rules(case: Case) -> Rules:
    """Yield what a body and its sensor need; one that would move the machine back is refused."""
    body, sensor = case.body, case.sensor
    if body is None:
        return
    moving = case.machine.rod_mass_kg + case.machine.reciprocating_mass_kg
    share = moving / body.mass_kg
    if share > MAX_MOVING_SHARE:
        much = f"{share:.3g} times" if share >= 1 else f"{100 * share:.2g} % of"
        yield (
            "body.mass_kg",
            f"the moving parts, {moving:.6g} kg, have {much} the body's mass; it is driven one "
            f"way, which holds up to {100 * MAX_MOVING_SHARE:g} %: give a heavier body, in kg",
        )
    axes = sorted({*body.freedoms[:2]} & {*AXES}) if share <= MAX_MOVING_SHARE else ()
    for axis, order in itertools.product(axes, (1, 2)):
        frequency, key = order * case.machine.speed_rpm / 60.0, f"frequency_{axis}_Hz"
        # A body that accelerates by a takes the moving parts m along, so that the force on it is
        # X - m a. With a = -X G / M, G = f^2 / (f_n^2 - f^2 + 2 i zeta f f_n), that is a relative
        # change of m G / M, and one coupled both ways moves as one driven one way over 1 - m G / M.
        natural = getattr(body, key)
        stiffness = natural**2 - frequency**2 + 2j * body.damping_ratio * frequency * natural
        back = abs(share * frequency**2 / stiffness)
        if back > MAX_BACK_ACTION:
            yield (
                f"body.{key}",
                f"order {order} of the speed, {frequency:.3g} Hz at {case.machine.speed_rpm:.6g} "
                "rpm, is so near that the body would change the force that drives it by "
                f"{100 * back:.0f} %; move {key}, give a heavier body, or leave body and sensor "
                "out",
            )
    # `auto` settles at a whole revolution, and measures whole ones from there on
    span = (case.duration - case.settle) / case.turn
    whole = abs(span) < MAX_REVOLUTIONS_TOLD and abs(span - round(span)) <= 1e-9
    if body.start == "steady" and not whole:
        yield (
            "body.start",
            "steady repeats whole settled revolutions: give duration_rev and settle_rev as whole "
            "numbers or auto, or set start: rest",
        )
    low, high = body.band_Hz
    if low >= high:
        yield (
            "body.band_high_Hz" if body.band_low_Hz is None else "body.band_low_Hz",
            f"the band of body_velocity_rms would be {low:g} to {high:g} Hz: give band_low_Hz less "
            "than band_high_Hz",
        )
    if case.drive:
        yield (
            "body",
            "moves in equal steps of time, which a drive whose speed gives way has not: leave out "
            "body or drive",
        )
    if sensor and sensor.low_pass_Hz is not None and sensor.low_pass_Hz >= sensor.rate_Hz / 2:
        yield "sensor.low_pass_Hz", "must be less than half of rate_Hz"
    if sensor and (count := sensor.rate_Hz * case.turn) < MIN_SAMPLES:
        text = f"{sensor.rate_Hz:g} Hz are {count:.3g} samples a revolution, too few: is it in kHz?"
        yield "sensor.rate_Hz", text


def contact_rules(case: Case) -> Rules:
    """Yield what a law of contact lacks, or cannot have."""
    contact = case.contact
    needed = f"is needed with contact.law: {contact.law}; give it, such as"
    if contact.law in CYLINDRICAL and contact.length_mm is None:
        yield "contact.length_mm", f"{needed} 20"
    if contact.law in CYLINDRICAL and contact.materials is None and contact.modulus_GPa is None:
        yield "contact.materials", f"{needed} [steel, copper], or give modulus_GPa"
    if contact.law in RESTITUTING and contact.restitution is None:
        yield "contact.restitution", f"{needed} 0.9"
    if contact.materials is not None and contact.exponent != 1.5:
        yield (
            "contact.exponent",
            f"is {contact.exponent:g}, but Eq. 15's stiffness from materials needs exponent 1.5: "
            "leave it out, or give stiffness_N_per_mm15 in place of materials",
        )


def friction_rules(case: Case) -> Rules:
    """Yield coefficients and speeds with which a law of friction has no value."""
    friction = case.friction
    if not friction:
        return
    if friction.law == "lugre" and bool(friction.static) != bool(friction.dynamic):
        yield (
            f"friction.{'dynamic' if friction.static else 'static'}",
            "is 0 and the other coefficient is not: LuGre's bristles divide by it; give more than "
            "0, or 0 for both",
        )
    if friction.law == "lugre" and friction.ideal_joints:
        yield (
            "friction.ideal_joints",
            "have no bristles, as friction.law: lugre needs: choose another law, or leave the key "
            "out",
        )
    slow, fast = friction.stiction_velocity_mm_per_s, friction.friction_velocity_mm_per_s
    if friction.law in READ_BY["friction"]["friction_velocity_mm_per_s"] and fast <= slow:
        yield (
            "friction.friction_velocity_mm_per_s",
            f"{fast:g} mm/s must exceed the stiction_velocity_mm_per_s, {slow:g} mm/s",
        )


def bore_rules(case: Case) -> Rules:
    """Yield bearings for which the film's numbers do not hold, and bores that cannot wear."""
    film, wear = case.lubricant, case.wear
    for joint in JOINTS:
        width = 2.0 * case.machine.pin_radius_mm.at(joint)
        length = film.bearing_length_mm.at(joint) if film else width
        if case.joint in (joint, "both") and not MIN_RATIO <= length / width <= MAX_RATIO:
            key = f"lubricant.bearing_length_mm.{joint}"
            text = (
                f"is {length / width:.3g} times the diameter of the pin, {width:g} mm; the film's "
                f"numbers hold from {MIN_RATIO:g} to {MAX_RATIO:g} times"
            )
            if length == table()[key].default:
                default = f"{length:g} mm is the default, of the paper's"
                text += f"; {default} pin: give the length that bears"
            yield key, text
    if wear and film:
        yield (
            "wear",
            "of a bore that runs dry is known, not that of one whose film parts journal and bore: "
            "leave out lubricant or wear",
        )
    most = max(case.clearance_mm.big_end, case.clearance_mm.small_end)
    if wear and wear.limit_mm is not None and wear.limit_mm <= most:
        yield (
            "wear.limit_mm",
            f"{wear.limit_mm:g} mm must be more than the clearance, {most:g} mm: it is what the "
            "clearance grows to",
        )


def rod_rules(case: Case) -> Rules:
    """Yield numbers of an elastic rod that no uniform bar has."""
    machine = case.machine
    if not case.rod:
        return
    if machine.rod_centre_mm != machine.rod_length_mm / 2:
        yield "machine.rod_centre_mm", "an elastic rod is a uniform bar: leave the key out"
    least = machine.rod_mass_kg * (machine.rod_length_mm / 1000) ** 2 / 12
    if (machine.rod_inertia_kg_m2 or 0.0) < MIN_BAR_INERTIA * least:
        yield (
            "machine.rod_inertia_kg_m2",
            f"an elastic rod is a uniform bar, which has {least:.4g} kg m2 at least: leave the key "
            "out",
        )


def _play(case: Case) -> float:
    """Return how much farther than ideal joints those with clearance let the crosshead go (mm)."""
    return case.clearance_mm.big_end + case.clearance_mm.small_end


RULES: tuple[Callable[[Case], Rules], ...] = (
    machine_rules, clearance_rules, load_rules, time_rules, body_rules, contact_rules,
    friction_rules, bore_rules, rod_rules,
)  # fmt: skip
