"""The case: frozen dataclasses that are, at once, the one table of parameters.

Every field carries its unit, range, source and phrase; the reader, the compiled record, the
dataset's attributes and the README's table are all made from these fields. Values keep the case
file's units, which stand in the field's name; `compressor.solve.si_record` turns them into SI.
"""

import dataclasses
import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from typing import Any

from compressor.cases.accuracy import ACCURACY, Targets, checked_targets, first_rung
from compressor.cases.conflicts import conflicts
from compressor.cases.parameter import CaseError, Parameter, Problem, choice, parameter, shown
from compressor.metrics import JOINTS

MODEL_VERSION = "1"  # of the equations and the meaning of what is stored; part of a job's identity

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

    duration_rev: float | None = parameter(
        4.0, "rev", (0, 1e5), "§3.1: 0.48 s", "duration in revolutions", above=True, optional=True
    )
    duration_s: float | None = parameter(
        None, "s", (0, 1e5), "§3.1", "duration in seconds, in place of duration_rev",
        above=True, optional=True,
    )  # fmt: skip
    settle_rev: float = parameter(
        1.0, "rev", (0, 1e5), "ours", "start-up left out of metrics and figures"
    )
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
        "job's identity", kind="boolean",
    )  # fmt: skip
    horizon: bool = choice(
        False, (), "ours", "how long the motion can be foretold, by a twin at rtol 1e-12; bars "
        "end there; not part of a job's identity", kind="boolean",
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
    )


@dataclass(frozen=True)
class Output:
    """What is stored of a job; not part of its identity."""

    keep: str = choice("series", ("series", "metrics"), "ours", "time series too, or metrics only")
    precision: str = choice(
        "double",
        ("double", "single"),
        "ours",
        "of the time series; time and crank angle are double",
    )
    compress: bool = choice(False, (), "ours", "time series shuffled and gzipped", kind="boolean")


GROUPS: dict[str, type] = {
    "clearance_mm": PerJoint,
    "initial_offset_mm": Offset,
    "machine": Machine,
    "gas": Gas,
    "spring": Spring,
    "contact": Contact,
    "friction": Friction,
    "solve": Solve,
    "output": Output,
}


@dataclass(frozen=True)
class Case:
    """One fully resolved simulation, in the case file's units."""

    name: str = choice("case", (), "ours", "name of the study; default: the file's", kind="text")
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
    solve: Solve = Solve()
    output: Output = Output()

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> "Case":
        """Build a case from nested values as in a case file, without lists.

        Raises CaseError with everything that is wrong: unknown keys, wrong types, ranges, and
        values that do not fit each other.
        """
        problems: list[Problem] = []
        parts = {key: _part(key, value, problems) for key, value in values.items()}
        if problems:
            raise CaseError(problems)
        case = cls(**parts)
        problems = [*_inertia_problems(case), *conflicts(case, frozenset(_given(values)))]
        if problems:
            raise CaseError(problems)
        vars(case)["problems"] = ()  # known: see `problems`
        return case

    @cached_property
    def problems(self) -> tuple[Problem, ...]:
        """What is wrong with a case that was made without `from_values`, which would raise it."""
        try:
            Case.from_values(self.values())
        except CaseError as error:
            return tuple(error.problems)
        return ()

    def __post_init__(self) -> None:
        """Fill in the defaults that depend on other values; unused clearances become 0."""
        machine, solve, contact = self.machine, self.solve, self.contact
        if machine.rod_centre_mm is None or machine.rod_inertia_kg_m2 is None:
            given = (machine.rod_centre_mm, machine.rod_inertia_kg_m2)
            length, mass = machine.rod_length_mm, machine.rod_mass_kg
            usual = (length / 2, mass * (length / 1000) ** 2 / 12)
            centre, inertia = (u if g is None else g for g, u in zip(given, usual, strict=True))
            machine = replace(machine, rod_centre_mm=centre, rod_inertia_kg_m2=inertia)
        if solve.duration_s is not None:
            solve = replace(solve, duration_rev=None)
        if solve.output_step_s is not None:
            solve = replace(solve, output_step_deg=None)
        if contact.materials is not None:
            contact = replace(contact, stiffness_N_per_mm15=None)
        resolved = {"machine": machine, "solve": solve, "contact": contact}
        if self.joint != "both":
            unused = {joint: 0.0 for joint in JOINTS if joint != self.joint}
            resolved["clearance_mm"] = replace(self.clearance_mm, **unused)
        for name, value in resolved.items():
            object.__setattr__(self, name, value)

    @classmethod
    def from_attribute(cls, text: str) -> "Case":
        """The case of a stored dataset, from its `case` attribute (JSON of `values`)."""
        return cls.from_values(json.loads(text))

    def values(self) -> dict[str, Any]:
        """The case as plain nested values; `from_values` reads them back to an equal case."""
        plain: dict[str, Any] = {"name": self.name, "load": self.load, "joint": self.joint}
        for name in GROUPS:
            group = getattr(self, name)
            # `vars` has the fields in their order, since a group has nothing but fields
            plain[name] = (
                {key: value for key, value in vars(group).items() if value is not None}
                if group is not None
                else False
            )
        if self.contact.materials:
            plain["contact"]["materials"] = list(self.contact.materials)
        if self.joint == "none":
            del plain["clearance_mm"]
        if self.solve.rtol is not None:
            del plain["solve"]["accuracy"]
        elif self.targets:
            plain["solve"]["accuracy"] = dict(self.targets)
        return plain

    @property
    def rtol(self) -> float:
        """The relative tolerance asked for, by number or word; with `targets`, the first one."""
        if self.solve.rtol is not None:
            return self.solve.rtol
        accuracy = self.solve.accuracy
        return ACCURACY[accuracy].rtol if isinstance(accuracy, str) else first_rung(accuracy)

    @property
    def targets(self) -> Targets:
        """The greatest relative error of each metric that accuracy is asked for by."""
        return () if isinstance(self.solve.accuracy, str) else self.solve.accuracy

    @property
    def wants_bars(self) -> bool:
        """Whether metrics are to have error bars; accuracy by number cannot do without."""
        return self.solve.error_bars or bool(self.targets)

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
        """Duration, s."""
        if self.solve.duration_s is not None:
            return self.solve.duration_s
        return float(self.solve.duration_rev or 0.0) * self.turn

    @property
    def settle(self) -> float:
        """Time from which metrics count, s."""
        return self.solve.settle_rev * self.turn

    @property
    def steps(self) -> float:
        """Output steps in the duration, a whole number in a valid case."""
        if self.solve.output_step_s is not None:
            return self.duration / self.solve.output_step_s
        return self.duration * self.machine.speed_rpm * 6.0 / float(self.solve.output_step_deg or 1)

    @cached_property
    def physics_key(self) -> str:
        """Hash of what is simulated: the resolved physics and span, not how it is solved."""
        return _digest(self._identity(with_solver=False))

    @cached_property
    def key(self) -> str:
        """The job's identity: a hash of the resolved physics and solve settings and the model."""
        return _digest(self._identity(with_solver=True))

    def _identity(self, with_solver: bool) -> dict[str, Any]:
        values = self.values()
        for unread in ("name", "output", "solve"):
            del values[unread]
        values["model"] = MODEL_VERSION
        values["span"] = [self.duration, self.settle, round(self.steps)]
        if with_solver:
            accuracy = dict(self.targets) or self.rtol
            values["solver"] = [accuracy, self.solve.method, self.solve.max_steps]
        return values


