"""The optional groups of a case file: oil, guide, drive, rod, body, sensor and wear."""

from dataclasses import replace
from functools import partial
from typing import ClassVar

from compressor.cases.groups import BEARING_LENGTH, SMOOTHING
from compressor.cases.parameter import (
    ALONG_X,
    ALONG_Y,
    AT_JOINTS,
    CASING,
    CASING_SENSED,
    GUIDE_FRICTION,
    PLAY,
    RANDOM,
    ROCKING,
    STEADY,
    THRESHOLD,
    PerJoint,
    Plausible,
    by_part,
    choice,
    document_fields,
    from_to,
    make_group,
    parameter,
    times,
)

MIN_RATIO, MAX_RATIO = 0.125, 1.0  # of a bearing's length and diameter


@document_fields
@make_group
class Lubricant:
    """An oil film in the joints that have clearance; a case's `lubricant`, None: they run dry.

    The film bears by rotation and squeeze; in its last share of the clearance the dry contact takes
    over. `True` stands for the defaults:

    >>> import compressor
    >>> case = compressor.Case.from_values(
    ...     {"joint": "big_end", "clearance_mm": 0.05, "lubricant": True}
    ... )
    >>> case.lubricant.viscosity_mPa_s
    30.0
    """

    viscosity_mPa_s: float = parameter(
        30.0, "mPa s", (0, 1e6), "ISO VG 100 at about 65 °C (ISO 3448)", "dynamic viscosity",
        above=True, judged=(3.0, 300.0),
        plausible=Plausible(
            "it halves in 15 degrees, and a bearing's temperature is a guess",
            times(0.5, 2), times(0.5, 2),
        ),
    )  # fmt: skip
    bearing_length_mm: PerJoint[float] = by_part(
        PerJoint, 20.0,
        parameter(
            20.0, "mm", (0, 1e4), "assumed: as long as wide", "length of the bearing", above=True,
            plausible=BEARING_LENGTH,
        ),
        AT_JOINTS,
    )  # fmt: skip
    last_share: float = parameter(
        0.02, "", (0.001, 0.5), "program",
        "share of the clearance below which the film gets no thinner", judged=(0.01, 0.1),
        plausible=Plausible("nobody knows the roughness", times(0.5, 2), times(0.5, 2)),
    )  # fmt: skip


PROGRAM = "program"


@document_fields
@make_group
class Guide:
    """The crosshead's guide; a case's `guide`, by default None: ideal, without friction.

    With a clearance the crosshead moves across and tilts, and its four corners meet the guide by
    ADAMS's IMPACT, whatever the joints' `contact.law`. `True` stands for the defaults, an ideal
    guide with friction:

    >>> import compressor
    >>> case = compressor.Case.from_values({"guide": {"clearance_mm": 0.1}})
    >>> round(case.guide.crosshead_inertia_kg_m2, 4)  # 14 kg (0.12^2 + 0.08^2) / 12
    0.0243
    """

    clearance_mm: float = parameter(
        0.0, "mm", (0, 100), PROGRAM, "clearance of the guide, on each side of the crosshead",
        judged=(0.01, 0.2),
    )  # fmt: skip
    friction: float = parameter(
        0.05, "", (0, 10), PROGRAM, "friction coefficient of the oiled guide", judged=(0.01, 0.2),
        plausible=Plausible("well oiled, or nearly dry", times(0.5, 3)),
    )  # fmt: skip
    stiction_velocity_mm_per_s: float = parameter(
        10.0, "mm/s", (0, 1e6), "Table 3, of the joints", "speed at which friction is three "
        "quarters of its greatest", above=True, read=GUIDE_FRICTION,
        plausible=SMOOTHING,
    )  # fmt: skip
    crosshead_length_mm: float = parameter(
        120.0, "mm", (0.001, 1e4), PROGRAM, "length of the crosshead", read=PLAY,
        judged=(60.0, 250.0),
        plausible=Plausible("the default's is of no machine", times(0.7, 1.5)),
    )  # fmt: skip
    crosshead_height_mm: float = parameter(
        80.0, "mm", (0.001, 1e4), PROGRAM, "height of the crosshead", read=PLAY,
        judged=(40.0, 150.0),
        plausible=Plausible("the default's is of no machine", times(0.7, 1.5)),
    )  # fmt: skip
    crosshead_inertia_kg_m2: float | None = parameter(
        None, "kg m2", (0, 1e9), "assumed: of a uniform block, m (l^2 + h^2) / 12",
        "inertia of the crosshead about its pin", above=True, optional=True, read=PLAY,
        plausible=Plausible("a crosshead is no block", times(0.5, 2)),
    )  # fmt: skip
    stiffness_N_per_mm15: float = parameter(
        3.36e5, "N/mm^p", (0, 1e15), "Table 3, of the joints",
        "contact stiffness of a corner, in N/mm^exponent", above=True, read=PLAY,
        judged=(3e4, 3e6),
        plausible=Plausible("no contact of a guide is known better", times(0.3, 3)),
    )  # fmt: skip
    exponent: float | None = parameter(
        None, "", (1, 3), "as the joints'", "force exponent of a corner", optional=True, read=PLAY
    )
    damping_N_s_per_mm: float | None = parameter(
        None, "N s/mm", (0, 1e9), "as the joints'", "greatest contact damping of a corner",
        optional=True, read=PLAY,
    )  # fmt: skip
    full_damping_mm: float | None = parameter(
        None, "mm", (0, 1e3), "as the joints'", "penetration of full damping of a corner",
        above=True, optional=True, read=PLAY,
    )  # fmt: skip


