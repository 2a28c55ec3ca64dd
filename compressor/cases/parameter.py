"""One row of the table of parameters: its readers, and what a value of it must satisfy.

Who reads a key: conditions on a case, in the language of `--only` (`compressor.cases.comparison`).
The fields of the groups name theirs (`read=`), and so do the groups in `compressor.cases.table`. A
key without one is read by every job. `compressor.cases.conflicts` refuses what no job reads.

`compressor.cases.table` builds the whole table from these; units are those of the case file, and
`to_si` turns a value into SI.

Accuracy as it may be requested: in words that promise, or in numbers by metric. Tolerances come
from the measured trade of tests/results/accuracy.json (make accuracy), for `method: auto`.
"""

import dataclasses
import inspect
import math
import re
import reprlib
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from functools import lru_cache, partial
from inspect import cleandoc
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Generic,
    Literal,
    NamedTuple,
    TypeVar,
    dataclass_transform,
)

import pydantic
from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
)

from compressor.cases.card import CardError, mark_card
from compressor.cases.laws import CONTACT_LAWS, FRICTION_LAWS, READ_BY
from compressor.metrics import METRICS
from compressor.program import CompsimError, did_you_mean

GAS = "load == gas"
CRANK_END = "gas.action == double or gas.action == crank_end"
HEAD_END = "gas.action != crank_end"
CYCLE = "not gas.is_measured"  # by an indicator card of an end that presses
MEASURED = "gas.is_measured"
HEAD_CLEARANCE = "gas.action != crank_end or not gas.clearance_percent.crank"
SPRING = "load == spring"
A_JOINT = "joint != none"
BIG_END = "joint == big_end or joint == both"
SMALL_END = "joint == small_end or joint == both"
CLEARANCE = "clearance_mm.big_end > 0 or clearance_mm.small_end > 0"
BIG_CLEARANCE = "clearance_mm.big_end > 0"
SMALL_CLEARANCE = "clearance_mm.small_end > 0"
IDEAL_JOINT = "not (clearance_mm.big_end > 0 and clearance_mm.small_end > 0)"
PLAY = "guide.clearance_mm > 0"
CONTACT = f"{CLEARANCE} or {PLAY}"
RUBBING = f"{CLEARANCE} or friction.ideal_joints == true"
RUBBING_AT = {
    "big_end": f"{BIG_CLEARANCE} or friction.ideal_joints == true",
    "small_end": f"{SMALL_CLEARANCE} or friction.ideal_joints == true",
}
AT_JOINTS = {"big_end": BIG_CLEARANCE, "small_end": SMALL_CLEARANCE}
GUIDE = f"guide.friction > 0 or {PLAY}"
GUIDE_FRICTION = "guide.friction > 0"
MATERIALS = "contact.materials"
DAMPED = "contact.restitution > 0"  # which johnson and liu need not have
STIFFNESS = (CLEARANCE, "contact.law != johnson and contact.law != liu")
BODY = "body"
STEADY = "body.start == steady"
ALONG_X = ("body", "body.freedoms != y")
ALONG_Y = ("body", "body.freedoms != x")
ROCKING = "body.freedoms == xy_rocking"
# the guide bears no force along x
CASING_SENSED = (
    "body",
    "sensor.place == bearing or sensor.place == guide and sensor.direction == y",
)
CASING = (*CASING_SENSED, "body.casing == true")
RANDOM = "sensor.noise_m_per_s2 > 0 or sensor.speed_jitter > 0"
THRESHOLD = "sensor.threshold_m_per_s2 > 0"
SERIES = "output.keep == series"


def or_own(key: str) -> str:
    """Return who reads a key of `contact` that a guide's corner may have of its own."""
    return f"{CLEARANCE} or not guide.{key} >= 0"


def by_law(group: str, key: str) -> tuple[str, ...]:
    """Return who reads a key of contact or friction that some laws alone read."""
    readers = READ_BY[group][key]
    every = CONTACT_LAWS if group == "contact" else FRICTION_LAWS
    others = [law for law in every if law not in readers]
    if "adams" in readers or len(others) < len(readers):  # which a file need not name
        return group, " and ".join(f"{group}.law != {law}" for law in others)
    return (" or ".join(f"{group}.law == {law}" for law in readers),)


