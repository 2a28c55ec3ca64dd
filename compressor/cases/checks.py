"""Which keys and values a case file may have: parts, words of the trade, what was meant instead.

A key may have a value for each part of a thing, such as `pin_radius_mm: {big_end: 60, small_end:
35}`, or one for all; then its name is an axis of a sweep like any key. Words of the trade: keys
that are twice one of ours, and other units that are answered.
"""

import dataclasses
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from functools import cache, lru_cache
from typing import Any

from pydantic import ValidationError

from compressor.cases.parameter import (
    BY_PART,
    OTHER_UNITS,
    PART_WORDS,
    WRITTEN,
    Parameter,
    convert_other,
    hint_at_part,
    quote_value,
    split_unit,
    to_python,
)
from compressor.cases.swept import FORMS
from compressor.cases.table import GROUPS, TOP, WORDS, parts_by_key, table
from compressor.cases.yaml_reader import Path, Problem, is_number


@lru_cache(1024)  # asked for of each key of each job
def stands_for(key: str) -> tuple[str, ...]:
    """Return the keys of the parts that a key may have a value for; none of another key."""
    return tuple(f"{key}.{part}" for part in parts_by_key().get(key, ()))


def row_of(key: str) -> Parameter | None:
    """Return the table's row of a key, of one by part that of its first; None for no key."""
    return table().get(next(iter(stands_for(key)), key))


def phrase_of(key: str) -> str:
    """Return the phrase of a key's values, such as "crank radius"; an unknown key as it is."""
    row = row_of(key)
    if row is None:
        return key
    first = next(iter(parts_by_key().get(key, ())), "")
    return row.label.removesuffix(PART_WORDS.get(first, "")).rstrip()


def single(key: str, value: Any) -> Any:
    """Return the one value that all parts of a key have, but for ideal joints; or None.

    What is no value by part is returned as it is; of a group None.
    """
    if not isinstance(value, Mapping):
        return value
    may_be_0 = key != "clearance_mm"
    found = {one for one in value.values() if one is not None and (one or may_be_0)}
    return found.pop() if key in parts_by_key() and len(found) == 1 else None


def keys_of(value: Callable[[str], Any]) -> Iterator[str]:
    """Yield the keys of the table; of parts with one value in common the key of all of them.

    value: the function that gives a key's value.
    """
    for key in table():
        whole = key.rpartition(".")[0]
        if whole not in parts_by_key() or value(whole) is None:
            yield key
        elif key == stands_for(whole)[0]:
            yield whole


def value_of(holder: Any, key: str) -> Any:
    """Return the value of a dotted key of a case, or of nested values; None where it is not one.

    Of an optional group it is whether a case has it.
    """
    value, above = holder, ""
    if not isinstance(holder, Mapping):
        value = getter(key)(holder)
        value = vars(value) if isinstance(value, BY_PART) else value
        return value is not None if key in WORDS else single(key, value)
    for name in key.split("."):
        if isinstance(value, Mapping):
            value = value.get(name)
        elif above not in parts_by_key():
            return None
        above = f"{above}.{name}".lstrip(".")
    return single(key, value)


@cache
def getter(key: str) -> Callable[[Any], Any]:
    """Return the function that gives a case's value of a dotted key, None without its group."""
    get = operator.attrgetter(key)
    row, group = table().get(key), key.partition(".")[0]
    if row and group not in WORDS and (row.default is not None or key.count(".") < 2):
        return get  # none of what it is in may be missing

    def value(case: Any) -> Any:
        try:
            return get(case)
        except AttributeError:
            return None

    return value


# key -> the key whose double it is; a file gives one of the two
DOUBLES = {"machine.stroke_mm": "machine.crank_radius_mm", "gas.bore_mm": "gas.piston_radius_mm"}
# words in the name of a diameter -> what to write of its value, half or whole
DIAMETERS = (
    (r"clearance", "clearance_mm: {half}, which is radial"),
    (
        r"wrist|gudgeon|small_end|(crosshead|piston)_?pin",
        "machine.pin_radius_mm: {{small_end: {half}, ...}}",
    ),
    (r"crank_?pin|big_end", "machine.pin_radius_mm: {{big_end: {half}, ...}}"),
    (r"pin(?!dle)|journal|(?<!main_)bearing", "machine.pin_radius_mm: {half}"),
    (r"(?<!con)(?<!con_)(?<!connecting_)rod", "gas.rod_diameter_mm: {whole}, the piston rod's"),
    (r"piston|cylinder|bore|^dia", "gas.bore_mm: {whole}"),
)
DIAMETER = re.compile(r"(?i)(\w*_)?(diameter|diametral|dia)(_\w*)?|piston_rod(_mm)?")
BACK_AND_FORTH = re.compile(
    r"(\w*_)?(piston|crosshead|plunger|reciprocating|wrist_?pin|gudgeon_?pin)(_\w*)?_mass(_[a-z]+)?"
)
WEIGHT = re.compile("(?<!counter)(?<!counter_)(?<!balance_)weight")  # a mass, in kg
TWICE = "stands in place of {}: give one of the two"


