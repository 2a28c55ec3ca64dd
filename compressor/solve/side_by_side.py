"""The attempts that several cases begin with, made side by side in lanes of the march.

They are those that each would make by itself, to the bit: what cannot be made so is left to it.
"""

from collections.abc import Collection, Sequence
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
    """The first attempts of each case, as far as lanes can make them: of scenes for which they
    are compiled.
    """
    asked: dict[int, list[Asked]] = {number: [] for number in scenes}
    for number, case in enumerate(cases):
        if suits(case) and (of := int(scene(case))) in asked:
            asked[of] += attempts_of(number, case)
    found: list[dict[float, Solution]] = [{} for _ in cases]
    for attempts in asked.values():
        if not attempts:
            continue
        ended = march_side_by_side([one.run for one in attempts], MOST_ATTEMPTS)
        for one, run in zip(attempts, ended, strict=True):
            if run:
                found[one.case][one.rtol] = made(one, run)
    return list(found)


def suits(case: Case) -> bool:
    """Whether a case may be simulated in lanes, by what it says of its solution."""
    how = case.solve
    ready = not case.problems and how.method in LANE_METHODS and how.settle_rev != "auto"
    return ready and how.timeout_s >= LEAST_TIME and how.max_steps >= MOST_ATTEMPTS


def attempts_of(number: int, case: Case) -> list[Asked]:
    """What a case's first attempt needs, and its companion's."""
    case = spanned(case, float(case.solve.settle_rev), 1)
    p = record(case)
    rtols = [(case.rtol, case.output.keep == "series")]
    if case.wants_bars and (tighter := companion_rtol(case.rtol)):
        rtols.append((tighter, False))
    found = []
    for rtol, sampled in rtols:
        times = times_of(case, sampled)
        if times.all.size <= MOST_SAMPLES:
            found.append(asked(number, case, rtol, p, times))
    return found


def asked(number: int, case: Case, rtol: float, p: np.record, times: Times) -> Asked:
    """An attempt made ready."""
    wanted = request(case, rtol, p, times)
    trajectory, edges, phases, z = ready(wanted)
    size = natural_sizes(p)
    walker = ready_walker(wanted, size)
    edges, phases, walker.settle = with_edge(edges, phases, wanted.settle)
    run = Run(walker, p, z, size, edges, phases, times.all, trajectory.states, trajectory.tally)
    return Asked(number, rtol, times, run, trajectory)


def made(one: Asked, run: Run) -> Solution:
    """An attempt whose run has reached its end."""
    walker, trajectory = run.walker, one.trajectory
    trajectory.states, trajectory.tally = run.states, run.tally
    trajectory.steps, trajectory.rejected = int(walker["steps"]), int(walker["rejected"])
    trajectory.evaluations = int(walker["evaluations"])
    return concluded(one.rtol, run.p, one.times, trajectory)