IMPLAUSIBLE = 0.1  # of the journal radius: a penetration the contact law was never meant for
NAME = re.compile(r"[A-Za-z0-9._-]{1,64}")
# metal of a bush or a pin -> which of ours to take for it, by its modulus of elasticity
COPPER = "copper, whose modulus is nearest"
SOFT = "copper, the softer one, or give contact.stiffness_N_per_mm15: babbitt has about 50 GPa"
OTHER_WORDS = dict.fromkeys(("bronze", "brass", "cast iron", "cast_iron"), COPPER)
OTHER_WORDS |= dict.fromkeys(("babbitt", "babbit", "white metal", "white_metal"), SOFT)
OTHER_WORDS["dopri5"] = "RK45, the same pair in SciPy, or auto"
NO_VALUE = "has no value; leave the key out to get its default"
# a number that is written as text, with a comma or a unit
AS_NUMBER = re.compile(r"\s*([-+]?\d+(?:([.,])\d+)?(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.ASCII)

# case-file unit -> (SI unit, numerator, denominator): SI value = value * numerator / denominator
UNITS = {
    "": ("1", 1, 1),
    "%": ("1", 1, 100),
    "mm": ("m", 1, 1000),
    "m": ("m", 1, 1),
    "kg": ("kg", 1, 1),
    "kg m2": ("kg m2", 1, 1),
    "m/s2": ("m/s2", 1, 1),
    "rpm": ("rad/s", math.pi, 30),
    "MPa": ("Pa", 1_000_000, 1),
    "GPa": ("Pa", 1_000_000_000, 1),
    "N": ("N", 1, 1),
    "mPa s": ("Pa s", 1, 1000),
    "N m": ("N m", 1, 1),
    "N m s": ("N m s", 1, 1),
    "kg mm": ("kg m", 1, 1000),
    "mm3/(N m)": ("m3/(N m)", 1, 1_000_000_000),
    "h": ("s", 3600, 1),
    "N/mm": ("N/m", 1000, 1),
    "N/mm^p": ("N/m^p", 1, 1),  # times 1000^exponent: see compressor.solve.si_record
    "N s/mm": ("N s/m", 1000, 1),
    "mm/s": ("m/s", 1, 1000),
    "1/mm": ("1/m", 1000, 1),
    "s/mm": ("s/m", 1000, 1),
    "s": ("s", 1, 1),
    "deg": ("rad", math.pi, 180),
    "Hz": ("Hz", 1, 1),
    "rev": ("rev", 1, 1),
}

Group = TypeVar("Group")
Value = TypeVar("Value")
PARTS = ConfigDict(extra="forbid", revalidate_instances="always")


@pydantic.dataclasses.dataclass(frozen=True, config=PARTS)
class PerJoint(Generic[Value]):
    """A value of each joint, such as a case's `clearance_mm`, mm: 0 where a joint is ideal.

    In values and case files one number stands for both:

    >>> import compressor
    >>> compressor.Case.from_values({"joint": "both", "clearance_mm": 0.2}).clearance_mm
    PerJoint(big_end=0.2, small_end=0.2)
    >>> pins = {"pin_radius_mm": {"big_end": 60, "small_end": 35}}
    >>> compressor.Case.from_values({"machine": pins}).machine.pin_radius_mm.small_end
    35.0
    """

    big_end: Value
    small_end: Value

    def at(self, joint: str) -> Value:
        """Return the value of a joint, big_end or small_end."""
        return self.big_end if joint == "big_end" else self.small_end


@pydantic.dataclasses.dataclass(frozen=True, config=PARTS)
class PerEnd(Generic[Value]):
    """A value of each end of a cylinder; one number in a case file stands for both."""

    head: Value
    crank: Value


@pydantic.dataclasses.dataclass(frozen=True, config=PARTS)
class PerValve(Generic[Value]):
    """A value of the suction and of the discharge valves; one number stands for both."""

    suction: Value
    discharge: Value


@pydantic.dataclasses.dataclass(frozen=True, config=PARTS)
class PerMotion(Generic[Value]):
    """A value of what rotates and of what reciprocates; one number stands for both."""

    rotating: Value
    reciprocating: Value


BY_PART = PerJoint | PerEnd | PerValve | PerMotion
PART_WORDS = {
    "big_end": "of the big end", "small_end": "of the small end", "head": "of the head end",
    "crank": "of the crank end", "suction": "of the suction valves",
    "discharge": "of the discharge valves", "rotating": "of what rotates",
    "reciprocating": "of what reciprocates",
}  # fmt: skip


@dataclass(frozen=True)
class Problem:
    """What is wrong with one key of a case."""

    key: str
    message: str

    def __str__(self) -> str:
        return f"{self.key}: {self.message}" if self.key else self.message


class CaseError(CompsimError, ValueError):
    """A case that cannot be simulated; raised by `Case.from_values`. Also a ValueError.

    `problems` lists everything that is wrong with it, each with its dotted `key` and a `message`
    that says what was given, what is allowed, and what to write. The error's text has a line for
    each:

    >>> import compressor
    >>> try:
    ...     compressor.Case.from_values({"joint": "top", "machine": {"speed": "700 rpm"}})
    ... except compressor.CaseError as error:
    ...     print(error)
    joint: needs none, big_end, small_end or both, not 'top'
    machine.speed: unknown key; did you mean machine.speed_rpm?
    """

    exit_code = 2

    def __init__(self, problems: Sequence[Problem], is_misfit: bool = False):
        self.problems = problems
        self.is_misfit = is_misfit  # of values that are good alone and do not fit each other
        super().__init__(problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))