@document_fields
@make_group
class Drive:
    """A motor whose speed gives way; a case's `drive`, by default None: steady speed.

    The motor's torque is a line by the speed: `torque_N_m` at `machine.speed_rpm`, and more by
    `slope_N_m_s` for each rad/s that the crank is slower. `True` stands for the defaults; a
    crank that runs free has neither torque nor slope:

    >>> import compressor
    >>> free = {"slope_N_m_s": 0, "flywheel_kg_m2": 0.5}
    >>> compressor.Case.from_values({"drive": free}).drive.torque_N_m
    0.0
    """

    flywheel_kg_m2: float = parameter(
        5.0, "kg m2", (0, 1e9), PROGRAM, "inertia of crank, flywheel and motor", above=True,
        judged=(1.0, 100.0),
        plausible=Plausible("the default's is of no machine", times(0.5, 2)),
    )  # fmt: skip
    torque_N_m: float = parameter(0.0, "N m", (-1e9, 1e9), PROGRAM, "torque at machine.speed_rpm")
    slope_N_m_s: float = parameter(
        100.0, "N m s", (0, 1e9), PROGRAM, "torque added for each rad/s that the speed falls",
        judged=(10.0, 1e4),
        plausible=Plausible("motors differ by their size", times(0.3, 3)),
    )  # fmt: skip
    unbalance_kg_mm: float = parameter(
        0.0, "kg mm", (0, 1e9), PROGRAM,
        "unbalance of the crank towards its pin: mass times its centre's distance from the axis. "
        "Gravity acts on it; machine.counterweight_kg_mm is opposite",
    )  # fmt: skip


@document_fields
@make_group
class Rod:
    """An elastic rod; a case's `rod`, by default None: rigid.

    A bar of rectangular section: two bending modes, and two shapes of stretch. `True` stands for
    the defaults:

    >>> import compressor
    >>> compressor.Case.from_values({"rod": True}).rod.depth_mm
    40.0
    """

    youngs_modulus_GPa: float = parameter(
        207.0, "GPa", (0, 1e6), "Table 2, steel", "modulus of elasticity", above=True,
        judged=(70.0, 250.0),
    )  # fmt: skip
    depth_mm: float = parameter(
        40.0, "mm", (0, 1e4), "assumed: a 600 x 40 x 25 mm bar",
        "depth of the rod, in the plane of motion", above=True, judged=(20.0, 80.0),
        plausible=Plausible("a rod is no bar", times(0.8, 1.25)),
    )  # fmt: skip
    width_mm: float = parameter(
        25.0, "mm", (0, 1e4), "assumed: a 600 x 40 x 25 mm bar",
        "width of the rod, across that plane", above=True, judged=(10.0, 50.0),
        plausible=Plausible("a rod is no bar", times(0.8, 1.25)),
    )  # fmt: skip
    damping_ratio: float = parameter(
        0.005, "", (0, 1), PROGRAM, "damping ratio of the first bending mode; others by stiffness",
        judged=(2e-3, 0.1),
        plausible=Plausible("bolts and bushes damp more than steel", times(0.4, 4)),
    )  # fmt: skip


