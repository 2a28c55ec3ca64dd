"""The general slider-crank: joints and guide with or without clearance, the rod elastic or rigid.

physics/README.md, The general mechanism. The bodies' velocities (`BodyRow`) are linear in the rates
of the coordinates (`record.Coordinate`), with a matrix of eleven columns; what a case does not name
is a column less. Forces of ideal joints drop out; they follow afterwards.

Angles of the crank, not times, are what integrators step through: with a speed that gives way, `t`
is the crank's angle over the steady speed, and what passes in time passes the slower the faster the
crank turns. So corners of the load and revolutions stay where they are.

The rod's frame floats with its ends: its origin is the big end's bore, u along the rod,
(cos phi, -sin phi), and v across it, (sin phi, cos phi); its spin is counter-clockwise, -phi'. A
point at the fraction s of an elastic rod is displaced along u by two quadratic shapes, of its
middle and of its small end, and along v by half a sine wave and a whole one.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from compressor.physics._jit import inline_llvm, inner, jit, square_root
from compressor.physics.contact import NO_CONTACT, ContactState, friction_coefficient, joint_contact
from compressor.physics.contact_laws import power, rise
from compressor.physics.kinematics import IdealMotion
from compressor.physics.loads import piston_force
from compressor.physics.record import BIG_END, SMALL_END, Coordinate

MODES = 4  # two across, two along
ACROSS = 2  # so many of them, the first, are across
BIG_SLOPE = math.pi * np.array([1.0, 2.0, 0.0, 0.0])  # at the ends, times the length
SMALL_SLOPE = math.pi * np.array([-1.0, 2.0, 0.0, 0.0])
BENDING = math.pi**4 / 2.0 * np.array([1.0, 16.0])  # stiffness over E I / L^3
AXIAL = np.array([[16.0, -8.0], [-8.0, 7.0]]) / 3.0  # over E A / L
MAX_ROUNDS = 50  # in which friction and the forces that it depends on agree
FRICTION_TOLERANCE = 1e-14  # of the friction


def shapes(s):
    """Return the four shapes at fractions s of the rod, (4, s.size)."""
    return np.array(
        [np.sin(math.pi * s), np.sin(2.0 * math.pi * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)]
    )


def integrals():
    """Return means over the rod: of the shapes, (4,), of those times s, and of products, (4, 4)."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    s, weights = (nodes + 1.0) / 2.0, weights / 2.0
    each = shapes(s)
    return each @ weights, each @ (weights * s), (each * weights) @ each.T


FIRST, MOMENT, _PRODUCT = integrals()
_SIGNS = np.array([1.0, 1.0, -1.0, -1.0])
_ALIKE = np.equal.outer(_SIGNS, _SIGNS)
# of shapes in one direction, and of one across and one along, by which spin couples them
ALIKE, CROSSED = _PRODUCT * _ALIKE, _SIGNS[:, None] * _PRODUCT * ~_ALIKE


@inline_llvm
def dot_rows(row, begin, end, q):
    """Return the sum of a row of numbers times those of q, from begin to end."""
    total = 0.0
    for i in range(begin, end):
        total += row[i] * q[i]
    return total


@inner
def fill_rod(pose, p):
    """Write the rod's mass matrix, and its own forces, of its motion and weight; SI."""
    m, length, spin = p.rod_mass, p.rod_length, pose.spin
    ux, uy, vx, vy = pose.cos_phi, -pose.sin_phi, pose.sin_phi, pose.cos_phi
    along, across = m * p.rod_centre, 0.0
    along_rate, across_rate = 0.0, 0.0
    polar, swelling = p.rod_inertia + along * p.rod_centre, 0.0  # half the polar inertia's rate
    if p.elastic:
        q, rates = p.w[7:11], p.rates[7:11]
        along += m * dot_rows(FIRST, ACROSS, MODES, q)
        across = m * dot_rows(FIRST, 0, ACROSS, q)
        along_rate = m * dot_rows(FIRST, ACROSS, MODES, rates)
        across_rate = m * dot_rows(FIRST, 0, ACROSS, rates)
        polar += 2.0 * m * length * dot_rows(MOMENT, ACROSS, MODES, q)
        swelling = m * length * dot_rows(MOMENT, ACROSS, MODES, rates)
        for i in range(MODES):
            polar += m * q[i] * dot_rows(ALIKE[i], 0, MODES, q)
            swelling += m * q[i] * dot_rows(ALIKE[i], 0, MODES, rates)
        fill_modes((ux, uy, vx, vy), spin, q, rates, p)
    mass, force = p.mass, p.own
    mass[1, 1], mass[2, 2], mass[3, 3] = m, m, polar
    mass[1, 3] = mass[3, 1] = along * vx - across * ux
    mass[2, 3] = mass[3, 2] = along * vy - across * uy
    back = 2.0 * spin * across_rate + spin * spin * along
    side = spin * spin * across - 2.0 * spin * along_rate
    force[1] = back * ux + side * vx
    force[2] = back * uy + side * vy - m * p.gravity
    force[3] = -2.0 * spin * swelling - p.gravity * (along * vy - across * uy)


