"""The general slider-crank: joints and guide with or without clearance, the rod elastic or rigid.

One system for all combinations. The bodies' velocities (`BodyRow`) are linear in the rates of the
coordinates (`record.Coordinate`), with a matrix of eleven columns; what a case does not name is a
column less. The equations of motion are the bodies' own, projected on the columns that are left
(Jourdain's principle), so that the forces of ideal joints drop out; these follow afterwards.

The position x of the crosshead is no coordinate: it follows from the rod's length. Angles of the
crank, not times, are what integrators step through: with a speed that gives way, `t` is the crank's
angle over the steady speed, and what passes in time passes the slower the faster the crank turns.
So corners of the load and revolutions stay where they are.

The rod as a body in the plane: rigid, or an elastic bar in a frame that floats with its ends. The
frame's origin is the big end's bore, its first axis runs to the small end's. A point at the
fraction s of the rod is displaced along it by two quadratic shapes, of its middle and of its small
end, and across it by half a sine wave and a whole one: the modes of a bar with pinned ends. This is
the model of Simeon's slider-crank (IVP test set, "crank"; linear stiffness). The mass of the
displaced rod is spread evenly.

Axes: u along the rod, (cos phi, -sin phi), and v across it, (sin phi, cos phi); the rod's spin is
counter-clockwise, -phi'. Rows and columns of a mechanism's bodies: `mechanism.BodyRow`.

The crosshead's guide: friction of an ideal one, contact of the four corners in one with play. The
crosshead is a block about its pin, `guide_length` to either side along x and `guide_height` along
y. Each corner meets the plane of its side by ADAMS's IMPACT, whatever the joints' law.
"""

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from compressor.physics._jit import jit, square_root
from compressor.physics.card import measured_force
from compressor.physics.contact import NO_CONTACT, ContactState
from compressor.physics.contact_laws import power, rise
from compressor.physics.film import oiled_joint
from compressor.physics.loads import piston_force
from compressor.physics.record import BIG_END, SMALL_END, Coordinate

MODES = 4  # two across, two along
ACROSS = 2  # so many of them, the first, are across
BIG_SLOPE = math.pi * np.array([1.0, 2.0, 0.0, 0.0])  # at the ends, times the length
SMALL_SLOPE = math.pi * np.array([-1.0, 2.0, 0.0, 0.0])
BENDING = math.pi**4 / 2.0 * np.array([1.0, 16.0])  # stiffness over E I / L^3
AXIAL = np.array([[16.0, -8.0], [-8.0, 7.0]]) / 3.0  # over E A / L


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


FIRST, MOMENT, PRODUCT = integrals()


@jit
def dot_rows(row, begin, end, q):
    """Return the sum of a row of numbers times those of q, from begin to end."""
    total = 0.0
    for i in range(begin, end):
        total += row[i] * q[i]
    return total


@jit
def add_rod(axes, spin, q, rates, p, mass, force):
    """Write the rod's mass matrix and the forces of its motion and weight; SI.

    axes: u_x, u_y, v_x, v_y; spin: counter-clockwise; q, rates: of the modes, (4,), zeros of a
    rigid rod; mass, force: of the bodies, (rows, rows) and (rows,), zeros before.
    """
    ux, uy, vx, vy = axes
    m, length = p.rod_mass, p.rod_length
    along = m * (p.rod_centre + dot_rows(FIRST, ACROSS, MODES, q))
    across = m * dot_rows(FIRST, 0, ACROSS, q)
    along_rate = m * dot_rows(FIRST, ACROSS, MODES, rates)
    across_rate = m * dot_rows(FIRST, 0, ACROSS, rates)
    polar = p.rod_inertia + m * p.rod_centre * p.rod_centre
    polar += 2.0 * m * length * dot_rows(MOMENT, ACROSS, MODES, q)
    swelling = m * length * dot_rows(MOMENT, ACROSS, MODES, rates)  # half the polar inertia's rate
    for i in range(MODES):
        begin, end = (0, ACROSS) if i < ACROSS else (ACROSS, MODES)
        polar += m * q[i] * dot_rows(PRODUCT[i], begin, end, q)
        swelling += m * q[i] * dot_rows(PRODUCT[i], begin, end, rates)
    mass[1, 1], mass[2, 2], mass[3, 3] = m, m, polar
    mass[1, 3] = mass[3, 1] = along * vx - across * ux
    mass[2, 3] = mass[3, 2] = along * vy - across * uy
    back = 2.0 * spin * across_rate + spin * spin * along
    side = spin * spin * across - 2.0 * spin * along_rate
    force[1] += back * ux + side * vx
    force[2] += back * uy + side * vy - m * p.gravity
    force[3] += -2.0 * spin * swelling - p.gravity * (along * vy - across * uy)
    if p.elastic:
        add_modes(axes, spin, q, rates, p, mass, force)


