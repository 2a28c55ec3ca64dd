"""In which assumptions a case differs from the defaults: the paper's values, or ours."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from compressor.cases import Case, CaseError, table, value_in


@dataclass(frozen=True)
class Difference:
    """A key of a case file whose value is not the default; both values with their unit."""

    key: str
    phrase: str  # what the key is; empty for a whole group
    value: str
    default: str

    @property
    def said(self) -> str:
        """The difference in words."""
        phrase = f", {self.phrase}" if self.phrase else ""
        return f"{self.key}{phrase}: {self.value} (default: {self.default})"


def differences(case: Case, besides: tuple[str, ...] = ()) -> list[Difference]:
    """Return the keys in which a case's physics or span differs from the default case, in a file's
    order.

    A value that follows from others, such as the inertia of a uniform rod, is none of its own, nor
    is one that means the same as the default. besides: groups or keys at the top to leave out.
    """
    values, defaults = case.values(), Case().values()
    found = []
    for key, value in leaves(values, defaults):
        default = value_in(defaults, key) if "." in key else defaults.get(key)
        if key.partition(".")[0] in besides or value == default or follows(case, values, key):
            continue
        row = table().get(key)
        unit, phrase = (row.unit, row.phrase) if row else ("", "")
        found.append(Difference(key, phrase, spelt(value, unit), spelt(default, unit)))
    return found


def leaves(values: Mapping[str, Any], defaults: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the dotted keys and values; a group that the default case lacks, or has alone, is
    one value.
    """
    for name in dict.fromkeys([*defaults, *values]):
        value, default = values.get(name), defaults.get(name)
        if isinstance(value, Mapping) and isinstance(default, Mapping):
            yield from ((f"{name}.{inner}", item) for inner, item in value.items())
        else:
            yield name, value


def follows(case: Case, values: Mapping[str, Any], key: str) -> bool:
    """Return whether a case is the same without a key: it follows from the others, or is not
    read.
    """
    group, _, name = key.rpartition(".")
    rest: dict[str, Any] = {n: item for n, item in values.items() if n != key}
    if group:
        rest[group] = {n: item for n, item in values[group].items() if n != name}
    try:
        return Case.resolve(rest).physics_key == case.physics_key
    except CaseError:
        return False  # what is left fits no more


def spelt(value: Any, unit: str) -> str:
    """Return a value as a case file has it, with its unit."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {spelt(item, '')}" for name, item in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    if isinstance(value, int | float):
        return f"{value:.10g}" + (f" {unit}" if unit else "")
    return str(value)