def row_of_double(key: str) -> Parameter:
    """Return the row of a key of `DOUBLES`."""
    row = table()[DOUBLES[key]]
    return dataclasses.replace(
        row, key=key, phrase=f"twice {row.key}, in its place", low=2 * row.low,
        high=2 * row.high, default=row.default and 2 * row.default,
    )  # fmt: skip


def expand_synonyms(values: Mapping[str, Any]) -> tuple[dict[str, Any], list[Problem]]:
    """Return nested values with each synonym as its key; both at once are a problem."""
    whole, problems = dict(values), []
    for synonym, key in DOUBLES.items():
        group, name, own = *synonym.split("."), _leaf(key)
        within = whole.get(group)
        if not isinstance(within, Mapping) or name not in within:
            continue
        whole[group] = {one: value for one, value in within.items() if one != name}
        row, value = row_of_double(synonym), within[name]
        if message := TWICE.format(key) if own in within else row.check(value):
            problems.append(Problem(synonym, message))
        else:
            whole[group][own] = to_python(value) / 2
    return whole, problems


def in_our_unit(name: str, value: Any, allowed: list[str]) -> str:
    """Return the hint at a key in another unit, such as "; write suction_MPa: 0.2"; or ""."""
    words = name.split("_")
    if "gauge" in words:  # as in suction_gauge_bar, which is in barg
        words.remove("gauge")
        words[-1:] = [f"{word}g" for word in words[-1:]]
    stem, _, unit = "_".join(words).rpartition("_")
    if unit not in OTHER_UNITS or stem.endswith("_per"):
        return ""
    for known in (stem, stem.removesuffix("_pressure")):
        if known and (ours := f"{known}_{WRITTEN[OTHER_UNITS[unit][0]]}") in allowed:
            return f"; write {ours}: {convert_other(value, unit)}"
    return ""


def of_other_quantity(name: str, group: str, value: Any) -> str:
    """Return the hint at a diameter, or a part of a mass; "" for none."""
    is_near = group in ("", "machine", "gas")
    if BACK_AND_FORTH.fullmatch(name) and is_near:
        return "; write machine.reciprocating_mass_kg, of piston, its rod and crosshead together"
    for words, form in DIAMETERS if DIAMETER.fullmatch(name) else ():
        if re.search(words, name) and (is_near or "pin_radius" in form):
            ours, factor = OTHER_UNITS.get(name.rpartition("_")[2], ("mm", 1.0))
            factor = factor if ours == "mm" else math.nan
            value = None if isinstance(value, Mapping) and "{{" in form else value
            half, whole = (_spell_scaled(value, factor / n) for n in (2, 1))
            return "; write " + form.format(half=half, whole=whole)
    return ""


def _spell_scaled(value: Any, factor: float) -> str:
    """Return a number, or one of each part, times a factor as a file has it; `...` if it cannot."""
    if isinstance(value, Mapping):
        parts = (f"{part}: {_spell_scaled(one, factor)}" for part, one in value.items())
        return f"{{{', '.join(parts)}}}"
    return f"{value * factor:.12g}" if is_number(value) and math.isfinite(factor) else "..."


# keys of a case file that are no part of a case: how values are swept together, what the page of
# the report says of the machine
SWEEP = ("sample", "zip", "exclude", "blocks", "report")
MAX_MEANT = 3  # keys that have a name's words in them: of more, none is a guess


def known_keys(group: str) -> list[str]:
    """Return the keys that a group (or, for "", the top) may hold."""
    if group and group not in GROUPS:
        return [*parts_by_key().get(group, ())]
    if not group:
        return [*TOP, *GROUPS]
    return [item.name for item in dataclasses.fields(GROUPS[group])]