@jit
def add_modes(axes, spin, q, rates, p, mass, force):
    """Add the rod's modes to `add_rod`: their inertia, their coupling and the material's forces."""
    ux, uy, vx, vy = axes
    m = p.rod_mass
    for i in range(MODES):
        if i < ACROSS:
            x, y, begin, end, others, last = vx, vy, 0, ACROSS, ACROSS, MODES
            arm = p.rod_length * MOMENT[i] + dot_rows(PRODUCT[i], others, last, q)
            turning = spin * dot_rows(PRODUCT[i], begin, end, q)
            turning -= 2.0 * dot_rows(PRODUCT[i], others, last, rates)
        else:
            x, y, begin, end, others, last = ux, uy, ACROSS, MODES, 0, ACROSS
            arm = -dot_rows(PRODUCT[i], others, last, q)
            turning = spin * (p.rod_length * MOMENT[i] + dot_rows(PRODUCT[i], begin, end, q))
            turning += 2.0 * dot_rows(PRODUCT[i], others, last, rates)
        row = 4 + i
        mass[1, row] = mass[row, 1] = m * FIRST[i] * x
        mass[2, row] = mass[row, 2] = m * FIRST[i] * y
        mass[3, row] = mass[row, 3] = m * arm
        for j in range(begin, end):
            mass[row, 4 + j] = m * PRODUCT[i, j]
        force[row] += m * (spin * turning - p.gravity * FIRST[i] * y)
        force[row] -= material(i, q, p) + p.rod_damping * material(i, rates, p)


@jit
def material(i, q, p):
    """Return the elastic force (N) against mode i of the deflections q, (4,) m."""
    if i < ACROSS:
        return p.bending_stiffness * BENDING[i] * q[i]
    return p.axial_stiffness * (AXIAL[i - 2, 0] * q[2] + AXIAL[i - 2, 1] * q[3])


@jit
def material_work(q, other, p):
    """Return the sum of the elastic forces of deflections q times others, both (4,).

    Of q and q it is twice the energy (J).
    """
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


@jit
def guide_coefficient(slip, p):
    """Return the friction coefficient of the guide at a slip (m/s): mu tanh(v / v_s)."""
    return p.guide_friction * math.tanh(slip / p.guide_stiction) if p.guide_friction else 0.0


@jit
def corner_force(penetration, rate, p):
    """Return the normal force (N) of a corner and its elastic part.

    penetration in m, rate in m/s.
    """
    if penetration <= 0.0:
        return 0.0, 0.0
    elastic = p.guide_stiffness * power(penetration, p.guide_exponent)
    damping = p.guide_damping * rise(penetration * p.per_guide_full_damping)
    return max(0.0, damping * rate + elastic), elastic


@jit
def corner_depth(height, tilt, end, side, p):
    """Return the penetration (m) of a corner: end and side, -1 or 1, along and across the guide."""
    half = math.sin(0.5 * tilt)
    depth = side * (height + end * p.guide_length * math.sin(tilt))
    return depth - (p.guide_clearance + p.guide_height * 2.0 * half * half)


