"""The paper's claims, measured on stored runs.

The thresholds of the claims were written before the first comparison and stay as they are: the
masses are our assumption, so a claim that fails is a result.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from compressor.analysis.continuity import compared, continuity, more_continuous
from compressor.analysis.margins import (
    Margin,
    Measure,
    above,
    at_least,
    at_most,
    least,
    metric,
    series_error,
)
from compressor.analysis.paper_cases import (
    CLEARANCES,
    FAULT_LABELS,
    FAULTS,
    SPOKEN,
    faulty_joints,
    label,
)
from compressor.analysis.runs import (
    ACTIVE,
    active_share,
    case_of,
    force_relation,
    ideal_motion,
    load_corners,
    settled,
)
from compressor.metrics import AXES, JOINTS

Runs = Mapping[str, xr.Dataset]


@dataclass(frozen=True)
class Claim:
    """One claim of the paper, measured: `held` is None when its cases are not there."""

    number: int
    statement: str
    threshold: str
    held: bool | None
    measured: list[tuple[str, str]] = field(default_factory=list)
    note: str = ""
    margin: Margin | None = None


# how far each measure is from its threshold, and what is shown: a claim holds where no margin is
# negative
Verdict = tuple[list[Margin], list[tuple[str, str]]]


@dataclass(frozen=True)
class Rule:
    """How a claim is measured: the labels it needs and the function that judges it."""

    statement: str
    threshold: str
    needs: tuple[str, ...]
    judge: Callable[[Runs], Verdict]
    note: str = ""


def claims(runs: Runs) -> list[Claim]:
    """Measure every claim on the runs at hand, complete ones by label (see `paper_cases`)."""
    found = []
    for number, rule in enumerate(RULES, 1):
        missing = [name for name in rule.needs if name not in runs]
        said = (number, rule.statement, rule.threshold)
        if missing:
            found.append(Claim(*said, None, [("missing", ", ".join(missing))], rule.note))
            continue
        margins, rows = rule.judge(runs)
        margin = least(margins)
        found.append(Claim(*said, margin.value >= 0.0, rows, rule.note, margin))
    return found


def same_motion(runs: Runs) -> Verdict:
    """Claim 1: both ideal machines move alike."""
    rows, margins = [], []
    for name in ("displacement", "velocity", "acceleration"):
        one, other = runs["design"][name].values, runs["typical"][name].values
        apart = float(np.abs(one - other).max() / np.abs(other).max())
        margins.append(at_most(Measure(apart), 1e-12))
        rows.append((name, f"{apart:.1e}"))
    return margins, rows


def design_force(runs: Runs) -> Verdict:
    """Claim 2: the design load peaks higher, and its corners lie elsewhere."""
    peaks = {load: float(runs[load]["piston_force"].max()) for load in ("design", "typical")}
    corners = {load: np.degrees(load_corners(runs[load])) for load in peaks}
    apart = np.abs(corners["design"] - corners["typical"])[[0, 2]]
    rows = [(f"peak, {load}", f"{peak:.1f} N") for load, peak in peaks.items()]
    rows += [
        (f"corners, {load}", ", ".join(f"{angle:.2f}°" for angle in angles))
        for load, angles in corners.items()
    ]
    ratio = Measure(peaks["design"] / peaks["typical"])
    return [at_least(ratio, 1.01), at_least(Measure(float(apart.min())), 1.0)], rows


def acceleration_alone(runs: Runs) -> Verdict:
    """Claim 3: displacement and velocity hardly change with clearance, acceleration does."""
    rows, margins = [], []
    for name in FAULT_LABELS:
        kept = settled(runs[name])
        changes = []
        for series, ideal in zip(
            ("displacement", "velocity", "acceleration"), ideal_motion(kept), strict=True
        ):
            values, spread = kept[series].values, np.std(ideal)
            away = float(np.sqrt(np.mean((values - ideal) ** 2)) / spread)
            changes.append(Measure(away, series_error(kept, series, values) / float(spread)))
        margins += [at_most(changes[0], 0.01), at_most(changes[1], 0.05)]
        margins.append(at_least(changes[2], 0.10))
        said = "x {:.2%}, v {:.2%}, a {:.1%}".format(*(change.value for change in changes))
        rows.append((name, said))
    return margins, rows


def growing_peaks(runs: Runs) -> Verdict:
    """Claim 4: peaks of acceleration and contact force grow with clearance."""
    rows, margins = [], []
    for fault in FAULTS:
        line = [runs[label(fault, c)] for c in CLEARANCES]
        peaks = {"a, m/s²": [metric(run, "peak_acceleration") for run in line]}
        for joint in faulty_joints(fault):
            forces = [metric(run, "peak_contact_force", joint=joint) for run in line]
            peaks[f"F {SPOKEN[joint]}, N"] = forces
        for what, values in peaks.items():
            margins += [at_least(b.over(a), 1.01) for a, b in itertools.pairwise(values)]
            said = " → ".join(f"{one.value:.0f}" for one in values)
            rows.append((f"{SPOKEN[fault]}, {what}", said))
    return margins, rows


def horizontal_force(runs: Runs) -> Verdict:
    """Claim 5: the horizontal contact force far exceeds the vertical one."""
    rows, margins = [], []
    for fault in FAULTS:
        for joint in faulty_joints(fault):
            ratios = []
            for c in CLEARANCES:
                across, up = (
                    metric(runs[label(fault, c)], "peak_contact_force_axis", joint=joint, axis=axis)
                    for axis in AXES
                )
                ratios.append(across.over(up))
            margins += [at_least(ratio, 3.0) for ratio in ratios]
            where = SPOKEN[fault] if fault != "both" else f"both, {SPOKEN[joint]}"
            rows.append((where, ", ".join(f"{ratio.value:.1f}" for ratio in ratios)))
    return margins, rows


def proportional_force(runs: Runs) -> Verdict:
    """Claim 6: acceleration is proportional to the horizontal contact force."""
    rows, margins = [], []
    for name in FAULT_LABELS:
        fault = name.split()[0]
        machine = case_of(runs[name]).machine
        masses = {
            "m_p": machine.reciprocating_mass_kg,
            "m_p + 0.5 m_cr": machine.reciprocating_mass_kg + 0.5 * machine.rod_mass_kg,
        }
        for joint in faulty_joints(fault):
            relation = force_relation(runs[name], joint)
            margins.append(at_least(Measure(relation.r2, r2_error(runs[name], joint)), 0.9))
            slope = abs(relation.slope)
            beside = ", ".join(f"{slope / mass - 1:+.0%} of {m}" for m, mass in masses.items())
            rows.append(
                (f"{name}, {SPOKEN[joint]}", f"r² {relation.r2:.3f}, {slope:.2f} kg ({beside})")
            )
    return margins, rows


def r2_error(run: xr.Dataset, joint: str) -> float:
    """How much r² may change by the errors of acceleration and force.

    A correlation changes by at most the sum of the errors' shares of the standard deviations.
    """
    kept = settled(run)
    a, force = kept["acceleration"].values, kept["contact_force"].sel(joint=joint).values
    away = series_error(run, "acceleration", a) / float(np.std(a))
    away += series_error(run, "contact_force", force, joint=joint) / float(np.std(force[:, 0]))
    return 2.0 * away


def steady_impacts(runs: Runs) -> Verdict:
    """Claim 7: nearly continuous impacts at the big end, intermittent ones at the small end."""
    rows, margins = [], []
    for c in CLEARANCES:
        shares = [active(runs[label(fault, c)]) for fault in ("big_end", "small_end")]
        margins += [at_least(shares[0], 0.5), at_most(shares[1], 0.5)]
        margins.append(at_least(shares[0].over(shares[1]), 1.5))
        big, small = (share.value for share in shares)
        impacts, releases = (
            [float(runs[label(joint, c)][name].sel(joint=joint)) for joint in JOINTS]
            for name in ("impact_count", "release_count")
        )
        rows.append(
            (
                f"{c:g} mm",
                f"active: big end {big:.0%}, small end {small:.0%}; "
                f"impacts {impacts[0]:.0f} and {impacts[1]:.0f}, "
                f"releases {releases[0]:.0f} and {releases[1]:.0f}",
            )
        )
    return margins, [*rows, *by_the_literature(runs)]


def by_the_literature(runs: Runs) -> Iterator[tuple[str, str]]:
    """Claim 7 by other measures (`continuity`), big end and small end, beside the verdict."""
    for begin, start_up in (("settled", False), ("from the start", True)):
        more = []
        for c in CLEARANCES:
            pair = [continuity(runs[label(joint, c)], joint, start_up) for joint in JOINTS]
            more.append(more_continuous(*pair))
            yield f"{c:g} mm, {begin}", compared(*pair)
        yield (
            f"{begin}: big end more continuous by all three shares",
            f"at {sum(more)} of {len(more)} clearances",
        )


def active(run: xr.Dataset) -> Measure:
    """The active share; its error is what it changes where the level moves by the rms error."""
    kept = settled(run)
    error = series_error(run, "acceleration", kept["acceleration"].values)
    moved = error / float(np.abs(ideal_motion(kept)[2]).max())
    if math.isnan(moved):
        return Measure(active_share(run), math.nan)
    shares = [active_share(run, level=max(ACTIVE + part, 0.0)) for part in (-moved, 0.0, moved)]
    return Measure(shares[1], max(abs(share - shares[1]) for share in shares))


def two_are_worse(runs: Runs) -> Verdict:
    """Claim 8: two clearances are worse than one of the same size."""
    rows, margins = [], []
    for c in CLEARANCES:
        for name, unit in (("peak_acceleration", "peak"), ("rms_acceleration_deviation", "rms")):
            big, small, both = (metric(runs[label(fault, c)], name) for fault in FAULTS)
            margins += [above(both.over(one), 1.0) for one in (big, small)]
            said = f"big {big.value:.0f}, small {small.value:.0f}, both {both.value:.0f} m/s²"
            rows.append((f"{c:g} mm, {unit}", said))
    return margins, rows


RULES = (
    Rule(
        "The design and the typical model agree in displacement, velocity and acceleration.",
        "greatest difference ≤ 1e-12 of the greatest value",
        ("design", "typical"),
        same_motion,
        "True by construction: with ideal joints and a prescribed crank both are the same curve.",
    ),
    Rule(
        "The design force peaks higher than the typical one and its corners lie elsewhere.",
        "peak ≥ 1.01 times the typical; first and third corner ≥ 1° apart",
        ("design", "typical"),
        design_force,
        "Figure 7; peaks of the stored series, corners of the load.",
    ),
    Rule(
        "Displacement and velocity hardly change with clearance; acceleration does.",
        "rms deviation from the ideal motion, relative to its standard deviation: displacement "
        "≤ 1 %, velocity ≤ 5 %, acceleration ≥ 10 %, in all nine cases",
        FAULT_LABELS,
        acceleration_alone,
    ),
    Rule(
        "Peaks grow with clearance, for each joint and for both.",
        "peak acceleration and peak contact force each grow by ≥ 1 % from 0.1 to 0.2 to 0.3 mm",
        FAULT_LABELS,
        growing_peaks,
    ),
    Rule(
        "The horizontal contact force far exceeds the vertical one.",
        "ratio of the peaks ≥ 3 at every joint with clearance, for 0.1, 0.2 and 0.3 mm",
        FAULT_LABELS,
        horizontal_force,
    ),
    Rule(
        "Acceleration is proportional to the horizontal contact force.",
        "r² ≥ 0.9 at every joint with clearance; the slope stands beside the reciprocating mass "
        "m_p and Eq. 7's m_p + 0.5 m_cr",
        FAULT_LABELS,
        proportional_force,
    ),
    Rule(
        "Impacts are nearly continuous at the big end, intermittent at the small end.",
        "active share of the time: big end ≥ 50 %, small end < 50 %, ratio ≥ 1.5, at every "
        "clearance (active: the rms over 6° of the acceleration's deviation from the ideal motion "
        "exceeds 10 % of the ideal peak)",
        tuple(label(fault, c) for fault in JOINTS for c in CLEARANCES),
        steady_impacts,
        "Beside the verdict, big end and small end by measures of the literature.",
    ),
    Rule(
        "Two clearances are worse than one.",
        "peak acceleration and rms deviation with both joints exceed those of either alone, at "
        "every clearance",
        FAULT_LABELS,
        two_are_worse,
    ),
)


def held_share(all_claims: list[list[Claim]]) -> Iterator[tuple[int, int, int]]:
    """For each claim, over several sets of claims: its number, in how many it held, of how many."""
    for same in zip(*all_claims, strict=True):
        judged = [claim.held for claim in same if claim.held is not None]
        yield same[0].number, sum(judged), len(judged)