MAX_WORD = 100  # characters that are looked at to find what was meant
SHORT_REPR = reprlib.Repr()
SHORT_REPR.maxstring = SHORT_REPR.maxother = SHORT_REPR.maxlong = 60


def quote_value(value: Any) -> str:
    """Return a value as an error message quotes it: control characters escaped, long values cut."""
    if isinstance(value, bool):
        return str(value).lower()
    return SHORT_REPR.repr(value)


@lru_cache(4096)  # the jobs of a study share most of their values
def to_si(value: float, unit: str) -> float:
    """Return a case-file value in SI. Raises KeyError for a unit that is none of `UNITS`.

    Powers of ten are divided, so that 0.1 mm is exactly 1e-4 m.
    """
    _, numerator, denominator = UNITS[unit]
    return value * numerator / denominator


class Span(NamedTuple):
    """Two numbers that a value may well be: factors of it, or values in the case file's unit."""

    low: float
    high: float
    are_factors: bool = True

    def ends(self, value: float) -> list[float]:
        """Return the two values around one, those that are not the value itself."""
        each = [self.low * value, self.high * value] if self.are_factors else [self.low, self.high]
        return [end for end in each if abs(end - value) > 1e-9 * abs(value)]

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g}" + " times" * self.are_factors


def times(low: float, high: float) -> Span:
    """Return a span of factors."""
    return Span(low, high)


def from_to(low: float, high: float) -> Span:
    """Return a span of values in the case file's unit."""
    return Span(low, high, are_factors=False)


class Plausible(NamedTuple):
    """How far a number of a plant's machine may be from what a case has, and why.

    `left_out`: where the file does not give it. `given`: where it does, of what a plant can only
    guess; None of what is known where it is given. `compsim explain --models` varies both.
    """

    why: str
    left_out: Span
    given: Span | None = None

    def __str__(self) -> str:
        also = f"; given, {self.given}" if self.given else ""
        return f"{self.left_out}{', given or not' if self.given == self.left_out else also}"