def fill_guide(guide: Guide, mass: float) -> Guide:
    """Return a guide with its crosshead's inertia, by the mass (kg) that reciprocates."""
    if guide.crosshead_inertia_kg_m2 is not None:
        return guide
    square = (guide.crosshead_length_mm / 1000) ** 2 + (guide.crosshead_height_mm / 1000) ** 2
    return replace(guide, crosshead_inertia_kg_m2=mass * square / 12)


BOLTED = "assumed: bolted to a block on firm ground"
BODIES_PER_CASING = 25.0  # mass of the body over the modal mass of a casing mode


@document_fields
@make_group
class Body:
    """The compressor's rigid body on its foundation; a case's `body`, None by default.

    It is driven one way: the machine's forces move it, and it does not move the machine back. A
    body for which that would be wrong, since its motion would change the force by more than 30 %
    at the speed's first two orders, is refused. `True` stands for the defaults:

    >>> import compressor
    >>> compressor.Case.from_values({"body": True}).body.mass_kg
    500.0
    """

    freedoms: str = choice(
        "xy", ("x", "y", "xy", "xy_rocking"), PROGRAM, "directions in which the rigid body may move"
    )
    mass_kg: float = parameter(
        500.0, "kg", (0, 1e7), PROGRAM, "mass of the body", above=True,
        plausible=Plausible("the default's is of no machine", times(0.5, 2)),
    )  # fmt: skip
    inertia_kg_m2: float = parameter(
        40.0, "kg m2", (0, 1e9), PROGRAM, "inertia of the body about its mass centre", above=True,
        read=ROCKING,
        plausible=Plausible("the default's is of no machine", times(0.5, 2)),
    )  # fmt: skip
    centre_x_mm: float = parameter(
        300.0, "mm", (-1e5, 1e5), PROGRAM, "x of the body's mass centre, from the crank's",
        read=ROCKING,
        plausible=Plausible("the default's is of no machine", times(0.5, 1.5)),
    )  # fmt: skip
    centre_y_mm: float = parameter(
        -200.0, "mm", (-1e5, 1e5), PROGRAM, "y of the body's mass centre, from the crank's",
        read=ROCKING,
        plausible=Plausible("the default's is of no machine", times(0.5, 1.5)),
    )  # fmt: skip
    frequency_x_Hz: float = parameter(
        60.0, "Hz", (0, 1e5), BOLTED, "natural frequency along x", above=True, read=ALONG_X,
        plausible=Plausible("30 on a skid to 80 on rock", from_to(30, 80), times(0.7, 1.4)),
    )  # fmt: skip
    frequency_y_Hz: float = parameter(
        60.0, "Hz", (0, 1e5), BOLTED, "natural frequency along y", above=True, read=ALONG_Y,
        plausible=Plausible("30 on a skid to 80 on rock", from_to(30, 80), times(0.7, 1.4)),
    )  # fmt: skip
    frequency_rocking_Hz: float = parameter(
        20.0, "Hz", (0, 1e5), PROGRAM, "natural frequency of rocking", above=True, read=ROCKING,
        plausible=Plausible("nobody computes it well", times(0.7, 1.4), times(0.7, 1.4)),
    )  # fmt: skip
    damping_ratio: float = parameter(
        0.03, "", (0, 0.99), PROGRAM, "damping ratio of the foundation", above=True,
        plausible=Plausible("soil damps more than steel", times(0.3, 3)),
    )  # fmt: skip
    casing: bool = choice(
        True, (), PROGRAM, "casing modes, one at the guide and one at the main bearing, "
        "which sensors feel", kind="boolean", read=CASING_SENSED,
    )  # fmt: skip
    casing_mass_kg: float | None = parameter(
        None, "kg", (0, 1e6), "program: a 25th of the body's mass", "modal mass of a casing mode; "
        "the sensor's level goes as its inverse", above=True, optional=True, read=CASING,
        plausible=Plausible("nobody weighs what a mode moves", times(0.2, 2), times(0.5, 2)),
    )  # fmt: skip
    casing_frequency_Hz: float = parameter(
        2000.0, "Hz", (0, 1e5), PROGRAM, "natural frequency of a casing mode", above=True,
        read=CASING,
        plausible=Plausible("a hammer finds it", times(0.5, 2)),
    )  # fmt: skip
    casing_damping_ratio: float = parameter(
        0.02, "", (0, 0.99), PROGRAM, "damping ratio of a casing mode", above=True, read=CASING,
        plausible=Plausible("a hammer finds it", times(0.5, 2)),
    )  # fmt: skip
    start: str = choice(
        "steady", ("steady", "rest"), PROGRAM,
        "start of the body; steady: as if the settled revolutions had always repeated; rest: at "
        "rest at time 0",
    )  # fmt: skip
    band_low_Hz: float | None = parameter(
        None, "Hz", (0, 1e5), "program: 2", "lowest frequency of body_velocity_rms", optional=True
    )
    band_high_Hz: float | None = parameter(
        None, "Hz", (0, 1e5), "program: 1000", "highest frequency of body_velocity_rms", above=True,
        optional=True,
    )  # fmt: skip

    @property
    def band_Hz(self) -> tuple[float, float]:
        """Return the frequencies between which the body's velocity counts."""
        low, high = self.band_low_Hz, self.band_high_Hz
        return 2.0 if low is None else low, 1000.0 if high is None else high

    def __post_init__(self) -> None:
        """Fill in the modal mass of a casing mode."""
        if self.casing_mass_kg is None:
            vars(self)["casing_mass_kg"] = self.mass_kg / BODIES_PER_CASING


