"""The optional groups of a case file: oil, guide, drive, rod, body, sensor and wear."""

from dataclasses import replace
from functools import partial
from typing import ClassVar

from compressor.cases.groups import AT_JOINTS
from compressor.cases.parameter import PerJoint, by_part, choice, flag, integer, make_group, number

# conditions under which a case reads a key; others stand beside their only key
PLAY = "guide.clearance_mm > 0"
ROCKING = "body.freedoms == xy_rocking"
# the guide bears no force along x
CASING_SENSED = (
    "body",
    "sensor.place == bearing or sensor.place == guide and sensor.direction == y",
)
CASING = (*CASING_SENSED, "body.casing == true")

MIN_RATIO, MAX_RATIO = 0.125, 1.0  # of a bearing's length and diameter


@make_group
class Lubricant:
    """An oil film in the joints that have clearance; a case's `lubricant`, None: they run dry.

    The film bears by rotation and squeeze; in the last part of the clearance the dry contact takes
    over. `True` stands for the defaults.
    """

    viscosity_mPa_s: float = number(
        30.0, "(0, 1e6]", "dynamic viscosity", "ISO VG 100 at about 65 °C (ISO 3448)",
        judged=(3.0, 300.0), fact=True,
    )  # fmt: skip
    bearing_length_mm: PerJoint[float] = by_part(
        PerJoint,
        number(20.0, "(0, 1e4]", "length of the bearing", "assumed: as long as wide", fact=True),
        AT_JOINTS,
    )  # fmt: skip
    last_share: float = number(
        0.02, "[0.001, 0.5]", "fraction of the clearance below which the film gets no thinner",
        judged=(0.01, 0.1),
    )  # fmt: skip


@make_group
class Guide:
    """The crosshead's guide; a case's `guide`, by default None: ideal, without friction.

    With a clearance the crosshead moves across and tilts, and its four corners meet the guide by
    ADAMS's IMPACT, whatever the joints' `contact.law`. `True` stands for the defaults, an ideal
    guide with friction.
    """

    clearance_mm: float = number(
        0.0, "[0, 100]", "clearance of the guide, on each side of the crosshead", judged=(0.01, 0.2)
    )
    friction: float = number(
        0.05, "[0, 10]", "friction coefficient of the oiled guide", judged=(0.01, 0.2)
    )
    stiction_velocity_mm_per_s: float = number(
        10.0, "(0, 1e6]", "speed at which friction is three quarters of its greatest",
        "Table 3, of the joints", read="guide.friction > 0",
    )  # fmt: skip
    crosshead_length_mm: float = number(
        120.0, "[0.001, 1e4]", "length of the crosshead", read=PLAY, judged=(60.0, 250.0)
    )
    crosshead_height_mm: float = number(
        80.0, "[0.001, 1e4]", "height of the crosshead", read=PLAY, judged=(40.0, 150.0)
    )
    crosshead_inertia_kg_m2: float | None = number(
        None, "(0, 1e9]", "inertia of the crosshead about its pin",
        "assumed: of a uniform block, m (l^2 + h^2) / 12", read=PLAY,
    )  # fmt: skip
    stiffness_N_per_mm15: float = number(
        3.36e5, "(0, 1e15]", "contact stiffness of a corner, in N/mm^exponent",
        "Table 3, of the joints", read=PLAY, judged=(3e4, 3e6),
    )  # fmt: skip
    exponent: float | None = number(
        None, "[1, 3]", "force exponent of a corner", "as the joints'", read=PLAY
    )
    damping_N_s_per_mm: float | None = number(
        None, "[0, 1e9]", "greatest contact damping of a corner", "as the joints'", read=PLAY
    )
    full_damping_mm: float | None = number(
        None, "(0, 1e3]", "penetration of full damping of a corner", "as the joints'", read=PLAY
    )


@make_group
class Drive:
    """A motor whose speed gives way; a case's `drive`, by default None: steady speed.

    The motor's torque is a line by the speed: `torque_N_m` at `machine.speed_rpm`, and more by
    `slope_N_m_s` for each rad/s that the crank is slower. `True` stands for the defaults; a
    crank that runs free has neither torque nor slope.
    """

    flywheel_kg_m2: float = number(
        5.0, "(0, 1e9]", "inertia of crank, flywheel and motor", judged=(1.0, 100.0)
    )
    torque_N_m: float = number(0.0, "[-1e9, 1e9]", "torque at machine.speed_rpm")
    slope_N_m_s: float = number(
        100.0, "[0, 1e9]", "torque added for each rad/s that the speed falls", judged=(10.0, 1e4)
    )
    unbalance_kg_mm: float = number(
        0.0, "[0, 1e9]",
        "unbalance of the crank towards its pin: mass times its centre's distance from the axis. "
        "Gravity acts on it; machine.counterweight_kg_mm is opposite",
    )  # fmt: skip


