"""What does not fit together in a case whose values are each in range."""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from types import FunctionType
from typing import Any, cast

from compressor.cases.law_conflicts import (
    contact_conflicts,
    friction_conflicts,
    law_conflicts,
)
from compressor.cases.mechanism_conflicts import (
    lubricant_conflicts,
    mechanism_conflicts,
    wear_conflicts,
)
from compressor.cases.one_way import back_action, moving_mass
from compressor.cases.parameter import IMPLAUSIBLE, Problem
from compressor.cases.table import GROUPS, Settings, table
from compressor.cases.unread import unread_values
from compressor.metrics import AXES, JOINTS

# One key, and the other whose place it takes; a case gives one of the two.
IN_PLACE_OF = (
    ("solve.duration_s", "solve.duration_rev"),
    ("solve.output_step_s", "solve.output_step_deg"),
    ("solve.rtol", "solve.accuracy"),
    ("contact.materials", "contact.stiffness_N_per_mm15"),
    ("contact.materials", "contact.modulus_GPa"),
)
HEAVIEST = 0.1  # the moving parts' share of a body's mass
MOST_BACK = 0.3  # of a force that a body's motion may change at the speed's first two orders
MANY = 1e9  # revolutions, more than any run has
SETTLING_REV = 3.0  # that `settle_rev: auto` compares at least


# keys that a case fills in where others are not given or not used, and those that decide it
FILLED_IN = {
    "machine.rod_centre_mm": ("machine.rod_length_mm",),
    "machine.rod_inertia_kg_m2": ("machine.rod_mass_kg", "machine.rod_length_mm"),
    "body.casing_mass_kg": ("body.mass_kg",),
    **{f"clearance_mm.{joint}": ("joint",) for joint in JOINTS},
}


def conflicts(
    case: Settings,
    given: frozenset[str],
    values: Mapping[str, Any],
    wrong: frozenset[str] = frozenset(),
) -> Iterator[Problem]:
    """Find everything in a case that does not fit together.

    given: the dotted keys set by hand. values: those of them that the case has to read. wrong:
    keys, or whole groups, in whose place the case holds defaults; what does not fit is found among
    the others alone.
    """
    if not wrong:
        for rule in RULES:
            yield from rule(case, given)
        yield from unread_values(case, values)
        return
    undecided = _undecided(wrong)
    known = cast(Settings, _Known(case, undecided))
    for rule in RULES:
        with contextlib.suppress(_Unknown):
            yield from rule(known, given)
    for key, value in values.items():
        if not undecided & {str(key), str(key).partition(".")[0]}:
            with contextlib.suppress(_Unknown):
                yield from unread_values(known, {key: value})


def _undecided(wrong: frozenset[str]) -> frozenset[str]:
    """Return the keys of which nothing is known where some are wrong: these, and what they
    decide.
    """
    filled_in = {key for key, by in FILLED_IN.items() if wrong & {*by, "machine"}}
    rivals = {pair[not place] for pair in IN_PLACE_OF for place in (0, 1) if pair[place] in wrong}
    return wrong | filled_in | rivals


class _Unknown(Exception):
    """Ends a rule that reads what is wrong."""


class _Known:
    """A case, or a group of one, of which some values are wrong: to read those raises _Unknown."""

    def __init__(self, values: Any, wrong: frozenset[str], prefix: str = ""):
        self._values, self._wrong, self._prefix = values, wrong, prefix

    def __getattr__(self, name: str) -> Any:
        key = self._prefix + name
        if key in self._wrong:
            raise _Unknown(key)
        made = getattr(type(self._values), name, None)
        if isinstance(made, property) and made.fget:
            return made.fget(self)
        if isinstance(made, FunctionType):
            return partial(made, self)
        value = getattr(self._values, name)
        return _Known(value, self._wrong, f"{key}.") if key in GROUPS and value else value


