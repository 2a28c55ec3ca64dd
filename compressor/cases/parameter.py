"""One row of the table of parameters, and what a value of it must satisfy.

`compressor.cases.table` builds the whole table from the fields of the groups; units are those of
the case file, which stand at the end of a key's name, and `to_si` turns a value into SI.

Accuracy as it may be requested: in words that promise, or in numbers by metric. Tolerances come
from the measured trade of tests/results/accuracy.json (make accuracy), for `method: auto`.
"""

import dataclasses
import math
import re
import reprlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property, lru_cache, partial, reduce
from types import NoneType
from typing import Annotated, Any, Generic, Literal, TypeVar, dataclass_transform, get_args

import pydantic
from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
)

from compressor.cases.card import ATMOSPHERE_MPA, IN_MPA, CardError, mark_card
from compressor.cases.yaml_reader import Problem, is_number, read_comma
from compressor.metrics import METRICS
from compressor.program import MAX_WORD_LENGTH, CompsimError, did_you_mean

IMPLAUSIBLE = 0.1  # of the journal radius: a penetration the contact law was never meant for
NAME = r"^[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}$"
NO_VALUE = "has no value; leave the key out to get its default"
ABSOLUTE = f"pressures are absolute: add {ATMOSPHERE_MPA:g}, the atmosphere's, to a gauge's"
# a number that is written as text, with a decimal comma or a unit
AS_NUMBER = re.compile(r"\s*([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.ASCII)

# case-file unit -> numerator and denominator of its SI value
UNITS = {
    "": (1, 1), "%": (1, 100), "mm": (1, 1000), "m": (1, 1), "kg": (1, 1), "kg m2": (1, 1),
    "m/s2": (1, 1), "rpm": (math.pi, 30), "MPa": (1_000_000, 1), "GPa": (1_000_000_000, 1),
    "N": (1, 1), "mPa s": (1, 1000), "N m": (1, 1), "N m s": (1, 1), "kg mm": (1, 1000),
    "mm3/(N m)": (1, 1_000_000_000), "h": (3600, 1), "N/mm": (1000, 1),
    "N/mm^p": (1, 1),  # times 1000^exponent: see compressor.solve.si_record
    "N s/mm": (1000, 1), "mm/s": (1, 1000), "1/mm": (1000, 1), "s/mm": (1000, 1), "s": (1, 1),
    "deg": (math.pi, 180), "Hz": (1, 1), "rev": (1, 1),
}  # fmt: skip
# how a unit is written at the end of a key
WRITTEN = {unit: unit.replace(" ", "_").replace("/", "_per_") for unit in UNITS} | {
    "%": "percent", "N/mm^p": "N_per_mm15", "1/mm": "per_mm", "h": "hours",
    "mm3/(N m)": "mm3_per_N_m",
}  # fmt: skip
ENDS = {end: unit for unit, end in WRITTEN.items()}
# other units that people write -> that of our keys, and what one of it is there
OTHER_UNITS = {
    **{f"{unit}{end}": ("MPa", IN_MPA[unit]) for unit in ("bar", "psi") for end in ("", "a", "g")},
    "MPag": ("MPa", 1.0), "kPag": ("MPa", IN_MPA["kpa"]),
    "kPa": ("MPa", IN_MPA["kpa"]), "Pa": ("MPa", 1e-6), "um": ("mm", 1e-3), "cm": ("mm", 10.0),
    "m": ("mm", 1e3), "in": ("mm", 25.4), "inch": ("mm", 25.4), "mil": ("mm", 0.0254),
    "mils": ("mm", 0.0254), "kN": ("N", 1e3), "g": ("m/s2", 9.80665), "lb": ("kg", 0.45359237),
    "lbs": ("kg", 0.45359237), "Hz": ("rpm", 60.0), "cP": ("mPa s", 1.0),
}  # fmt: skip

Group = TypeVar("Group")
Value = TypeVar("Value")
PARTS = ConfigDict(extra="forbid", revalidate_instances="always")


@lru_cache
def split_unit(name: str) -> tuple[str, str]:
    """Return a key's name without its unit, and the unit; "" for a name that ends in none.

    >>> split_unit("damping_N_s_per_mm"), split_unit("exponent")
    (('damping', 'N s/mm'), ('exponent', ''))
    """
    end = max((one for one in ENDS if f"_{name}".endswith(f"_{one}")), key=len, default="")
    return name.removesuffix(f"_{end}" if end else ""), ENDS[end]


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


LED = "gas.indicator"  # key whose one value is that of its first part alone
BY_PART = PerJoint | PerEnd | PerValve | PerMotion
PART_WORDS = {
    "big_end": "of the big end", "small_end": "of the small end", "head": "of the head end",
    "crank": "of the crank end", "suction": "of the suction valves",
    "discharge": "of the discharge valves", "rotating": "of what rotates",
    "reciprocating": "of what reciprocates",
}  # fmt: skip


# names of pins -> the joint that each is in
PINS = {
    "crank_pin": "big_end", "crosshead_pin": "small_end", "wrist_pin": "small_end",
    "gudgeon_pin": "small_end",
}  # fmt: skip


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

    def __init__(self, problems: Sequence[Problem], is_misfit: bool = False):
        self.problems = problems
        self.is_misfit = is_misfit  # of values that are good alone and do not fit each other
        super().__init__(problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))


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
    numerator, denominator = UNITS[unit]
    return value * numerator / denominator


