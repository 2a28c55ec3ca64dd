"""The attempts that several cases begin with, made side by side in lanes of the march.

They are those that each would make by itself, to the bit: what cannot be made so is left to it.
"""

import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from compressor.cases import Case
from compressor.physics import Run, march_side_by_side
from compressor.solve.attempts import (
    Ahead,
    Solution,
    Times,
    companion_rtol,
    concluded,
    request,
    times_of,
)
from compressor.solve.integrate import ready
from compressor.solve.marching import LANE_METHODS, ready_walker
from compressor.solve.request import Trajectory
from compressor.solve.settling import spanned
from compressor.solve.si_record import record, scene
from compressor.solve.sizes import natural_sizes
from compressor.solve.turns import with_edge

MOST_ATTEMPTS = 200_000  # of a step, of a run in a lane: a longer one is looked at by the clock
LEAST_TIME = 10.0  # s of wall time that a case must have: the clock is not looked at in lanes
MOST_SAMPLES = 100_000  # of a run in a lane


class Asked(NamedTuple):
    """An attempt that is to be made for a case: its number, and what `attempt` would ask for."""

    case: int
    rtol: float
    times: Times
    run: Run
    trajectory: Trajectory


def side_by_side(cases: Sequence[Case], scenes: Collection[int]) -> list[Ahead]:
    """Return the first attempts of each case, as far as lanes can make them: of scenes for which
    they are compiled.
    """
    asked: dict[int, list[Asked]] = {number: [] for number in scenes}
    for number, case in enumerate(cases):
        if suits(case) and (of := int(scene(case))) in asked:
            asked[of] += attempts_of(number, case)
    found: list[dict[float, Solution]] = [{} for _ in cases]
    for attempts in asked.values():
        if not attempts:
            continue
        began = time.perf_counter()
        ended = march_side_by_side([one.run for one in attempts], MOST_ATTEMPTS)
        whole = sum(int(run.walker["evaluations"]) for run in ended if run)
        each = (time.perf_counter() - began) / max(whole, 1)
        for one, run in zip(attempts, ended, strict=True):
            if run:
                found[one.case][one.rtol] = made(one, run, each)
    return list(found)


def suits(case: Case) -> bool:
    """Return whether a case may be simulated in lanes, by what it says of its solution."""
    how = case.solve
    ready = case.is_plain and not case.problems and how.method in LANE_METHODS
    ready = ready and how.settle_rev != "auto"
    return ready and how.timeout_s >= LEAST_TIME and how.max_steps >= MOST_ATTEMPTS


def attempts_of(number: int, case: Case) -> list[Asked]:
    """Return what a case's first attempt needs, and its companion's."""
    case = spanned(case, float(case.solve.settle_rev), 1)
    p, sampled = record(case), case.output.keep == "series"
    found = [asked(number, case, case.rtol, p, times_of(case, sampled))]
    if case.wants_bars and (tighter := companion_rtol(p, case.rtol)):
        if sampled:
            found.append(asked(number, case, tighter, p, times_of(case, False)))
        else:  # all but the tolerance is the same
            found.append(tightened(found[0], tighter))
    return [one for one in found if one.times.all.size <= MOST_SAMPLES]


def tightened(one: Asked, rtol: float) -> Asked:
    """Return the same attempt at another tolerance."""
    walker = one.run.walker.copy()
    walker["rtol"] = rtol
    run, trajectory = one.run._replace(walker=walker), replace(one.trajectory)
    return one._replace(rtol=rtol, run=run, trajectory=trajectory)


def asked(number: int, case: Case, rtol: float, p: np.record, times: Times) -> Asked:
    """Return an attempt made ready."""
    wanted = request(case, rtol, p, times)
    trajectory, edges, phases, z = ready(wanted)
    size = natural_sizes(p)
    walker = ready_walker(wanted, size)
    edges, phases, walker["settle"] = with_edge(edges, phases, wanted.settle)
    run = Run(walker, p, z, size, edges, phases, times.all, trajectory.states, trajectory.tally)
    return Asked(number, rtol, times, run, trajectory)


def made(one: Asked, run: Run, each: float) -> Solution:
    """Return an attempt whose run has reached its end; each: wall time (s) of an evaluation."""
    walker, trajectory = run.walker, one.trajectory
    trajectory.states, trajectory.tally = run.states, run.tally
    trajectory.steps, trajectory.rejected = int(walker["steps"]), int(walker["rejected"])
    trajectory.evaluations = int(walker["evaluations"])
    trajectory.seconds = each * trajectory.evaluations
    return concluded(one.rtol, run.p, one.times, trajectory)