def _body_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    """Yield what a body and its sensor need; one that would move the machine back is refused."""
    body, sensor = case.body, case.sensor
    if body is None:
        return
    if case.output.keep != "series":
        yield Problem("body", "moves in time series: it needs output.keep: series")
    share = moving_mass(case) / body.mass_kg
    if share > HEAVIEST:
        yield Problem(
            "body.mass_kg",
            f"the moving parts have {100 * share:.2g} % of the body's mass; it is driven one way, "
            f"which holds up to {100 * HEAVIEST:g} %: give a heavier body",
        )
    for axis in sorted({*body.freedoms[:2]} & {*AXES}):
        yield from _resonance_conflicts(case, axis)
    # `auto` settles at a whole revolution, and measures whole ones from there on
    span = (case.duration - case.settle) / case.turn
    whole = abs(span) < MANY and abs(span - round(span)) <= 1e-9
    if body.start == "steady" and not whole:
        yield Problem(
            "body.start",
            "steady repeats whole settled revolutions: give duration_rev and settle_rev as whole "
            "numbers or auto, or set start: rest",
        )
    if sensor is None:
        return
    if sensor.low_pass_Hz is not None and sensor.low_pass_Hz >= sensor.rate_Hz / 2:
        yield Problem("sensor.low_pass_Hz", "must be less than half of rate_Hz")


def _resonance_conflicts(case: Settings, axis: str) -> Iterator[Problem]:
    """Yield the first two orders of the speed carry most of the shaking force."""
    for order in (1, 2):
        frequency = order * case.machine.speed_rpm / 60.0
        back = abs(back_action(case, axis, frequency))
        if back > MOST_BACK:
            key = f"frequency_{axis}_Hz"
            yield Problem(
                f"body.{key}",
                f"order {order} of the speed, {frequency:.3g} Hz, is so near that the "
                f"body would change the force that drives it by {100 * back:.2g} %; "
                f"move {key}, or give a heavier body",
            )


def _inertia_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    """Yield a default inertia may leave the range that a given one must keep."""
    key, inertia = "machine.rod_inertia_kg_m2", case.machine.rod_inertia_kg_m2
    if inertia is None or not table()[key].holds(inertia):
        yield Problem(key, f"m L^2 / 12 of the rod: {table()[key].check(inertia)}")


def _geometry_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    machine, play = case.machine, _play(case)
    if machine.crank_radius_mm + play >= machine.rod_length_mm:
        loose = f" and {play:g} mm of clearance" if play else ""
        yield Problem(
            "machine.crank_radius_mm",
            f"the crank, {machine.crank_radius_mm:g} mm{loose}, must be shorter than the rod, "
            f"{machine.rod_length_mm:g} mm, or the mechanism locks",
        )
    if (machine.rod_centre_mm or 0) > machine.rod_length_mm:
        yield Problem(
            "machine.rod_centre_mm",
            f"{machine.rod_centre_mm:g} mm: the mass centre lies beyond the rod's small end, at "
            f"{machine.rod_length_mm:g} mm",
        )


def _clearance_conflicts(case: Settings, given: frozenset[str], joint: str) -> Iterator[Problem]:
    clearance, pin = getattr(case.clearance_mm, joint), case.machine.pin_radius(joint)
    key = f"clearance_mm.{joint}"
    if clearance > pin:
        yield Problem(key, f"{clearance:g} mm exceeds the pin radius, {pin:g} mm: lower it")
    x, y = (getattr(case.initial_offset_mm, f"{joint}_{axis}") for axis in "xy")
    shift = (x * x + y * y) ** 0.5
    if 0 < clearance < shift - IMPLAUSIBLE * pin:
        yield Problem(
            f"initial_offset_mm.{joint}_x",
            f"shifts the journal by {shift:g} mm, {shift - clearance:.3g} mm into its bearing, "
            f"more than a tenth of the pin radius; lower it, or raise {key}",
        )


def _missing_clearance(case: Settings, given: frozenset[str], joint: str) -> Iterator[Problem]:
    key = f"clearance_mm.{joint}"
    worn = case.joint in (joint, "both")
    if worn and not getattr(case.clearance_mm, joint) and key not in given:
        yield Problem(key, f"is needed with joint: {case.joint}; give it in mm, such as 0.2")


def _choice_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    for one, other in IN_PLACE_OF:
        if one in given and other in given:
            yield Problem(one, f"stands in place of {other}: give one of the two")


