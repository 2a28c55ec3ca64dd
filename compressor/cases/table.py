"""The table of parameters: frozen dataclasses whose fields carry unit, range, source and phrase.

The reader, the compiled record, the dataset's attributes and the README's table are all made from
these fields. Values keep the case file's units, which stand in the field's name;
`compressor.solve.si_record` turns them into SI.
"""

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

from compressor.cases.accuracy import ACCURACY
from compressor.cases.parameter import Parameter, choice, parameter
from compressor.cases.vibration import Body, Sensor

# those that `compressor.solve` has compiled, and then SciPy's
MOST_REV = 50.0  # with `duration_rev: auto`
METHODS = ("auto", "DOPRI5", "TSIT5", "RODAS", "LSODA", "Radau", "BDF", "DOP853", "RK45")


@dataclass(frozen=True)
class PerJoint:
    """A length per joint, mm; 0 where the joint is ideal."""

    big_end: float = parameter(0.0, "mm", (0, 1000), "§3.2", "radial clearance of the big end")
    small_end: float = parameter(0.0, "mm", (0, 1000), "§3.2", "radial clearance of the small end")


@dataclass(frozen=True)
class Offset:
    """How far a journal starts from its bore's centre, mm."""

    big_end_x: float = parameter(0.0, "mm", (-1000, 1000), "ours", "big end's journal, along x")
    big_end_y: float = parameter(0.0, "mm", (-1000, 1000), "ours", "big end's journal, along y")
    small_end_x: float = parameter(0.0, "mm", (-1000, 1000), "ours", "small end's journal, along x")
    small_end_y: float = parameter(0.0, "mm", (-1000, 1000), "ours", "small end's journal, along y")


@dataclass(frozen=True)
class Machine:
    """The mechanism and its masses."""

    crank_radius_mm: float = parameter(
        120.0, "mm", (0, 1e5), "Table 1", "crank radius R", above=True
    )
    rod_length_mm: float = parameter(600.0, "mm", (0, 1e6), "Table 1", "rod length L", above=True)
    speed_rpm: float = parameter(500.0, "rpm", (0, 1e5), "Table 1", "crank speed", above=True)
    rod_mass_kg: float = parameter(
        4.7, "kg", (0, 1e6), "assumed: a 600 x 40 x 25 mm steel bar", "rod mass", above=True
    )
    rod_centre_mm: float | None = parameter(
        None, "mm", (0, 1e6), "assumed: half the rod", "rod's mass centre, from the big end",
        optional=True,
    )  # fmt: skip
    rod_inertia_kg_m2: float | None = parameter(
        None, "kg m2", (0, 1e9), "assumed: m L^2 / 12", "rod's inertia about its mass centre",
        above=True, optional=True,
    )  # fmt: skip
    reciprocating_mass_kg: float = parameter(
        14.0, "kg", (0, 1e6), "assumed", "crosshead, piston rod and piston", above=True
    )
    pin_radius_mm: float = parameter(
        10.0, "mm", (0, 1e4), "inferred from Eq. 15 and Table 3", "journal radius R_j", above=True
    )
    gravity_m_per_s2: float = parameter(0.0, "m/s2", (0, 1000), "assumed", "gravity, along -y")


@dataclass(frozen=True)
class Gas:
    """The typical load: an ideal gas cycle."""

    piston_radius_mm: float = parameter(
        50.0, "mm", (0, 1e4), "Table 1", "piston radius", above=True
    )
    head_clearance_mm: float = parameter(
        20.0, "mm", (0, 1e5), "Eq. 13", "clearance of the cylinder head s0", above=True
    )
    suction_MPa: float = parameter(
        0.105, "MPa", (0, 1e3), "Table 1", "suction pressure (absolute)", above=True
    )
    discharge_MPa: float = parameter(
        0.393, "MPa", (0, 1e3), "Table 1", "discharge pressure (absolute)", above=True
    )
    exponent: float = parameter(1.4, "", (1, 5), "Eq. 13", "isentropic exponent")
    back_pressure_MPa: float = parameter(
        0.0, "MPa", (0, 1e3), "assumed", "pressure on the piston's other face"
    )
    switching: str = choice(
        "paper", ("paper", "exact"), "Eq. 13", "corners as printed, or where the pressures meet"
    )