@dataclass(frozen=True)
class Parameter:
    """One row of the table of parameters; `low` and `high` are in the case file's unit."""

    key: str
    unit: str
    default: Any
    low: float
    high: float
    above: bool  # whether `low` itself is excluded
    source: str
    phrase: str
    kind: str  # number | integer | boolean | choice | text | materials | accuracy
    choices: tuple[str, ...] = ()
    optional: bool = False
    identity: bool = True  # whether it is part of a job's identity
    aliases: tuple[tuple[str, str], ...] = ()  # other words, each with the choice it stands for
    judged: tuple[float, float] | None = None  # range that extreme scenes are drawn from
    read: tuple[str, ...] = ()  # conditions that all hold where a case reads it
    plausible: Plausible | None = None  # where there is a doubt about it

    @property
    def label(self) -> str:
        """Return the phrase without its remarks, such as a coordinate's `long_name`."""
        return re.split(r"[:;]| \(", self.phrase)[0]

    @property
    def range(self) -> str:
        """Return the allowed values, for a table or an error."""
        if self.kind == "choice":
            return " | ".join(self.choices)
        if self.kind == "boolean":
            return " | ".join([*self.choices, "true", "false"])
        if self.kind == "accuracy":
            return " | ".join(self.choices) + " | {metric: relative error}"
        if self.kind == "materials":
            return "two of " + ", ".join(self.choices)
        if self.kind == "text":
            return "[A-Za-z0-9._-], at most 64"
        if self.kind == "card":
            return "path of a CSV file"
        opening = "(" if self.above else "["
        return " | ".join([*self.choices, f"{opening}{self.low:g}, {self.high:g}]"])

    @property
    def needed(self) -> str:
        """Return the allowed values in words, with their unit."""
        words = join_with_or(self.choices)
        if self.kind == "choice":
            return words
        if self.kind == "boolean":
            return join_with_or([*self.choices, "true", "false"])
        if self.kind == "accuracy":
            return f"{words}, or errors by metric such as {{peak_acceleration: 0.01}}"
        if self.kind == "materials":
            return f"a pair of materials, {words}, such as [steel, steel]"
        if self.kind == "text":
            return "text"
        if self.kind == "card":
            return "the path of a CSV file with columns crank_angle_deg and pressure_bar"
        span = f"{'(' if self.above else '['}{self.low:g}, {self.high:g}]"
        number = "a whole number" if self.kind == "integer" else "a number"
        return " or ".join([*self.choices, f"{number} in {span} {self.unit}".strip()])

    @property
    def judged_on(self) -> str:
        """Return the range that the program was judged on, "" without one."""
        return "{:g} to {:g}".format(*self.judged) if self.judged else ""

    @property
    def readers(self) -> str:
        """Return what a case file sets so that the key is read; "" where every job reads it.

        Of "a" and "a or b" it is "a".
        """
        needed = [one for one in self.read if not any(o != one and o in one for o in self.read)]
        return "; ".join(dict.fromkeys(needed))

    def choice_of(self, value: Any) -> Any:
        """Return the choice that an alias stands for, and any other value as it is."""
        return next((choice for alias, choice in self.aliases if alias == value), value)

    def check(self, value: Any) -> str | None:
        """Return what is wrong with a scalar value of this parameter, or None."""
        try:
            adapter_of(self).validate_python(value)
        except ValidationError as error:
            cause = error.errors(include_url=False)[0].get("ctx", {}).get("error", "")
            return self.explain(value, str(cause))
        return None

    def explain(self, value: Any, cause: str = "") -> str:
        """Return the error of a wrong value; cause: what a check of our own has said of it."""
        if value is None:
            return NO_VALUE
        if cause:
            return cause
        if self.kind in ("number", "integer") and type(value) in (int, float):
            if not _is_finite(value):
                return f"must be finite: {self._refused(value)}"
            if self.kind == "integer" and value != int(value):
                return self._refused(value)
            return f"{value:g} is outside {self.range} {self.unit}".rstrip()
        if self.kind == "materials" and isinstance(value, tuple | list) and len(value) == 2:
            return self._refused(value, next(name for name in value if name not in self.choices))
        return self._refused(value, None if self.kind == "materials" else value)

    def problem(self, key: str, value: Any, path: Sequence[str], cause: str) -> Problem | None:
        """Return the problem of a wrong value at a key, whose path within it pydantic tells.

        None of errors by metric that are no accuracy in a word.
        """
        if self.kind != "accuracy" or not isinstance(value, Mapping):
            return Problem(key, self.explain(value, cause))
        if not value:
            return Problem(key, "needs a metric, such as {peak_acceleration: 0.01}")
        metric = next((str(name) for name in value if str(name) in path), "")
        if not metric:
            return None
        if metric not in METRICS:
            hint = did_you_mean(metric, METRICS) or "metrics are " + ", ".join(METRICS)
            return Problem(f"{key}.{metric}", f"unknown metric; {hint}")
        return Problem(f"{key}.{metric}", TARGET.explain(value[metric], cause))

    def _refused(self, value: Any, word: Any = None) -> str:
        """Return the error of a value of another kind.

        `word`: what may be a choice that is misspelt.
        """
        message = f"needs {self.needed}, not {quote_value(value)}"
        if not isinstance(word, str):
            return message
        lower = dict(self.aliases)
        lower |= {choice.lower(): choice for choice in (*self.choices, "true", "false")}
        if word.lower() in OTHER_WORDS:
            return f"{message}; take {OTHER_WORDS[word.lower()]}"
        near = get_close_matches(word[:MAX_WORD].lower(), lower, n=1)
        if near and lower[near[0]] in self.needed:
            return f"{message}; did you mean {lower[near[0]]}?"
        if self.kind in ("number", "integer") and (number := AS_NUMBER.fullmatch(word[:MAX_WORD])):
            plain, comma, unit = number[1].replace(",", "."), number[2] == ",", number[3]
            if unit and unit != self.unit:
                return f"{message}; write a number alone" + (self.unit and f", in {self.unit}")
            text = f"{message}; write {plain}" + ("" if comma or unit else " without quotes")
            first, _, second = number[1].partition(",")
            several = len(first) == len(second) > 1  # 700,800 is no decimal comma
            return f"{text}, or [{number[1].replace(',', ', ')}]" if several else text
        return message


