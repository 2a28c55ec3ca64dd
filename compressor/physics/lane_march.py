"""Runs that march side by side, a lane each: `march` for all of them, to rounding.

Steps in which nothing begins or ends are taken in all lanes at once (`lane_steps`, `lane_control`).
For any other step a lane is given to `march` itself: at corners of the load, where contact may
begin or end, where the stiff partner is at work. A lane whose run has ended takes the next one.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from compressor.physics._jit import fma, inline_numba, jit
from compressor.physics.kinematics import MAX_SERIES_ANGLE, crank_direction
from compressor.physics.lane_control import (
    advance_lanes,
    choose_next_steps,
    exclude_onsets,
    select_plain_steps,
    tally_lanes,
)
from compressor.physics.lane_steps import (
    ALIVE,
    ATOL,
    BETWEEN,
    BUDGET,
    CALL,
    COS,
    END,
    FIELDS,
    FIRST_FIELD,
    FIRST_TALLY_ROW,
    IS_COUNT,
    LANES,
    LAST_ERROR,
    MAX_DEPTH,
    NEXT_SAMPLE,
    PAIR,
    PHASE,
    PLAIN,
    R0,
    REJECTED,
    RTOL,
    SETTLE,
    SIN,
    SIZE,
    STABILITY_LIMITED,
    STAGE_COUNT,
    STATE,
    STEPS,
    STEPS_TO_TEST,
    TALLY_WORDS,
    H,
    K,
    T,
    Z,
    new_lanes,
    observe_nodes,
    try_steps,
)  # fmt: skip
from compressor.physics.march import DONE, RUNNING, STEPPER, WorkArrays, march, new_work
from compressor.physics.observe import ACCELERATION, CRANK_POWER
from compressor.physics.record import RECORD, Load
from compressor.physics.runge_kutta import FLOWS, STAGES, weights_at
from compressor.physics.step_control import AUTO, begin_stiff_steps, is_last_step
from compressor.physics.tally import TALLY

MIN_FULL = 4  # lanes: fewer runs are faster one after the other, each by itself
NO_TEST = 1e300  # steps without a test for stiffness, where another method is not wanted


class Runs(NamedTuple):
    """Runs of one scene, m of them, in arrays.

    Edges and phases of the segments, times and states of the output samples stand one run after
    the other; `places` holds where each one's begin.
    """

    steppers: np.ndarray  # (m,) of STEPPER
    records: np.ndarray  # (m,) of RECORD
    tallies: np.ndarray  # (m,) of TALLY
    sums: np.ndarray  # (m, TALLY_WORDS): the same memory, each word as a number,
    counts: np.ndarray  # and each as an integer
    z: np.ndarray  # (m, n + 4)
    atol: np.ndarray  # (m, n)
    size: np.ndarray  # (m, n)
    fields: np.ndarray  # (m, FIELDS): the records' numbers that are rows
    places: np.ndarray  # (m, 4): first segment, how many; first sample, how many
    edges: np.ndarray
    phases: np.ndarray
    times: np.ndarray
    states: np.ndarray  # (samples, n)
    works: WorkArrays  # each array with a first axis more, (m,)


@inline_numba
def segment_end(runs, job):
    """Return when the segment ends that a run is in."""
    return runs.edges[runs.places[job, 0] + job + runs.steppers[job].segment + 1]


@jit
def plain_ahead(w, omega, end):
    """Return whether the next step is an explicit one in which nothing is known to begin or end."""
    ready = not w.fresh and w.observed and not w.stiff and w.landing == 0.0 and w.h > 0.0
    return ready and not is_last_step(w.t, w.h, end) and omega * w.h <= MAX_SERIES_ANGLE


@inline_numba
def march_to_plain_step(runs, job, work, limit):
    """March a run by itself until its next step is a plain one; False where it has ended."""
    w, p = runs.steppers[job], runs.records[job]
    first, count = runs.places[job, 0], runs.places[job, 1]
    begin, samples = runs.places[job, 2], runs.places[job, 3]
    edges = runs.edges[first + job : first + job + count + 1]
    phases = runs.phases[first : first + count]
    times, states = runs.times[begin : begin + samples], runs.states[begin : begin + samples]
    while True:
        march(
            w, p, runs.z[job], work, runs.atol[job], runs.size[job], edges, phases, times, states,
            runs.tallies[job], np.int64(1),
        )  # fmt: skip
        if w.status != RUNNING or w.steps + w.rejected + w.onsets >= limit:
            return False
        if plain_ahead(w, p.omega, edges[w.segment + 1]):
            return True


@jit
def next_sample_time(runs, job):
    """Return the time of a run's next output sample."""
    sample, samples = runs.steppers[job].sample, runs.places[job, 3]
    return runs.times[runs.places[job, 2] + sample] if sample < samples else math.inf


