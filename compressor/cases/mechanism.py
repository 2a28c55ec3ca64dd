"""The groups of a case file that free what the paper's machine holds: guide, drive and rod."""

from dataclasses import dataclass, replace

from compressor.cases.parameter import documented, parameter
from compressor.cases.readers import CORNER_DAMPED, CORNER_RESTITUTION, GUIDE_FRICTION, PLAY

OURS = "ours"


@documented
@dataclass(frozen=True)
class Guide:
    """The crosshead's guide; a case's `guide`, None unless a case asks: ideal, without friction.

    With a clearance the crosshead moves across and tilts, and its four corners meet the guide as
    journals meet their bores: by `contact.law` where that has a restitution, else by ADAMS's
    IMPACT. `True` stands for the defaults, an ideal guide with friction:

    >>> import compressor
    >>> case = compressor.Case.from_values({"guide": {"clearance_mm": 0.1}})
    >>> round(case.guide.crosshead_inertia_kg_m2, 4)  # 14 kg (0.12^2 + 0.08^2) / 12
    0.0243
    """

    clearance_mm: float = parameter(
        0.0, "mm", (0, 100), OURS, "between crosshead and guide, on each side", judged=(0.01, 0.2)
    )
    friction: float = parameter(
        0.05, "", (0, 10), OURS, "coefficient of friction, oiled", judged=(0.01, 0.2)
    )
    stiction_velocity_mm_per_s: float = parameter(
        10.0, "mm/s", (0, 1e6), "Table 3, of the joints", "speed at which friction is three "
        "quarters of its greatest", above=True, read=GUIDE_FRICTION,
    )  # fmt: skip
    crosshead_length_mm: float = parameter(
        120.0,
        "mm",
        (0.001, 1e4),
        OURS,
        "the crosshead's length",
        read=PLAY,
        judged=(60.0, 250.0),
    )
    crosshead_height_mm: float = parameter(
        80.0,
        "mm",
        (0.001, 1e4),
        OURS,
        "the crosshead's height",
        read=PLAY,
        judged=(40.0, 150.0),
    )
    crosshead_inertia_kg_m2: float | None = parameter(
        None, "kg m2", (0, 1e9), "assumed: of a uniform block, m (l^2 + h^2) / 12",
        "the crosshead's inertia about its pin", above=True, optional=True, read=PLAY,
    )  # fmt: skip
    stiffness_N_per_mm15: float = parameter(
        3.36e5, "N/mm^p", (0, 1e15), "Table 3, of the joints",
        "contact stiffness of a corner, in N/mm^exponent", above=True, read=PLAY,
        judged=(3e4, 3e6),
    )  # fmt: skip
    exponent: float | None = parameter(
        None, "", (1, 3), "as the joints'", "force exponent of a corner", optional=True, read=PLAY
    )
    damping_N_s_per_mm: float | None = parameter(
        None, "N s/mm", (0, 1e9), "as the joints'", "greatest contact damping of a corner",
        optional=True, read=(PLAY, CORNER_DAMPED),
    )  # fmt: skip
    full_damping_mm: float | None = parameter(
        None, "mm", (0, 1e3), "as the joints'", "penetration of full damping of a corner",
        above=True, optional=True, read=(PLAY, CORNER_DAMPED),
    )  # fmt: skip
    restitution: float | None = parameter(
        None, "", (0, 1), "as the joints'", "coefficient of restitution of a corner",
        above=True, optional=True, read=(PLAY, CORNER_RESTITUTION),
    )  # fmt: skip


@documented
@dataclass(frozen=True)
class Drive:
    """A motor whose speed gives way; a case's `drive`, None unless a case asks: steady speed.

    The motor's torque is a line by the speed: `torque_N_m` at `machine.speed_rpm`, and more by
    `slope_N_m_s` for each rad/s that the crank is slower. `True` stands for the defaults; a
    crank that runs free has neither torque nor slope:

    >>> import compressor
    >>> free = {"slope_N_m_s": 0, "flywheel_kg_m2": 0.5}
    >>> compressor.Case.from_values({"drive": free}).drive.torque_N_m
    0.0
    """

    flywheel_kg_m2: float = parameter(
        5.0,
        "kg m2",
        (0, 1e9),
        OURS,
        "inertia of crank, flywheel and motor",
        above=True,
        judged=(1.0, 100.0),
    )
    torque_N_m: float = parameter(0.0, "N m", (-1e9, 1e9), OURS, "torque at machine.speed_rpm")
    slope_N_m_s: float = parameter(
        100.0,
        "N m s",
        (0, 1e9),
        OURS,
        "by which the torque grows for each rad/s that speed falls",
        judged=(10.0, 1e4),
    )
    unbalance_kg_mm: float = parameter(
        0.0, "kg mm", (0, 1e9), OURS,
        "the crank's mass times its centre's distance from the axis, on which gravity acts",
    )  # fmt: skip


@documented
@dataclass(frozen=True)
class Rod:
    """An elastic rod; a case's `rod`, None unless a case asks: rigid.

    A bar of rectangular section: two bending modes, and two shapes of stretch. `True` stands for
    the defaults:

    >>> import compressor
    >>> compressor.Case.from_values({"rod": True}).rod.depth_mm
    40.0
    """

    youngs_modulus_GPa: float = parameter(
        207.0,
        "GPa",
        (0, 1e6),
        "Table 2, steel",
        "modulus of elasticity",
        above=True,
        judged=(70.0, 250.0),
    )
    depth_mm: float = parameter(
        40.0, "mm", (0, 1e4), "assumed: a 600 x 40 x 25 mm bar", "section, in the plane of motion",
        above=True, judged=(20.0, 80.0),
    )  # fmt: skip
    width_mm: float = parameter(
        25.0,
        "mm",
        (0, 1e4),
        "assumed: a 600 x 40 x 25 mm bar",
        "section, across it",
        above=True,
        judged=(10.0, 50.0),
    )
    damping_ratio: float = parameter(
        0.005,
        "",
        (0, 1),
        OURS,
        "of the first bending mode, in proportion to stiffness",
        judged=(2e-3, 0.1),
    )


def filled_guide(guide: Guide, mass: float) -> Guide:
    """Return a guide with its crosshead's inertia, by the mass (kg) that reciprocates."""
    if guide.crosshead_inertia_kg_m2 is not None:
        return guide
    square = (guide.crosshead_length_mm / 1000) ** 2 + (guide.crosshead_height_mm / 1000) ** 2
    return replace(guide, crosshead_inertia_kg_m2=mass * square / 12)