@jit
def corners(height, tilt, rates, p):
    """Return what the guide does to a crosshead with play, as `Guided`.

    height: of its pin (m); tilt: rad; rates: of x, height and tilt.
    """
    v, rise, spin = rates
    fx, fy, moment, stored, damped, rubbed = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    deepest = -math.inf
    sine, half = math.sin(tilt), math.sin(0.5 * tilt)
    drop = 2.0 * half * half  # 1 - cos(tilt)
    for end in (-1.0, 1.0):
        for side in (-1.0, 1.0):
            x = end * p.guide_length * (1.0 - drop) - side * p.guide_height * sine
            y = end * p.guide_length * sine + side * p.guide_height * (1.0 - drop)
            penetration = corner_depth(height, tilt, end, side, p)
            deepest = max(deepest, penetration)
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
    return Guided(fx, fy, moment, stored, damped, rubbed, deepest)


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


@jit
def speed_of(y, p):
    """Return the crank's speed (rad/s)."""
    return p.omega * (1.0 + y[p.at[0]]) if p.driven else p.omega


@jit
def unpack(y, p, w, rates):
    """Write the coordinates and their rates into w and rates, (11,); 0 of what is left out.

    The crank has its slip in place of a coordinate.
    """
    n = p.freedoms
    w[0] = y[p.at[0]] if p.driven else 0.0
    for i in range(1, COORDINATES):
        place = p.at[i]
        w[i], rates[i] = (y[place], y[n + place]) if place >= 0 else (0.0, 0.0)
    rates[0] = speed_of(y, p)


@jit
def pose_of(motion, w, rates, p):
    """Return the `Pose` at a crank angle, whose ideal `Motion` is given."""
    c, s = motion.cos_theta, motion.sin_theta
    length = p.rod_length + w[STRETCH]
    fall = p.crank_radius * s - w[2] + w[4] - w[5]  # from the big end's bore to the small end's
    sin_phi = fall / length
    cos_phi = square_root((1.0 - sin_phi) * (1.0 + sin_phi))
    x = p.crank_radius * c - w[1] + w[3] + length * cos_phi
    falling = p.crank_radius * c * rates[0] - rates[2] + rates[4] - rates[5]
    phi_rate = (falling - sin_phi * rates[STRETCH]) / (length * cos_phi)
    return Pose(c, s, sin_phi, cos_phi, length, x, w[5], w[6], rates[0], w[0], -phi_rate)


@jit
def apply_jacobian(pose, rates, p, velocity):
    """Write the bodies' velocities that follow from the coordinates' rates, (11,) both.

    They are linear in the rates.
    """
    crank, reach = p.crank_radius * rates[0], pose.length * pose.cos_phi
    velocity[0] = rates[0]
    velocity[1] = -pose.sin_theta * crank - rates[1]
    velocity[2] = pose.cos_theta * crank - rates[2]
    falling = velocity[2] + rates[4] - rates[5]
    velocity[3] = (pose.sin_phi * rates[STRETCH] - falling) / reach
    for i in range(MODES):
        velocity[4 + i] = rates[FIRST_MODE + i]
    along = velocity[1] + rates[3] + pose.cos_phi * rates[STRETCH]
    velocity[8] = along + pose.length * pose.sin_phi * velocity[3]
    velocity[9], velocity[10] = rates[5], rates[6]


@jit
def apply_jacobian_transpose(pose, force, p, pushed):
    """Write the forces on the coordinates that follow from those on the bodies, (11,) both."""
    along, reach = force[1] + force[8], pose.length * pose.cos_phi
    turning = (force[3] + pose.length * pose.sin_phi * force[8]) / reach
    across = force[2] - turning
    pushed[0] = force[0] + p.crank_radius * (pose.cos_theta * across - pose.sin_theta * along)
    pushed[1], pushed[2], pushed[3] = -along, -across, force[8]
    pushed[4], pushed[5], pushed[6] = -turning, force[9] + turning, force[10]
    for i in range(MODES):
        pushed[FIRST_MODE + i] = force[4 + i]
    pushed[STRETCH] += pose.sin_phi * turning + pose.cos_phi * force[8]