@dataclass(frozen=True)
class Spring:
    """The design load: a spring between the piston and a cam follower."""

    stiffness_N_per_mm: float = parameter(20.0, "N/mm", (0, 1e6), "Table 1", "spring stiffness k")
    damping_N_s_per_mm: float = parameter(0.023, "N s/mm", (0, 1e6), "Table 1", "spring damping c")
    preload_N: float = parameter(800.0, "N", (0, 1e8), "Table 1", "preload of the spring")
    stroke_mm: float = parameter(
        120.0, "mm", (0, 1e5), "Table 1", "piston travel of each dwell of the cam follower",
        above=True,
    )  # fmt: skip


@dataclass(frozen=True)
class Contact:
    """The normal contact law of both joints."""

    law: str = choice("impact", ("impact",), "Eq. 14", "contact law (ADAMS's IMPACT)")
    stiffness_N_per_mm15: float | None = parameter(
        3.36e5, "N/mm^p", (0, 1e15), "Table 3", "contact stiffness K, in N/mm^exponent",
        above=True, optional=True,
    )  # fmt: skip
    materials: tuple[str, str] | None = choice(
        None, ("steel", "copper"), "Table 2, Eq. 15", "two materials in place of a stiffness",
        kind="materials", optional=True,
    )  # fmt: skip
    geometry: str | None = choice(
        None, ("external", "internal"), "Eq. 15",
        "of the materials' stiffness: radii as of two discs (the paper's), or of a pin in a bore",
        optional=True,
    )  # fmt: skip
    exponent: float = parameter(1.5, "", (1, 3), "Table 3", "force exponent p")
    damping_N_s_per_mm: float = parameter(
        336.0, "N s/mm", (0, 1e9), "Table 3", "greatest contact damping C_max"
    )
    full_damping_mm: float = parameter(
        0.1, "mm", (0, 1e3), "Table 3", "penetration of full damping d_max", above=True
    )


@dataclass(frozen=True)
class Friction:
    """ADAMS's friction at the joints; the case file's `friction: false` leaves it out."""

    static: float = parameter(0.23, "", (0, 10), "Table 3", "static coefficient")
    dynamic: float = parameter(0.15, "", (0, 10), "Table 3", "dynamic coefficient")
    stiction_velocity_mm_per_s: float = parameter(
        10.0, "mm/s", (0, 1e6), "Table 3", "stiction transition velocity", above=True
    )
    friction_velocity_mm_per_s: float = parameter(
        100.0, "mm/s", (0, 1e6), "Table 3", "friction transition velocity", above=True
    )


@dataclass(frozen=True)
class Solve:
    """How far, how finely and how exactly to integrate."""

    duration_rev: float | str | None = parameter(
        4.0, "rev", (0, 1e5), "§3.1: 0.48 s",
        "duration in revolutions; auto: three after settling", above=True, optional=True,
        choices=("auto",),
    )  # fmt: skip
    duration_s: float | None = parameter(
        None, "s", (0, 1e5), "§3.1", "duration in seconds, in place of duration_rev",
        above=True, optional=True,
    )  # fmt: skip
    settle_rev: float | str = parameter(
        1.0, "rev", (0, 1e5), "ours",
        "start-up left out of metrics and figures; auto: until revolutions agree",
        choices=("auto",),
    )  # fmt: skip
    output_step_deg: float | None = parameter(
        0.3, "deg", (0, 360), "§3.1: 0.1 ms", "output step in degrees of crank angle",
        above=True, optional=True,
    )  # fmt: skip
    output_step_s: float | None = parameter(
        None, "s", (0, 10), "§3.1", "output step in seconds, in place of output_step_deg",
        above=True, optional=True,
    )  # fmt: skip
    accuracy: str | tuple[tuple[str, float], ...] = choice(
        "standard", tuple(ACCURACY), "measured",
        "promised relative error of acceleration, or the greatest one of each metric named",
        kind="accuracy",
    )  # fmt: skip
    rtol: float | None = parameter(
        None, "", (1e-13, 0.1), "ours", "relative tolerance, in place of accuracy", optional=True
    )
    error_bars: bool = choice(
        True, (), "ours", "an error beside each metric, by a second run; not part of a "
        "job's identity", kind="boolean", identity=False,
    )  # fmt: skip
    horizon: bool | str = choice(
        "auto", ("auto",), "ours", "how long the motion can be foretold: auto looks where errors "
        "are large, true by a twin at rtol 1e-12; not part of a job's identity",
        kind="boolean", identity=False,
    )  # fmt: skip
    method: str = choice(
        "auto", METHODS, "ours", "integrator: compiled (auto is TSIT5 and RODAS), or SciPy's"
    )
    max_steps: int = parameter(
        5_000_000, "", (1, 10**12), "ours", "budget of integration steps", kind="integer"
    )
    timeout_s: float = parameter(
        600.0,
        "s",
        (0, 1e7),
        "ours",
        "budget of wall time; not part of a job's identity",
        above=True,
        identity=False,
    )