@make_group
class Rod:
    """An elastic rod; a case's `rod`, by default None: rigid.

    A bar of rectangular section: two bending modes, and two shapes of stretch. `True` stands for
    the defaults.
    """

    youngs_modulus_GPa: float = number(
        207.0, "(0, 1e6]", "modulus of elasticity", "Table 2, steel", judged=(70.0, 250.0)
    )
    depth_mm: float = number(
        40.0, "(0, 1e4]", "depth of the rod, in the plane of motion",
        "assumed: a 600 x 40 x 25 mm bar", judged=(20.0, 80.0),
    )  # fmt: skip
    width_mm: float = number(
        25.0, "(0, 1e4]", "width of the rod, across that plane", "assumed: a 600 x 40 x 25 mm bar",
        judged=(10.0, 50.0),
    )  # fmt: skip
    damping_ratio: float = number(
        0.005, "[0, 1]", "damping ratio of the first bending mode; others by stiffness",
        judged=(2e-3, 0.1),
    )  # fmt: skip


def fill_guide(guide: Guide, mass: float) -> Guide:
    """Return a guide with its crosshead's inertia, by the mass (kg) that reciprocates."""
    if guide.crosshead_inertia_kg_m2 is not None:
        return guide
    square = (guide.crosshead_length_mm / 1000) ** 2 + (guide.crosshead_height_mm / 1000) ** 2
    return replace(guide, crosshead_inertia_kg_m2=mass * square / 12)


BOLTED = "assumed: bolted to a block on firm ground"
BODIES_PER_CASING = 25.0  # mass of the body over the modal mass of a casing mode


@make_group
class Body:
    """The compressor's rigid body on its foundation; a case's `body`, None by default.

    It is driven one way: the machine's forces move it, and it does not move the machine back. A
    body for which that would be wrong, since its motion would change the force by more than 30 %
    at the speed's first two orders, is refused. `True` stands for the defaults.
    """

    freedoms: str = choice(
        "xy", ("x", "y", "xy", "xy_rocking"), "directions in which the rigid body may move"
    )
    mass_kg: float = number(500.0, "(0, 1e7]", "mass of the body")
    inertia_kg_m2: float = number(
        40.0, "(0, 1e9]", "inertia of the body about its mass centre", read=ROCKING
    )
    centre_x_mm: float = number(
        300.0, "[-1e5, 1e5]", "x of the body's mass centre, from the crank's", read=ROCKING
    )
    centre_y_mm: float = number(
        -200.0, "[-1e5, 1e5]", "y of the body's mass centre, from the crank's", read=ROCKING
    )
    frequency_x_Hz: float = number(
        60.0, "(0, 1e5]", "natural frequency along x", BOLTED, read=("body", "body.freedoms != y")
    )
    frequency_y_Hz: float = number(
        60.0, "(0, 1e5]", "natural frequency along y", BOLTED, read=("body", "body.freedoms != x")
    )
    frequency_rocking_Hz: float = number(
        20.0, "(0, 1e5]", "natural frequency of rocking", read=ROCKING
    )
    damping_ratio: float = number(0.03, "(0, 0.99]", "damping ratio of the foundation")
    casing: bool = flag(
        True, "casing modes, one at the guide and one at the main bearing, which sensors feel",
        read=CASING_SENSED,
    )  # fmt: skip
    casing_mass_kg: float | None = number(
        None, "(0, 1e6]", "modal mass of a casing mode; the sensor's level goes as its inverse",
        "program: a 25th of the body's mass", read=CASING,
    )  # fmt: skip
    casing_frequency_Hz: float = number(
        2000.0, "(0, 1e5]", "natural frequency of a casing mode", read=CASING
    )
    casing_damping_ratio: float = number(
        0.02, "(0, 0.99]", "damping ratio of a casing mode", read=CASING
    )
    start: str = choice(
        "steady", ("steady", "rest"),
        "start of the body; steady: as if the settled revolutions had always repeated; rest: at "
        "rest at time 0",
    )  # fmt: skip
    band_low_Hz: float | None = number(
        None, "[0, 1e5]", "lowest frequency of body_velocity_rms", "program: 2"
    )
    band_high_Hz: float | None = number(
        None, "(0, 1e5]", "highest frequency of body_velocity_rms", "program: 1000"
    )

    @property
    def band_Hz(self) -> tuple[float, float]:
        """Return the frequencies between which the body's velocity counts."""
        low, high = self.band_low_Hz, self.band_high_Hz
        return 2.0 if low is None else low, 1000.0 if high is None else high

    def __post_init__(self) -> None:
        """Fill in the modal mass of a casing mode."""
        if self.casing_mass_kg is None:
            vars(self)["casing_mass_kg"] = self.mass_kg / BODIES_PER_CASING


