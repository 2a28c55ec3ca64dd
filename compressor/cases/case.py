"""The case: one fully resolved simulation, its identity, and the numbers that follow from it.

A job's key holds the version of the model: results of one version agree within the sum of their
error bars, and a change that moves numbers further is a new version, and so makes other jobs.
"""

import hashlib
import json
import math
from collections.abc import Mapping, Set
from dataclasses import field, replace
from functools import cached_property, lru_cache, partial
from typing import Any

import yaml
from pydantic import TypeAdapter, ValidationError, model_validator
from pydantic_core import ArgsKwargs

from compressor.cases.card import ATMOSPHERE_MPA
from compressor.cases.checks import (
    describe_wrong,
    expand_synonyms,
    getter,
    stands_for,
    values_given,
)
from compressor.cases.conflicts import FACT_KEYS, RULES, given_conflicts, reads, unread_values
from compressor.cases.groups import Contact, Friction, Gas, Machine, Offset, Output, Solve, Spring
from compressor.cases.laws import CONTACT_LAWS, FRICTION_LAWS
from compressor.cases.optional_groups import (
    Body,
    Drive,
    Guide,
    Lubricant,
    Rod,
    Sensor,
    Wear,
    fill_guide,
    fill_wear,
)
from compressor.cases.parameter import (
    ACCURACY,
    BY_PART,
    CaseError,
    PerJoint,
    Targets,
    first_tolerance,
    make_group,
    name_as_written,
    problems_of,
    quote_value,
)
from compressor.cases.table import GROUPS, TOP, WORDS, parts_by_key, table
from compressor.cases.yaml_reader import Problem
from compressor.metrics import JOINTS

MODEL_VERSION = "3"  # of equations and of the meaning of what is stored; part of a key
MAX_REV = 50.0  # with `duration_rev: auto`
SOUND = PerJoint(0.0, 0.0)  # a healthy clearance that no case need name
FOLLOWING = ("gas.switching", "gas.back_pressure_MPa")  # from what else is given of a cylinder
OWN_GAS = {key for key in (*table(), *parts_by_key()) if key.startswith("gas.")} - {*FOLLOWING}
IN_KEY_IF_READ = {".".join(key.split(".")[:2]) for key in FACT_KEYS}
# values that a job's key does not have, as it has none of what is not given
AS_WITHOUT = {
    "machine.counterweight_kg_mm": 0.0, "contact.geometry": "external", "friction.law": "adams",
    "friction.ideal_joints": False,
}  # fmt: skip
EXAMPLE = {"joint": "big_end", "clearance_mm": 0.2}
KEY_TEXT = json.JSONEncoder(sort_keys=True, separators=(",", ":"), check_circular=False)
# the groups that results depend on; of `solve` the span and the solver are parts of a key
IDENTITY_GROUPS = tuple(name for name in GROUPS if name not in ("wear", "solve", "output"))


def group(name: str) -> Any:
    """Return the field of a group of keys."""
    of, word = GROUPS[name], WORDS.get(name)
    opened = partial(open_group, of, word)
    return field(default=None if word else of(), metadata={"open": opened})


def open_group(of: type, word: bool | None, value: Any) -> Any:
    """Return what a group is checked by: that of its word, a mapping as a dict, else the value."""
    if word is not None and value is word:
        return of() if word else None
    return dict(value) if isinstance(value, Mapping) else value


