"""Keys that are not there, and groups that are none: what they are told, in files and values alike.

An unknown key is told what was probably meant, or else what there is.
"""

import dataclasses
from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any

from compressor.cases.parameter import shown
from compressor.cases.synonyms import DOUBLES, in_our_unit, of_percent, stroke_in, synonyms_of
from compressor.cases.table import GROUPS, WORDS, Settings, table

# keys of a case file that are no part of a case: how values are swept together
SWEEP = ("sample", "zip", "exclude", "blocks", "regimes")
MAPPINGS = {  # of these, what stands in them
    "sample": ("n", "seed"),
    "regimes": (
        "over", "from", "to", "n", "log", "direction", "section_deg", "settle_rev", "measure_rev",
        "exponent",
    ),
}  # fmt: skip
MOST_MEANT = 3  # keys that an unknown one may have meant


def known(group: str, file: bool = True) -> list[str]:
    """Return the keys that a group (or, for "", the top) may hold; of a `file`, those of sweeps,
    too.
    """
    if group in MAPPINGS:
        return [*MAPPINGS[group]]
    names = [item.name for item in dataclasses.fields(GROUPS[group] if group else Settings)]
    return [*names, *SWEEP] if file and not group else names


def accepted(group: str, file: bool = True) -> list[str]:
    """Return the keys that a group may hold, words of the trade among them."""
    return [*known(group, file), *synonyms_of(group)]


def unknown(name: str, group: str, file: bool = True, value: Any = None, values: Any = None) -> str:
    """Return what is said of a key that a group does not have.

    value: the key's. values: the whole case's, nested, as far as they are known.
    """
    whole = group or ("a case file" if file else "a case")
    hint = (
        in_our_unit(name, value, accepted(group))
        or of_percent(name, group, value, stroke_in(values))
        or suggestion(name, group)
        or f"; {whole} has {', '.join(known(group, file))}"
    )
    return f"unknown key{hint}"


def no_mapping(key: str, value: Any) -> str:
    """Return what is told of a value that stands where a group's keys are due."""
    word = f"{shown(WORDS[key])} or " if key in WORDS else ""
    return f"needs {word}a mapping of keys{_example(key)}, not {shown(value)}"


def _example(group: str) -> str:
    """Return a key of a group with its default, such as crank_radius_mm: 120."""
    for name in known(group) if group in GROUPS else ():
        row = table()[f"{group}.{name}"]
        if row.default is not None:
            value = f"{row.default:g}" if isinstance(row.default, float) else shown(row.default)
            return f", such as {{{name}: {value.strip(chr(39))}}}"
    return ""


def suggestion(name: str, group: str) -> str:
    """Return the end of an error about an unknown key: what was probably meant, if anything."""
    if name in table() and "." in name:
        outer, _, inner = name.partition(".")
        return f"; write {inner} inside {outer}"
    if group and name in known(""):
        return f"; write {name} at the top, outside {group}"
    if name.partition(":")[0] in known(group):
        return "; put a space after the colon"
    if name in DOUBLES:
        return f"; write {DOUBLES[name]}, which is half of it"
    keys = meant(name, group)
    return f"; did you mean {' or '.join(keys)}?" if keys else ""


def meant(name: str, group: str) -> list[str]:
    """Return the dotted keys that an unknown one probably stands for, in a group of that group."""
    if name in table() and not group:
        return [name]
    if group and name in map(_leaf, DOUBLES):
        return []  # a word of another group, which is like none of this one
    if near := _nearest(name, known(group), 0.6) or _nearest(name, synonyms_of(group), 0.8):
        return [f"{group}.{near}" if group else near]
    if group:
        return _holding(name, f"{group}.")
    every = [*table(), *DOUBLES]
    near = _nearest(name, [_leaf(key) for key in every], cutoff=0.8)
    return [key for key in every if _leaf(key) == near] or _holding(name)


def _holding(name: str, within: str = "") -> list[str]:
    """Return the keys, if they are few, in whose name all words of another one stand."""
    words = {word for word in name.lower().split("_") if word}
    found = [
        key
        for key in table()
        if key.startswith(within) and words and words <= {*_leaf(key).lower().split("_")}
    ]
    return found if len(found) <= MOST_MEANT else []


def _leaf(key: str) -> str:
    return key.rpartition(".")[2]


def _nearest(name: str, allowed: Sequence[str], cutoff: float) -> str | None:
    """Return the allowed key with another unit, or else the one most alike."""
    stems = {_stem(key): key for key in reversed(allowed)}
    for stem in sorted(stems, key=len, reverse=True):
        if stem != stems[stem] and f"{name}_".startswith(f"{stem}_"):
            return stems[stem]
    lower = {key.lower(): key for key in allowed}
    near = get_close_matches(name.lower(), lower, n=1, cutoff=cutoff)
    return lower[near[0]] if near else None


def _stem(name: str) -> str:
    """Return a key's name without its unit."""
    if name in map(_leaf, DOUBLES):
        return name.removesuffix("_mm")
    if name in map(_leaf, DOUBLES):
        return name.removesuffix("_mm")
    for row in table().values():
        if _leaf(row.key) == name and row.unit:
            unit = row.unit.replace(" ", "_").replace("/", "_per_").replace("^p", "15")
            return name.removesuffix(f"_{unit}")
    return name