@jit
def load_lane(W, j, runs, job, work, limit):
    """Write a run's present state into a lane."""
    w, p = runs.steppers[job], runs.records[job]
    n = runs.size.shape[1]
    for i in range(runs.fields.shape[1]):
        W[FIRST_FIELD + i * LANES + j] = runs.fields[job, i]
    W[COS + j], W[SIN + j] = crank_direction(w.t, p)
    W[T + j], W[H + j], W[END + j] = w.t, w.h, segment_end(runs, job)
    W[PHASE + j] = runs.phases[runs.places[job, 0] + w.segment]
    W[RTOL + j], W[SETTLE + j], W[MAX_DEPTH + j] = w.rtol, w.settle, w.deepest
    W[NEXT_SAMPLE + j] = next_sample_time(runs, job)
    W[LAST_ERROR + j], W[STABILITY_LIMITED + j] = w.error, w.stability_limited
    W[STEPS_TO_TEST + j] = w.steps_to_test if w.mode == AUTO else NO_TEST
    W[STEPS + j], W[REJECTED + j] = w.steps, 0.0
    W[BUDGET + j] = limit - w.rejected - w.onsets
    W[ALIVE + j], W[CALL + j] = 1.0, 0.0
    for i in range(n):
        W[ATOL + i * LANES + j] = runs.atol[job, i]
        W[SIZE + i * LANES + j] = runs.size[job, i]
    for i in range(n + FLOWS):
        W[Z + i * LANES + j] = runs.z[job, i]
        W[K + i * LANES + j] = work.k[0, i]
        for s in range(1, STAGE_COUNT):  # zero times nan is nan
            W[K + (s * STATE + i) * LANES + j] = 0.0
    for i in range(CRANK_POWER - ACCELERATION):
        W[R0 + i * LANES + j] = work.row[ACCELERATION + i]
    for i in range(TALLY_WORDS):
        word = runs.counts[job, i] if IS_COUNT[i] else runs.sums[job, i]
        W[FIRST_TALLY_ROW + i * LANES + j] = word


@jit
def unload_lane(W, j, runs, job, work):
    """Write a lane's state back into its run."""
    w, tally = runs.steppers[job], runs.tallies[job]
    n = runs.size.shape[1]
    steps, refused = np.int64(W[STEPS + j]), np.int64(W[REJECTED + j])
    w.evaluations += (STAGES - 1) * (steps - w.steps + refused)
    if steps > w.steps:  # as `march.onset_ahead` does: steps in lanes land on nothing
        w.landed = 0
    w.t, w.h, w.error, w.steps = W[T + j], W[H + j], W[LAST_ERROR + j], steps
    w.rejected += refused
    w.stability_limited = np.int64(W[STABILITY_LIMITED + j])
    begin_stiff_steps(w)
    if w.mode == AUTO:
        w.steps_to_test = np.int64(W[STEPS_TO_TEST + j])
    w.has_dense = 0
    for i in range(n + FLOWS):
        runs.z[job, i] = W[Z + i * LANES + j]
        work.k[0, i] = W[K + i * LANES + j]
    for i in range(CRANK_POWER - ACCELERATION):
        work.row[ACCELERATION + i] = W[R0 + i * LANES + j]
    for i in range(TALLY_WORDS):
        word = W[FIRST_TALLY_ROW + i * LANES + j]
        if IS_COUNT[i]:
            runs.counts[job, i] = np.int64(word)
        else:
            runs.sums[job, i] = word
    tally.crank_work, tally.load_work = runs.z[job, n], runs.z[job, n + 1]
    tally.contact_work, tally.friction_loss = runs.z[job, n + 2], runs.z[job, n + 3]