@inner
def fill_modes(axes, spin, q, rates, p):
    """Write the rod's modes' inertia, their coupling and the material's forces."""
    ux, uy, vx, vy = axes
    m, mass, force = p.rod_mass, p.mass, p.own
    for i in range(MODES):
        row, straight = 4 + i, p.rod_length * MOMENT[i]
        x, y = (vx, vy) if i < ACROSS else (ux, uy)
        arm, centrifugal = dot_rows(CROSSED[i], 0, MODES, q), dot_rows(ALIKE[i], 0, MODES, q)
        if i < ACROSS:
            arm += straight
        else:
            centrifugal += straight
        turning = spin * centrifugal - 2.0 * dot_rows(CROSSED[i], 0, MODES, rates)
        mass[1, row] = mass[row, 1] = m * FIRST[i] * x
        mass[2, row] = mass[row, 2] = m * FIRST[i] * y
        mass[3, row] = mass[row, 3] = m * arm
        for j in range(MODES):
            mass[row, 4 + j] = m * ALIKE[i, j]
        force[row] = m * (spin * turning - p.gravity * FIRST[i] * y)
        force[row] -= material(i, q, p) + p.rod_damping * material(i, rates, p)


@inner
def material(i, q, p):
    """Return the elastic force (N) against mode i of the deflections q, (4,) m."""
    if i < ACROSS:
        return p.bending_stiffness * BENDING[i] * q[i]
    return p.axial_stiffness * (AXIAL[i - 2, 0] * q[2] + AXIAL[i - 2, 1] * q[3])


@inline_llvm
def material_work(q, other, p):
    """Return the elastic forces of deflections q times others; of q and q twice the energy (J)."""
    total = 0.0
    if p.elastic:
        for i in range(MODES):
            total += material(i, q, p) * other[i]
    return total


class Guided(NamedTuple):
    """What the guide does to the crosshead: forces (N), moment about the pin (N m), and energy."""

    fx: float
    fy: float
    moment: float
    stored: float  # J
    damped: float  # W, lost in the normal direction
    rubbed: float  # W, lost to friction
    deepest: float  # greatest penetration of a corner (m), negative: the least gap