def convert_other(value: Any, unit: str) -> str:
    """Return what to write of a value in a unit of `OTHER_UNITS`."""
    ours, factor = OTHER_UNITS[unit]
    is_gauge, note = ours == "MPa" and unit.endswith("g"), ""
    if is_gauge:
        note = f", absolute: with the atmosphere's {ATMOSPHERE_MPA:g}"
    elif ours == "MPa" and unit not in ("bara", "psia"):
        note = f"; if a gauge shows it, add the atmosphere's {ATMOSPHERE_MPA:g}"
    each = f"..., 1 {unit} being {factor:g} {ours}"
    absolute = f"{value * factor + is_gauge * ATMOSPHERE_MPA:.6g}" if is_number(value) else each
    return absolute + note


# kind -> what it may be beside the words of its row
OTHERWISE = {
    "accuracy": "errors by metric such as {peak_acceleration: 0.01}",
    "text": "a name of up to 64 letters [A-Za-z0-9._-], without a leading dot",
    "card": "the path of a CSV file with columns crank_angle_deg and pressure_bar",
}


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
    # whether it is of the machine: a file may give it though no job reads it, so that one file
    # serves the machine with clearance and without; of the gas, of a cylinder that is there
    fact: bool = False

    @property
    def label(self) -> str:
        """Return the phrase without its remarks, such as a coordinate's `long_name`."""
        return re.split(r"[:;]| \(", self.phrase)[0]

    @property
    def is_number(self) -> bool:
        """Return whether its values are numbers, beside words."""
        return self.kind in ("number", "integer")

    @property
    def words(self) -> list[str]:
        """Return the words that it may be."""
        return [*self.choices, *["true", "false"] * (self.kind == "boolean")]

    @property
    def span(self) -> str:
        """Return the least and the greatest number, such as (0, 5]."""
        return f"{'(' if self.above else '['}{self.low:g}, {self.high:g}]"

    @property
    def needed(self) -> str:
        """Return the allowed values in words, with their unit."""
        if self.is_number:
            number = "a whole number" if self.kind == "integer" else "a number"
            return " or ".join([*self.choices, f"{number} in {self.span} {self.unit}".strip()])
        if self.kind == "lines":
            return f"printable text of up to {self.high:g} letters"
        words = join_with_or(self.words)
        if self.kind == "materials":
            return f"a pair of materials, {words}, such as [steel, steel]"
        return ", or ".join(filter(None, [words, OTHERWISE.get(self.kind)]))

    @cached_property
    def adapter(self) -> TypeAdapter[Any]:
        """Return what checks values of this parameter alone."""
        return TypeAdapter(annotation_of(self))

    def choice_of(self, value: Any) -> Any:
        """Return the choice that an alias stands for, and any other value as it is."""
        return next((choice for alias, choice in self.aliases if alias == value), value)

    def check(self, value: Any) -> str | None:
        """Return what is wrong with a scalar value of this parameter, or None."""
        try:
            self.adapter.validate_python(value)
        except ValidationError as error:
            cause = error.errors(include_url=False)[0].get("ctx", {}).get("error", "")
            return self.explain(value, str(cause))
        return None

    def explain(self, value: Any, cause: str = "") -> str:
        """Return the error of a wrong value; cause: what a check of our own has said of it."""
        if value is None or cause:
            return cause or NO_VALUE
        if self.is_number and type(value) in (int, float):
            if not math.isfinite(to_python(value)):
                return f"must be finite: {self._refuse(value)}"
            if self.kind == "number" or value == int(value):
                told = f"; {ABSOLUTE}" * (self.unit == "MPa" and value <= 0)
                return f"{value:g} is outside {self.span} {self.unit}".rstrip() + told
        if self.kind != "materials":
            return self._refuse(value, value)
        pair = value if isinstance(value, tuple | list) and len(value) == 2 else ()
        return self._refuse(value, *(one for one in pair if one not in self.choices))

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

    def _refuse(self, value: Any, *words: Any) -> str:
        """Return the error of a value of another kind; words: of these one may be misspelt."""
        message = f"needs {self.needed}, not {quote_value(value)}"
        word = words[0][:MAX_WORD_LENGTH] if words and isinstance(words[0], str) else ""
        aliases = dict(self.aliases) | {n: one for n, one in PINS.items() if one in self.choices}
        if hint := did_you_mean(word, [*aliases, *self.words], aliases):
            return f"{message}; {hint}"
        number = AS_NUMBER.fullmatch(word) if self.is_number else None
        if not number:
            return message
        plain, (whole, comma, behind) = number[1].replace(",", "."), number[1].partition(",")
        written = read_comma(whole, behind) if comma else plain
        if number[2].startswith(","):
            return f"{message}; several values are a list: write [{word}]"
        if OTHER_UNITS.get(number[2], ("none",))[0] == self.unit:
            return f"{message}; write {convert_other(float(plain), number[2])}"
        if number[2] not in ("", self.unit):
            return f"{message}; write a number alone" + (self.unit and f", in {self.unit}")
        return f"{message}; write {written}"


