"""No contact missed: onsets on hand-made interpolants, and 400 constructed re-engagements."""

import itertools
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import brentq

from compressor.cases.case import Case
from compressor.physics._jit import ENABLED, jit
from compressor.physics.contact_laws import normal_force
from compressor.physics.kinematics import crank_direction, ideal
from compressor.physics.loads import segments
from compressor.physics.march import (
    NODES,
    Status,
    march,
    measure_gap_fractions,
    new_stepper,
    new_work,
)
from compressor.physics.observe import COLUMNS, Column
from compressor.physics.onset import (
    CHANGE_TOLERANCE,
    NEVER,
    approach_at,
    joint_onset,
    locate_change,
    locate_contact_between,
    nearness_at,
)
from compressor.physics.record import FREEDOMS, SMALL_END
from compressor.physics.runge_kutta import FLOWS, STAGES, interpolate, take_step
from compressor.physics.systems import (
    derivative,
    derivative_with_flows,
    evaluate,
    observe_all,
    observe_contact,
)
from compressor.physics.tally import new_tally
from compressor.solve.run import COMPILED as METHODS
from compressor.solve.run import CONTACT_STEP
from compressor.solve.si_record import initial_state, length_and_speed, natural_sizes, record, scene

H = 1e-3  # s, of the hand-made steps
CLEARANCE = 2e-4  # m
SHALLOWEST = 1e-10  # m: less is no pulse but a chance coincidence of accelerations
FAR = 5e-3  # m: a clearance that no flight here crosses
COUNT = 100 if ENABLED else 20


def parameters(joint="small_end", load="none", millimetres=CLEARANCE * 1e3):
    return record(Case.from_values({"joint": joint, "load": load, "clearance_mm": millimetres}))


# ---- hand-made interpolants: the journals move along x, the rod does not turn


def path(coefficients):
    """Coefficients of s^j in m -> positions and rates of an interpolant, (5,) each."""
    position = np.zeros(5)
    position[: len(coefficients)] = coefficients
    rate = np.zeros(5)
    rate[:4] = position[1:] * np.arange(1, 5) / H
    return position, rate


def hump(top, height, half_width):
    """A parabola: the journal is `height` m beyond its bearing at s = top (negative: short of)."""
    curvature = abs(height) / half_width**2
    return [CLEARANCE + height - curvature * top**2, 2 * curvature * top, -curvature]


def small_end_only(coefficients):
    dense = np.zeros((5, 4))
    dense[:, 0], dense[:, 2] = path(coefficients)
    return dense


APART, INSIDE = [0.5 * CLEARANCE], [1.1 * CLEARANCE]
CLOSING = [0.5 * CLEARANCE, CLEARANCE]  # touches at s = 0.5
RELEASE = [1.2 * CLEARANCE, -0.4 * CLEARANCE]  # at 0.08 m/s, out at s = 0.5
LEAVING = [1.002 * CLEARANCE, -0.04 * CLEARANCE]  # out at s = 0.05, pushed until then
RELEASED = 0.477775  # where K delta^1.5 outgrows STEP(delta) 0.08 m/s
WIDTH = 1e-3  # half of a pulse, in steps
PULSE = 1e-10  # m, its height

ONSETS = {
    "apart": (APART, NEVER, NEVER),
    "inside": (INSIDE, NEVER, NEVER),  # was touching before
    "closing": (CLOSING, 0.5, 1.0),
    "leaving, still pushed": ([1.2 * CLEARANCE, -0.04 * CLEARANCE], NEVER, NEVER),
    "let go, pushed again": (RELEASE, RELEASED, None),
    "long pulse": (hump(0.5, 1e-7, 0.2), 0.3, 0.75),
    "near miss": (hump(0.52, -1e-6, 0.2), NEVER, NEVER),
    **{
        f"pulse at {top}": (hump(top, PULSE, WIDTH), top - WIDTH, None)
        for top in (0.0015, 0.01, 0.04, 0.05, 0.1, 0.52, 0.9, 0.95, 0.97, 0.99, 0.9985)
    },
}