def _load_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    machine, gas = case.machine, case.gas
    if case.load == "spring" and case.spring.stroke_mm >= 2 * machine.crank_radius_mm:
        yield Problem(
            "spring.stroke_mm",
            f"{case.spring.stroke_mm:g} mm must be less than the piston's stroke, "
            f"{2 * machine.crank_radius_mm:g} mm",
        )
    if case.load != "gas":
        return
    play = _play(case)
    if gas.head_clearance_mm <= play:
        yield Problem(
            "gas.head_clearance_mm",
            f"{gas.head_clearance_mm:g} mm does not exceed the clearances, {play:g} mm in all: the "
            "piston would reach the cylinder head, where the gas force has no bound; raise it",
        )
    if gas.discharge_MPa <= gas.suction_MPa:
        yield Problem(
            "gas.discharge_MPa",
            f"{gas.discharge_MPa:g} MPa must exceed suction_MPa, {gas.suction_MPa:g} MPa",
        )
    elif gas.switching == "exact":
        full = 2 * machine.crank_radius_mm + gas.head_clearance_mm
        growth = (gas.discharge_MPa / gas.suction_MPa) ** (1 / gas.exponent)
        if gas.head_clearance_mm * growth >= full:
            yield Problem(
                "gas.head_clearance_mm",
                "the gas left at the head never expands to the suction pressure; "
                "lower it, or the pressure ratio",
            )
    elif _gas_geometry(case) != _gas_geometry(Settings()):
        yield Problem(
            "gas.switching",
            "the printed corners hold for the paper's geometry and pressures only; "
            "set switching: exact",
        )


def _play(case: Settings) -> float:
    """Return how much farther than ideal joints those with clearance let the crosshead go (mm)."""
    return case.clearance_mm.big_end + case.clearance_mm.small_end


def _gas_geometry(case: Settings) -> tuple[float, ...]:
    """Return what decides where the gas cycle's corners lie."""
    gas, machine = case.gas, case.machine
    return (
        machine.crank_radius_mm,
        machine.rod_length_mm,
        gas.head_clearance_mm,
        gas.suction_MPa,
        gas.discharge_MPa,
        gas.exponent,
    )


def _time_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    solve = case.solve
    span_key = "solve.duration_s" if solve.duration_s is not None else "solve.duration_rev"
    step_key = "solve.output_step_s" if solve.output_step_s is not None else "solve.output_step_deg"
    if not case.steps <= 1e8:  # which may be inf, or nan
        yield Problem(step_key, f"makes {case.steps:.3g} samples; at most 1e8: lengthen it")
    elif round(case.steps) < 1:
        yield Problem(step_key, f"is longer than the duration, {case.duration:g} s: shorten it")
    elif abs(case.steps - round(case.steps)) > 1e-6 * max(1.0, 1e-3 * case.steps):
        yield Problem(
            step_key,
            f"the duration is {case.steps:.6g} output steps, not a whole number of them: "
            "choose a step that divides it",
        )
    if solve.settle_rev == "auto" and case.duration < SETTLING_REV * case.turn * (1 - 1e-12):
        text = f"auto compares {SETTLING_REV:g} revolutions; lengthen {span_key}"
        yield Problem("solve.settle_rev", text)
    if solve.duration_rev == "auto" or (solve.settle_rev == "auto" and solve.duration_s is None):
        each = case.steps * case.turn / case.duration
        if abs(each - round(each)) > 1e-6:
            text = f"a revolution is {each:.6g} output steps; auto needs a whole number of them"
            yield Problem(step_key, text)
    if case.settle >= case.duration * (1 - 1e-12):
        revolutions = case.duration / case.turn
        yield Problem(
            "solve.settle_rev",
            f"{solve.settle_rev:g} revolutions leave nothing of a run of {revolutions:g}; "
            f"lengthen {span_key}, or shorten settle_rev",
        )


Rule = Callable[[Settings, frozenset[str]], Iterator[Problem]]
RULES: tuple[Rule, ...] = (
    _inertia_conflicts, _geometry_conflicts,
    *(partial(rule, joint=joint) for joint in JOINTS
      for rule in (_missing_clearance, _clearance_conflicts)),
    _choice_conflicts, _load_conflicts, _time_conflicts, _body_conflicts,
    law_conflicts, contact_conflicts, friction_conflicts, lubricant_conflicts, wear_conflicts,
    mechanism_conflicts,
)  # fmt: skip