@make_group
class Case:
    """One fully resolved simulation: every value of a case file, in the case file's units.

    `Case.from_values` makes a valid one. `name` (of the study), `load` (spring, gas or none)
    and `joint` (none, big_end, small_end or both) are words; `clearance_mm` and
    `healthy_clearance_mm` have a value of each joint (PerJoint). The groups are `initial_offset_mm`
    (Offset), `machine`, `gas`, `spring`, `contact`, `friction`, `lubricant`, `guide`, `drive`,
    `rod`, `wear`, `body`, `sensor`, `solve` and `output`, each of the class of that name; friction
    and the seven after it may be None. A case never changes; `dataclasses.replace` makes another:

    >>> from dataclasses import replace
    >>> import compressor
    >>> case = compressor.Case.from_values({"joint": "big_end", "clearance_mm": 0.2})
    >>> case.machine.speed_rpm, case.clearance_mm.big_end
    (500.0, 0.2)
    >>> fast = replace(case, machine=replace(case.machine, speed_rpm=700))
    >>> fast.key == case.key
    False

    What does not fit together is refused, as by from_values:

    >>> replace(case, spring=compressor.Spring(stroke_mm=300))
    Traceback (most recent call last):
        ...
    compressor.cases.parameter.CaseError: spring.stroke_mm: 300 mm must be less than the piston's \
stroke, 240 mm

    What was filled in stays: a uniform rod's inertia beside another mass, where None fills it in
    anew, and the clearance 0 of a joint without play, so give another `joint` its `clearance_mm`.
    """

    name: str = TOP["name"]
    load: str = TOP["load"]
    joint: str = TOP["joint"]
    clearance_mm: PerJoint[float] = TOP["clearance_mm"]
    healthy_clearance_mm: PerJoint[float] = TOP["healthy_clearance_mm"]
    initial_offset_mm: Offset = group("initial_offset_mm")
    machine: Machine = group("machine")
    gas: Gas = group("gas")
    spring: Spring = group("spring")
    contact: Contact = group("contact")
    friction: Friction | None = group("friction")
    lubricant: Lubricant | None = group("lubricant")
    guide: Guide | None = group("guide")
    drive: Drive | None = group("drive")
    rod: Rod | None = group("rod")
    wear: Wear | None = group("wear")
    body: Body | None = group("body")
    sensor: Sensor | None = group("sensor")
    solve: Solve = group("solve")
    output: Output = group("output")

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> "Case":
        """Return a case of nested values as in a case file, without sweeps.

        values: words, numbers (also those of numpy) and, by group, mappings, in the units that
        stand in the keys. What is left out has its default; configs/README.md lists defaults,
        ranges and sources.

        Raises CaseError with everything that is wrong at once: unknown keys, wrong types, ranges,
        and values that do not fit each other, in the same words as for a case file.

        >>> import compressor
        >>> case = compressor.Case.from_values({
        ...     "joint": "both",
        ...     "clearance_mm": {"big_end": 0.1, "small_end": 0.2},
        ...     "machine": {"speed_rpm": 700, "rod_mass_kg": 3},
        ... })
        >>> case.machine.speed_rpm
        700.0
        """
        case = cls.resolve(values)
        written = expand_synonyms(values)[0]
        if unread := [*unread_values(case, values_given(written), find_given(written))]:
            raise CaseError(name_as_written(written, unread))
        return case

    @classmethod
    def resolve(cls, values: Mapping[str, Any]) -> "Case":
        """Return a case as `from_values` does, of values that it need not all read.

        Such are those of a job of a sweep over loads or laws, and what an older program has stored.
        Raises CaseError with everything else that is wrong.
        """
        if not isinstance(values, Mapping):
            message = f"needs a mapping of keys, such as {EXAMPLE}, not {quote_value(values)}"
            raise CaseError([Problem("", message)])
        whole, problems, given = plain_values(values)
        case = None
        try:
            case = ADAPTER.validate_python(whole)
        except ValidationError as error:
            problems += cls._problems_of(error, whole)
            if any(one["type"] != "value_error" or len(one["loc"]) for one in error.errors()):
                raise CaseError(name_as_written(whole, problems)) from None
        problems += given_conflicts(str(whole.get("joint", "none")), given)
        if case is None or problems:
            raise CaseError(name_as_written(whole, problems), is_misfit=True)
        return case

    @staticmethod
    def _problems_of(error: ValidationError, values: Mapping[str, Any]) -> list[Problem]:
        """Return what pydantic has found wrong with nested values, in our words."""
        return problems_of(error, values, table(), describe_wrong)

    @model_validator(mode="before")
    @classmethod
    def _require_clearances(cls, values: Any) -> Any:
        """Return the values; those of Python give the clearance of each joint with play."""
        if isinstance(values, ArgsKwargs):
            found = {"joint": "none", "clearance_mm": None} | (values.kwargs or {})
            given = find_given({"clearance_mm": found["clearance_mm"]})
            if problems := given_conflicts(str(found["joint"]), given):
                raise CaseError(problems)
        return values

    def __post_init__(self) -> None:
        """Fill in what depends on other groups; what needs a clearance goes without.

        Raises CaseError with everything that does not fit together.
        """
        values = vars(self)  # which alone can be written to: a case is frozen
        if self.guide:
            values["guide"] = fill_guide(self.guide, self.machine.reciprocating_mass_kg)
        if self.joint != "both":
            gaps = {one: self.clearance_mm.at(one) if one == self.joint else 0.0 for one in JOINTS}
            values["clearance_mm"] = PerJoint(**gaps)
        if self.joint == "none":  # which has no bore that oil fills, or that wears
            values["lubricant"] = values["wear"] = None
        if self.wear:
            values["wear"] = fill_wear(self.wear, self.clearance_mm)
        if problems := [Problem(*one) for rule in RULES for one in rule(self)]:
            raise CaseError(problems)

    @classmethod
    def from_attribute(cls, text: str) -> "Case":
        """Return the case of a stored Dataset, from its attribute `case` (JSON of `values`).

        Raises CaseError where this version of the program has no such case, and where the text is
        no JSON.

        >>> import compressor
        >>> case = compressor.Case.from_values({"joint": "big_end", "clearance_mm": 0.2})
        >>> compressor.Case.from_attribute(case.attributes()["case"]) == case
        True
        """
        try:
            values = json.loads(text)
        except (TypeError, ValueError, RecursionError) as error:
            message = (
                f"needs JSON text, such as the attribute `case` of a run, not {quote_value(text)}"
            )
            raise CaseError([Problem("", message)]) from error
        try:
            return cls.resolve(values)
        except CaseError as error:
            message = f"a stored case is of another version ({error}): run its case file again"
            raise CaseError([Problem("", message)]) from error

    def values(self) -> dict[str, Any]:
        """Return the case as plain nested values; `from_values` reads them back to an equal case.

        >>> import compressor
        >>> case = compressor.Case.from_values({"joint": "big_end", "clearance_mm": 0.2})
        >>> case.values()["clearance_mm"]
        {'big_end': 0.2, 'small_end': 0.0}
        >>> compressor.Case.from_values(case.values()) == case
        True
        """
        found: dict[str, Any] = {}
        for name in (*TOP, *GROUPS):
            value = getattr(self, name)
            is_sound = name == "healthy_clearance_mm" and value == SOUND
            is_default = is_sound or (value is None and WORDS[name])
            if is_default or (self.joint == "none" and name == "clearance_mm"):
                continue
            if name in GROUPS:
                found[name] = _plain_value(value)
            else:
                found[name] = value if isinstance(value, str) else dict(vars(value))
        return found

    @property
    def omega(self) -> float:
        """Return the crank speed, rad/s."""
        return self.machine.speed_rpm * math.pi / 30

    @cached_property
    def turn(self) -> float:
        """Return the time of one revolution, s."""
        return 60.0 / self.machine.speed_rpm

    @property
    def worn_joint(self) -> str:
        """Return which joints count as worn: none, big_end, small_end or both.

        Those that `joint` names, but for a clearance that is healthy.
        """
        worn = [
            joint
            for joint in JOINTS
            if self.joint in (joint, "both")
            and not 0.0 < self.healthy_clearance_mm.at(joint) >= self.clearance_mm.at(joint)
        ]
        return "both" if len(worn) > 1 else (*worn, "none")[0]

    @property
    def unbalance(self) -> float:
        """Return what is out of balance on the crank, towards its pin, kg mm.

        A drive's own unbalance less the counterweight, and so below 0 where that is the greater.
        """
        return self._own_unbalance - self.counterweight

    @property
    def counterweight(self) -> float:
        """Return the crank's counterweight, kg mm: as given, or by what it balances; 0 for none.

        What turns with the crank pin is the rod's share there, m (1 - a / L), and the crank's own
        unbalance, if a drive names one; the rest of the rod reciprocates.
        """
        machine = self.machine
        if machine.balance is None:
            return machine.counterweight_kg_mm or 0.0
        rotating, reciprocating = machine.balance.rotating, machine.balance.reciprocating
        at_crosshead = machine.rod_mass_kg * (machine.rod_centre_mm or 0.0) / machine.rod_length_mm
        at_pin = machine.rod_mass_kg - at_crosshead
        turning = at_pin * machine.crank_radius_mm + self._own_unbalance
        back_and_forth = (machine.reciprocating_mass_kg + at_crosshead) * machine.crank_radius_mm
        return rotating * turning + reciprocating * back_and_forth

    @property
    def _own_unbalance(self) -> float:
        """Return the crank's unbalance without its counterweight, kg mm, as a drive names it."""
        return self.drive.unbalance_kg_mm if self.drive else 0.0

    @cached_property
    def duration(self) -> float:
        """Return the duration, s; with `duration_rev: auto` the longest that it may come to."""
        if self.solve.duration_s is not None:
            return self.solve.duration_s
        given = self.solve.duration_rev
        return (MAX_REV if isinstance(given, str) else given or 0.0) * self.turn

    @property
    def settle(self) -> float:
        """Return the time from which metrics count, s; 0 with `auto`, until that is known."""
        given = self.solve.settle_rev
        return 0.0 if isinstance(given, str) else given * self.turn

    @property
    def steps(self) -> float:
        """Return the output steps in the duration, a whole number in a valid case."""
        if self.solve.output_step_s is not None:
            return self.duration / self.solve.output_step_s
        return self.duration * self.machine.speed_rpm * 6.0 / (self.solve.output_step_deg or 1.0)

    @property
    def rtol(self) -> float:
        """Return the relative tolerance of the first run, by `rtol` or by the accuracy."""
        if self.solve.rtol is not None:
            return self.solve.rtol
        accuracy = self.solve.accuracy
        return ACCURACY[accuracy].rtol if isinstance(accuracy, str) else first_tolerance(accuracy)

    @property
    def promise(self) -> float:
        """Return the relative L2 error of acceleration that `accuracy` promises; inf for none."""
        word = self.solve.accuracy
        named = isinstance(word, str) and self.solve.rtol is None
        return ACCURACY[str(word)].promise if named else math.inf

    @property
    def targets(self) -> Targets:
        """Return the greatest relative error of each metric, where accuracy is given by number."""
        return () if isinstance(self.solve.accuracy, str) else self.solve.accuracy

    @property
    def wants_bars(self) -> bool:
        """Return whether metrics are to have error bars; accuracy by number needs them."""
        return self.solve.error_bars or bool(self.targets)

    @property
    def chooses_forces(self) -> bool:
        """Return whether it has laws, a film or a load that runs by default do not have."""
        measured = self.load == "gas" and self.gas.is_measured
        own_law = self.contact.law != CONTACT_LAWS[0]
        own_law |= self.friction is not None and self.friction.law != FRICTION_LAWS[0]
        return measured or (self.joint != "none" and bool(own_law or self.lubricant))

    @property
    def needs_mechanism(self) -> bool:
        """Return whether a guide, a drive, a rod or rubbing joints need the general mechanism."""
        rubbing = self.friction and self.friction.ideal_joints
        return bool(self.guide or self.drive or self.rod or rubbing)

    @cached_property
    def physics_key(self) -> str:
        """Return the hash of physics and span, without the solver: 20 hexadecimal digits."""
        return digest({k: part for k, part in identity_of(self).items() if k != "solver"})

    @cached_property
    def key(self) -> str:
        """Return the job's identity: 20 hexadecimal digits.

        It is a hash of physics, solver and model version. Equal keys have equal results, within
        error bars, and a store holds each once. Name, output, time limit and error bars are no part
        of it.
        """
        return digest(identity_of(self))

    def attributes(self) -> dict[str, Any]:
        """Return what is stored of a case: `name`, `case` (JSON), `key` and `physics_key`."""
        text = json.dumps(self.values(), sort_keys=True)
        return {"name": self.name, "case": text, "key": self.key, "physics_key": self.physics_key}