@dataclass(frozen=True)
class Output:
    """What is stored of a job; not part of its identity."""

    keep: str = choice(
        "series", ("series", "metrics"), "ours", "time series too, or metrics only", identity=False
    )
    precision: str = choice(
        "double",
        ("double", "single"),
        "ours",
        "of the time series; time and crank angle are double",
        identity=False,
    )
    signals: bool = choice(
        False, (), "ours", "forces on frame, bearing and guide, torque and rod load beside the "
        "time series", kind="boolean", identity=False,
    )  # fmt: skip
    compress: bool = choice(
        False, (), "ours", "time series shuffled and gzipped", kind="boolean", identity=False
    )


GROUPS: dict[str, type] = {
    "clearance_mm": PerJoint,
    "initial_offset_mm": Offset,
    "machine": Machine,
    "gas": Gas,
    "spring": Spring,
    "contact": Contact,
    "friction": Friction,
    "body": Body,
    "sensor": Sensor,
    "solve": Solve,
    "output": Output,
}
# groups that a word may stand for: `false` leaves one out, `true` is one with its defaults
WORDS = {"friction": False, "body": True, "sensor": True}
# groups that no joint reads with `joint: none`
OF_JOINTS = ("clearance_mm",)


@dataclass(frozen=True)
class Settings:
    """The values of one simulation in the case file's units, and the times that follow from them.

    `compressor.cases.case.Case` is made of these.
    """

    name: str = choice(
        "case", (), "ours", "name of the study; default: the file's", kind="text", identity=False
    )
    load: str = choice("design", ("design", "typical", "none"), "§2.2-2.4", "load on the piston")
    joint: str = choice(
        "none", ("none", "big_end", "small_end", "both"), "§3.2", "joints with clearance"
    )
    clearance_mm: PerJoint = PerJoint()
    initial_offset_mm: Offset = Offset()
    machine: Machine = Machine()
    gas: Gas = Gas()
    spring: Spring = Spring()
    contact: Contact = Contact()
    friction: Friction | None = Friction()
    body: Body | None = None
    sensor: Sensor | None = None
    solve: Solve = Solve()
    output: Output = Output()

    @property
    def omega(self) -> float:
        """Crank speed, rad/s."""
        return self.machine.speed_rpm * math.pi / 30

    @property
    def turn(self) -> float:
        """Time of one revolution, s."""
        return 60.0 / self.machine.speed_rpm

    @property
    def duration(self) -> float:
        """Duration, s; with `duration_rev: auto` the longest that it may come to."""
        if self.solve.duration_s is not None:
            return self.solve.duration_s
        given = self.solve.duration_rev
        return (MOST_REV if given == "auto" else float(given or 0.0)) * self.turn

    @property
    def settle(self) -> float:
        """Time from which metrics count, s; with `settle_rev: auto` 0, until that is known."""
        given = self.solve.settle_rev
        return 0.0 if given == "auto" else float(given) * self.turn

    @property
    def settles_itself(self) -> bool:
        """Whether a run finds out by itself where it settles, or how long it is."""
        return "auto" in (self.solve.duration_rev, self.solve.settle_rev)

    @property
    def steps(self) -> float:
        """Output steps in the duration, a whole number in a valid case."""
        if self.solve.output_step_s is not None:
            return self.duration / self.solve.output_step_s
        return self.duration * self.machine.speed_rpm * 6.0 / float(self.solve.output_step_deg or 1)


def parameters(owner: type = Settings, prefix: str = "") -> Iterator[Parameter]:
    """The rows of the table, in the order of the case file."""
    for item in dataclasses.fields(owner):
        if item.name in GROUPS and owner is Settings:
            yield from parameters(GROUPS[item.name], item.name + ".")
        else:
            row = dict(item.metadata)
            yield Parameter(key=prefix + item.name, default=item.default, **row)


@cache
def table() -> dict[str, Parameter]:
    """The table of parameters by dotted key, such as `machine.rod_mass_kg`."""
    return {row.key: row for row in parameters()}


@cache
def outside_identity() -> frozenset[str]:
    """The keys that change nothing of what a job computes, so that no study can sweep them."""
    return frozenset(row.key for row in parameters() if not row.identity)