def _digest(values: Mapping[str, Any]) -> str:
    text = json.dumps(values, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:20]


def parameters(owner: type = Case, prefix: str = "") -> Iterator[Parameter]:
    """All rows of the table, in the order of the case file."""
    for item in dataclasses.fields(owner):
        if item.name in GROUPS and owner is Case:
            yield from parameters(GROUPS[item.name], item.name + ".")
        else:
            row = dict(item.metadata)
            yield Parameter(key=prefix + item.name, default=item.default, **row)


@cache
def table() -> dict[str, Parameter]:
    """The table of parameters by dotted key, such as `machine.rod_mass_kg`."""
    return {row.key: row for row in parameters()}


def _part(key: str, value: Any, problems: list[Problem]) -> Any:
    """Check one top-level key and give the dataclass, scalar or None that stands for it."""
    if key in GROUPS:
        if key == "friction" and value is False:
            return None
        if key == "clearance_mm" and not isinstance(value, Mapping):
            value = dict.fromkeys(JOINTS, value)
        if not isinstance(value, Mapping):
            problems.append(Problem(key, f"needs a mapping of keys, not {shown(value)}"))
            return None
        try:
            found, wrong = _group(key, tuple((n, v, type(v)) for n, v in value.items()))
        except TypeError:  # a list or a mapping is in it
            found, wrong = _checked_group(key, value.items())
        problems += wrong
        return found
    if key not in table():
        problems.append(Problem(key, "unknown key"))
        return None
    return checked(key, value, problems)


@lru_cache(maxsize=256)
def _group(key: str, items: tuple[tuple[str, Any, type], ...]) -> tuple[Any, list[Problem]]:
    """A group from its values, and what is wrong; jobs of a sweep share those they have alike.

    Types are part of the values, since 1, 1.0 and true are equal.
    """
    return _checked_group(key, [(name, value) for name, value, _ in items])


def _checked_group(key: str, items: Iterable[tuple[str, Any]]) -> tuple[Any, list[Problem]]:
    problems: list[Problem] = []
    known = {item.name for item in dataclasses.fields(GROUPS[key])}
    values = dict(items)
    problems += [Problem(f"{key}.{name}", "unknown key") for name in values if name not in known]
    good = {n: checked(f"{key}.{n}", v, problems) for n, v in values.items() if n in known}
    return GROUPS[key](**good), problems


def checked(key: str, value: Any, problems: list[Problem]) -> Any:
    """A value as its dataclass holds it; what is wrong with it joins `problems`."""
    row = table()[key]
    if value is None and row.optional:
        return row.default
    if row.kind == "accuracy" and isinstance(value, Mapping):
        return checked_targets(key, value, problems)
    message = row.check(value)
    if message:
        problems.append(Problem(key, message))
        return value
    if row.kind == "number":
        return float(value) + 0.0  # no -0.0: equal cases have one key
    if row.kind == "integer":
        return int(value)
    return tuple(value) if row.kind == "materials" else value


def _given(values: Mapping[str, Any]) -> Iterator[str]:
    """Dotted keys that are set in nested values."""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from (f"{key}.{name}" for name, item in value.items() if item is not None)
        else:
            yield key


def _inertia_problems(case: Case) -> Iterator[Problem]:
    """A default inertia may leave the range that a given one must keep."""
    key = "machine.rod_inertia_kg_m2"
    message = table()[key].check(case.machine.rod_inertia_kg_m2)
    if message:
        yield Problem(key, f"m L^2 / 12 of the rod: {message}")
