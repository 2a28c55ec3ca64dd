"""Where a case leaves the range that the program was judged on.

Extreme scenes are drawn from it (`compressor.studies.stress.extremes`); it stands in the table of
parameters as `judged`.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from compressor.cases.shorthands import value_in
from compressor.cases.table import table

OF_CONTACT = ("contact.", "friction.")  # keys that ideal joints do not read
# keys that leave a thing out at 0, as a case without the group does
ABSENT_AT_ZERO = (
    "clearance_mm.big_end", "clearance_mm.small_end", "guide.clearance_mm", "guide.friction",
)  # fmt: skip


def judged_range(key: str) -> tuple[float, float]:
    """Return the range of a key, in its unit, that the program was judged on.

    Raises KeyError for a key without one.
    """
    found = table()[key].judged
    if found is None:
        raise KeyError(key)
    return found


def outside_judged(values: Mapping[str, Any]) -> dict[str, str]:
    """Return the keys of a case whose values are outside the judged range, each with a sentence.

    values: nested, of one case (`Case.values`). A sentence continues the key: "62 kg is outside
    the range that the program was judged on, 0.1 to 50 kg". Clearances of both joints are one key.
    """
    found = {}
    for key, value, (low, high) in _judged_values(values):
        if not low * (1 - 1e-9) <= value <= high * (1 + 1e-9):
            unit = f" {table()[key].unit}".replace("^p", "^1.5").rstrip()
            shared = "clearance_mm" if key.startswith("clearance_mm.") else key
            found[shared] = (
                f"{value:g}{unit} is outside the range that the program was judged on, "
                f"{low:g} to {high:g}{unit}"
            )
    return found


def _judged_values(values: Mapping[str, Any]) -> Iterator[tuple[str, float, tuple[float, float]]]:
    """Yield the keys with a judged range that a case reads, their values, and the ranges."""
    ideal = values.get("joint") == "none"
    other_exponent = value_in(values, "contact.exponent") != 1.5  # the stiffness has another unit
    for key, row in table().items():
        value = value_in(values, key) if row.judged else None
        if row.judged is None or not isinstance(value, int | float) or isinstance(value, bool):
            continue
        if value == 0.0 and key in ABSENT_AT_ZERO:
            continue
        if ideal and key.startswith(OF_CONTACT):
            continue
        if key == "contact.stiffness_N_per_mm15" and other_exponent:
            continue
        yield key, float(value), row.judged