@make_group
class Sensor:
    """An accelerometer on the body, with a tacho; a case's `sensor`, None by default.

    `True` stands for the defaults.
    """

    REPORTED: ClassVar[float] = 1e-3  # of a record's samples: clipping is reported from here on

    place: str = choice(
        "guide", ("guide", "bearing", "body"),
        "place of the sensor: crosshead guide at mid-stroke, main bearing, or the body's mass "
        "centre",
    )  # fmt: skip
    direction: str = choice("y", ("x", "y"), "direction of the sensor")
    rate_Hz: float = number(25600.0, "(0, 1e6]", "sampling rate")
    low_pass_Hz: float | None = number(
        None, "(0, 1e6]", "anti-aliasing filter's corner", "usual: rate_Hz / 2.56"
    )
    mounting_Hz: float = number(25000.0, "(0, 1e6]", "mounting resonance", "usual: on a stud")
    mounting_damping_ratio: float = number(0.03, "(0, 0.99]", "damping ratio of the mounting")
    range_m_per_s2: float = number(
        490.0, "(0, 1e6]", "range of the sensor; the signal is clipped beyond it", "usual: 50 g"
    )
    noise_m_per_s2: float = number(
        0.0015, "[0, 1e6]", "rms of white noise up to half the rate", "usual: piezoelectric"
    )
    speed_jitter: float = number(
        0.0, "[0, 0.1]",
        "rms of the speed's relative deviation; drawn once a revolution and smooth between: 0.93 "
        "of it at all times, 0.81 of it in a revolution's mean speed",
        read="body.start == steady",
    )  # fmt: skip
    seed: int = integer(
        1, "[0, 2147483648]", "seed of noise and jitter",
        read="sensor.noise_m_per_s2 > 0 or sensor.speed_jitter > 0",
    )  # fmt: skip
    length_rev: int | None = integer(
        None, "[1, 10000]", "revolutions of the record; beyond the settled ones they repeat",
        "program: the settled ones",
        read="body.start == steady",
    )  # fmt: skip
    threshold_m_per_s2: float | None = number(
        None, "(0, 1e6]", "level over which a peak of the record counts (sensor_counts_per_rev)",
        "none: no peaks are counted",
    )  # fmt: skip
    second_threshold_m_per_s2: float | None = number(
        None, "(0, 1e6]", "second level over which a peak counts", "none",
        read="sensor.threshold_m_per_s2 > 0",
    )  # fmt: skip


value = partial(number, identity=False)  # of no single run


@make_group
class Wear:
    """How the rod's bores wear in joints with clearance; a case's `wear`, None by default.

    `compsim wear` opens the clearances over operating hours, by Archard's law. A single run has
    the clearances that are given. `True` stands for the defaults.
    """

    coefficient_mm3_per_N_m: float = value(
        1e-8, "(0, 1.0]",
        "wear coefficient: volume lost for each N m of normal force times sliding",
        "assumed: of oiled metals, for which tables give 1e-9 to 1e-6 (Archard, J. Appl. Phys. 24, "
        "1953, defines it)",
    )  # fmt: skip
    coefficient_factor: float = value(
        2.0, "[1, 1e6]", "factor by which the coefficient may be smaller or greater", "assumed"
    )
    limit_mm: float | None = value(
        None, "(0, 1e4]", "radial clearance at which a joint counts as worn out",
        "assumed: twice the greater clearance",
    )  # fmt: skip
    hours: float = value(50000.0, "(0, 1e9]", "operating hours after which the study ends")
    step_mm: float = value(
        0.02, "(0, 1e4]", "growth of a clearance after which the motion is computed again",
        "program",
    )  # fmt: skip
    bore_length_mm: float = value(
        20.0, "(0, 1e4]", "length of the bores", "assumed: as long as wide"
    )


def fill_wear(wear: Wear, clearance_mm: PerJoint[float]) -> Wear:
    """Return the wear with its limit, by the clearances of both joints."""
    most = max(clearance_mm.big_end, clearance_mm.small_end)
    return wear if wear.limit_mm or not most else replace(wear, limit_mm=2.0 * most)