@pytest.mark.parametrize(("coefficients", "begin", "end"), ONSETS.values(), ids=ONSETS)
def test_first_onset_of_a_joint(coefficients, begin, end):
    dense = small_end_only(coefficients)
    found, until = joint_onset(SMALL_END, 0.0, H, dense, 0, parameters(), np.zeros(4))
    assert found == pytest.approx(begin, abs=1e-6)
    if end is None:
        assert begin + 2 * WIDTH <= until <= begin + 0.25
    else:
        assert until == pytest.approx(end, abs=1e-9)


@pytest.mark.parametrize(
    ("coefficients", "low", "high", "at"),
    [(CLOSING, 0.2, 0.9, 0.5), (LEAVING, 0.0, 1.0, 0.05), (RELEASE, 0.0, 0.49, RELEASED),
     (hump(0.5, 1e-7, 0.2), 0.0, 0.5, 0.3), (hump(0.5, 1e-7, 0.2), 0.5, 1.0, 0.7)],
)  # fmt: skip
def test_a_change_of_contact_is_placed(coefficients, low, high, at):
    def at_fraction(s):
        return nearness_at(SMALL_END, s, 0.0, H, dense, 0, p, np.zeros(4))

    p, dense = parameters(), small_end_only(coefficients)
    ends = at_fraction(low), at_fraction(high)
    found = locate_change(SMALL_END, low, high, *ends, 0.0, H, dense, 0, p, np.zeros(4))
    assert found == pytest.approx(at, abs=1e-6)  # of RELEASED six digits are known
    edges = found - 2 * CHANGE_TOLERANCE, found + 2 * CHANGE_TOLERANCE
    assert len({at_fraction(edge) > 0 for edge in edges}) == 2


@pytest.mark.parametrize(
    ("coefficients", "apart"),
    [(APART, 1.0), (INSIDE, 0.0), (CLOSING, 0.5), (LEAVING, 0.95), (hump(0.5, 1e-7, 0.2), 0.6)],
)  # fmt: skip
def test_the_share_of_a_step_without_contact_ends_where_contact_does(coefficients, apart):
    p, stepper, work = parameters(), new_stepper(1), new_work(4)
    stepper.has_dense, work.dense[:] = 1, small_end_only(coefficients)
    for s, row in zip(NODES, work.rows, strict=True):
        interpolate(s, work.dense, work.y)
        observe_contact(ideal(s * H, p), work.y, 0, p, row)
    measure_gap_fractions(stepper, H, 1, work, np.ones(4), 0, p, new_tally())
    assert work.gap_fraction == pytest.approx([0.0, apart], abs=2 * CHANGE_TOLERANCE)


def test_a_journal_that_rests_at_the_edge_does_not_touch():
    """F_N = 0 at a penetration of 0."""
    dense, p, y = small_end_only([CLEARANCE]), parameters(), np.zeros(4)
    assert nearness_at(SMALL_END, 0.5, 0.0, H, dense, 0, p, y) == 0.0
    assert joint_onset(SMALL_END, 0.0, H, dense, 0, p, y) == (NEVER, NEVER)
    assert locate_contact_between(SMALL_END, 0.2, 0.5, 0.0, H, dense, 0, p, y) == NEVER