def join_with_or(words: Sequence[str]) -> str:
    """Return the words as a sentence lists them: a, b or c."""
    return " or ".join(filter(None, [", ".join(words[:-1]), *words[-1:]]))


def to_python(value: Any) -> Any:
    """Return a scalar of numpy or xarray, and a number beyond any float, as Python has it."""
    if getattr(value, "ndim", None) == 0 and hasattr(value, "item"):
        return value.item()
    return value if type(value) is not int or value.bit_length() < 1000 else math.inf


def to_whole(value: Any) -> Any:
    """Return a whole number as an integer, and any other value as it is."""
    value = to_python(value)
    return int(value) if type(value) is float and value.is_integer() else value


def check_lines(value: str) -> str:
    """Return a text of lines without blanks around it. Raises ValueError for any other."""
    if value.strip() and all(line.isprintable() for line in value.strip().split("\n")):
        return value.strip()
    raise ValueError("needs printable text")


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
            float, Field(strict=True, allow_inf_nan=False, **ends), BeforeValidator(to_python),
            AfterValidator(lambda value: value or 0.0),  # of -0
        ],
        "integer": Annotated[int, Field(strict=True, **ends), BeforeValidator(to_whole)],
        "boolean": Annotated[bool, Field(strict=True), BeforeValidator(to_python)],
        "text": Annotated[str, Field(strict=True, pattern=NAME)],
        "card": Annotated[str, Field(strict=True, min_length=1)],
        "lines": Annotated[
            str, Field(strict=True, min_length=1, max_length=int(row.high)),
            AfterValidator(check_lines),
        ],
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
    Field(min_length=1),
    BeforeValidator(lambda value: dict(value) if isinstance(value, tuple) else value),
]


Describe = Callable[[str, str, Any], str]


