"""Captions of the report's diagnosis: how the paper's faults shake the frame, and why.

Whether something rises or falls with clearance is measured. That friction feeds the swing away from
the changes of direction follows from a run without friction at 0.1 mm, in which less than a fifth
of it is left (tests/analysis/test_shaking.py).
"""

from collections.abc import Callable, Mapping

import numpy as np

from compressor.analysis.captions import Runs
from compressor.analysis.contact_modes import MODES, contact_modes, mode_shares
from compressor.analysis.orbit import orbit
from compressor.analysis.paper_cases import CLEARANCES, FAULTS, SPOKEN, label
from compressor.analysis.plot_captions import newtons
from compressor.analysis.runs import case_of
from compressor.analysis.shaking import AFTER, BEFORE, ORDER, Shaking

Shakings = Mapping[str, Shaking]

ALONE = FAULTS[:2]
SPAN = f"{CLEARANCES[0]:g} to {CLEARANCES[-1]:g} mm"


def spectra(found: Shakings, runs: Runs) -> str:
    """Of X's order spectra: the rms above `ORDER` against clearance, for each fault."""
    sentences = [
        "(a) Order spectra of X, the force on the frame along the cylinder, over "
        f"{found['design'].revolutions} settled revolutions. Above order {ORDER} (dashed) the rms "
        f"is {newtons(found['design'].spectrum.above)} without clearance."
    ]
    for fault in FAULTS:
        above = [found[label(fault, c)].spectrum.above for c in CLEARANCES]
        where = f"the {SPOKEN[fault]}'s clearance" if fault in ALONE else "clearance at both joints"
        sentences.append(
            f"With {where} from {SPAN} the rms of X above order {ORDER} {course_of(above)}."
        )
    return " ".join(sentences)


def orbits(found: Shakings, runs: Runs) -> str:
    """Of the journals' orbits: off the wall or not, and how they go round."""
    known = {
        joint: [orbit(runs[label(joint, c)]).sel(joint=joint) for c in CLEARANCES]
        for joint in ALONE
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
        for joint in ALONE
    )
    return (
        "The journal's centre in its bore over the last revolution, all to one scale. Without "
        f"clearance it is a point. {stays}: {rounds}. Outside the circle it is pressed in."
    )


def angles(found: Shakings, runs: Runs) -> str:
    """Of the crank angles at which X has its high orders: which share changes with clearance."""
    sentences = [
        f"The part of X above order {ORDER} over crank angle. Shaded: from {BEFORE:g}° before to "
        f"{AFTER:g}° after a change of direction of the joint's force along the cylinder, at "
        f"{CLEARANCES[-1]:g} mm."
    ]
    for joint in ALONE:
        of = [found[label(joint, c)] for c in CLEARANCES]
        if not all(one.turns for one in of):
            continue
        near, rest = ([getattr(one, name) for one in of] for name in ("near_turns", "elsewhere"))
        turns = " and ".join(f"{turn:.0f}°" for turn in of[-1].turns)
        sentences.append(
            f"At the {SPOKEN[joint]} the force turns at {turns}. From {SPAN} the rms share near "
            f"these angles {course_of(near)}, the one elsewhere {course_of(rest)}. "
            + why(of, near, rest)
        )
        if rest[-1] < rest[0]:
            sentences += friction(of, runs[label(joint, CLEARANCES[0])])
    return " ".join([*sentences, flights(runs)])


def why(of: list[Shaking], near: list[float], rest: list[float]) -> str:
    """Return what decides whether the whole rises or falls."""
    whole = [one.spectrum.above for one in of]
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


def friction(of: list[Shaking], run) -> list[str]:
    """Of the share elsewhere that falls: the order at which it rings, and what feeds it."""
    first, last = of[0].ring, of[-1].ring
    if not np.isfinite([first, last]).all() or case_of(run).friction is None:
        return []
    return [
        f"It rings at order {first:.0f}, with {CLEARANCES[-1]:g} mm at order {last:.0f}: the "
        "journal's swing on its wall, which friction feeds: without it less than a fifth of this "
        "share is left at 0.1 mm."
    ]


def flights(runs: Runs) -> str:
    """Return whether any joint is ever in flight."""
    following, most = True, 0.0
    for joint in ALONE:
        for clearance in CLEARANCES:
            shares = mode_shares(contact_modes(runs[label(joint, clearance)]))["share"]
            of = shares.sel(joint=joint)
            following &= float(of.sel(mode="following")) == 1.0
            most = max(most, float(of.sel(mode=MODES[0])))
    if following:
        return "Below: all contact is following; there is no flight and no impact."
    return f"Below: contact modes; flight takes up to {100 * most:.2g} % of the time."


def course_of(values: list[float]) -> str:
    """Return how forces (N) go from the first to the last clearance, and through what."""
    first, *_, last = values
    steps = np.diff(values)
    if (steps > 0).all():
        how = "rises"
    elif (steps < 0).all():
        how = "falls"
    else:
        middle = ", ".join(newtons(value) for value in values[1:-1])
        return f"goes from {newtons(first)} over {middle} to {newtons(last)}"
    return f"{how} from {newtons(first)} to {newtons(last)}"


CAPTIONS: dict[str, Callable[[Shakings, Runs], str]] = {
    "spectra": spectra,
    "orbits": orbits,
    "angles": angles,
}


def diagnosis_caption(name: str, found: Shakings, runs: Runs) -> str:
    """Return the caption of one of the three figures: spectra, orbits, angles.

    found: `shaking` of the runs, by label of the paper's cases.
    """
    return CAPTIONS[name](found, runs)