UNGUIDED = Guided(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@inner
def guide_coefficient(slip, p):
    """Return the friction coefficient of the guide at a slip (m/s): mu tanh(v / v_s)."""
    return p.guide_friction * math.tanh(slip / p.guide_stiction) if p.guide_friction else 0.0


@inner
def corner_force(penetration, rate, p):
    """Return the normal force (N) of a corner and its elastic part."""
    if penetration <= 0.0:
        return 0.0, 0.0
    elastic = p.guide_stiffness * power(penetration, p.guide_exponent)
    damping = p.guide_damping * rise(penetration * p.per_guide_full_damping)
    return max(0.0, damping * rate + elastic), elastic


@inner
def corners(pose, p):
    """Return what the guide does to a crosshead with play, as `Guided`."""
    v, rise, spin = p.velocity[8], p.velocity[9], p.velocity[10]
    fx, fy, moment, stored, damped, rubbed = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    sine, half = math.sin(pose.tilt), math.sin(0.5 * pose.tilt)
    drop = 2.0 * half * half  # 1 - cos(tilt)
    room, lift = p.guide_clearance + p.guide_height * drop, p.guide_length * sine
    for end in (-1.0, 1.0):
        for side in (-1.0, 1.0):
            x = end * p.guide_length * (1.0 - drop) - side * p.guide_height * sine
            y = end * lift + side * p.guide_height * (1.0 - drop)
            penetration = side * (pose.height + end * lift) - room
            rate = side * (rise + spin * x)
            normal, elastic = corner_force(penetration, rate, p)
            if normal > 0.0:
                slip = v - spin * y
                friction = -guide_coefficient(slip, p) * normal
                fx += friction
                fy -= side * normal
                moment -= x * side * normal + y * friction
                rubbed -= friction * slip
            stored += elastic * penetration / (p.guide_exponent + 1.0)
            damped += (normal - elastic) * rate
    return Guided(fx, fy, moment, stored, damped, rubbed, abs(pose.height) + abs(lift) - room)


class BodyRow(IntEnum):
    """Velocities of the bodies, by which their inertia and forces are written."""

    CRANK = 0  # rad/s
    ROD_X = 1  # of the big end's bore, m/s
    ROD_Y = 2
    ROD_SPIN = 3  # of the rod's frame, counter-clockwise, rad/s
    MODES = 4  # four of them, m/s
    CROSSHEAD_X = 8
    CROSSHEAD_Y = 9
    CROSSHEAD_SPIN = 10


ROWS, COORDINATES = len(BodyRow) + MODES - 1, len(Coordinate)
FIRST_MODE = int(Coordinate.BEND_1)
STRETCH = int(Coordinate.STRETCH)


class Pose(NamedTuple):
    """Where the bodies are and how they move: SI, angles of the crank and the rod."""

    cos_theta: float
    sin_theta: float
    sin_phi: float
    cos_phi: float
    length: float  # of the rod, between the bores
    per_reach: float  # 1 over the rod's length along the cylinder
    x: float
    height: float  # of the crosshead's pin
    tilt: float
    speed: float  # of the crank, rad/s
    slip: float  # of the crank: its speed over the steady one, less 1
    spin: float  # of the rod, counter-clockwise


class Joints(NamedTuple):
    """Contacts, guide and load, and the bores' spins: all forces that need no acceleration."""

    big: ContactState  # with the film's force and moment, where a joint has one
    small: ContactState
    guide: Guided
    load: float
    big_spin: float  # rad/s, of the rod's bore
    small_spin: float
    pin_spin: float  # of the crosshead


class Reactions(NamedTuple):
    """Forces on the rod at both ends, of the guide upwards, and friction of what is ideal."""

    big_x: float
    big_y: float
    small_x: float
    small_y: float
    guide: float  # on the crosshead along y, N
    big_torque: float  # on the rod, N m
    small_torque: float
    rubbing: float  # of the guide on the crosshead along x, N


class Solved(NamedTuple):
    """A mechanism at one crank angle and state; SI.

    What else `solve` finds stands in the record's scratch until something else is solved.
    """

    motion: IdealMotion  # ideal, of a steady crank
    pose: Pose
    joints: Joints
    big: ContactState  # of the joints
    small: ContactState
    reactions: Reactions


@inner
def unpack(y, p):
    """Write the coordinates and their rates; the crank has its slip in place of a coordinate."""
    n = p.freedoms
    p.w[0] = y[p.at[0]] if p.driven else 0.0
    p.rates[0] = p.omega * (1.0 + p.w[0])
    for i in range(n):
        coordinate = p.coordinates[p.driven + i]
        p.w[coordinate], p.rates[coordinate] = y[i], y[n + i]


@inner
def pose_of(motion, p):
    """Return the `Pose` at a crank angle, whose ideal `Motion` is given."""
    w, rates = p.w, p.rates
    c, s = motion.cos_theta, motion.sin_theta
    length = p.rod_length + w[STRETCH]
    fall = p.crank_radius * s - w[2] + w[4] - w[5]  # from the big end's bore to the small end's
    sin_phi = fall / length
    cos_phi = square_root((1.0 - sin_phi) * (1.0 + sin_phi))
    x = p.crank_radius * c - w[1] + w[3] + length * cos_phi
    falling = p.crank_radius * c * rates[0] - rates[2] + rates[4] - rates[5]
    per_reach = 1.0 / (length * cos_phi)
    spin = (sin_phi * rates[STRETCH] - falling) * per_reach
    return Pose(
        c, s, sin_phi, cos_phi, length, per_reach, x, w[5], w[6], rates[0], w[0], spin
    )  # fmt: skip


@inner
def apply_jacobian(pose, rates, p, velocity):
    """Write the bodies' velocities that follow from the coordinates' rates, (11,) both."""
    crank = p.crank_radius * rates[0]
    velocity[0] = rates[0]
    velocity[1] = -pose.sin_theta * crank - rates[1]
    velocity[2] = pose.cos_theta * crank - rates[2]
    falling = velocity[2] + rates[4] - rates[5]
    velocity[3] = (pose.sin_phi * rates[STRETCH] - falling) * pose.per_reach
    if p.elastic:
        for i in range(MODES):
            velocity[4 + i] = rates[FIRST_MODE + i]
    along = velocity[1] + rates[3] + pose.cos_phi * rates[STRETCH]
    velocity[8] = along + pose.length * pose.sin_phi * velocity[3]
    velocity[9], velocity[10] = rates[5], rates[6]


@inner
def apply_jacobian_transpose(pose, force, p, pushed):
    """Write the forces on the coordinates that follow from those on the bodies, (11,) both."""
    along = force[1] + force[8]
    turning = (force[3] + pose.length * pose.sin_phi * force[8]) * pose.per_reach
    across = force[2] - turning
    pushed[0] = force[0] + p.crank_radius * (pose.cos_theta * across - pose.sin_theta * along)
    pushed[1], pushed[2], pushed[3] = -along, -across, force[8]
    pushed[4], pushed[5], pushed[6] = -turning, force[9] + turning, force[10]
    if p.elastic:
        for i in range(MODES):
            pushed[FIRST_MODE + i] = force[4 + i]
        pushed[STRETCH] += pose.sin_phi * turning + pose.cos_phi * force[8]


@inner
def apply_mass(vector, p, out):
    """Write the bodies' mass matrix times their velocities or accelerations, (11,) both."""
    out[0] = p.crank_inertia * vector[0]
    if p.elastic:
        for i in range(1, 8):
            out[i] = dot_rows(p.mass[i], 1, 8, vector)
    else:
        for i in range(1, 4):
            out[i] = dot_rows(p.mass[i], 1, 4, vector)
    out[8], out[9] = p.reciprocating_mass * vector[8], p.reciprocating_mass * vector[9]
    out[10] = p.crosshead_inertia * vector[10]


@inner
def fill_bias(pose, p):
    """Write the bodies' accelerations where the coordinates' own are zero."""
    bias = p.bias
    inward = p.crank_radius * pose.speed * pose.speed
    twice = 2.0 * p.rates[STRETCH] * pose.spin  # of Coriolis, across the rod
    bias[1], bias[2] = -inward * pose.cos_theta, -inward * pose.sin_theta
    lowering = bias[2] + pose.length * pose.sin_phi * pose.spin * pose.spin
    bias[3] = -(lowering + twice * pose.cos_phi) * pose.per_reach
    centripetal = pose.length * pose.cos_phi * pose.spin * pose.spin
    bias[8] = bias[1] + twice * pose.sin_phi - centripetal
    bias[8] += pose.length * pose.sin_phi * bias[3]


@inner
def joints_of(phase, y, motion, pose, p):
    """Return the `Joints` at a state."""
    w, rates, velocity = p.w, p.rates, p.velocity
    big_spin, small_spin, pin_spin = pose.spin, pose.spin, velocity[10]
    if p.elastic:
        big_spin += dot_rows(BIG_SLOPE, 0, ACROSS, velocity[4:8]) * p.per_rod_length
        small_spin += dot_rows(SMALL_SLOPE, 0, ACROSS, velocity[4:8]) * p.per_rod_length
    big, small = NO_CONTACT, NO_CONTACT
    if p.clearance[0] > 0.0:
        eccentricity = w[1], w[2], rates[1], rates[2]
        big = joint_contact(BIG_END, eccentricity, (pose.speed, big_spin), y, p)
    if p.clearance[1] > 0.0:
        eccentricity = w[3], w[4], rates[3], rates[4]
        small = joint_contact(SMALL_END, eccentricity, (pin_spin, small_spin), y, p)
    guide = corners(pose, p) if p.tilting else UNGUIDED
    ideal_v = motion.v * (1.0 + pose.slip)
    load = piston_force(phase, pose.x, velocity[8], motion, velocity[8] - ideal_v, p)
    return Joints(big, small, guide, load, big_spin, small_spin, pin_spin)


@inner
def add_forces(pose, joints, p, force):
    """Add to the bodies' forces, (11,), those of contacts, guide, load, weight and motor."""
    big, small, guide = joints.big, joints.small, joints.guide
    c, s = pose.cos_theta, pose.sin_theta
    force[0] -= p.crank_radius * (c * big.fy - s * big.fx)
    force[0] += (p.pin_radius[0] - big.penetration) * big.friction + big.film_moment
    force[0] -= p.unbalance * p.gravity * c
    if p.driven:
        force[0] += motor_torque(pose, p)
    add_on_rod(pose, (big.fx, big.fy, big.moment), (small.fx, small.fy, small.moment), p, force)
    force[8] += guide.fx - joints.load - small.fx
    force[9] += guide.fy - p.reciprocating_mass * p.gravity - small.fy
    force[10] += guide.moment + small.film_moment
    force[10] += (p.pin_radius[1] - small.penetration) * small.friction


@inner
def add_on_rod(pose, big, small, p, force):
    """Add a force (N) and a moment (N m) on the rod at either end: each (x, y, moment)."""
    force[1] += big[0] + small[0]
    force[2] += big[1] + small[1]
    lever = pose.sin_phi * small[0] + pose.cos_phi * small[1]
    force[3] += big[2] + small[2] + pose.length * lever
    if p.elastic:
        for i in range(ACROSS):
            turning = BIG_SLOPE[i] * big[2] + SMALL_SLOPE[i] * small[2]
            force[4 + i] += turning * p.per_rod_length
        # the stretch moves the small end
        force[7] += pose.cos_phi * small[0] - pose.sin_phi * small[1]


@inner
def motor_torque(pose, p):
    """Return the torque (N m) of the motor at the crank's speed: a line."""
    # by the slip: of a steep line the difference of two speeds would leave no digits
    return p.torque - p.torque_slope * p.omega * pose.slip


@jit
def factorize_positive(matrix, n):
    """Write L and 1 / D of L D L' in the lower half of a symmetric matrix, or return False.

    So it does where the matrix is not positive. n: rows and columns that count.
    """
    # sums, no updates of rows: LLVM makes vector code of those, which is slower for so few numbers
    for i in range(n):
        for j in range(i):
            total = matrix[i, j]
            for m in range(j):
                total -= matrix[i, m] * matrix[j, m]
            matrix[i, j] = total
        total = matrix[i, i]
        for j in range(i):
            scaled = matrix[i, j] * matrix[j, j]
            total -= matrix[i, j] * scaled
            matrix[i, j] = scaled
        if not total > 0.0:
            return False
        matrix[i, i] = 1.0 / total
    return True


@jit
def substitute_positive(matrix, b):
    """Solve with the factors of `factorize_positive`, b (n,) being overwritten by the solution."""
    n = b.size
    for i in range(n):
        total = b[i]
        for m in range(i):
            total -= matrix[i, m] * b[m]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i] * matrix[i, i]
        for m in range(i + 1, n):
            total -= matrix[m, i] * b[m]
        b[i] = total