@jit
def fill_bias(pose, rates, p, bias):
    """Write the bodies' accelerations, (11,), where the coordinates' own are zero."""
    inward = p.crank_radius * pose.speed * pose.speed
    twice = 2.0 * rates[STRETCH] * pose.spin  # of Coriolis, across the rod
    bias[1], bias[2] = -inward * pose.cos_theta, -inward * pose.sin_theta
    lowering = bias[2] + pose.length * pose.sin_phi * pose.spin * pose.spin
    bias[3] = -(lowering + twice * pose.cos_phi) / (pose.length * pose.cos_phi)
    centripetal = pose.length * pose.cos_phi * pose.spin * pose.spin
    bias[8] = bias[1] + twice * pose.sin_phi - centripetal
    bias[8] += pose.length * pose.sin_phi * bias[3]


@jit
def joints_of(phase, y, motion, pose, w, velocity, p):
    """Return the `Joints` at a state; w: coordinates, (11,); velocity: of the bodies, (11,)."""
    n, modes = p.freedoms, velocity[4:8]
    big_spin = pose.spin + dot_rows(BIG_SLOPE, 0, MODES, modes) / p.rod_length
    small_spin = pose.spin + dot_rows(SMALL_SLOPE, 0, MODES, modes) / p.rod_length
    pin_spin = velocity[10]
    big, small = NO_CONTACT, NO_CONTACT
    if p.clearance[0] > 0.0:
        place = p.at[1]
        eccentricity = y[place], y[place + 1], y[n + place], y[n + place + 1]
        big = oiled_joint(BIG_END, eccentricity, (pose.speed, big_spin), y, p)
    if p.clearance[1] > 0.0:
        place = p.at[3]
        eccentricity = y[place], y[place + 1], y[n + place], y[n + place + 1]
        small = oiled_joint(SMALL_END, eccentricity, (pin_spin, small_spin), y, p)
    guide = UNGUIDED
    if p.tilting:
        rates = velocity[8], velocity[9], velocity[10]
        guide = corners(pose.height, pose.tilt, rates, p)
    ideal_v = motion.v * pose.speed / p.omega
    load = piston_force(phase, pose.x, velocity[8], pose.x - motion.x, velocity[8] - ideal_v, p)
    load += measured_force(motion.cos_theta, motion.sin_theta, p)
    return Joints(
        big, small, guide, load, big_spin, small_spin, pin_spin
    )  # fmt: skip


@jit
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


@jit
def add_on_rod(pose, big, small, p, force):
    """Add a force (N) and a moment (N m) on the rod at either end: each (x, y, moment)."""
    force[1] += big[0] + small[0]
    force[2] += big[1] + small[1]
    lever = pose.sin_phi * small[0] + pose.cos_phi * small[1]
    force[3] += big[2] + small[2] + pose.length * lever
    for i in range(MODES):
        force[4 + i] += (BIG_SLOPE[i] * big[2] + SMALL_SLOPE[i] * small[2]) / p.rod_length
    force[7] += pose.cos_phi * small[0] - pose.sin_phi * small[1]  # the stretch moves the small end


@jit
def motor_torque(pose, p):
    """Return the torque (N m) of the motor at the crank's speed: a line."""
    # by the slip: of a steep line the difference of two speeds would leave no digits
    return p.torque - p.torque_slope * p.omega * pose.slip


@jit
def add_bodies(p, mass):
    """Write the mass matrix of crank and crosshead."""
    mass[0, 0] = p.crank_inertia
    mass[8, 8], mass[9, 9] = p.reciprocating_mass, p.reciprocating_mass
    mass[10, 10] = p.crosshead_inertia
