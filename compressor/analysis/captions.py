"""Captions of the paper's figures and of the diagnosis: sentences that follow from numbers.

A sentence is chosen by numbers, and says them.

Captions of the report's diagnosis: how the paper's faults shake the frame, and why. Whether
something rises or falls with clearance is measured. That friction feeds the swing away from the
changes of direction follows from a run without friction at 0.1 mm, in which less than a fifth of it
is left (tests/analysis/test_shaking.py).
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.cam import Cam
from compressor.analysis.contacts import MODES, contact_modes, mode_shares
from compressor.analysis.orbit import SAME_TURN_DEGREES, JournalMotion, course, orbit
from compressor.analysis.plot_captions import newtons
from compressor.analysis.runs import (
    CLEARANCES,
    FAULTS,
    SPOKEN,
    case_of,
    faulty_joints,
    force_relation,
    ideal_motion,
    label,
    load_corners,
    settled_part,
)
from compressor.analysis.shaking import AFTER, BEFORE, ORDER, Shaking

if TYPE_CHECKING:
    import xarray as xr

Runs = Mapping[str, "xr.Dataset"]

ENLARGED_VIEWS = (
    "Left, the last revolution, acceleration in a row a clearance, with the motion without "
    "clearance dotted; right, the part in the black rectangles, where the curves differ most."
)
LOOP = {
    "big_end": "What is left of a loop is the load, and the rod, which moves otherwise.",
    "small_end": "What is left of a loop is the load; without it the force is all inertia.",
}
SERIES = ("displacement", "velocity", "acceleration")
SAME_CURVE = 1e-9  # of a curve's range: what cannot be seen, and is rounding
MIN_ANGLE, MIN_GAP = 0.005, 1e-6  # degrees, m: the least that captions show


def pressure_volume(runs: Runs) -> str:
    """Describe the gas cycle, and the angles at which it changes."""
    cam = Cam(runs["typical"])
    used, exact = np.degrees(load_corners(runs["typical"])), np.degrees(cam.gas_corners)
    offset = float(np.abs(used - exact).max())
    which = f", up to {offset:.1g}° off the exact ones" if offset > MIN_ANGLE else ""
    return (
        "Cylinder pressure over gas volume in the typical model, made from the stored piston force "
        "and displacement; arrows point in the direction of time. Suction and discharge keep their "
        "pressures, compression and expansion are isentropic. The phases change at "
        f"{in_degrees(used)}{which}."
    )


def cam(runs: Runs) -> str:
    """Describe the cam: whether it closes as printed, and what ours does."""
    found = Cam(runs["design"])
    rise, fall = found.printed_heights
    closes = abs(rise - fall) < MIN_GAP
    printed = "so that the cam closes" if closes else "so that the cam does not close"
    return (
        "(a) The path of the roller's centre around the base circle, at rest while the gas would "
        "expand or be compressed, moving with the piston in between. (b) The follower's "
        "displacement. As printed, with the ideal gas's corner angles, Eq. 10 rises by "
        f"{1e3 * rise:.1f} mm and falls by {1e3 * fall:.1f} mm, {printed}. The closed cam, our "
        f"reconstruction, rises and falls by {1e3 * found.height:.1f} mm. From "
        f"{np.degrees(found.printed_fall):.0f}° on the two are the same."
    )


def load_response(runs: Runs) -> str:
    """Describe both ideal machines: how far apart they move."""
    one, other = runs["design"], runs["typical"]
    away = max(
        float(np.abs(one[name].values - other[name].values).max() / np.ptp(other[name].values))
        for name in SERIES
    )
    how = "coincide, as they must" if away <= SAME_CURVE else f"differ by up to {100 * away:.2g} %"
    return (
        f"Without clearance, both models. The curves {how}: ideal joints and a crank of prescribed "
        "speed leave the load no say in the motion. Left, the last revolution; right, the part in "
        "the black rectangle, at a peak."
    )


def piston_force(runs: Runs) -> str:
    """Describe both loads: their peaks and corners."""
    design, typical = (float(runs[load]["piston_force"].max()) for load in ("design", "typical"))
    higher = "higher than" if design > typical else "no higher than"
    corners = (np.degrees(load_corners(runs[load])) for load in ("design", "typical"))
    return (
        f"The spring's force peaks at {design / 1e3:.2f} kN, {higher} the gas's "
        f"{typical / 1e3:.2f} kN. It turns at {in_degrees(next(corners))}, the gas's at "
        f"{in_degrees(next(corners))}. Steps of the spring's force are its damping, which acts "
        "only while the follower rests."
    )


def in_degrees(found: np.ndarray) -> str:
    """Return the angles, one after the other."""
    return ", ".join(f"{angle:.2f}°" for angle in found)


def response(runs: Runs, fault: str) -> str:
    """Describe displacement, velocity and acceleration with one fault at three clearances."""
    worn_runs = [runs[label(fault, c)] for c in CLEARANCES]
    sentences = [ENLARGED_VIEWS, deviations(worn_runs)]
    for joint in faulty_joints(fault):
        courses = [course(run, joint) for run in worn_runs]
        sentences.append(motion(courses))
        if fault != "both":  # of two joints, acceleration does not show which rings
            sentences += rings(courses)
    sentences.append(peaks(worn_runs))
    return " ".join(sentences)


def deviations(worn_runs: "Sequence[xr.Dataset]") -> str:
    """Describe how far the motion leaves that of the machine without clearance."""
    greatest = np.zeros(3)
    for run in worn_runs:
        settled = settled_part(run)
        ideal = ideal_motion(settled)
        for number, name in enumerate(SERIES):
            difference = np.abs(settled[name].values - ideal[number]).max() / np.ptp(ideal[number])
            greatest[number] = max(greatest[number], difference)
    shares = [percent(share) for share in greatest]
    return (
        f"From the machine without clearance displacement differs by at most {shares[0]} of its "
        f"range, velocity by {shares[1]}, acceleration by {shares[2]}."
    )


def motion(courses: Sequence[JournalMotion]) -> str:
    """Describe how the journal moves in its bearing."""
    joint = SPOKEN[courses[0].joint]
    gap_fractions = [one.gap_fraction for one in courses]
    spans = angle_spans([one.turns for one in courses])
    if any(one.turns for one in courses):
        at_same_angles = spans and max(high - low for low, high in spans) <= SAME_TURN_DEGREES
        at = " and ".join(map(format_span, spans)) if at_same_angles else list_turns_by_run(courses)
        reverses = f"The horizontal force at the {joint} changes its sign near {at}."
    else:
        reverses = f"The horizontal force at the {joint} does not change its sign."
    if max(gap_fractions) == 0.0:
        least = min(one.least for one in courses)
        runs_round = all(abs(abs(one.laps) - 1.0) < 0.05 for one in courses)
        path = "goes round on its wall once a revolution" if runs_round else "moves along its wall"
        stays = (
            f"The journal never leaves its bearing there: it {path}, always pressed in by "
            f"{two_digits(1e6 * least)} µm or more."
        )
    else:
        shares = ", ".join(map(percent, gap_fractions))
        stays = f"The journal is without dry contact for {shares} of the time."
    return f"{reverses} {stays}"


def rings(courses: Sequence[JournalMotion]) -> list[str]:
    """Describe the frequencies after the first change of sign, where all runs have the same one."""
    found = [one.rings for one in courses]
    spans = angle_spans([one.turns[:1] for one in courses])
    if (
        not np.isfinite(found).all()
        or not spans
        or max(spans[0]) - min(spans[0]) > SAME_TURN_DEGREES
    ):
        return []
    return [f"After the first change acceleration rings at {list_by_clearance(found, 0)} Hz."]


def peaks(worn_runs: "Sequence[xr.Dataset]") -> str:
    """Describe the greatest accelerations, and whether they grow with clearance."""
    greatest = [float(run["peak_acceleration"]) for run in worn_runs]
    grows = all(b > a for a, b in itertools.pairwise(greatest))
    trend = "grows with clearance" if grows else "does not always grow with clearance"
    return f"The greatest acceleration {trend}: {list_by_clearance(greatest, 0)} m/s²."


def contact_force(runs: Runs, fault: str, joint: str) -> str:
    """Describe the contact force at one joint at three clearances."""
    of = [runs[label(fault, c)] for c in CLEARANCES]
    along, across = (
        [float(run["peak_contact_force_axis"].sel(joint=joint, axis=axis)) for run in of]
        for axis in "xy"
    )
    at = " at the big end" if fault == "both" else ""
    sentences = [
        "Force on the rod: (a) along the cylinder, positive away from the crank, and (b) vertical, "
        "on a scale of its own. Left, the last revolution, a row a clearance; right, the part in "
        f"the black rectangles, where the horizontal forces{at} differ most.",
        f"Greatest: {list_by_clearance(np.array(along) / 1e3, 2)} kN along the cylinder, "
        f"{list_by_clearance(np.array(across) / 1e3, 2)} kN across it.",
    ]
    slopes = [force_relation(run, joint).slope for run in of]
    if max(slopes) < 0:
        sentences.append("The force opposes the acceleration: here the crosshead holds the rod.")
    elif min(slopes) > 0:
        sentences.append("The force goes with the acceleration: here the crank drives the rod.")
    return " ".join(sentences)


def relation(runs: Runs, joint: str) -> str:
    """Describe acceleration against the horizontal force at one joint."""
    found = [force_relation(runs[label(joint, c)], joint) for c in CLEARANCES]
    return (
        "A dot for each stored sample. The line is the least-squares fit of force on acceleration; "
        f"its slope is a mass: {list_by_clearance([one.slope for one in found], 2)} kg, with r² "
        f"{', '.join(f'{one.r2:.3f}' for one in found)}. {LOOP[joint]}"
    )


def angle_spans(turns: Sequence[Sequence[float]]) -> list[tuple[float, float]]:
    """Return the least and greatest value of each angle (degrees) over runs.

    They are in the order of the first run. Angles that lie nearest to each other round the circle
    belong together, so that 359 and 1 degrees are one change: (359, 361). The list is empty where
    runs have different numbers of angles.
    """
    first = np.array(turns[0])
    if not first.size or {len(one) for one in turns} != {first.size}:
        return []
    gaps = []
    for one in turns:
        rotated = (np.roll(one, n) - first for n in range(first.size))
        gaps.append(min(((d + 180.0) % 360.0 - 180.0 for d in rotated), key=lambda d: (d**2).sum()))
    return [*zip(first + np.min(gaps, axis=0), first + np.max(gaps, axis=0), strict=True)]


def format_span(span: tuple[float, float]) -> str:
    """Return a span of angles in words."""
    low, high = (f"{angle % 360.0:.0f}".replace("360", "0") for angle in span)
    return f"{low}°" if low == high else f"{low}–{high}°"


def list_turns_by_run(courses: Sequence[JournalMotion]) -> str:
    """Return the angles of each run, where they are not the same few."""
    turns = [", ".join(f"{turn:.0f}°" for turn in one.turns) or "no angle" for one in courses]
    return ", ".join(f"{at} at {c:g} mm" for at, c in zip(turns, CLEARANCES, strict=True))


def percent(share: float) -> str:
    """Return a share in percent, to two digits or whole."""
    return f"{two_digits(100.0 * share)} %"


def two_digits(value: float) -> str:
    """Return a number to two digits or whole, without a power of ten."""
    text = f"{value:.2g}"
    return f"{value:.{decimals(abs(value), 0)}f}" if "e" in text else text


def decimals(size: float, usual: int) -> int:
    """Return digits after the point: as usual, or as many more as two digits of a number need."""
    return max(usual, 1 - math.floor(math.log10(size))) if size > 0 else usual


def list_by_clearance(values: Sequence[float] | np.ndarray, usual: int) -> str:
    """Return the numbers of 0.1, 0.2 and 0.3 mm, in this order; usual: digits after the point."""
    digits = decimals(float(np.abs(values).min()), usual)
    return ", ".join(f"{value:.{digits}f}" for value in values)


CAPTIONS: dict[int, Callable[[Runs], str]] = {
    3: pressure_volume,
    4: cam,
    6: load_response,
    7: piston_force,
    8: partial(response, fault="big_end"),
    9: partial(contact_force, fault="big_end", joint="big_end"),
    10: partial(relation, joint="big_end"),
    11: partial(response, fault="small_end"),
    12: partial(contact_force, fault="small_end", joint="small_end"),
    13: partial(relation, joint="small_end"),
    14: partial(response, fault="both"),
    15: partial(contact_force, fault="both", joint="big_end"),
    16: partial(contact_force, fault="both", joint="small_end"),
}


def caption(number: int, runs: Runs) -> str:
    """Return the caption of a figure of the paper, by its number, for the runs it shows."""
    return CAPTIONS[number](runs)


Shakings = Mapping[str, Shaking]

SINGLE_FAULTS = FAULTS[:2]
SPAN = f"{CLEARANCES[0]:g} to {CLEARANCES[-1]:g} mm"


def spectra(found: Shakings, runs: Runs) -> str:
    """Describe X's order spectra: the rms above `ORDER` against clearance, for each fault."""
    sentences = [
        "(a) Order spectra of X, the force on the frame along the cylinder, over "
        f"{found['design'].revolutions} settled revolutions. Above order {ORDER} (dashed) the rms "
        f"is {newtons(found['design'].spectrum.above)} without clearance."
    ]
    for fault in FAULTS:
        above = [found[label(fault, c)].spectrum.above for c in CLEARANCES]
        where = (
            f"the {SPOKEN[fault]}'s clearance"
            if fault in SINGLE_FAULTS
            else "clearance at both joints"
        )
        sentences.append(
            f"With {where} from {SPAN} the rms of X above order {ORDER} {course_of(above)}."
        )
    return " ".join(sentences)


