"""The paper's claims: how each is measured, with its threshold, and what stored runs say.

How each of the paper's claims is measured, with its threshold. The thresholds of the claims were
written before the first comparison, and how claims 5 and 7 are measured before the first map over
machines: the masses are our assumption, so a claim that fails is a result.
"""

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.margins import (
    BarredNumber,
    Margin,
    above,
    at_least,
    at_most,
    exceeds,
    least,
    measure,
    metric,
    peak,
    series_error,
    share_apart,
)
from compressor.analysis.runs import (
    CLEARANCES,
    FAULT_LABELS,
    FAULTS,
    SPOKEN,
    case_of,
    faulty_joints,
    force_relation,
    ideal_motion,
    label,
    record_of,
    settled_part,
)
from compressor.metrics import JOINTS

if TYPE_CHECKING:
    import xarray as xr

Runs = Mapping[str, "xr.Dataset"]
MOTION = ("displacement", "velocity", "acceleration")  # in the order of `ideal_motion`
# how far each measure is from its threshold, and what is shown: a claim holds where no margin is
# negative
Verdict = tuple[list[Margin], list[tuple[str, str]]]
EXCESS = 0.05  # of all crank angles, by which a big end's share is to exceed a small end's


@dataclass(frozen=True)
class Rule:
    """How a claim is measured: the labels it needs and the function that judges it."""

    statement: str
    threshold: str
    needs: tuple[str, ...]
    judge: Callable[[Runs], Verdict]
    note: str = ""


def same_motion(runs: Runs) -> Verdict:
    """Return the verdict on claim 1: both ideal machines move alike."""
    rows, margins = [], []
    for name in MOTION:
        one, other = runs["design"][name].values, runs["typical"][name].values
        difference = float(np.abs(one - other).max() / np.abs(other).max())
        margins.append(at_most(BarredNumber(difference), 1e-12))
        rows.append((name, f"{difference:.1e}"))
    return margins, rows


def design_force(runs: Runs) -> Verdict:
    """Return the verdict on claim 2: the spring load peaks higher, with other corners."""
    peaks = {load: float(runs[load]["piston_force"].max()) for load in ("design", "typical")}
    corners = {load: np.degrees(record_of(runs[load]).corners) for load in peaks}
    shifts = np.abs(corners["design"] - corners["typical"])[[0, 2]]
    rows = [(f"peak, {load}", f"{peak:.1f} N") for load, peak in peaks.items()]
    rows += [
        (f"corners, {load}", ", ".join(f"{angle:.2f}°" for angle in angles))
        for load, angles in corners.items()
    ]
    ratio = BarredNumber(peaks["design"] / peaks["typical"])
    return [at_least(ratio, 1.01), at_least(BarredNumber(float(shifts.min())), 1.0)], rows


def acceleration_alone(runs: Runs) -> Verdict:
    """Return the verdict on claim 3: clearance changes acceleration, and hardly v or x."""
    rows, margins = [], []
    for name in FAULT_LABELS:
        settled = settled_part(runs[name])
        changes = []
        for series, ideal in zip(MOTION, ideal_motion(settled), strict=True):
            spread = float(np.std(ideal))
            error = series_error(settled, series, settled[series].values) / spread

            def away(part: "xr.Dataset", series: str = series, spread: float = spread) -> float:
                motion = dict(zip(MOTION, ideal_motion(part), strict=True))[series]
                return float(np.sqrt(np.mean((part[series].values - motion) ** 2))) / spread

            changes.append(measure(settled, away, error))
        margins += [at_most(changes[0], 0.01), at_most(changes[1], 0.05)]
        margins.append(at_least(changes[2], 0.10))
        text = "x {:.2%}, v {:.2%}, a {:.1%}".format(*(change.value for change in changes))
        rows.append((name, text))
    return margins, rows


def growing_peaks(runs: Runs) -> Verdict:
    """Return the verdict on claim 4: acceleration and contact force peak higher with clearance."""
    rows, margins = [], []
    for fault in FAULTS:
        line = [runs[label(fault, c)] for c in CLEARANCES]
        peaks = {("a", "m/s²"): [peak(run, "peak_acceleration") for run in line]}
        for joint in faulty_joints(fault):
            forces = [peak(run, "peak_contact_force", joint=joint) for run in line]
            peaks[f"F {SPOKEN[joint]}", "N"] = forces
        for (quantity, unit), values in peaks.items():
            margins += [at_least(b.over(a), 1.01) for a, b in itertools.pairwise(values)]
            text = " → ".join(f"{one.value:.0f}" for one in values) + f" {unit}"
            rows.append((f"{SPOKEN[fault]}, {quantity}", text))
    return margins, rows


def horizontal_force(runs: Runs) -> Verdict:
    """Return the verdict on claim 5: the horizontal contact force far exceeds the vertical."""
    rows, margins = [], []
    for fault in FAULTS:
        for joint in faulty_joints(fault):
            line = [runs[label(fault, c)] for c in CLEARANCES]
            ratios = [across_over_up(run, joint) for run in line]
            margins += [at_least(ratio, 3.0) for ratio in ratios]
            where = SPOKEN[fault] if fault != "both" else f"both, {SPOKEN[joint]}"
            peaks = (run["peak_contact_force_axis"].sel(joint=joint).values for run in line)
            beside = ", ".join(f"{across / up:.1f}" for across, up in peaks)
            text = ", ".join(f"{ratio.value:.1f}" for ratio in ratios)
            rows.append((where, f"{text} (ratio of the peaks: {beside})"))
    return margins, rows