@document_fields
@make_group
class Sensor:
    """An accelerometer on the body, with a tacho; a case's `sensor`, None by default.

    `True` stands for the defaults:

    >>> import compressor
    >>> sensor = {"place": "bearing", "noise_m_per_s2": 0.05}
    >>> case = compressor.Case.from_values({"body": True, "sensor": sensor})
    >>> case.sensor.rate_Hz, case.sensor.noise_m_per_s2
    (25600.0, 0.05)
    """

    REPORTED: ClassVar[float] = 1e-3  # of a record's samples: clipping is reported from here on

    place: str = choice(
        "guide", ("guide", "bearing", "body"), PROGRAM,
        "place of the sensor: crosshead guide at mid-stroke, main bearing, or the body's mass "
        "centre",
    )  # fmt: skip
    direction: str = choice("y", ("x", "y"), PROGRAM, "direction of the sensor")
    rate_Hz: float = parameter(25600.0, "Hz", (0, 1e6), PROGRAM, "sampling rate", above=True)
    low_pass_Hz: float | None = parameter(
        None, "Hz", (0, 1e6), "usual: rate_Hz / 2.56", "anti-aliasing filter's corner",
        above=True, optional=True,
    )  # fmt: skip
    mounting_Hz: float = parameter(
        25000.0, "Hz", (0, 1e6), "usual: on a stud", "mounting resonance", above=True,
        plausible=Plausible("a magnet, or a hand, in place of a stud", times(0.2, 1)),
    )  # fmt: skip
    mounting_damping_ratio: float = parameter(
        0.03, "", (0, 0.99), PROGRAM, "damping ratio of the mounting", above=True
    )
    range_m_per_s2: float = parameter(
        490.0, "m/s2", (0, 1e6), "usual: 50 g",
        "range of the sensor; the signal is clipped beyond it", above=True,
    )  # fmt: skip
    noise_m_per_s2: float = parameter(
        0.0015, "m/s2", (0, 1e6), "usual: piezoelectric", "rms of white noise up to half the rate",
        plausible=Plausible("cables, and a plant's own noise", times(1, 30)),
    )  # fmt: skip
    speed_jitter: float = parameter(
        0.0, "", (0, 0.1), PROGRAM,
        "rms of the speed's relative deviation; drawn once a revolution and smooth between: 0.93 "
        "of it at all times, 0.81 of it in a revolution's mean speed", read=STEADY,
    )  # fmt: skip
    seed: int = parameter(
        1, "", (0, 2**31), PROGRAM, "seed of noise and jitter", kind="integer", read=RANDOM
    )
    length_rev: int | None = parameter(
        None, "", (1, 10_000), "the settled ones", "revolutions of the record; more of them repeat",
        kind="integer", optional=True, read=STEADY,
    )  # fmt: skip
    threshold_m_per_s2: float | None = parameter(
        None, "m/s2", (0, 1e6), "none: no peaks are counted", "level over which a peak of the "
        "record counts (sensor_counts_per_rev)", above=True, optional=True,
    )  # fmt: skip
    second_threshold_m_per_s2: float | None = parameter(
        None, "m/s2", (0, 1e6), "none", "second level over which a peak counts", above=True,
        optional=True, read=THRESHOLD,
    )  # fmt: skip

    @property
    def thresholds(self) -> tuple[float | None, float | None]:
        """Return both thresholds, None where there is none."""
        return self.threshold_m_per_s2, self.second_threshold_m_per_s2

    def report_clipping(self, fraction: float) -> str:
        """Return a sentence about a record with a fraction clipped; "" below a thousandth."""
        if not fraction >= self.REPORTED:
            return ""
        return (
            f"{100 * fraction:.3g} % of the sensor's samples are clipped at its range, "
            f"{self.range_m_per_s2:g} m/s²: levels and spectra are those of the clipped record; "
            "raise sensor.range_m_per_s2"
        )