def orbits(found: Shakings, runs: Runs) -> str:
    """Describe the journals' orbits: off the wall or not, and how they go round."""
    known = {
        joint: [orbit(runs[label(joint, c)]).sel(joint=joint) for c in CLEARANCES]
        for joint in SINGLE_FAULTS
    }
    off = max(float(one["off_wall_share"]) for each in known.values() for one in each)
    stays = "No journal leaves its wall" if off == 0.0 else (
        f"Journals are off their walls for up to {100 * off:.2g} % of the time"
    )  # fmt: skip
    laps = {joint: float(np.mean([one["laps"] for one in each])) for joint, each in known.items()}
    ways = {j: "counter-clockwise" if turns > 0 else "clockwise" for j, turns in laps.items()}
    rounds = "; ".join(
        f"at the {SPOKEN[joint]} it goes round {abs(laps[joint]):.1f} times a revolution, "
        f"{ways[joint]}"
        for joint in SINGLE_FAULTS
    )
    return (
        "The journal's centre in its bore over the last revolution, all to one scale. Without "
        f"clearance it is a point. {stays}: {rounds}. Outside the circle it is pressed in."
    )


def angles(found: Shakings, runs: Runs) -> str:
    """Describe which part of X's high orders changes with clearance, by crank angle."""
    sentences = [
        f"The part of X above order {ORDER} over crank angle. Shaded: from {BEFORE:g}° before to "
        f"{AFTER:g}° after a change of direction of the joint's force along the cylinder, at "
        f"{CLEARANCES[-1]:g} mm."
    ]
    for joint in SINGLE_FAULTS:
        forces = [found[label(joint, c)] for c in CLEARANCES]
        if not all(one.turns for one in forces):
            continue
        near, rest = (
            [getattr(one, name) for one in forces] for name in ("near_turns", "elsewhere")
        )
        turns = " and ".join(f"{turn:.0f}°" for turn in forces[-1].turns)
        sentences.append(
            f"At the {SPOKEN[joint]} the force turns at {turns}. From {SPAN} the rms share near "
            f"these angles {course_of(near)}, the one elsewhere {course_of(rest)}. "
            + why(forces, near, rest)
        )
        if rest[-1] < rest[0]:
            sentences += friction(forces, runs[label(joint, CLEARANCES[0])])
    return " ".join([*sentences, flights(runs)])