def across_over_up(run: "xr.Dataset", joint: str) -> BarredNumber:
    """Return the ratio of horizontal to vertical contact force, weighted by the force.

    Both forces are at the same times: the mean of |F| |F_x| over that of |F| |F_y|. Its error is
    what the force's one allows by Cauchy's inequality.
    """

    def means(part: "xr.Dataset") -> tuple[float, float]:
        force = part["contact_force"].sel(joint=joint).values
        across, up = (np.linalg.norm(force, axis=1)[:, None] * np.abs(force)).mean(axis=0)
        return float(across), float(up)

    def ratio(part: "xr.Dataset") -> float:
        across, up = means(part)
        return across / up if up else math.inf

    settled = settled_part(run)
    force = settled["contact_force"].sel(joint=joint).values
    error = series_error(settled, "contact_force", force, joint=joint)
    sizes = [math.sqrt(float(np.mean(part**2))) for part in force.T]
    both = math.hypot(*sizes)
    parts = [
        BarredNumber(mean, error * (size + both))
        for mean, size in zip(means(settled), sizes, strict=True)
    ]
    return measure(settled, ratio, parts[0].over(parts[1]).error)


def proportional_force(runs: Runs) -> Verdict:
    """Return the verdict on claim 6: acceleration is proportional to horizontal force."""
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
            margins.append(at_least(correlation(runs[name], joint), 0.9))
            slope = abs(relation.slope)
            beside = ", ".join(f"{slope / mass - 1:+.0%} of {m}" for m, mass in masses.items())
            rows.append(
                (f"{name}, {SPOKEN[joint]}", f"r² {relation.r2:.3f}, {slope:.2f} kg ({beside})")
            )
    return margins, rows


def correlation(run: "xr.Dataset", joint: str) -> BarredNumber:
    """Return r² of a joint's horizontal force and acceleration.

    A correlation changes by at most the sum of the errors' shares of the standard deviations.
    """
    settled = settled_part(run)
    a, force = settled["acceleration"].values, settled["contact_force"].sel(joint=joint).values
    error = series_error(run, "acceleration", a) / float(np.std(a))
    error += series_error(run, "contact_force", force, joint=joint) / float(np.std(force[:, 0]))
    return measure(settled, lambda part: force_relation(part, joint).r2, 2.0 * error)


def steady_impacts(runs: Runs) -> Verdict:
    """Return the verdict on claim 7: nearly continuous impacts at the big end alone."""
    rows, margins = [], []
    for c in CLEARANCES:
        big, small = (share_apart(runs[label(joint, c)], joint) for joint in JOINTS)
        margins.append(exceeds(big, small, EXCESS))
        rows.append((f"{c:g} mm", f"big end {big.value:.1%}, small end {small.value:.1%}"))
    return margins, rows


def two_are_worse(runs: Runs) -> Verdict:
    """Return the verdict on claim 8: two clearances are worse than one of the same size."""
    rows, margins = [], []
    for c in CLEARANCES:
        for name, unit in (("peak_acceleration", "peak"), ("rms_acceleration_deviation", "rms")):
            measure = peak if unit == "peak" else metric
            big, small, both = (measure(runs[label(fault, c)], name) for fault in FAULTS)
            margins += [above(both.over(one), 1.0) for one in (big, small)]
            joints = zip(("big", "small", "both"), (big, small, both), strict=True)
            text = ", ".join(f"{name} {one.value:.0f} m/s²" for name, one in joints)
            rows.append((f"{c:g} mm, {unit}", text))
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
        "horizontal over vertical force at the same times, weighted by the force, ≥ 3 at every "
        "joint with clearance, for 0.1, 0.2 and 0.3 mm",
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
        "the crank angle in flight and impact is at the big end ≥ 5 % of the revolution more than "
        "at the small end, at every clearance",
        tuple(label(fault, c) for fault in JOINTS for c in CLEARANCES),
        steady_impacts,
    ),
    Rule(
        "Two clearances are worse than one.",
        "peak acceleration and rms deviation with both joints exceed those of either alone, at "
        "every clearance",
        FAULT_LABELS,
        two_are_worse,
    ),
)


@dataclass(frozen=True)
class Claim:
    """One claim of the paper, measured: without `margins` where its cases are not there."""

    number: int
    statement: str
    threshold: str
    measured: list[tuple[str, str]]
    note: str
    margins: list[Margin]

    @property
    def margin(self) -> Margin | None:
        """Return the smallest margin, that of the claim."""
        return least(self.margins) if self.margins else None

    @property
    def held(self) -> bool | None:
        """Return whether the claim holds; None where its cases are not there."""
        return self.margin.value >= 0.0 if self.margin else None


def claims(runs: Runs) -> list[Claim]:
    """Return every claim with its margins, measured on the runs at hand.

    runs: by label (see `paper_cases`), complete ones.
    """
    found = []
    for number, rule in enumerate(RULES, 1):
        missing = [name for name in rule.needs if name not in runs]
        margins, rows = ([], [("missing", ", ".join(missing))]) if missing else rule.judge(runs)
        found.append(Claim(number, rule.statement, rule.threshold, rows, rule.note, margins))
    return found


def claim_margins(runs: Runs) -> list[Margin]:
    """Return how far each claim is from its threshold; all worn and ideal runs must be there."""
    settled = {name: settled_part(run) for name, run in runs.items()}
    return [least(claim.margins) for claim in claims(settled)]