def problems_of(
    error: ValidationError,
    values: Mapping[str, Any],
    rows: Mapping[str, Parameter],
    describe: Describe = lambda group, name, value: "unknown key",
) -> list[Problem]:
    """Return what pydantic has found wrong with nested values, in our words.

    rows: by dotted key. describe: a function of a group, a name and its value, which returns the
    error of a key that the group has not, or of a value that is no group (name "").
    """
    found: dict[Problem | None, None] = {}
    for one in error.errors(include_url=False):
        cause, kind = one.get("ctx", {}).get("error", ""), one["type"]
        if isinstance(cause, CaseError):  # of values that do not fit together
            found |= dict.fromkeys(cause.problems)
            continue
        if not one["loc"]:
            raise cause  # an error of the program's own
        key, value, rest = "", values, [*map(str, one["loc"])]
        while rest:
            inner = f"{key}.{rest[0]}".lstrip(".")
            is_named = kind in NAMED_WRONGLY and not rest[1:]
            if is_named or not any(f"{row}.".startswith(f"{inner}.") for row in rows):
                break
            key, value, rest = inner, _value_under(value, rest[0]), rest[1:]
        if key in rows:
            found[rows[key].problem(key, value, rest, str(cause))] = None
        elif parts := {name: row for name in PART_WORDS if (row := rows.get(f"{key}.{name}"))}:
            found[_problem_of_parts(key, value, parts, str(cause))] = None
        elif kind in NAMED_WRONGLY:
            message = describe(key, rest[0], _value_under(value, rest[0]))
            found[Problem(f"{key}.{rest[0]}".lstrip("."), message)] = None
        else:
            found[Problem(key, NO_VALUE if value is None else describe(key, "", value))] = None
    return name_as_written(values, filter(None, found))


def name_as_written(values: Mapping[str, Any], problems: Iterable[Problem]) -> list[Problem]:
    """Return the problems of parts that one value stands for as problems of that, each once."""
    found: dict[Problem, None] = {}
    for one in problems:
        whole, _, part = one.key.rpartition(".")
        is_part = whole and part in PART_WORDS
        value = reduce(_value_under, whole.split("."), values) if is_part else {}
        by_part = isinstance(value, Mapping | BY_PART)
        by_part |= value is None and whole == "clearance_mm"
        by_part |= whole == LED and part != "head"
        found[one if by_part else Problem(whole, one.message)] = None
    return [*found]


NAMED_WRONGLY = ("unexpected_keyword_argument", "invalid_key", "missing")  # kinds of pydantic's


def _problem_of_parts(key: str, value: Any, parts: Mapping[str, Parameter], cause: str) -> Problem:
    """Return the problem of a value by part as a whole: of another kind, or of other parts."""
    if cause or not isinstance(value, Mapping):
        return Problem(key, next(iter(parts.values())).explain(value, cause))
    for name in (str(one) for one in value if one not in parts):
        known = f"{key} has {', '.join(parts)}"
        told = (hint_at_part(key, parts, name) or known) + "; halve a diameter" * ("diam" in name)
        return Problem(f"{key}.{name}", f"unknown key; {told}")
    needed = f"needs both, {' and '.join(parts)}, not {', '.join(value) or 'none'}"
    one = "pair" if next(iter(parts.values())).kind == "materials" else "number"
    return Problem(key, f"{needed}; or one {one} for both")


def hint_at_part(key: str, parts: Iterable[str], name: str) -> str:
    """Return what part of a key an unknown name means, as `did_you_mean`; "" without a guess."""
    meant = {part: part for part in parts}
    meant |= {pin: joint for pin, joint in PINS.items() if joint in meant}
    return did_you_mean(name, meant, {word: f"{key}.{part}" for word, part in meant.items()})


def _value_under(value: Any, name: str) -> Any:
    """Return the value of a name in a value by name; one that stands for all parts as it is."""
    if isinstance(value, BY_PART):
        value = vars(value)
    if not isinstance(value, Mapping):
        return value
    return next((inner for known, inner in value.items() if str(known) == name), None)


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def make_group(cls: type[Group]) -> type[Group]:
    """Return a group of keys as a frozen dataclass that pydantic checks as it is made.

    A group of wrong values raises CaseError with everything that is wrong.
    """
    own = dict(cls.__annotations__)
    for name, item in vars(cls).items():
        if isinstance(item, dataclasses.Field):
            cls.__annotations__[name] = annotation_of_field(name, item, own[name])
    made: Any = pydantic.dataclasses.dataclass(frozen=True, config=ConfigDict(extra="forbid"))(cls)
    rows = {row.key: row for item in fields(made) for row in rows_of(item.name, item)}
    validate, tell = made.__init__, getattr(made, "_problems_of", partial(problems_of, rows=rows))

    def __init__(self: Any, *args: Any, **values: Any) -> None:
        try:
            validate(self, *args, **values)
        except ValidationError as error:
            raise CaseError(tell(error, values)) from None

    made.__init__ = __init__
    made.__annotations__ = own
    return made