def why(forces: list[Shaking], near: list[float], rest: list[float]) -> str:
    """Describe which part decides whether the whole rises or falls."""
    whole = [one.spectrum.above for one in forces]
    bigger = "larger" if near[-1] > rest[-1] else "smaller"
    if near[-1] > near[0] and whole[-1] > whole[0]:
        longer = " It also rings on for longer, beyond these angles." if rest[-1] > rest[0] else ""
        return (
            "In a wider bore the journal swings harder to the other side when its force turns; "
            f"this share is the {bigger} one at {CLEARANCES[-1]:g} mm.{longer}"
        )
    if near[-1] > near[0] and rest[-1] < rest[0]:
        return (
            "Here too the journal swings harder when its force turns, but the share elsewhere "
            "falls by more, and the whole with it."
        )
    return "Neither share explains the whole by itself."


def friction(forces: list[Shaking], run) -> list[str]:
    """Describe the share elsewhere that falls: the order at which it rings, and what feeds it."""
    first, last = forces[0].ring, forces[-1].ring
    if not np.isfinite([first, last]).all() or case_of(run).friction is None:
        return []
    return [
        f"It rings at order {first:.0f}, with {CLEARANCES[-1]:g} mm at order {last:.0f}: the "
        "journal's swing on its wall, which friction feeds: without it less than a fifth of this "
        "share is left at 0.1 mm."
    ]


