"""The groups of a case file: frozen dataclasses whose fields carry unit, range, source and phrase.

`compressor.cases.table` makes the table of parameters of these fields. Values keep the case file's
units, which stand in the field's name; `compressor.solve.si_record` turns them into SI.
"""

from collections.abc import Mapping
from functools import partial

from compressor.cases.card import ATMOSPHERE_MPA
from compressor.cases.laws import (
    CLEARANCE,
    CONTACT_LAWS,
    CYLINDRICAL,
    FRICTION_LAWS,
    fill_by_law,
    or_own,
)
from compressor.cases.parameter import (
    ACCURACY,
    PerEnd,
    PerJoint,
    PerMotion,
    PerValve,
    by_part,
    choice,
    flag,
    integer,
    make_group,
    number,
)

# conditions under which a case reads a key; others stand beside their only key
AT_JOINTS = {"big_end": "clearance_mm.big_end > 0", "small_end": "clearance_mm.small_end > 0"}
CRANK_END = "gas.action == double or gas.action == crank_end"
CYCLE = "not gas.is_measured"  # by an indicator card of an end that presses
HEAD_CLEARANCE = "gas.action != crank_end or not gas.clearance_percent.crank"

JUDGED_STIFFNESS = (1e8 / 1000**1.5, 1e12 / 1000**1.5)  # N/mm^1.5: judged on, 1e8 to 1e12 N/m^1.5
PAPER_STIFFNESS = 3.36e5  # N/mm^1.5
# the first three are compiled, by `compressor.solve`; the others are SciPy's
METHODS = ("auto", "TSIT5", "RODAS", "LSODA", "Radau", "BDF", "DOP853", "RK45")


shift = partial(number, 0.0, "[-1000, 1000]", unit="mm")


@make_group
class Offset:
    """How far a journal starts from its bore's centre, mm; a case's `initial_offset_mm`.

    It shows whether a motion depends on where it starts.
    """

    big_end_x: float = shift("start of the big end's journal along x", read=AT_JOINTS["big_end"])
    big_end_y: float = shift("start of the big end's journal along y", read=AT_JOINTS["big_end"])
    small_end_x: float = shift(
        "start of the small end's journal along x", read=AT_JOINTS["small_end"]
    )
    small_end_y: float = shift(
        "start of the small end's journal along y", read=AT_JOINTS["small_end"]
    )