def describe_wrong(group: str, name: str, value: Any) -> str:
    """Return the error of an unknown key of a case's group; without a name of what is no group."""
    if not name:
        return no_mapping(group, value)
    value, name = to_python(value), WEIGHT.sub("mass", name)
    known, doubles = known_keys(group), [key for key in DOUBLES if key.startswith(f"{group}.")]
    hint = (
        in_our_unit(name, value, [*known, *map(_leaf, doubles)])
        or of_other_quantity(name, group, value)
        or ("" if DIAMETER.fullmatch(name) or name in SWEEP else suggestion(name, group))
        or f"; {group or 'a case'} has {', '.join(known)}"
    )
    return f"unknown key{hint}"


def no_mapping(key: str, value: Any) -> str:
    """Return the error of a value that stands where a group's keys are due."""
    word = f"{quote_value(WORDS[key])} or " if key in WORDS else ""
    rows = (table()[f"{key}.{name}"] for name in known_keys(key)) if key in GROUPS else ()
    row = next((row for row in rows if row.default is not None), None)
    value = str(row.default).removesuffix(".0") if row else ""
    such = f", such as {{{_leaf(row.key)}: {value}}}" if row else ""
    return f"needs {word}a mapping of keys{such}, not {quote_value(value)}"


def suggestion(name: str, group: str) -> str:
    """Return the end of an error about an unknown key: what was probably meant, if anything."""
    if name in table() and "." in name:
        outer, _, inner = name.partition(".")
        return f"; write {inner} inside {outer}"
    if group and name in known_keys(""):
        return f"; write {name} at the top, outside {group}"
    if ":" in name and name.partition(":")[0] in known_keys(group):
        return "; put a space after the colon"
    if name in DOUBLES:
        return f"; write {DOUBLES[name]}, which is half of it"
    if "rotating_mass" in name:
        return ""  # which no key has
    every = [*DOUBLES, *keys_of(lambda key: key), *table()]
    if exact := [key for key in every if _leaf(key) == name]:
        return f"; did you mean {exact[0]}?"
    own = [f"{group}.{one}".lstrip(".") for one in known_keys(group)]
    own += [key for key in DOUBLES if group and key.startswith(f"{group}.")]
    for keys, cutoff in ((own, 0.58 if group else 0.75), (every, 0.8)):
        spelled: dict[str, str] = {}
        for key in reversed(keys):  # the first of a spelling counts
            inner = key.partition(".")[2] or key
            texts = (key, inner, split_unit(key)[0], split_unit(inner)[0])
            spelled |= {text.lower(): key for text in texts}
        if near := get_close_matches(name.lower(), spelled, 1, cutoff):
            return f"; did you mean {spelled[near[0]]}?"
    words = {*re.split("[_.]", name.lower())}
    near = [key for key in (*own, *every) if words <= {*re.split("[_.]", key.lower())}]
    return f"; did you mean {near[0]}?" if 0 < len({*near}) <= MAX_MEANT else ""


def _leaf(key: str) -> str:
    return key.rpartition(".")[2]


def hold_value(key: str, value: Any) -> Any:
    """Return a value of a key as a case holds it; one that no case can hold as it is."""
    row = row_of(key)
    if type(value) is float and row and row.kind == "number":  # as most of what is drawn
        return value or 0.0
    try:
        held = row.adapter.validate_python(value) if row else value
    except ValidationError:
        return value
    return tuple(sorted(held.items())) if row and isinstance(held, dict) else held


def values_given(values: Mapping[Any, Any]) -> dict[str, Any]:
    """Return the values that are set in nested values, by dotted key, of a key by part by part."""
    return {key_of(path): value for path, value in walk_leaves(values) if value is not None}


@lru_cache(4096)  # asked for of each value of each job
def key_of(path: Path) -> str:
    """Return the dotted key of a path."""
    return ".".join(map(str, path))


def walk_leaves(values: Mapping[Any, Any], above: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Yield the path and the value, or the sweep, of each key; of a value by part each part's."""
    for name, value in values.items():
        path, inner = (*above, name), value if isinstance(value, Mapping) else None
        if inner == {} and not above and name in GROUPS:  # its defaults
            yield path, WORDS.get(name) or value
        elif inner and ((not above and name in GROUPS) or is_by_part(key_of(path), inner)):
            yield from walk_leaves(inner, path)
        elif path[0] not in SWEEP:
            yield path, value


def is_by_part(key: str, value: Any) -> bool:
    """Return whether a value is one for each part of a key, and no sweep of one for all.

    A part's name may be misspelt, or a word of the trade.
    """
    parts = parts_by_key().get(key, ())
    if not parts or not isinstance(value, Mapping):
        return False
    is_form = bool(FORMS.keys() & value)
    return any(n in parts or (not is_form and hint_at_part(key, parts, str(n))) for n in value)