def flights(runs: Runs) -> str:
    """Describe whether any joint is ever in flight."""
    following, most = True, 0.0
    for joint in SINGLE_FAULTS:
        for clearance in CLEARANCES:
            shares = mode_shares(contact_modes(runs[label(joint, clearance)]))["share"]
            own_shares = shares.sel(joint=joint)
            following &= float(own_shares.sel(mode="following")) == 1.0
            most = max(most, float(own_shares.sel(mode=MODES[0])))
    if following:
        return "Below: all contact is following; there is no flight and no impact."
    return f"Below: contact modes; flight takes up to {100 * most:.2g} % of the time."


def course_of(values: list[float]) -> str:
    """Describe how forces (N) go from the first to the last clearance, and through which values."""
    first, *_, last = values
    steps = np.diff(values)
    if (steps > 0).all():
        verb = "rises"
    elif (steps < 0).all():
        verb = "falls"
    else:
        middle = ", ".join(newtons(value) for value in values[1:-1])
        return f"goes from {newtons(first)} over {middle} to {newtons(last)}"
    return f"{verb} from {newtons(first)} to {newtons(last)}"


DIAGNOSIS_CAPTIONS: dict[str, Callable[[Shakings, Runs], str]] = {
    "spectra": spectra,
    "orbits": orbits,
    "angles": angles,
}


def diagnosis_caption(name: str, found: Shakings, runs: Runs) -> str:
    """Return the caption of one of the three figures: spectra, orbits, angles.

    found: `shaking` of the runs, by label of the paper's cases.
    """
    return DIAGNOSIS_CAPTIONS[name](found, runs)
