"""Second attractors: where a chain that goes up and one that goes down end differently.

A difference may be a transient that is not over. So both ends' states are run on at the same value,
and the machine is started from other places, too: a second attractor is confirmed where two
different motions are reached by simulation at that value.

    RESULTS/regimes/STUDY/pair-KEY.nc    of the two chains, over their values going up
"""

import hashlib
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from compressor.cases import Case
from compressor.metrics import AXES, JOINTS
from compressor.outcome import Regime
from compressor.program import PROGRAM
from compressor.solve import record
from compressor.store import Folder, StoreError, read_dataset, write_dataset
from compressor.studies.regimes.chains import FOLDER, REMEDY, Chain, read_kept_rows
from compressor.studies.regimes.revolutions import follow_revolutions
from compressor.studies.regimes.values import (
    Clock,
    Row,
    SettledMotion,
    hausdorff_distance,
    measure_motion,
    places,
    span_of,
    tolerance,
)

FURTHER = 200  # rev that a motion runs on before it is looked at again
START_COUNT = 8  # from other places
SEED = 13  # of these places
START_ROOM = 0.9  # of the clearance, within which they lie
# tolerances: each of two sets may lie one, and a little more, beside its motion
APART_TOLERANCES = 3.0
APART_STANDARD_ERRORS = 3.0  # standard errors by which means of chaotic motions differ
VERDICTS = {
    "differs": "1: the chains that go up and down end in different motions here",
    "confirmed": "1: two different motions were reached by further simulation here",
    "motions": "different motions that further simulation reached, of up, down and other starts",
    "starts_like_up": "of the other starts, those that end in the motion of the chain that goes up",
    "starts_like_down": "the same of the chain that goes down",
}


class MotionSignature(NamedTuple):
    """What distinguishes motions: regime, period (rev, nan: none), Poincaré places, rms, its error.

    places: (k, joint, 2), in clearances; rms of acceleration and its standard error, m/s2.
    """

    regime: str
    period: float
    places: np.ndarray
    rms: float
    rms_error: float


def differ(one: MotionSignature, other: MotionSignature, within: float) -> bool:
    """Return whether two motions of a machine are different ones.

    Two periodic motions differ if their sets of Poincaré places are farther apart than three times
    the tolerance `within`, of the clearance. Sets of different periods are, unless a period is
    doubled by less than that. A periodic and a chaotic motion differ. Two chaotic ones differ if
    their means of rms_acceleration are more than 3 standard errors of their difference apart. Other
    motions are not known well enough to differ.
    """
    regimes = {one.regime, other.regime}
    if regimes == {Regime.PERIODIC}:
        return hausdorff_distance(one.places, other.places) > APART_TOLERANCES * within
    if regimes == {Regime.CHAOTIC}:
        error = math.hypot(one.rms_error, other.rms_error)
        return abs(one.rms - other.rms) > APART_STANDARD_ERRORS * error
    return regimes == {Regime.PERIODIC, Regime.CHAOTIC}


def signature_of_row(row: Row, case: Case) -> MotionSignature:
    """Return the signature of the motion at a stored value."""
    count = 0 if row["status"] != "ok" else int(row["revolutions"])
    period = float(row["period"])
    points = row["section"][: count if math.isnan(period) else int(period)]
    found = places(points, record(case)["clearance"])
    error = float(row["rms_acceleration_standard_error"])
    return MotionSignature(row["regime"], period, found, float(row["rms_acceleration"]), error)


def signature_of_motion(motion: SettledMotion, case: Case) -> MotionSignature:
    """Return the signature of a motion that was followed now."""
    found = places(motion.points, record(case)["clearance"])
    if motion.reason:
        return MotionSignature("", math.nan, found, math.nan, math.nan)
    rms = float(motion.run.numbers(motion.count)["rms_acceleration"])
    error = motion.run.rms_error(motion.count)
    return MotionSignature(motion.regime, motion.period, found, rms, error)


@dataclass(frozen=True)
class ChainPair:
    """The two chains of one machine, up and down."""

    up: Chain
    down: Chain

    @cached_property
    def key(self) -> str:
        identity = f"{self.up.key} {self.down.key} {FURTHER} {START_COUNT} {SEED}"
        return hashlib.sha256(identity.encode()).hexdigest()[:20]

    def path(self, folder: Folder) -> Path:
        """Return the path of the file with its verdicts."""
        return Path(folder) / FOLDER / self.up.study / f"pair-{self.key}.nc"


class Doubt(NamedTuple):
    """A value at which chains differ: its number going up, and where each of them ended."""

    number: int
    case: Case
    up: np.ndarray
    down: np.ndarray
    pair: ChainPair


class Verdict(NamedTuple):
    """Numbers by the names of `VERDICTS`."""

    differs: int
    confirmed: int
    motions: int
    starts_like_up: int
    starts_like_down: int


AGREED_VERDICT = Verdict(0, 0, 0, 0, 0)


def doubts(pair: ChainPair, folder: Folder) -> list[Doubt]:
    """Return the values at which the stored chains of a pair differ."""
    up = read_kept_rows(pair.up, pair.up.path(folder))
    down = read_kept_rows(pair.down, pair.down.path(folder))
    if min(len(up), len(down)) < len(pair.up.cases):
        return []
    found = []
    # rows are in the order of running, so that those of `down` begin at the last value
    for number, (one, other) in enumerate(zip(up, down[::-1], strict=False)):
        case = pair.up.cases[number]
        if differ(signature_of_row(one, case), signature_of_row(other, case), tolerance(case)):
            found.append(Doubt(number, case, one["end_state"], other["end_state"], pair))
    return found


