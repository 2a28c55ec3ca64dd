"""Units that people read beside SI: of axes, tables, `show`, CSV headers, limits of searches.

Files and Python have SI. Two choices are offered: `si`, and `plant` with mm, mm/s, g, kN, bar and
rpm. Without a choice pages, figures and `show` have kN, mm, µm and m/s², CSV and `find` SI. Angles
stay in degrees in figures; what is not listed stays as it is. Without libraries, as `digits`.
"""

import math
import re
from typing import Literal

Units = Literal["usual", "si", "plant"]

GRAVITY = 9.80665  # m/s2, of vibration in g (ISO 80000-3:2019)
# unit as it is read -> its SI unit, and how many of that it is
IN_SI = {
    "m": ("m", 1.0), "mm": ("m", 1e-3), "µm": ("m", 1e-6), "um": ("m", 1e-6),
    "m/s": ("m/s", 1.0), "mm/s": ("m/s", 1e-3),
    "m/s2": ("m/s2", 1.0), "m/s²": ("m/s2", 1.0), "g": ("m/s2", GRAVITY),
    "N": ("N", 1.0), "kN": ("N", 1e3),
    "Pa": ("Pa", 1.0), "MPa": ("Pa", 1e6), "bar": ("Pa", 1e5),
    "rad/s": ("rad/s", 1.0), "rpm": ("rad/s", 2.0 * math.pi / 60.0),
    "rad": ("rad", 1.0),
}  # fmt: skip
# SI unit -> the unit that a plant reads
PLANT = {
    "m": "mm", "m/s": "mm/s", "m/s2": "g", "N": "kN", "Pa": "bar", "rad/s": "rpm", "rad": "°",
}  # fmt: skip
# units that a text may give for a number, beside those above
READABLE = IN_SI | {
    "deg": ("rad", math.pi / 180.0), "°": ("rad", math.pi / 180.0),
    "%": ("1", 1e-2), "percent": ("1", 1e-2), "1": ("1", 1.0),
    "J": ("J", 1.0), "s": ("s", 1.0), "ms": ("s", 1e-3), "N m": ("N m", 1.0),
}  # fmt: skip


def unit_in(unit: str, units: Units) -> tuple[str, float]:
    """Return the unit in which a number is read, and the factor to it from a unit.

    unit: as it is read so far, such as kN, or SI; units: the choice. A unit that is not listed
    stays.

    >>> unit_in("kN", "si"), unit_in("m/s²", "plant")[0], unit_in("kN", "usual")
    (('N', 1000.0), 'g', ('kN', 1.0))
    """
    if units == "usual" or unit not in IN_SI:
        return unit, 1.0
    si, factor = IN_SI[unit]
    if units == "si":
        return ("m/s²" if si == "m/s2" and unit != si else si), factor
    plant = PLANT[si]
    return plant, factor / READABLE[plant][1]


def read_quantity(text: str, si: str) -> float | None:
    """Return the number of a text in an SI unit: of `166 kN` 166000; None where it is no number.

    A bare number is in SI. Raises ValueError for a unit of another quantity, which it names.

    >>> read_quantity("166 kN", "N"), read_quantity("20", "m/s2"), read_quantity("5 %", "1")
    (166000.0, 20.0, 0.05)
    """
    number, unit = split_number(text)
    if number is None or unit in ("", si):
        return number
    if unit not in READABLE or READABLE[unit][0] != si:
        known = dict.fromkeys([si, *(one for one, (base, _) in READABLE.items() if base == si)])
        raise ValueError(f"{unit!r} is no unit of it; there are {', '.join(known)}")
    return number * READABLE[unit][1]


NUMBER = re.compile(r"\s*([-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


def split_number(text: str) -> tuple[float | None, str]:
    """Return the number at the beginning of a text, None without one, and what stands behind."""
    found = NUMBER.fullmatch(text)
    if found is None:
        return None, ""
    value = float(found[1])
    return (value if math.isfinite(value) else None), found[2]