@inner
def reduce_mass(pose, p):
    """Write the mass matrix of the coordinates that move, its lower half."""
    for i in range(p.degrees):
        coordinate = p.coordinates[i]
        p.unit[coordinate] = 1.0
        apply_jacobian(pose, p.unit, p, p.column)
        p.unit[coordinate] = 0.0
        apply_mass(p.column, p, p.momentum)
        apply_jacobian_transpose(pose, p.momentum, p, p.pushed)
        for j in range(i + 1):
            p.matrix[i, j] = p.pushed[p.coordinates[j]]


@inner
def friction_arms(pose, joints, p):
    """Return the friction of what is ideal over its force: of both joints (m), and the guide's."""
    big, small, guide = 0.0, 0.0, 0.0
    if p.rubbing and not p.clearance[0] > 0.0:
        big = p.pin_radius[0]
        big *= friction_coefficient((pose.speed - joints.big_spin) * big, 0.0, p)
    if p.rubbing and not p.clearance[1] > 0.0:
        small = p.pin_radius[1]
        small *= friction_coefficient((joints.pin_spin - joints.small_spin) * small, 0.0, p)
    if not p.tilting:
        guide = -guide_coefficient(p.velocity[8], p)
    return big, small, guide


@inner
def reactions_of(pose, joints, arms, last, p):
    """Return the `Reactions` that the motion needs, with their friction where joints rub.

    last: those whose friction has made these accelerations; arms: as by `friction_arms`.
    """
    big, small = joints.big, joints.small
    big_x, big_y, small_x, small_y = big.fx, big.fy, small.fx, small.fy
    if not p.clearance[1] > 0.0:
        pushed = joints.guide.fx + last.rubbing - joints.load
        small_x = pushed - p.reciprocating_mass * p.body[8]
        small_y = needed_of(2, p) - big.fy
        if not p.clearance[0] > 0.0:
            lever = (needed_of(3, p) - last.big_torque - last.small_torque) / pose.length
            small_y = (lever - pose.sin_phi * small_x) / pose.cos_phi
    if not p.clearance[0] > 0.0:
        big_x, big_y = needed_of(1, p) - small_x, needed_of(2, p) - small_y
    big_torque = arms[0] * square_root(big_x * big_x + big_y * big_y)
    small_torque = arms[1] * square_root(small_x * small_x + small_y * small_y)
    guide, rubbing = joints.guide.fy, 0.0
    if not p.tilting:
        guide = p.reciprocating_mass * p.gravity + small_y
        rubbing = arms[2] * abs(guide)
    return Reactions(big_x, big_y, small_x, small_y, guide, big_torque, small_torque, rubbing)