@pytest.mark.parametrize("late", [-2e-6, -1e-6, 1e-6, 2e-6])
def test_the_speed_of_approach_is_that_where_the_gap_closes(late):
    """Seen a little before or after, to second order; the rate of the gap changes far more."""
    case = Case.from_values({
        "joint": "small_end", "load": "gas", "clearance_mm": 0.2,
        "contact": {"law": "flores", "restitution": 0.7},
        "initial_offset_mm": {"small_end_x": 0.2},
    })  # fmt: skip
    p = record(case)
    y = initial_state(case, p)
    y[FREEDOMS[scene(case)]] = 0.3
    rates, scratch, middle = np.empty_like(y), np.empty_like(y), np.empty_like(y)
    closed = approach_at(SMALL_END, 0.0, y, 0, p, rates, scratch)
    assert closed[0] == pytest.approx(0.0, abs=1e-15)
    assert closed[1] == pytest.approx(0.3, rel=1e-2)
    derivative(0.0, y, 0, p, rates)
    derivative(late / 2, y + late / 2 * rates, 0, p, middle)
    seen = approach_at(SMALL_END, late, y + late * middle, 0, p, rates, scratch)
    assert np.sign(seen[0]) == np.sign(late)
    # beyond it the contact has begun to push
    assert seen[1] == pytest.approx(closed[1], abs=1e-6 if late < 0.0 else 5e-5)
    assert abs(contact_at(SMALL_END, 0.0, y + late * middle, 0, p).rate - closed[1]) > 1e-4


# ---- constructed re-engagements: a free flight drawn backwards from its contact


class Pulse(NamedTuple):
    """A flight that meets its bearing for `length` s; state and phase at its begin, and its end."""

    p: np.record
    begin: float
    y: np.ndarray
    end: float
    phase: int
    depth: float  # m: of its largest penetration, or of that at which the clamp lets go
    length: float
    clamped: bool


def contact_at(joint, t, y, phase, p):
    now = evaluate(ideal(t, p), y, phase, p)
    return now.small if joint == SMALL_END else now.big


def with_radial_rate(joint, t, y, phase, p, wanted):
    """The state with the least change of its rates that gives the journal a radial rate."""
    n = y.size // 2
    changes = np.zeros((n, y.size))
    changes[:, n:] = np.eye(n)
    rate = contact_at(joint, t, y, phase, p).rate
    slopes = np.array([contact_at(joint, t, y + d, phase, p).rate - rate for d in changes])
    return y + (wanted - rate) / (slopes @ slopes) * slopes @ changes


def flown(t, y, time, phase, p):
    """The state at `time`, earlier or later, of the flight that is at y at t: short RK steps."""
    count = 1 + int(abs(time - t) / 1e-4)
    return step_on(t, (time - t) / count, count, np.append(y, np.zeros(FLOWS)), phase, p)[: y.size]


@jit
def step_on(t, h, count, z, phase, p):
    k, row = np.zeros((STAGES, z.size)), np.zeros(COLUMNS)
    for i in range(count):
        new = np.zeros(z.size)
        derivative_with_flows(t + i * h, z, phase, p, k[0])
        take_step(crank_direction(t + i * h, p), h, z, k, phase, p, new, row)
        z = new
    return z


def graze(length, joint, t, y, phase, p):
    """A state with the journal at its largest eccentricity, and the clearance that is then crossed
    for `length`; None where the eccentricity is at its least."""
    y = with_radial_rate(joint, t, y, phase, p, 0.0)

    def depth(time):
        return contact_at(joint, time, flown(t, y, time, phase, p), phase, p).penetration

    def unbalance(lag):
        return depth(t - lag) - depth(t - lag + length)

    if depth(t + 0.1 * length) > depth(t) or unbalance(0.0) * unbalance(length) >= 0:
        return None
    edge = depth(t - brentq(unbalance, 0.0, length, xtol=1e-13))
    return (y, FAR + edge, depth(t) - edge) if depth(t) - edge > SHALLOWEST else None


def release(length, joint, t, y, phase, p):
    """A state of clamped release, pushed again for the last `length` s, and its clearance."""
    stiffness = p.stiffness[joint]

    def force(speed):
        return normal_force(speed * length, -speed, 1.0, stiffness, p.clearance[joint], p)[1]

    speed = brentq(force, 1e-3, 0.5 * p.full_damping / length)
    y = with_radial_rate(joint, t, y, phase, p, -speed)
    depth = speed * length
    return y, FAR + contact_at(joint, t, y, phase, p).penetration - depth, depth