def require_case(value: Any) -> Case:
    """Return a value that is a Case. Raises CaseError for any other."""
    if isinstance(value, Case):
        return value
    raise CaseError(
        [Problem("", f"needs a Case, as of Case.from_values, not {quote_value(value)}")]
    )


ADAPTER = TypeAdapter(Case)  # which checks the values of a case


def plain_values(values: Mapping[str, Any]) -> tuple[dict[str, Any], list[Problem], frozenset[str]]:
    """Return nested values without synonyms, and with what follows from others; problems; keys.

    The keys are those given (`find_given`). What follows is the geometry of materials, and the
    corners and the back pressure of a cylinder of one's own, which a value of it that is the
    paper's by chance leaves one's own.
    """
    whole, problems = expand_synonyms(values)
    given = find_given(whole)
    own_pin = {"machine.pin_radius_mm", "contact.materials"} <= given
    if own_pin and "contact.geometry" not in given and isinstance(whole.get("contact"), Mapping):
        whole["contact"] = {**whole["contact"], "geometry": "internal"}
    group = whole.get("gas", {})
    if has_own_cylinder(whole, given) and isinstance(group, Mapping):
        followed = {"switching": "exact", "back_pressure_MPa": ATMOSPHERE_MPA}
        whole["gas"] = followed | dict(group)
    return whole, problems, given