@make_group
class Machine:
    """The mechanism and its masses; a case's `machine`.

    The paper gives no masses: the defaults are assumptions. What is left out follows from the
    rest, such as the inertia of a uniform rod, m L^2 / 12.
    """

    crank_radius_mm: float = number(120.0, "(0, 1e5]", "crank radius R", "Table 1")
    rod_length_mm: float = number(600.0, "(0, 1e6]", "rod length L", "Table 1")
    speed_rpm: float = number(500.0, "(0, 1e5]", "crank speed", "Table 1", judged=(50, 6000))
    rod_mass_kg: float = number(
        4.7, "(0, 1e6]", "rod mass", "assumed: a 600 x 40 x 25 mm steel bar", judged=(0.1, 200)
    )
    rod_centre_mm: float | None = number(
        None, "[0, 1e6]", "rod's mass centre, from the big end", "assumed: half the rod"
    )
    rod_inertia_kg_m2: float | None = number(
        None, "(0, 1e9]", "rod's inertia about its mass centre", "assumed: m L^2 / 12"
    )
    reciprocating_mass_kg: float = number(
        14.0, "(0, 1e6]", "crosshead, piston rod and piston", "assumed", judged=(0.1, 200)
    )
    pin_radius_mm: PerJoint[float] = by_part(
        PerJoint,
        number(
            10.0, "(0, 1e4]", "journal radius R_j", "inferred from Eq. 15 and Table 3",
            judged=(10, 100), fact=True,
        ),
        {joint: f"{own} or friction.ideal_joints == true" for joint, own in AT_JOINTS.items()},
    )  # fmt: skip
    gravity_m_per_s2: float = number(0.0, "[0, 1000]", "gravity, along -y", "assumed")
    counterweight_kg_mm: float | None = number(
        0.0, "[0, 1e9]",
        "counterweight on the crank, opposite to its pin: mass times its centre's distance from "
        "the axis",
        "none",
    )  # fmt: skip
    balance: PerMotion[float] | None = by_part(
        PerMotion,
        number(
            None, "[0, 1]",
            "fraction that a counterweight balances; in place of counterweight_kg_mm", "none",
        ),
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Fill in a uniform rod, as far as the rod is not given."""
        values = vars(self)  # which can be written to, though the group is frozen
        length, mass = self.rod_length_mm, self.rod_mass_kg
        if self.rod_centre_mm is None:
            values["rod_centre_mm"] = length / 2
        if self.rod_inertia_kg_m2 is None:
            values["rod_inertia_kg_m2"] = mass * (length / 1000) ** 2 / 12
        if self.balance is not None:
            values["counterweight_kg_mm"] = None
        elif self.counterweight_kg_mm is None:
            values["counterweight_kg_mm"] = 0.0


# ends of a cylinder, and the actions by which the gas in them presses
ENDS = {"head": ("single", "double"), "crank": ("double", "crank_end")}
# what the paper's gas load has not; any of them makes a cylinder of one's own
CYLINDER_KEYS = (
    "action", "rod_diameter_mm", "clearance_percent", "valve_loss_percent", "unloaded",
    "indicator", "ambient_MPa", "smooth_deg",
)  # fmt: skip
NO_LOSS = PerValve(0.0, 0.0)
OWN_CYLINDER = (
    "a cylinder of one's own: any key of `gas` but this one and {other}, the stroke or the rod's "
    "length is given"
)


@make_group
class Gas:
    """The gas load, an ideal cycle (Eq. 13); a case's `gas`, read with `load: gas`.

    The corners of the cycle are printed for the paper's cylinder, whose other face is in a vacuum.
    Any other has the exact ones, and the atmosphere:

    >>> import compressor
    >>> gas = compressor.Case.from_values({"load": "gas", "gas": {"discharge_MPa": 0.5}}).gas
    >>> gas.switching, gas.back_pressure_MPa
    ('exact', 0.101325)
    """

    piston_radius_mm: float = number(50.0, "(0, 1e4]", "piston radius", "Table 1")
    head_clearance_mm: float | None = number(
        20.0, "(0, 1e5]", "clearance of the cylinder head s0", "Eq. 13",
        read=(CYCLE, HEAD_CLEARANCE), fact=True,
    )  # fmt: skip
    suction_MPa: float = number(
        0.105, "(0, 1e3]", "suction pressure (absolute)", "Table 1", read=CYCLE, fact=True
    )
    discharge_MPa: float = number(
        0.393, "(0, 1e3]", "discharge pressure (absolute)", "Table 1", read=CYCLE, fact=True
    )
    exponent: float = number(1.4, "[1, 5]", "isentropic exponent", "Eq. 13", read=CYCLE, fact=True)
    back_pressure_MPa: float | None = number(
        None, "[0, 1e3]",
        "pressure on what no gas cycle presses: the piston's other face, or the rod's "
        "cross-section in a double-acting cylinder; 0 in the paper's rig, and the atmosphere, "
        f"{ATMOSPHERE_MPA:g}, in {OWN_CYLINDER.format(other='switching')}",
        "assumed",
    )  # fmt: skip
    switching: str | None = choice(
        None, ("paper", "exact"),
        "corners of the cycle: as the paper prints them for its rig, or where the pressures meet, "
        f"the default of {OWN_CYLINDER.format(other='back_pressure_MPa')}", "Eq. 13", read=CYCLE,
    )  # fmt: skip
    action: str | None = choice(
        None, ("single", "double", "crank_end"),
        "ends in which the gas has a cycle: the head's (the default), both, the crank's",
    )  # fmt: skip
    rod_diameter_mm: float | None = number(
        None, "(0, 1e4]", "diameter of the piston rod, whose section the crank end lacks",
        read=CRANK_END, fact=True,
    )  # fmt: skip
    clearance_percent: PerEnd[float | None] | None = by_part(
        PerEnd,
        number(
            None, "(0, 1000]", "clearance volume over swept volume; in place of head_clearance_mm",
            optional=True, fact=True,
        ),
        {"head": (CYCLE, HEAD_CLEARANCE), "crank": (CYCLE, CRANK_END)}, fill=None,
    )  # fmt: skip
    valve_loss_percent: PerValve[float] | None = by_part(
        PerValve,
        number(
            None, "[0, 90]", "loss of absolute pressure while open; 0 without", read=CYCLE,
            fact=True,
        ),
    )  # fmt: skip
    unloaded: str | None = choice(
        None, ("none", "head", "crank"),
        "unloaded end, whose valves are held open: its gas stays at suction pressure; none by "
        "default",
        read=CYCLE,
    )  # fmt: skip
    indicator: PerEnd[str | None] | None = by_part(
        PerEnd,
        choice(
            None, (), "card; in place of pressures, exponent and clearance", "measured",
            kind="card", optional=True,
        ),
        {"head": "gas.action != crank_end", "crank": CRANK_END}, fill=None, first=True,
    )  # fmt: skip
    ambient_MPa: float | None = number(
        None, "(0, 1e3]",
        f"pressure from which a card's gauge pressures count; {ATMOSPHERE_MPA:g} by default",
        "standard", read="gas.is_measured",
    )  # fmt: skip
    smooth_deg: float | None = number(
        None, "[0, 60]",
        "width of the window in which noise of a card is smoothed, by cubic least squares; 0 by "
        "default: none",
        read="gas.is_measured",
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Fill in what a cylinder's keys leave open; what is as without a key goes without it."""
        values = vars(self)
        if self.is_cylinder:
            filled = {"action": "single", "unloaded": "none", "valve_loss_percent": NO_LOSS}
            values.update({key: value for key, value in filled.items() if values[key] is None})
        if self.switching is None:
            values["switching"] = "exact" if self.is_cylinder else "paper"
        if self.back_pressure_MPa is None:
            values["back_pressure_MPa"] = ATMOSPHERE_MPA if self.is_cylinder else 0.0
        if self.clearance_percent and self.clearance_percent.head is not None:
            values["head_clearance_mm"] = None

    @property
    def is_cylinder(self) -> bool:
        """Return whether any key beyond the paper's gas load is given, of an end that presses."""
        unread = () if self.presses("crank") else ("rod_diameter_mm",)
        return any(getattr(self, key) is not None for key in CYLINDER_KEYS if key not in unread)

    @property
    def is_measured(self) -> bool:
        """Return whether indicator cards stand in place of a cycle."""
        return bool(self.cards)

    @property
    def cards(self) -> dict[str, str]:
        """Return the cards of the ends that press, by end, head or crank."""
        given = vars(self.indicator) if self.indicator else {}
        return {end: card for end, card in given.items() if card is not None and self.presses(end)}

    @property
    def ambient(self) -> float:
        """Return the pressure (MPa) from which gauge pressures of cards count."""
        return ATMOSPHERE_MPA if self.ambient_MPa is None else self.ambient_MPa

    @property
    def open_pressures(self) -> tuple[float, float]:
        """Return the pressures (MPa) while the suction and the discharge valve is open."""
        loss = self.valve_loss_percent or NO_LOSS
        lowered, raised = 1.0 - loss.suction / 100, 1.0 + loss.discharge / 100
        return self.suction_MPa * lowered, self.discharge_MPa * raised

    def presses(self, end: str) -> bool:
        """Return whether an end, head or crank, holds gas that presses on the piston."""
        return (self.action or "single") in ENDS[end]

    def has_cycle(self, end: str) -> bool:
        """Return whether the gas in an end, head or crank, is compressed."""
        return self.presses(end) and self.unloaded != end

    @property
    def compressing_ends(self) -> list[str]:
        """Return the ends, head or crank, in which gas is compressed."""
        return [*filter(self.has_cycle, ENDS)]

    def clearance_key(self, end: str) -> str:
        """Return the key that gives the clearance of an end, head or crank."""
        each = self.clearance_percent
        is_percent = each and (end == "crank" or each.head is not None)
        return f"gas.clearance_percent.{end}" if is_percent else "gas.head_clearance_mm"

    def clearance(self, end: str, stroke: float) -> float:
        """Return the clearance (mm) of an end, head or crank, at a stroke (mm)."""
        if self.clearance_key(end) == "gas.head_clearance_mm":
            return self.head_clearance_mm or 0.0
        return (getattr(self.clearance_percent, end) or 0.0) / 100 * stroke


@make_group
class Spring:
    """The spring load, a spring between piston and cam follower (§2.2); a case's `spring`.

    Read with `load: spring`, the default.
    """

    stiffness_N_per_mm: float = number(20.0, "[0, 1e6]", "spring stiffness k", "Table 1")
    damping_N_s_per_mm: float = number(0.023, "[0, 1e6]", "spring damping c", "Table 1")
    preload_N: float = number(800.0, "[0, 1e8]", "preload of the spring", "Table 1")
    stroke_mm: float = number(
        120.0, "(0, 1e5]", "piston travel of each dwell of the cam follower", "Table 1"
    )


@make_group
class Contact:
    """The normal contact law of both joints; a case's `contact`.

    ADAMS's IMPACT (Eq. 14) by default: F = K d^p + C(d) d' with the penetration d; C grows to C_max
    up to the depth of full damping. Others damp by K d^p times the penetration's rate over the
    speed at which journal and bore met; the name of one and a coefficient of restitution choose it.
    """

    law: str = choice(
        "impact", CONTACT_LAWS, "contact law (impact: ADAMS's)", "Eq. 14", read=CLEARANCE
    )
    stiffness_N_per_mm15: float | None = number(
        PAPER_STIFFNESS, "(0, 1e15]", "contact stiffness K, in N/mm^exponent", "Table 3",
        read=(CLEARANCE, "contact.law != johnson and contact.law != liu"), judged=JUDGED_STIFFNESS,
    )  # fmt: skip
    materials: PerJoint[tuple[str, str]] | None = by_part(
        PerJoint,
        choice(
            None, ("steel", "copper"), "two materials; in place of a stiffness", "Table 2, Eq. 15",
            kind="materials", fact=True,
        ),
        AT_JOINTS,
    )  # fmt: skip
    geometry: str = choice(
        "external", ("external", "internal"),
        "radii in the materials' stiffness: of two discs (the paper's, and the default for its "
        "pin), or of a pin in a bore (the default with a pin radius of a file's own)",
        "Eq. 15", read=(CLEARANCE, "contact.materials"),
    )  # fmt: skip
    exponent: float = number(
        1.5, "[1, 3]", "force exponent p", "Table 3",
        read=or_own("exponent"), judged=(1.0, 2.2),
    )  # fmt: skip
    damping_N_s_per_mm: float = number(
        336.0, "[0, 1e9]", "greatest contact damping C_max", "Table 3",
        read=or_own("damping_N_s_per_mm"), judged=(0, 33600),
    )  # fmt: skip
    full_damping_mm: float = number(
        0.1, "(0, 1e3]", "penetration of full damping d_max", "Table 3",
        read=or_own("full_damping_mm"),
    )  # fmt: skip
    restitution: float | None = number(
        None, "(0, 1]", "coefficient of restitution, in laws that damp by it", judged=(0.3, 0.95)
    )
    least_approach_mm_per_s: float | None = number(
        None, "(0, 1e6]",
        "approach speed below which the damping stays that of this speed; 10 by default",
        read="contact.restitution > 0", judged=(1.0, 100.0),
    )  # fmt: skip
    length_mm: PerJoint[float] | None = by_part(
        PerJoint,
        number(None, "(0, 1e4]", "length (johnson, liu)", judged=(10.0, 100.0), fact=True),
        AT_JOINTS,
    )  # fmt: skip
    modulus_GPa: float | None = number(
        None, "(0, 1e6]", "composite modulus (johnson, liu)", read=CLEARANCE, judged=(10.0, 250.0),
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Fill in what the law reads, and leave out a stiffness where others make it."""
        if self.materials is not None or self.law in CYLINDRICAL:
            vars(self)["stiffness_N_per_mm15"] = None
        elif self.stiffness_N_per_mm15 is None:
            vars(self)["stiffness_N_per_mm15"] = PAPER_STIFFNESS
        fill_by_law("contact", self)


@make_group
class Friction:
    """Friction at the joints; a case's `friction`, None without.

    By default ADAMS's smoothed Coulomb law (Table 3). coulomb_tanh, threlfall and ambrosio go to
    the dynamic coefficient, the first two over the stiction velocity, the last from there to the
    friction velocity. lugre sticks by bristles; its stiction velocity is Stribeck's.
    """

    static: float = number(0.23, "[0, 10]", "static coefficient", "Table 3", judged=(0, 0.5))
    dynamic: float = number(0.15, "[0, 10]", "dynamic coefficient", "Table 3", judged=(0, 0.5))
    stiction_velocity_mm_per_s: float = number(
        10.0, "(0, 1e6]", "stiction transition velocity", "Table 3", judged=(0.1, 100)
    )
    friction_velocity_mm_per_s: float = number(
        100.0, "(0, 1e6]", "friction transition velocity", "Table 3"
    )
    law: str = choice("adams", FRICTION_LAWS, "friction law", "Eq. 16")
    bristle_stiffness_per_mm: float | None = number(
        None, "(0, 1e9]", "LuGre's sigma_0 over the normal force; 100 by default",
        judged=(10.0, 1e4),
    )  # fmt: skip
    bristle_damping_s_per_mm: float | None = number(
        None, "[0, 1e6]", "LuGre's sigma_1 over the normal force; 0.03 by default",
        judged=(1e-3, 0.1),
    )  # fmt: skip
    viscous_s_per_mm: float | None = number(
        None, "[0, 1e6]", "LuGre's sigma_2 over the normal force; 0 by default"
    )
    ideal_joints: bool = flag(
        False, "friction in joints without clearance, too",
        read="not (clearance_mm.big_end > 0 and clearance_mm.small_end > 0)",
    )  # fmt: skip

    def __post_init__(self) -> None:
        """Fill in what the law reads."""
        fill_by_law("friction", self)


@make_group
class Solve:
    """How far, how finely and how exactly to integrate; a case's `solve`.

    `accuracy` is a promise about the run, which is checked: a word for the relative L2 error of
    the acceleration, or the relative error of metrics by name.
    """

    duration_rev: float | str | None = number(
        4.0, "(0, 1e5]", "duration in revolutions; auto: three after settling", "§3.1: 0.48 s",
        choices=("auto",),
    )  # fmt: skip
    duration_s: float | None = number(
        None, "(0, 1e5]", "duration in seconds, in place of duration_rev", "§3.1"
    )
    settle_rev: float | str = number(
        1.0, "[0, 1e5]", "start-up left out of metrics and figures; auto: until revolutions agree",
        choices=("auto",),
    )  # fmt: skip
    output_step_deg: float | None = number(
        0.3, "(0, 360]", "output step in degrees of crank angle", "§3.1: 0.1 ms"
    )
    output_step_s: float | None = number(
        None, "(0, 10]", "output step in seconds, in place of output_step_deg", "§3.1"
    )
    accuracy: str | tuple[tuple[str, float], ...] = choice(
        "standard", tuple(ACCURACY),
        "promised relative error of acceleration, or the greatest one of each metric named",
        "measured", kind="accuracy",
    )  # fmt: skip
    rtol: float | None = number(None, "[1e-13, 0.1]", "relative tolerance, in place of accuracy")
    error_bars: bool = flag(
        True, "errors of metrics, from a second run; not part of a job's key", identity=False
    )
    horizon: bool | str = flag(
        "auto",
        "time for which the motion can be predicted: auto measures it where errors are large, true "
        "always; not part of a job's key",
        choices=("auto",), identity=False,
    )  # fmt: skip
    method: str = choice(
        "auto", METHODS, "integrator: compiled (auto is TSIT5 and RODAS), or SciPy's"
    )
    max_steps: int = integer(5_000_000, "[1, 1e12]", "budget of integration steps")
    timeout_s: float = number(
        600.0, "(0, 1e7]", "budget of wall time; not part of a job's key", identity=False
    )

    def __post_init__(self) -> None:
        """Leave out the durations and steps in whose place others are given; sort the targets."""
        if isinstance(self.accuracy, Mapping):
            vars(self)["accuracy"] = tuple(sorted(self.accuracy.items()))
        for rival, key, usual in (
            ("duration_s", "duration_rev", 4.0), ("output_step_s", "output_step_deg", 0.3),
        ):  # fmt: skip
            if vars(self)[rival] is not None:
                vars(self)[key] = None
            elif vars(self)[key] is None:
                vars(self)[key] = usual


@make_group
class Output:
    """What is stored of a job; a case's `output`. Not part of the job's key."""

    keep: str = choice(
        "series", ("series", "metrics"), "stored results: time series too, or metrics only",
        identity=False,
    )  # fmt: skip
    precision: str = choice(
        "double", ("double", "single"),
        "precision of the time series; single: gzipped, time and crank angle double",
        identity=False, read="output.keep == series",
    )  # fmt: skip
    signals: bool = flag(
        False,
        "metrics of the rod load, and more time series: forces on frame, bearing and guide, torque "
        "and rod load",
        identity=False,
    )  # fmt: skip