def construct(rng, length, clamped):
    """One `Pulse`; None where the draw does not make one, or makes two."""
    joint = int(rng.integers(2))
    where = rng.choice([("big_end", "small_end")[joint], "both"])
    p = parameters(where, rng.choice(["none", "gas", "spring"]))
    p.clearance[p.clearance > 0] = FAR
    n = FREEDOMS[int(p.scene)]
    t = rng.uniform(0.002, 0.1)
    edges, phases = segments(p, 0.12)
    phase = int(phases[np.searchsorted(edges, t) - 1])
    y = np.concatenate((rng.normal(0.0, 1e-4, n), rng.normal(0.0, 0.05, n)))
    made = (release if clamped else graze)(length, joint, t, y, phase, p)
    if made is None:
        return None
    y, clearance, depth = made
    before, after = np.exp(rng.uniform(np.log(3e-5), np.log(2e-3), 2))
    begin, end = t - before - length, t + after + length
    first = y = flown(t, y, begin, phase, p)
    p.clearance[joint] = FAR  # flies on as if nothing were met
    times = np.linspace(begin, end, 25)
    path = [first]
    for now, later in itertools.pairwise(times):
        path.append(flown(now, path[-1], later, phase, p))
    p.clearance[joint] = clearance
    for time, y in zip(times, path, strict=True):
        if abs(time - t) > length and contact_at(joint, time, y, phase, p).normal > 0:
            return None  # another contact
    return Pulse(p, begin, first, end, phase, depth, length, clamped)


@pytest.fixture(scope="module")
def pulses():
    """Grazes and clamped releases in turn, of 5 to 500 microseconds."""
    rng = np.random.default_rng(3)
    lengths = np.exp(rng.uniform(np.log(5e-6), np.log(5e-4), COUNT))
    made = []
    while len(made) < COUNT:
        pulse = construct(rng, lengths[len(made)], len(made) % 2 == 1)
        made += [pulse] if pulse else []
    return made


def walk(pulse, rtol, method, times=None):
    """March along a pulse's flight; returns the onsets it landed on, and states at `times`."""
    p, edges, phases = pulse.p, np.array([pulse.begin, pulse.end]), np.array([pulse.phase])
    times = edges[1:] if times is None else times
    stepper, work, size = new_stepper(METHODS[method]), new_work(pulse.y.size), natural_sizes(p)
    length, speed = length_and_speed(p)
    stepper.rtol, stepper.t = rtol, pulse.begin
    stepper.contact_step, stepper.deepest = CONTACT_STEP * length / speed, p.pin_radius[0]
    z, states = np.append(pulse.y, np.zeros(FLOWS)), np.empty((times.size, pulse.y.size))
    march(
        stepper, p, z, work, rtol * size, size, edges, phases, times, states, new_tally(), 10**6
    )  # fmt: skip
    assert stepper.status == Status.DONE
    return stepper.onsets, states


def passes_by(pulse, rtol, method):
    """Whether the computed motion itself, looked at every 0.2 microseconds, never touches."""
    times = np.linspace(pulse.begin, pulse.end, 20001)
    _, states = walk(pulse, rtol, method, times)
    rows = np.empty((times.size, COLUMNS))
    observe_all(times, states, np.full(times.size, pulse.phase), pulse.p, rows)
    return not (rows[:, [Column.NORMAL, Column.NORMAL + 1]] > 0).any()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "rtol"),
    [("TSIT5", 1e-3), ("TSIT5", 1e-5), ("TSIT5", 1e-7), ("TSIT5", 1e-9), ("RODAS", 1e-5)],
)
def test_no_constructed_pulse_is_stepped_over(pulses, method, rtol):
    """An onset is landed on, unless a graze shallower than the tolerance is not there at all."""
    left = [pulse for pulse in pulses if walk(pulse, rtol, method)[0] == 0]
    assert len(left) <= 0.02 * COUNT
    for pulse in left:
        assert not pulse.clamped
        assert pulse.depth < 10 * rtol * length_and_speed(pulse.p)[0]
        assert passes_by(pulse, rtol, method)