def confirm(doubt: Doubt) -> Verdict:
    """Run a machine on from both chains' ends and from other starts, and count its motions.

    Two motions are confirmed where two of these runs end differently, after `FURTHER` revolutions
    each. The starts are drawn within the clearance, always the same ones.
    """
    case = doubt.case
    of_ends = [follow_on(case, state, doubt.pair.up) for state in (doubt.up, doubt.down)]
    of_starts = [follow_on(start, None, doubt.pair.up) for start in other_starts(case)]
    within = tolerance(case)
    different: list[MotionSignature] = []
    for one in (*of_ends, *of_starts):
        if one.regime and all(differ(one, other, within) for other in different):
            different.append(one)
    up, down = (
        sum(bool(one.regime) and one.regime == end.regime and not differ(one, end, within)
            for one in of_starts)
        for end in of_ends
    )  # fmt: skip
    return Verdict(1, int(len(different) > 1), len(different), up, down)


def follow_on(case: Case, state: np.ndarray | None, chain: Chain) -> MotionSignature:
    """Return the motion after many more revolutions.

    state: where it goes on, or None to begin at the case's own start.
    """
    clock = Clock(case.solve.timeout_s)
    run = follow_revolutions(case, state, span_of(chain.request, FURTHER, clock))
    if run.reason:
        return MotionSignature("", math.nan, run.points[:0, :, :2], math.nan, math.nan)
    return signature_of_motion(measure_motion(case, run.state, chain.request, clock), case)


def other_starts(case: Case) -> list[Case]:
    """Return the case with its journals starting elsewhere, several times.

    The places are evenly drawn from a disk within each clearance.
    """
    rng = np.random.default_rng(SEED)
    found = []
    for _ in range(START_COUNT):
        shift: dict[str, float] = {}
        for joint in JOINTS:
            radius, angle = math.sqrt(rng.random()), 2.0 * math.pi * rng.random()
            size = START_ROOM * getattr(case.clearance_mm, joint) * radius
            place = (size * math.cos(angle), size * math.sin(angle))
            shift |= {f"{joint}_{axis}": at for axis, at in zip(AXES, place, strict=True)}
        found.append(replace(case, initial_offset_mm=replace(case.initial_offset_mm, **shift)))
    return found


def read_verdicts(pair: ChainPair, folder: Folder) -> dict[int, Verdict]:
    """Return the stored verdicts by the number of the value, going up.

    None where there is no file.
    """
    path = pair.path(folder)
    if not path.exists():
        return {}
    found = read_dataset(path, REMEDY)
    if found.attrs.get("key") != pair.key:
        raise StoreError(path, "is not the pair that its name says", REMEDY)
    columns = [found[name].values.tolist() for name in VERDICTS]
    rows = zip(found["looked"].values.tolist(), zip(*columns, strict=True), strict=True)
    return {n: Verdict(*row) for n, (looked, row) in enumerate(rows) if looked}


def write_verdicts(pair: ChainPair, folder: Folder, known: Mapping[int, Verdict]) -> None:
    """Store verdicts by the number of the value, going up; the others are not known yet."""
    rows = [known.get(n, AGREED_VERDICT) for n in range(len(pair.up.cases))]
    dims = ("value",)
    variables: dict[str, tuple] = {
        name: (dims, np.array([getattr(row, name) for row in rows]), attrs)
        for name, attrs in verdict_attrs().items()
    }
    looked = np.array([int(n in known) for n in range(len(rows))])
    variables["looked"] = dims, looked, {"units": "1", "long_name": "1: the verdict is known"}
    value = (
        np.array(pair.up.values),
        {"units": pair.up.request.unit, "long_name": pair.up.request.over},
    )
    attrs = {"key": pair.key, "study": pair.up.study, "program": PROGRAM}
    write_dataset(pair.path(folder), xr.Dataset(variables, {"value": (dims, *value)}, attrs))


def verdict_attrs() -> dict[str, dict[str, str]]:
    """Return the units and long names of the verdicts."""
    return {name: {"units": "1", "long_name": phrase} for name, phrase in VERDICTS.items()}


class VerdictBook:
    """The verdicts of a pair of chains as they arrive; written every few seconds."""

    def __init__(self, pair: ChainPair, folder: Folder, flush: float):
        self.pair, self.folder, self.flush = pair, folder, flush
        self.known = read_verdicts(pair, folder)
        stored = (len(read_kept_rows(chain, chain.path(folder))) for chain in (pair.up, pair.down))
        whole = min(stored) == len(pair.up.cases)
        doubted = doubts(pair, folder)
        self.numbers = {doubt.number for doubt in doubted}
        self.missing = [d for d in doubted if not self.known.get(d.number, AGREED_VERDICT).differs]
        before = dict(self.known)
        if whole:
            agreed = (n for n in range(len(pair.up.cases)) if n not in self.numbers)
            self.known |= dict.fromkeys(agreed, AGREED_VERDICT)
        for doubt in self.missing:
            self.known.pop(doubt.number, None)
        self.written = time.monotonic()
        if self.known != before:
            self.write()

    def add(self, number: int, verdict: Verdict) -> None:
        """Record a verdict; store all that is known if the last time is long ago."""
        self.known[number] = verdict
        if time.monotonic() - self.written > self.flush:
            self.write()

    def write(self) -> None:
        """Store what is known."""
        write_verdicts(self.pair, self.folder, self.known)
        self.written = time.monotonic()

    def count(self) -> tuple[int, int]:
        """Return at how many values the chains differ, and how many of these are confirmed."""
        found: Sequence[Verdict] = [*self.known.values()]
        return len(self.numbers), sum(one.confirmed for one in found)