def annotation_of_field(name: str, item: Any, own: Any) -> Any:
    """Return the type by which pydantic checks a field; own: the one that it was written with."""
    if "open" in item.metadata:  # a group
        return Annotated[own, BeforeValidator(item.metadata["open"])]
    rows = [*rows_of(name, item, annotation=own)]
    if "parts" not in item.metadata:
        return annotation_of(rows[0])
    one = item.metadata["of"][annotation_of(rows[0])]
    one = one | None if item.default is None else one
    if rows[0].kind == "card":
        one = Annotated[one, AfterValidator(check_cards)]
    return Annotated[one, BeforeValidator(partial(spread, item.metadata))]


def by_part(
    of: type, row: Any, read: Mapping[str, Any] | None = None, fill: Any = ..., first: bool = False
) -> Any:
    """Return the field of a key that has a value for each part of a thing, or one for all.

    of: the class of its values, such as PerJoint. row: the field, by `number` or `choice`, of
    one part. fill: what a part has that is not given beside another one; without, it is needed.
    first: whether one value is that of the first part alone. read: the conditions of each part.
    """
    parts = {}
    for name in (item.name for item in fields(of)):
        own = dict(row.metadata)
        own["read"] = _all_of((read or {}).get(name, own["read"]))
        head = re.split(r"[:;,]| \(", own["phrase"])[0]
        own["phrase"] = f"{head} {PART_WORDS[name]}{own['phrase'][len(head) :]}"
        parts[name] = own
    whole = None if row.default is None else of(*[row.default] * len(parts))
    return field(default=whole, metadata={"of": of, "parts": parts, "fill": fill, "first": first})


def rows_of(
    key: str, item: Any, above: tuple[str, ...] = (), annotation: Any = None
) -> Iterator[Parameter]:
    """Yield the rows of a field, of one by part those of the parts; above: conditions of its group.

    Of a field of another kind none. annotation: that of a field which no dataclass has yet.
    """
    whole = {"": item.metadata} if "kind" in item.metadata else {}
    optional = NoneType in get_args(annotation or item.type)
    units = [unit for name in key.split(".") if (unit := split_unit(name)[1])]
    shared = {"optional": optional and bool(whole), "unit": units[-1] if units else ""}
    for part, row in item.metadata.get("parts", whole).items():
        default = getattr(item.default, part, None) if part else item.default
        name = f"{key}.{part}" if part else key
        yield Parameter(name, default=default, **{**shared, **row, "read": (*above, *row["read"])})


def spread(metadata: Mapping[str, Any], value: Any) -> Any:
    """Return a value by part: one that stands for all parts, or one of some with the others."""
    parts = metadata["parts"]
    if isinstance(value, metadata["of"]) or value is None:
        return value
    if not isinstance(value, Mapping):
        value = {next(iter(parts)): value} if metadata["first"] else dict.fromkeys(parts, value)
    filled = {} if metadata["fill"] is ... else dict.fromkeys(parts, metadata["fill"])
    return {**filled, **value}


def number(default: Any, span: str, phrase: str, source: str = "program", **more: Any) -> Any:
    """Return a dataclass field that is also a row of the table, of a number within a span.

    span: such as "(0, 1e5]", in the unit that stands at the end of the key; source: of the default;
    more: of `Parameter`.
    """
    low, high = map(float, span.strip("([]").split(","))
    row = {"low": low, "high": high, "above": span[0] == "(", "kind": "number"}
    return _field(default, phrase, source, row | more)


def choice(
    default: Any, choices: tuple[str, ...], phrase: str, source: str = "program", **more: Any
) -> Any:
    """Return a field whose value is one of a few words, or of another `kind` that is given."""
    row = {"low": 0.0, "high": 0.0, "above": False, "kind": "choice", "choices": choices}
    return _field(default, phrase, source, row | more)


def flag(default: Any, phrase: str, **more: Any) -> Any:
    """Return a field whose value is true or false."""
    return choice(default, **{"choices": (), "phrase": phrase, "kind": "boolean", **more})


integer = partial(number, kind="integer")


def _field(default: Any, phrase: str, source: str, row: dict[str, Any]) -> Any:
    """Return a dataclass field with a row; its `read` may be one condition, or several."""
    row |= {"phrase": phrase, "source": source, "read": _all_of(row.get("read", ()))}
    return field(default=default, metadata=row)


def _all_of(read: str | Sequence[str]) -> tuple[str, ...]:
    return (read,) if isinstance(read, str) else tuple(read)


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