@inner
def needed_of(row, p):
    """Return what the rod needs beside its weight, by the bodies' row: a force, or the moment."""
    return dot_rows(p.mass[row], 1, 8 if p.elastic else 4, p.body) - p.own[row]


@inner
def friction_differs(one, other):
    """Return whether the friction of two `Reactions` differs beyond rounding.

    That of the guide goes by the pin's force: where its own passes through 0, it has no digits.
    """
    size = abs(other.big_torque) + abs(other.small_torque)
    torque = abs(one.big_torque - other.big_torque) + abs(one.small_torque - other.small_torque)
    force, most = abs(one.rubbing - other.rubbing), abs(other.small_x) + abs(other.small_y)
    return torque > FRICTION_TOLERANCE * size or force > FRICTION_TOLERANCE * most


@inner
def solve(motion, y, phase, p):
    """Return the mechanism `Solved` around the ideal motion, in the load's phase.

    Friction of what is ideal depends on its forces, and these on it: both are found in rounds.
    """
    unpack(y, p)
    pose = pose_of(motion, p)
    apply_jacobian(pose, p.rates, p, p.velocity)
    fill_bias(pose, p)
    fill_rod(pose, p)
    joints = joints_of(phase, y, motion, pose, p)
    reduce_mass(pose, p)
    regular = factorize_positive(p.matrix, p.degrees)
    apply_mass(p.bias, p, p.momentum)
    for row in range(ROWS):
        p.steady[row] = p.own[row] - p.momentum[row]
    add_forces(pose, joints, p, p.steady)
    arms = friction_arms(pose, joints, p)
    reactions = Reactions(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(MAX_ROUNDS):
        p.force[:] = p.steady
        add_rubbing(pose, reactions, p, p.force)
        apply_jacobian_transpose(pose, p.force, p, p.pushed)
        for i in range(p.degrees):
            p.solution[i] = p.pushed[p.coordinates[i]] if regular else math.nan
        substitute_positive(p.matrix, p.solution[: p.degrees])
        for i in range(p.degrees):
            p.accelerations[p.coordinates[i]] = p.solution[i]
        apply_jacobian(pose, p.accelerations, p, p.body)
        for row in range(ROWS):
            p.body[row] += p.bias[row]
        last = reactions
        reactions = reactions_of(pose, joints, arms, last, p)
        if not friction_differs(last, reactions):
            break
    return Solved(motion, pose, joints, joints.big, joints.small, reactions)


@inner
def add_rubbing(pose, reactions, p, force):
    """Add to the bodies' forces the friction of ideal joints and of an ideal guide."""
    big, small = reactions.big_torque, reactions.small_torque
    add_on_rod(pose, (0.0, 0.0, big), (0.0, 0.0, small), p, force)
    force[0] -= big
    force[8] += reactions.rubbing
    force[10] -= small