def join_with_or(words: Sequence[str]) -> str:
    """Return the words as a sentence lists them: a, b or c."""
    return " or ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def _is_finite(value: float) -> bool:
    """Return whether a number fits a float, also for integers that are too large for `math`."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def to_python(value: Any) -> Any:
    """Return a scalar of numpy or xarray, and a number beyond any float, as Python has it."""
    if getattr(value, "ndim", None) == 0 and hasattr(value, "item"):
        return value.item()
    return value if type(value) is not int or value.bit_length() < 1000 else math.inf


def to_whole(value: Any) -> Any:
    """Return a whole number as an integer, and any other value as it is."""
    value = to_python(value)
    return int(value) if type(value) is float and value.is_integer() else value


def refuse_tiny(unit: str, value: float) -> float:
    """Return a number, 0 for -0. Raises ValueError for one that is 0 in SI and not in its unit."""
    if value and abs(to_si(value, unit)) < sys.float_info.min:
        raise ValueError(f"{value:g} is too small to differ from 0: write 0, or a larger number")
    return value + 0.0


def check_name(value: str) -> str:
    """Return the name of a study. Raises ValueError for one that no file could have."""
    if NAME.fullmatch(value) and not value.startswith("."):
        return value
    allowed = "[A-Za-z0-9._-], at most 64"
    raise ValueError(f"{quote_value(value)} is no name: use {allowed}, no leading dot")


def check_cards(value: PerEnd[str | None] | None) -> PerEnd[str | None] | None:
    """Return the paths of cards with their digests. Raises ValueError for a file that is none."""
    if value is None:
        return None
    try:
        marked = {end: card and mark_card(card, end) for end, card in vars(value).items()}
    except CardError as error:
        raise ValueError(str(error)) from error
    return PerEnd(**marked)


TARGET = Parameter("", "", None, 1e-9, 0.5, True, "", "", "number")


def annotation_of(row: Parameter) -> Any:
    """Return the type by which pydantic checks the values of a row."""
    words: Any = Literal[row.choices] if row.choices else None
    ends: dict[str, Any] = {"gt" if row.above else "ge": row.low, "le": row.high}
    kinds: dict[str, Any] = {
        "number": Annotated[
            float, BeforeValidator(to_python), Field(strict=True, allow_inf_nan=False, **ends),
            AfterValidator(partial(refuse_tiny, row.unit)),
        ],
        "integer": Annotated[int, BeforeValidator(to_whole), Field(strict=True, **ends)],
        "boolean": Annotated[bool, BeforeValidator(to_python), Field(strict=True)],
        "text": Annotated[str, Field(strict=True), AfterValidator(check_name)],
        "card": Annotated[str, Field(strict=True, min_length=1)],
        "materials": tuple[words, words],
        "accuracy": BY_METRIC,
    }  # fmt: skip
    found: Any = kinds.get(row.kind)
    if words is not None and row.kind != "materials":
        found = words if found is None else words | found
    if row.optional:
        found = found | None
    return Annotated[found, BeforeValidator(row.choice_of)] if row.aliases else found


BY_METRIC: Any = None
BY_METRIC = Annotated[
    dict[Literal[tuple(METRICS)], annotation_of(TARGET)],  # type: ignore[misc]
    BeforeValidator(lambda value: dict(value) if isinstance(value, tuple) else value),
    Field(min_length=1),
]


@lru_cache
def adapter_of(row: Parameter) -> TypeAdapter[Any]:
    """Return what checks values of a row alone."""
    return TypeAdapter(annotation_of(row))


def problems_of(
    error: ValidationError, rows: Mapping[str, Parameter], values: Mapping[str, Any]
) -> list[Problem]:
    """Return what is wrong with the fields of a group or a case that is made in Python."""
    found: dict[Problem | None, None] = {}
    for one in error.errors(include_url=False):
        cause, path = one.get("ctx", {}).get("error", ""), [*map(str, one["loc"])]
        if isinstance(cause, CaseError):  # of values that do not fit together
            found |= dict.fromkeys(cause.problems)
        elif path[0] in rows:
            name = path[0]
            found[rows[name].problem(name, values.get(name), path[1:], str(cause))] = None
        elif parts := {key.partition(".")[2]: row for key, row in rows.items()
                       if key.startswith(f"{path[0]}.")}:  # fmt: skip
            value = values.get(path[0])
            told = problem_of_parts(path[0], value, parts, path[1:], one["type"], str(cause))
            found[told] = None
        else:
            found[Problem(".".join(path[:2]), one["msg"])] = None
    return [problem for problem in found if problem]


def problem_of_parts(
    key: str,
    value: Any,
    rows: Mapping[str, Parameter],
    path: Sequence[str],
    kind: str,
    cause: str,
) -> Problem | None:
    """Return the problem of a key by part: of the part that a path names, or of the whole."""
    if isinstance(value, BY_PART) and vars(value).keys() == rows.keys():
        value = vars(value)
    within = [one for one in path if one in rows]
    if not isinstance(value, Mapping):
        return next(iter(rows.values())).problem(key, value, within[1:], cause)
    unknown = [str(name) for name in value if name not in rows]
    if unknown and kind in ("missing", "unexpected_keyword_argument", "invalid_key"):
        hint = did_you_mean(unknown[0], rows, {part: f"{key}.{part}" for part in rows})
        named = hint or f"{key} has {', '.join(rows)}"
        return Problem(f"{key}.{unknown[0]}", f"unknown key; {named}")
    if kind == "missing":
        needed = f"needs both, {' and '.join(rows)}, not {', '.join(value) or 'none'}"
        return Problem(key, f"{needed}; or one number for both")
    if not within:
        return Problem(key, cause)
    part = within[0]
    return rows[part].problem(f"{key}.{part}", value[part], within[1:], cause)


if TYPE_CHECKING:

    @dataclass_transform(frozen_default=True, field_specifiers=(field,))
    def make_group(cls: type[Group]) -> type[Group]: ...

else:

    def make_group(cls):
        """Return a group of keys as a frozen dataclass that pydantic checks as it is made.

        A group of wrong values raises CaseError with everything that is wrong.
        """
        own = {}
        for one in reversed(cls.__mro__):
            own |= vars(one).get("__annotations__", {})
        for name, item in vars(cls).items():
            if isinstance(item, dataclasses.Field) and "kind" in item.metadata:
                (row,) = rows_of(name, item)
                cls.__annotations__[name] = annotation_of(row)
            elif isinstance(item, dataclasses.Field) and "parts" in item.metadata:
                parts = [*rows_of(name, item)]
                one = item.metadata["of"][annotation_of(parts[0])]
                one = one | None if item.default is None else one
                if parts[0].kind == "card":
                    one = Annotated[one, AfterValidator(check_cards)]
                cls.__annotations__[name] = Annotated[
                    one, BeforeValidator(partial(spread, item.metadata))
                ]
            elif isinstance(item, dataclasses.Field) and "open" in item.metadata:
                opened = BeforeValidator(item.metadata["open"])
                cls.__annotations__[name] = Annotated[own[name], opened]
        made = pydantic.dataclasses.dataclass(frozen=True, config=ConfigDict(extra="forbid"))(cls)
        rows = {row.key: row for item in fields(made) for row in rows_of(item.name, item)}
        validate = made.__init__

        def __init__(self, *args, **values):
            try:
                validate(self, *args, **values)
            except ValidationError as error:
                raise CaseError(problems_of(error, rows, values)) from None

        made.__init__ = __init__
        made.__signature__ = inspect.Signature(
            inspect.Parameter(
                item.name, inspect.Parameter.POSITIONAL_OR_KEYWORD, default=item.default,
                annotation=own[item.name],
            )
            for item in fields(made)
        )  # fmt: skip
        made.__annotations__ = own
        return made


def by_part(
    of: type,
    default: Any,
    row: Any,
    read: Mapping[str, Any] | None = None,
    fill: Any = ...,
    first: bool = False,
) -> Any:
    """Return the field of a key that has a value for each part of a thing, or one for all.

    of: the class of its values, such as PerJoint. row: the field, by `parameter` or `choice`, of
    one part. fill: what a part has that is not given beside another one; without, it is needed.
    first: whether one value is that of the first part alone. read: the conditions of each part.
    """
    parts = {}
    for name in (item.name for item in fields(of)):
        own = dict(row.metadata)
        conditions: Any = (read or {}).get(name, own["read"])
        own["read"] = (conditions,) if isinstance(conditions, str) else tuple(conditions)
        head = re.split(r"[:;,]| \(", own["phrase"])[0]
        own["phrase"] = f"{head} {PART_WORDS[name]}{own['phrase'][len(head) :]}"
        parts[name] = own
    whole = None if default is None else of(*[default] * len(parts))
    return field(default=whole, metadata={"of": of, "parts": parts, "fill": fill, "first": first})


def rows_of(key: str, item: Any, above: tuple[str, ...] = ()) -> Iterator[Parameter]:
    """Yield the rows of a field, of one by part those of the parts; above: conditions of its group.

    Of a field of another kind none.
    """
    whole = {"": item.metadata} if "kind" in item.metadata else {}
    for part, row in item.metadata.get("parts", whole).items():
        default = getattr(item.default, part, None) if part else item.default
        name = f"{key}.{part}" if part else key
        yield Parameter(name, default=default, **{**row, "read": (*above, *row["read"])})


def spread(metadata: Mapping[str, Any], value: Any) -> Any:
    """Return a value by part: one that stands for all parts, or one of some with the others."""
    parts = metadata["parts"]
    if isinstance(value, metadata["of"]) or value is None:
        return value
    if not isinstance(value, Mapping):
        value = {next(iter(parts)): value} if metadata["first"] else dict.fromkeys(parts, value)
    filled = {} if metadata["fill"] is ... else dict.fromkeys(parts, metadata["fill"])
    return {**filled, **value}


def parameter(
    default: Any, unit: str, span: tuple[float, float], source: str, phrase: str, **more: Any
) -> Any:
    """Return a dataclass field that is also a row of the table; more: of `Parameter`."""
    row = {"unit": unit, "low": span[0], "high": span[1], "above": False, "source": source}
    row |= {"phrase": phrase, "kind": "number"}
    return _field(default, row | more)


def choice(default: Any, choices: tuple[str, ...], source: str, phrase: str, **more: Any) -> Any:
    """Return a field whose value is one of a few words, or of another `kind` that is given."""
    row = {"unit": "", "low": 0.0, "high": 0.0, "above": False, "source": source}
    row |= {"phrase": phrase, "kind": "choice", "choices": choices}
    return _field(default, row | more)


def _field(default: Any, row: dict[str, Any]) -> Any:
    """Return a dataclass field with a row; its `read` may be one condition, or several."""
    read = row.get("read", ())
    return field(
        default=default, metadata=row | {"read": (read,) if isinstance(read, str) else read}
    )


def document_fields(group: type[Group]) -> type[Group]:
    """Return a group's dataclass with its fields in the docstring: range, unit, default, source."""
    lines = []
    for item in fields(group):  # type: ignore[arg-type]
        rows = [*rows_of(item.name, item)]
        row, names = rows[0], [*item.metadata.get("parts", ())]
        phrase = row.phrase.replace(f" {PART_WORDS[names[0]]}", "") if names else row.phrase
        default = f"{row.default:g}" if isinstance(row.default, float) else repr(row.default)
        needed = row.needed.replace("true or false", "True or False")
        needed += f", or one for each: {', '.join(names)}" if names else ""
        notes = f" Judged on {row.judged_on}." if row.judged else ""
        readers = [one.readers for one in rows if one.read]
        notes += f" Read with {'; or '.join(dict.fromkeys(readers))}." if readers else ""
        notes += f" Plausible: {row.plausible} ({row.plausible.why})." if row.plausible else ""
        lines.append(
            f"- `{item.name}`: {phrase}. Needs {needed}; default {default} ({row.source}).{notes}"
        )
    text = cleandoc(group.__doc__ or "")
    group.__doc__ = f"{text}\n\nFields, with the sources of their defaults:\n\n" + "\n".join(lines)
    return group