@jit
def sample_lane(W, j, runs, job, work):
    """Fill a run's output samples within the step that its lane has just attempted."""
    w = runs.steppers[job]
    t, h = W[T + j], W[H + j]
    begin, samples = runs.places[job, 2], runs.places[job, 3]
    while w.sample < samples and runs.times[begin + w.sample] <= t + h:
        s = min(1.0, max(0.0, (runs.times[begin + w.sample] - t) / h))
        weights_at(PAIR, s, work.weights)
        for i in range(runs.size.shape[1]):
            total = 0.0
            for stage in range(STAGES):
                total = fma(work.weights[stage], W[K + (stage * STATE + i) * LANES + j], total)
            runs.states[begin + w.sample, i] = fma(h, total, W[Z + i * LANES + j])
        w.sample += 1
    W[NEXT_SAMPLE + j] = next_sample_time(runs, job)


@jit
def work_arrays(runs, job):
    """Return the arrays that `march` works in for a run."""
    w = runs.works
    return WorkArrays(
        w.k[job], w.new[job], w.column[job], w.jacobian[job], w.dense[job], w.weights[job],
        w.y[job], w.rows[job], w.gap_fraction[job], w.sides[job], w.row[job],
    )  # fmt: skip


@inline_numba
def load_next_run(W, j, runs, lane_jobs, begun, limit):
    """Load the next run that gets to a plain step into a lane whose run has ended.

    Returns how many runs have begun by then. Without one the lane is empty: its run is -1.
    """
    while begun < runs.size.shape[0]:
        begun += 1
        if march_to_plain_step(runs, begun - 1, work_arrays(runs, begun - 1), limit):
            lane_jobs[j] = begun - 1
            load_lane(W, j, runs, begun - 1, work_arrays(runs, begun - 1), limit)
            return begun
    lane_jobs[j] = -1
    W[ALIVE + j], W[CALL + j] = 0.0, 0.0
    return begun


@inline_numba
def march_out_of_lane(W, j, runs, job, limit):
    """March the run of a lane by itself over what is ahead; False where it has ended."""
    work, w = work_arrays(runs, job), runs.steppers[job]
    unload_lane(W, j, runs, job, work)
    if w.steps + w.rejected + w.onsets >= limit or not march_to_plain_step(runs, job, work, limit):
        return False
    load_lane(W, j, runs, job, work, limit)
    return True


@inline_numba
def march_to_end(W, j, runs, job, limit):
    """March the run of a lane by itself from where the lane is."""
    work, w, p = work_arrays(runs, job), runs.steppers[job], runs.records[job]
    unload_lane(W, j, runs, job, work)
    first, count = runs.places[job, 0], runs.places[job, 1]
    begin, samples = runs.places[job, 2], runs.places[job, 3]
    march(
        w, p, runs.z[job], work, runs.atol[job], runs.size[job],
        runs.edges[first + job : first + job + count + 1], runs.phases[first : first + count],
        runs.times[begin : begin + samples], runs.states[begin : begin + samples],
        runs.tallies[job], np.int64(limit - w.steps - w.rejected - w.onsets),
    )  # fmt: skip