def find_given(values: Mapping[str, Any]) -> frozenset[str]:
    """Return the keys that nested values give, of parts both their own and that of the whole."""
    return _with_parts(frozenset(values_given(values)))


@lru_cache(4096)  # the jobs of a study give the same keys
def _with_parts(keys: frozenset[str]) -> frozenset[str]:
    above = {key.rpartition(".")[0] for key in keys} & parts_by_key().keys()
    return keys | above | {part for key in keys for part in stands_for(key)}


def has_own_cylinder(values: Mapping[str, Any], given: Set[str]) -> bool:
    """Return whether a cylinder is not the paper's; given: the dotted keys of nested values."""
    if not given.isdisjoint(OWN_GAS):
        return True
    has_gas = values.get("load") in ("gas", "typical")
    return has_gas and any(
        key in given for key in ("machine.crank_radius_mm", "machine.rod_length_mm")
    )


def identity_of(case: Case) -> dict[str, Any]:
    """Return what makes a case's results, of which its key is the hash, by name."""
    solve = case.solve
    # what is integrated and from where on it counts, however it is written
    duration: float | str = case.duration if solve.duration_rev != "auto" else "auto"
    settle: float | str = case.settle if solve.settle_rev != "auto" else "auto"
    accuracy = solve.rtol or dict(case.targets) or solve.accuracy
    found = {
        "joint": case.joint,
        "load": case.load,
        "model": MODEL_VERSION,
        "solver": (accuracy, solve.method, solve.max_steps),
        "span": (duration, settle, round(case.steps)),
        "facts": {
            key: value
            for key in FACT_KEYS
            if (value := getter(key)(case)) not in (None, AS_WITHOUT.get(key)) and reads(case, key)
        },
    }
    if case.joint != "none":
        found["clearance_mm"] = vars(case.clearance_mm)
    for name in IDENTITY_GROUPS:
        group = getattr(case, name)
        if group is not None or not WORDS[name]:
            found[name] = _choices_of(name, group)
    return found


