"""How far numbers of a plant's machine may be from what a case has: `compsim explain --models`."""

from functools import partial
from typing import NamedTuple


class Span(NamedTuple):
    """Two numbers that a value may well be: factors of it, or values in the case file's unit."""

    low: float
    high: float
    are_factors: bool = True

    def ends(self, value: float) -> list[float]:
        """Return the two values around one, those that are not the value itself."""
        each = [self.low * value, self.high * value] if self.are_factors else [self.low, self.high]
        return [end for end in each if abs(end - value) > 1e-9 * abs(value)]


times = Span  # a span of factors
from_to = partial(Span, are_factors=False)  # a span of values in the case file's unit


class Plausible(NamedTuple):
    """How far a number of a plant's machine may be from what a case has, and why.

    `left_out`: where the file does not give it. `given`: where it does, of what a plant can only
    guess; None of what is known where it is given. `compsim explain --models` varies both.
    """

    why: str
    left_out: Span
    given: Span | None = None


def always(why: str, span: Span) -> Plausible:
    """Return what is in doubt as much where it is given."""
    return Plausible(why, span, span)


NO_MASS = Plausible("the paper prints no masses", times(0.5, 2))
NO_MACHINE = "the default's is of no machine"
PRESSURE = always("gauges, lines and the day", times(0.95, 1.05))
CLEARANCE = always("data sheets round it, pockets and worn valves change it", times(0.8, 1.25))
CONTACT = always("no joint's contact is known better", times(0.5, 2))
SMOOTHING = Plausible("a smoothing of the law, which nobody measures", times(0.3, 3))
LENGTH = always("grooves and holes shorten what bears", times(0.5, 1.25))
FRICTION = "metals scatter, and oil lowers it"
BAR = Plausible("a rod is no bar", times(0.8, 1.25))
GROUND = Plausible("30 on a skid to 80 on rock", from_to(30, 80), times(0.7, 1.4))
HAMMER = Plausible("a hammer finds it", times(0.5, 2))

# key, of all of its parts -> where there is a doubt about it
PLAUSIBLE = {
    "machine.rod_mass_kg": NO_MASS,
    "machine.rod_centre_mm": Plausible(
        "a rod is heavier at its big end", times(0.6, 1), times(0.9, 1.1)
    ),
    "machine.rod_inertia_kg_m2": Plausible(
        "drawn rods have 1.2 to 2 times that of a uniform bar", times(1, 2.5), times(0.8, 1.25)
    ),
    "machine.reciprocating_mass_kg": NO_MASS,
    "machine.pin_radius_mm": Plausible("the paper does not print it", times(0.7, 1.5)),
    "machine.gravity_m_per_s2": Plausible("it acts on a horizontal machine", from_to(0, 9.81)),
    "machine.balance": always("no nameplate has it", from_to(0, 0.5)),
    "gas.head_clearance_mm": CLEARANCE,
    "gas.suction_MPa": PRESSURE,
    "gas.discharge_MPa": PRESSURE,
    "gas.exponent": Plausible("moist gas and cooled walls lower it", from_to(1.15, 1.4)),
    "gas.back_pressure_MPa": Plausible(
        "a crankcase has the atmosphere's, or a little more", from_to(0.09, 0.15)
    ),
    "gas.clearance_percent": CLEARANCE,
    "gas.valve_loss_percent": always(
        "no nameplate has it; valves lose up to a tenth", from_to(0, 8)
    ),
    "contact.stiffness_N_per_mm15": CONTACT,
    "contact.damping_N_s_per_mm": CONTACT,
    "contact.full_damping_mm": CONTACT._replace(given=None),
    "contact.least_approach_mm_per_s": SMOOTHING,
    "contact.length_mm": LENGTH,
    "friction.static": always(FRICTION, times(0.7, 1.5)),
    "friction.dynamic": always(FRICTION, times(0.5, 1.5)),
    "friction.stiction_velocity_mm_per_s": SMOOTHING,
    "friction.friction_velocity_mm_per_s": SMOOTHING._replace(left_out=times(0.5, 2)),
    "friction.bristle_stiffness_per_mm": SMOOTHING,
    "friction.bristle_damping_s_per_mm": SMOOTHING,
    "lubricant.viscosity_mPa_s": always(
        "it halves in 15 degrees, and a bearing's temperature is a guess", times(0.5, 2)
    ),
    "lubricant.bearing_length_mm": LENGTH,
    "lubricant.last_share": always("nobody knows the roughness", times(0.5, 2)),
    "guide.friction": Plausible("well oiled, or nearly dry", times(0.5, 3)),
    "guide.stiction_velocity_mm_per_s": SMOOTHING,
    "guide.crosshead_length_mm": Plausible(NO_MACHINE, times(0.7, 1.5)),
    "guide.crosshead_height_mm": Plausible(NO_MACHINE, times(0.7, 1.5)),
    "guide.crosshead_inertia_kg_m2": Plausible("a crosshead is no block", times(0.5, 2)),
    "guide.stiffness_N_per_mm15": Plausible("no contact of a guide is known better", times(0.3, 3)),
    "drive.flywheel_kg_m2": Plausible(NO_MACHINE, times(0.5, 2)),
    "drive.slope_N_m_s": Plausible("motors differ by their size", times(0.3, 3)),
    "rod.depth_mm": BAR,
    "rod.width_mm": BAR,
    "rod.damping_ratio": Plausible("bolts and bushes damp more than steel", times(0.4, 4)),
    "body.mass_kg": Plausible(NO_MACHINE, times(0.5, 2)),
    "body.inertia_kg_m2": Plausible(NO_MACHINE, times(0.5, 2)),
    "body.centre_x_mm": Plausible(NO_MACHINE, times(0.5, 1.5)),
    "body.centre_y_mm": Plausible(NO_MACHINE, times(0.5, 1.5)),
    "body.frequency_x_Hz": GROUND,
    "body.frequency_y_Hz": GROUND,
    "body.frequency_rocking_Hz": always("nobody computes it well", times(0.7, 1.4)),
    "body.damping_ratio": Plausible("soil damps more than steel", times(0.3, 3)),
    "body.casing_mass_kg": Plausible(
        "nobody weighs what a mode moves", times(0.2, 2), times(0.5, 2)
    ),
    "body.casing_frequency_Hz": HAMMER,
    "body.casing_damping_ratio": HAMMER,
    "sensor.mounting_Hz": Plausible("a magnet, or a hand, in place of a stud", times(0.2, 1)),
    "sensor.noise_m_per_s2": Plausible("cables, and a plant's own noise", times(1, 30)),
}