@jit
def march_lanes(scene, W, k, runs, lane_jobs, limit):
    """March all runs, k at a time; a stepper that is still RUNNING then has taken too many steps.

    scene: a tuple of as many zeros as the scene's number: machine code is made for each. W: of
    `new_lanes`; lane_jobs: (k,) integers, the run in each lane, at first -1; limit: attempts of a
    step that a run may take.
    """
    begun = np.int64(0)  # as `load_next_run` returns it
    for j in range(k):
        W[CALL + j] = 1.0
    while True:
        empty = 0
        for j in range(k):
            if W[CALL + j] > 0.0 and not (
                lane_jobs[j] >= 0 and march_out_of_lane(W, j, runs, lane_jobs[j], limit)
            ):
                begun = load_next_run(W, j, runs, lane_jobs, begun, limit)
            empty += lane_jobs[j] < 0
        if k - empty < MIN_FULL:
            for j in range(k):
                if lane_jobs[j] >= 0:
                    march_to_end(W, j, runs, lane_jobs[j], limit)
            return
        try_steps(scene, W, k)
        if select_plain_steps(scene, W, k):  # else two of five nodes need not be observed
            observe_nodes(scene, W, k, BETWEEN)
            exclude_onsets(scene, W, k)
        tally_lanes(scene, W, k)
        for j in range(k):
            if W[PLAIN + j] > 0.0 and W[NEXT_SAMPLE + j] <= W[T + j] + W[H + j]:
                sample_lane(W, j, runs, lane_jobs[j], work_arrays(runs, lane_jobs[j]))
        choose_next_steps(scene, W, k)
        advance_lanes(scene, W, k)


LOAD_FIELDS = ("preload", "spring_stiffness", "spring_damping")


class Run(NamedTuple):
    """A run from its begin to its end, as `march` takes it; the names are those of `march`."""

    stepper: np.record
    p: np.record
    z: np.ndarray
    size: np.ndarray
    edges: np.ndarray
    phases: np.ndarray
    times: np.ndarray
    states: np.ndarray
    tally: np.record


def fits_lane(p: np.record) -> bool:
    """Return whether runs of a record can march in lanes: default laws and powers of 1.5."""
    default = p["laws"].size == 1
    return bool(default and p["load"] in (Load.NONE, Load.SPRING) and p["exponent"] == 1.5)


def march_side_by_side(runs: Sequence[Run], limit: int) -> list[Run | None]:
    """Return the runs of one scene with clearance at their ends, to the bit as by `march`.

    limit: attempts of a step that a run may take. None stands for a run that does not fit into a
    lane, that failed, or that took more attempts. What the runs hold is left as it is.
    """
    fitting = [i for i, run in enumerate(runs) if fits_lane(run.p)]
    results: list[Run | None] = [None] * len(runs)
    if not fitting:
        return results
    batch = gather_runs([runs[i] for i in fitting])
    scene = (0,) * int(runs[0].p["scene"])
    march_lanes(scene, new_lanes(), LANES, batch, np.full(LANES, -1), limit)
    for k, i in enumerate(fitting):
        begin, samples = batch.places[k, 2:].tolist()
        if batch.steppers["status"][k] == DONE:
            results[i] = runs[i]._replace(
                stepper=batch.steppers[k], z=batch.z[k], tally=batch.tallies[k],
                states=batch.states[begin : begin + samples],
            )  # fmt: skip
    return results


def gather_runs(runs: Sequence[Run]) -> Runs:
    """Return the runs in arrays."""
    m, n = len(runs), runs[0].size.size
    records = np.array([run.p for run in runs], RECORD).view(np.recarray)
    steppers = np.array([run.stepper for run in runs], STEPPER).view(np.recarray)
    size = np.array([run.size for run in runs])
    counts = np.array([(run.phases.size, run.times.size) for run in runs])
    places = np.stack([counts.cumsum(axis=0) - counts, counts], axis=2).reshape(m, 4)
    fields = np.empty((m, len(FIELDS)))
    for row, (name, joint) in enumerate(FIELDS):
        column = records[name]
        fields[:, row] = column[:, joint] if column.ndim > 1 else column
    for name in LOAD_FIELDS:  # no load is a spring without force
        fields[records["load"] == Load.NONE, FIELDS.index((name, 0))] = 0.0
    tallies = np.array([run.tally for run in runs], TALLY)
    return Runs(
        steppers, records, tallies.view(np.recarray), tallies.view(np.float64).reshape(m, -1),
        tallies.view(np.int64).reshape(m, -1), np.array([run.z for run in runs]),
        steppers["rtol"][:, None] * size, size, fields, places,
        np.concatenate([run.edges for run in runs]), np.concatenate([run.phases for run in runs]),
        np.concatenate([run.times for run in runs]),
        np.full((counts[:, 1].sum(), n), math.nan),
        WorkArrays(*(np.zeros((m, *array.shape)) for array in new_work(n))),
    )  # fmt: skip
