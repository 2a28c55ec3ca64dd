"""One evaluation of the equations: ours beside the bare transcription.

Both at the states of a run, in turn; times are medians of rounds. Ours is written into its caller
and gives the state's rates, as in a step; the transcription gives the accelerations alone.
"""

import time
from functools import partial
from statistics import median

import numpy as np
from numba import njit
from peers.mechanism import (
    ACCELERATIONS,
    DISCHARGE,
    GAS_EXPONENT,
    HEAD,
    OMEGA,
    SUCTION,
    A,
    L,
    R,
    case_values,
    error,
)

from compressor.cases.case import Case
from compressor.physics._jit import jit
from compressor.physics.kinematics import ideal
from compressor.physics.loads import piston_place
from compressor.physics.observe import COLUMNS, Column
from compressor.physics.systems import evaluate, observe_all, write_rates
from compressor.solve.solution import solve

ROUNDS, CALLS = 31, 40_000
HEAD_CLEARANCE = HEAD - L - R


@jit
def ours(times, states, phases, p, out, repeats):
    """Evaluate the equations at each state, again and again."""
    for _ in range(repeats):
        for i in range(times.size):
            y = states[i]
            write_rates(evaluate(ideal(times[i], p), y, phases[i], p), y, p, out[i])


def transcription(scene):
    """The same of the bare transcription: fill in the accelerations at m coordinates and loads."""
    accelerate, two_joints = ACCELERATIONS[scene], scene == "both"

    @njit(error_model="numpy")
    def at(t, y, shut, still):
        if two_joints:
            return accelerate(t, y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7], shut, still)
        return accelerate(t, y[0], y[1], y[2], y[3], shut, still)

    @njit(error_model="numpy")
    def fill(times, y, shut, still, out, repeats):
        for _ in range(repeats):
            for i in range(times.size):
                found = at(times[i], y[i], shut[i], still[i])
                for j in range(len(found)):
                    out[i, j] = found[j]

    return fill


def absolute_coordinates(scene, times, states):
    """Coordinates and rates of the transcription, (m, 4) or (m, 8), by eccentricities, (m, n)."""
    places, rates = np.split(states, 2, axis=1)
    ideal = np.zeros((times.size, 2))
    big, big_rate = (ideal, ideal) if scene == "small_end" else (places[:, :2], rates[:, :2])
    small, small_rate = (ideal, ideal) if scene == "big_end" else (places[:, -2:], rates[:, -2:])
    cosine, sine = np.cos(OMEGA * times), np.sin(OMEGA * times)
    sin_phi = (R * sine + small[:, 1] - big[:, 1]) / L
    cos_phi = np.sqrt(1.0 - sin_phi**2)
    rate = (R * OMEGA * cosine + small_rate[:, 1] - big_rate[:, 1]) / (L * cos_phi)
    x = R * cosine + small[:, 0] - big[:, 0] + L * cos_phi
    v = small_rate[:, 0] - big_rate[:, 0] - R * OMEGA * sine - L * sin_phi * rate
    phi = np.arcsin(sin_phi)
    if scene != "both":
        return np.column_stack((x, phi, v, rate))
    centre = R * cosine - big[:, 0] + A * cos_phi, R * sine - big[:, 1] - A * sin_phi
    speed = (
        -R * OMEGA * sine - big_rate[:, 0] - A * sin_phi * rate,
        R * OMEGA * cosine - big_rate[:, 1] - A * cos_phi * rate,
    )
    return np.column_stack((x, *centre, phi, v, *speed, rate))


def loads(phases):
    """The constants of the piston force at each phase of our runs, as of `load_of`."""
    number, clearance = phases & 3, HEAD_CLEARANCE - piston_place(phases)
    expanding = DISCHARGE * clearance**GAS_EXPONENT
    compressing = SUCTION * (clearance + 2.0 * R) ** GAS_EXPONENT
    shut = np.choose(number, (expanding, 0.0, compressing, 0.0))
    return shut, np.choose(number, (0.0, SUCTION, 0.0, DISCHARGE))


def seconds(call, count):
    """CPU seconds of one evaluation of a call that makes so many."""
    began = time.process_time()
    call()
    return (time.process_time() - began) / count


def in_turn(one, other, count):
    """Medians of the CPU seconds of one evaluation of each of two calls, and of their ratio."""
    one(), other()  # compiled
    pairs = [(seconds(one, count), seconds(other, count)) for _ in range(ROUNDS)]
    mine, theirs = (median(column) for column in zip(*pairs, strict=True))
    return {"seconds": mine, "other_seconds": theirs, "ratio": median(a / b for a, b in pairs)}


def beside_transcription(scene):
    """Our evaluation beside the bare one, and how far apart the crosshead's accelerations are."""
    found = solve(Case.from_values(case_values(scene, error_bars=False)))
    p, run = found.p, found.trajectory
    m, repeats, out = run.times.size, CALLS // run.times.size + 1, np.empty(run.states.shape)
    call = partial(ours, run.times, run.states, run.phases, p, out, repeats)
    y, (shut, still) = absolute_coordinates(scene, run.times, run.states), loads(run.phases)
    bare, rows = np.empty((m, y.shape[1] // 2)), np.empty((m, COLUMNS))
    fill = partial(transcription(scene), run.times, y, shut, still, bare, repeats)
    times = in_turn(call, fill, repeats * m)
    observe_all(run.times, run.states, run.phases, p, rows)
    return {"scene": scene, **times, "apart": error(bare[:, 0], rows[:, Column.ACCELERATION])}