value = partial(parameter, identity=False)  # of no single run


@document_fields
@make_group
class Wear:
    """How the rod's bores wear in joints with clearance; a case's `wear`, None by default.

    `compsim wear` opens the clearances over operating hours, by Archard's law. A single run has
    the clearances that are given. `True` stands for the defaults:

    >>> import compressor
    >>> case = compressor.Case.from_values({"joint": "both", "clearance_mm": 0.1, "wear": True})
    >>> case.wear.limit_mm  # twice the greater clearance
    0.2
    """

    coefficient_mm3_per_N_m: float = value(
        1e-8, "mm3/(N m)", (0, 1.0),
        "assumed: of oiled metals, for which tables give 1e-9 to 1e-6 (Archard, J. Appl. Phys. 24, "
        "1953, defines it)",
        "wear coefficient: volume lost for each N m of normal force times sliding", above=True,
    )  # fmt: skip
    coefficient_factor: float = value(
        2.0, "", (1, 1e6), "assumed", "factor by which the coefficient may be smaller or greater"
    )
    limit_mm: float | None = value(
        None, "mm", (0, 1e4), "assumed: twice the greater clearance",
        "radial clearance at which a joint counts as worn out", above=True,
        optional=True,
    )  # fmt: skip
    hours: float = value(
        50000.0, "h", (0, 1e9), "program", "operating hours after which the study ends",
        above=True,
    )  # fmt: skip
    step_mm: float = value(
        0.02, "mm", (0, 1e4), "program: tests/results/wear.md",
        "growth of a clearance after which the motion is computed again", above=True,
    )  # fmt: skip
    bore_length_mm: float = value(
        20.0, "mm", (0, 1e4), "assumed: as long as wide", "length of the bores", above=True
    )


def fill_wear(wear: Wear, clearance_mm: PerJoint[float]) -> Wear:
    """Return the wear with its limit, by the clearances of both joints."""
    most = max(clearance_mm.big_end, clearance_mm.small_end)
    return wear if wear.limit_mm or not most else replace(wear, limit_mm=2.0 * most)