def parameter_table(rows: Iterable[Parameter]) -> str:
    """Return the table of parameters in Markdown; `compressor.cases.table.table` has the rows."""
    heads = (
        "key", "unit", "default", "range", "judged on", "source", "what it is", "read with",
        "plausible",
    )  # fmt: skip
    lines = ["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for row in rows:
        default = "" if row.default is None or row.kind == "text" else str(row.default)
        default = default.lower() if row.kind == "boolean" else default.removesuffix(".0")
        cells = (
            f"`{row.key}`", row.unit, default, row.range, row.judged_on, row.source, row.phrase,
            row.readers, f"{row.plausible}: {row.plausible.why}" if row.plausible else "",
        )  # fmt: skip
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


@dataclass(frozen=True)
class Tier:
    """What a word stands for: the error that it promises, and the tolerance of the first run.

    `promise`: relative L2 error of acceleration after settling. `rtol` decides what a run costs,
    not what it keeps.
    """

    rtol: float
    promise: float


ACCURACY = {
    "draft": Tier(1e-5, 2e-2),
    "standard": Tier(1e-6, 5e-3),
    "fine": Tier(1e-8, 1e-4),
    "reference": Tier(5e-11, 1e-6),
}
LOOSEST, TIGHTEST = 2e-4, 1e-12  # of first runs for accuracy by number, and of any run for it
# of the error requested: the first tolerance. Bars are some 26 rtol in the median
FIRST_TOLERANCE_FACTOR = 0.01

Targets = tuple[tuple[str, float], ...]  # (metric, greatest relative error), by name


def first_tolerance(targets: Targets) -> float:
    """Return the tolerance of the first run where accuracy is given by number."""
    return min(LOOSEST, *(FIRST_TOLERANCE_FACTOR * target for _, target in targets))
