"""Who reads a key: conditions on a case, with the words that a case file has for them.

The fields of the groups name theirs (`read=`), and so do the groups in `compressor.cases.table`. A
key without a reader is read by every job. `compressor.cases.unread` refuses what no job reads.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from compressor.cases.laws import CONTACT_LAWS, CYLINDRICAL, FRICTION_LAWS, READ_BY, law_of


@dataclass(frozen=True)
class Reader:
    """A condition under which a case reads a key; `words`: what a case file sets for it.

    `reads` takes the case. Where numbers of the case are columns (`compressor.cases.columns`), its
    comparisons raise `Mixed` as theirs do.
    """

    words: str
    reads: Callable[[Any], Any]


def has_clearance(case: Any) -> bool:
    """Return whether a joint has clearance."""
    sizes = case.clearance_mm
    return bool(sizes.big_end > 0) or bool(sizes.small_end > 0)


def has_play(case: Any) -> bool:
    """Return whether the guide has clearance."""
    return bool(case.guide and case.guide.clearance_mm > 0)


def has_ideal_friction(case: Any) -> bool:
    """Return whether joints without clearance rub."""
    return bool(case.friction and case.friction.ideal_joints)


def hears_casing(case: Any) -> bool:
    """Return whether a sensor stands where a casing mode is heard."""
    return bool(case.body and case.sensor and case.sensor.place != "body")


GAS = Reader("load: gas", lambda case: case.load == "gas")
SPRING = Reader("load: spring", lambda case: case.load == "spring")
A_JOINT = Reader("joint: big_end, small_end or both", lambda case: case.joint != "none")
BIG_END = Reader("joint: big_end or both", lambda case: case.joint in ("big_end", "both"))
SMALL_END = Reader("joint: small_end or both", lambda case: case.joint in ("small_end", "both"))
CLEARANCE = Reader("clearance_mm above 0 at a joint", has_clearance)
BIG_CLEARANCE = Reader(
    "clearance_mm above 0 at the big end", lambda case: case.clearance_mm.big_end > 0
)
SMALL_CLEARANCE = Reader(
    "clearance_mm above 0 at the small end", lambda case: case.clearance_mm.small_end > 0
)
IDEAL_JOINT = Reader(
    "a joint without clearance",
    lambda case: not case.clearance_mm.big_end > 0 or not case.clearance_mm.small_end > 0,
)
PLAY = Reader("guide.clearance_mm above 0", has_play)
CONTACT = Reader(
    f"{CLEARANCE.words} or in the guide", lambda case: has_clearance(case) or has_play(case)
)
RUBBING = Reader(
    f"{CLEARANCE.words} or friction.ideal_joints: true",
    lambda case: has_clearance(case) or has_ideal_friction(case),
)
SMALL_RUBBING = Reader(
    f"{SMALL_CLEARANCE.words}, or friction.ideal_joints: true",
    lambda case: case.clearance_mm.small_end > 0 or has_ideal_friction(case),
)
CORNER_DAMPED = Reader(
    "a contact.law without a restitution",
    lambda case: case.contact.restitution is None,
)
CORNER_RESTITUTION = Reader(
    "a contact.law with a restitution", lambda case: case.contact.restitution is not None
)
GUIDE = Reader(
    "guide.friction above 0 or guide.clearance_mm above 0",
    lambda case: case.guide and (case.guide.friction > 0 or case.guide.clearance_mm > 0),
)
GUIDE_FRICTION = Reader(
    "guide.friction above 0", lambda case: case.guide and case.guide.friction > 0
)
MATERIALS = Reader(
    "contact.materials, such as [steel, steel]", lambda case: case.contact.materials is not None
)
DAMPED = Reader(
    "contact.restitution", lambda case: case.contact.restitution is not None
)  # which johnson and liu need not have
STIFFNESS = (
    CLEARANCE,
    Reader(
        f"another contact.law than {' or '.join(CYLINDRICAL)}",
        lambda case: case.contact.law not in CYLINDRICAL,
    ),
)
BODY = Reader("body: true", lambda case: case.body is not None)
STEADY = Reader("body.start: steady", lambda case: case.body and case.body.start == "steady")
ALONG_X = Reader(
    "body.freedoms: x, xy or xy_rocking", lambda case: case.body and case.body.freedoms != "y"
)
ALONG_Y = Reader(
    "body.freedoms: y, xy or xy_rocking", lambda case: case.body and case.body.freedoms != "x"
)
ROCKING = Reader(
    "body.freedoms: xy_rocking", lambda case: case.body and case.body.freedoms == "xy_rocking"
)
CASING_HEARD = Reader("sensor.place: guide or bearing", hears_casing)
CASING = (
    CASING_HEARD,
    Reader("body.casing: true", lambda case: case.body and case.body.casing),
)
RANDOM = Reader(
    "sensor.noise_m_per_s2 or sensor.speed_jitter above 0",
    lambda case: case.sensor and (case.sensor.noise_m_per_s2 > 0 or case.sensor.speed_jitter > 0),
)
SERIES = Reader("output.keep: series", lambda case: case.output.keep == "series")


def by_law(group: str, key: str) -> Reader:
    """Return the reader of a key that some laws of contact or friction alone read."""
    readers = READ_BY[group][key]
    every = CONTACT_LAWS if group == "contact" else FRICTION_LAWS
    others = [law for law in every if law not in readers]
    if len(others) < len(readers):
        words = f"another {group}.law than {' or '.join(others)}"
    else:
        words = f"{group}.law: {' or '.join(readers)}"

    def reads(case: Any) -> bool:
        chosen = getattr(case, group)
        return bool(chosen) and law_of(chosen) in readers

    return Reader(words, reads)