def _choices_of(name: str, group: Any) -> Any:
    """Return what a group gives, without facts: those that are read are a part of their own."""
    if group is None:
        return False
    given = {
        key: vars(value) if isinstance(value, BY_PART) else value
        for key, value in vars(group).items()
        if value not in (None, AS_WITHOUT.get(path := f"{name}.{key}"))
        and path not in IN_KEY_IF_READ
    }
    if cards := given.get("indicator"):  # the digest counts, wherever the file is
        given["indicator"] = {end: card and card.rpartition("@")[2] for end, card in cards.items()}
    return given


def _plain_parts(value: Any) -> Any:
    """Return a value by part as a case file has it: one for all, or one of each that there is."""
    if not isinstance(value, BY_PART):
        return value
    each = {*vars(value).values()}
    found = {
        part: [*one] if isinstance(one, tuple) else one  # two materials
        for part, one in vars(value).items()
        if one is not None
    }
    return next(iter(found.values())) if len(each) == 1 else found


def _plain_value(group: Any) -> dict[str, Any] | bool:
    """Return a group as a mapping of what it gives, as a case file has it; False for None."""
    if group is None:
        return False
    # `vars` has the fields in their order, since a group has nothing but fields
    plain = {key: _plain_parts(one) for key, one in vars(group).items() if one is not None}
    if isinstance(group, Solve):
        if group.rtol is not None:
            del plain["accuracy"]
        elif group.accuracy and not isinstance(group.accuracy, str):
            plain["accuracy"] = dict(group.accuracy)
    return plain


def digest(identity: Mapping[str, Any]) -> str:
    """Return the hash of an identity, as one JSON text: 20 hexadecimal digits."""
    return hashlib.sha256(KEY_TEXT.encode(identity).encode()).hexdigest()[:20]


def with_ideal_joints(case: Case, features: bool = True) -> Case:
    """Return the case without clearance, and so without oil and wear.

    features: False gives the sound machine, which is rigid and at a steady speed: without friction,
    guide, drive, rod, body and sensor, too.
    """
    ideal = replace(case, joint="none", lubricant=None, wear=None)
    if features:
        return ideal
    return replace(ideal, friction=None, guide=None, drive=None, rod=None, body=None, sensor=None)


def to_yaml(case: Case) -> str:
    """Return a resolved case as the text of a case file, which reads back to an equal case.

    Values that the case does not read are left out. A job of a sweep over loads or laws may have
    some that are not the defaults: its text reads back to a case of the same physics and another
    key. A name that YAML 1.2 alone reads as a number, such as `1e5`, does not read back.
    """
    found: dict[str, Any] = {}
    for key, value in case.values().items():
        if isinstance(value, Mapping):
            value = {name: one for name, one in value.items() if reads(case, f"{key}.{name}")}
        if value != {}:
            found[key] = value
    return yaml.safe_dump(found, sort_keys=False, allow_unicode=True, width=math.inf)
