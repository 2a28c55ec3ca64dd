"""Outputs recomputed from (t, y): what is stored, drawn, measured and audited.

The right-hand side records nothing. `observe` writes one row of quantities; the energy flows
(work of crank and load, losses to damping and friction) are integrated beside the motion.
"""

import math
from enum import IntEnum

from compressor.physics._jit import jit
from compressor.physics.contact import power
from compressor.physics.motion import (
    eccentricities_both,
    eccentricity_big_end,
    eccentricity_small_end,
    evaluate,
    write_derivative,
)
from compressor.physics.parameters import Scene

IDEAL = int(Scene.IDEAL)
BIG_END = int(Scene.BIG_END)
SMALL_END = int(Scene.SMALL_END)
BOTH = int(Scene.BOTH)


class Column(IntEnum):
    """Columns of an observed row (SI); pairs are big end, small end; forces act on the rod."""

    DISPLACEMENT = 0
    VELOCITY = 1
    ACCELERATION = 2
    ROD_ANGLE = 3
    PISTON_FORCE = 4
    FORCE = 5  # four: (joint, axis)
    ECCENTRICITY = 9  # four: (joint, axis)
    PENETRATION = 13  # two
    NORMAL = 15  # two
    FORCE_SIZE = 17  # two
    DEVIATION = 19  # of the acceleration from the ideal motion
    CRANK_POWER = 20  # put into the mechanism by the crank
    LOAD_POWER = 21  # put into the mechanism by the piston force
    DAMPING_POWER = 22  # lost in the contacts' normal direction
    FRICTION_POWER = 23  # lost to friction
    KINETIC = 24
    POTENTIAL = 25  # contacts' springs and gravity


COLUMNS = 26
# numba wants plain integers
DISPLACEMENT, VELOCITY, ACCELERATION = 0, 1, 2
ROD_ANGLE, PISTON_FORCE = int(Column.ROD_ANGLE), int(Column.PISTON_FORCE)
FORCE, ECCENTRICITY = int(Column.FORCE), int(Column.ECCENTRICITY)
PENETRATION, NORMAL = int(Column.PENETRATION), int(Column.NORMAL)
FORCE_SIZE, DEVIATION = int(Column.FORCE_SIZE), int(Column.DEVIATION)
CRANK_POWER, LOAD_POWER = int(Column.CRANK_POWER), int(Column.LOAD_POWER)
DAMPING_POWER, FRICTION_POWER = int(Column.DAMPING_POWER), int(Column.FRICTION_POWER)
KINETIC, POTENTIAL = int(Column.KINETIC), int(Column.POTENTIAL)


@jit
def eccentricity_row(y, turn, p, row):
    """Write both eccentricities (m) into the row; an ideal joint has none."""
    for i in range(4):
        row[ECCENTRICITY + i] = 0.0
    if p.scene == BIG_END:
        row[ECCENTRICITY], row[ECCENTRICITY + 1], _, _ = eccentricity_big_end(y, turn, p)
    elif p.scene == SMALL_END:
        row[ECCENTRICITY + 2], row[ECCENTRICITY + 3], _, _ = eccentricity_small_end(y, turn, p)
    elif p.scene == BOTH:
        big, small = eccentricities_both(y, turn, p)
        row[ECCENTRICITY], row[ECCENTRICITY + 1] = big[0], big[1]
        row[ECCENTRICITY + 2], row[ECCENTRICITY + 3] = small[0], small[1]


@jit
def centre_motion(now, y, p):
    """Rod centre's velocity, acceleration (x, y each) and height (m): vx, vy, ax, ay, height."""
    motion = now.motion
    sin_phi = motion.sin_phi + now.turn.ds
    cos_phi = motion.cos_phi + now.turn.dc
    rate = motion.rate + y[y.size - 1]
    crank = p.crank_radius * p.omega
    if p.scene == BIG_END:
        b = p.rod_length - p.rod_centre
        vx = motion.v + y[2] + b * sin_phi * rate
        vy = b * cos_phi * rate
        ax = now.a + b * (cos_phi * rate * rate + sin_phi * now.spin_up)
        ay = b * (cos_phi * now.spin_up - sin_phi * rate * rate)
        return vx, vy, ax, ay, b * sin_phi
    c = p.rod_centre
    height = p.crank_radius * motion.sin_theta - c * motion.sin_phi
    if p.scene == BOTH:
        vx = -crank * motion.sin_theta - c * motion.sin_phi * motion.rate + y[5]
        vy = crank * motion.cos_theta - c * motion.cos_phi * motion.rate + y[6]
        return vx, vy, now.centre_x, now.centre_y, height + y[2]
    vx = -crank * motion.sin_theta - c * sin_phi * rate
    vy = crank * motion.cos_theta - c * cos_phi * rate
    ax = -crank * p.omega * motion.cos_theta - c * (cos_phi * rate * rate + sin_phi * now.spin_up)
    ay = -crank * p.omega * motion.sin_theta + c * (sin_phi * rate * rate - cos_phi * now.spin_up)
    return vx, vy, ax, ay, height - c * now.turn.ds


@jit
def joint_forces(now, centre, p):
    """Forces on the rod at both joints: the contact's, or by inverse dynamics at an ideal joint.

    Newton-Euler of the rod with the crosshead's x balance; returns (big x, big y, small x, small
    y) in N.
    """
    big, small = now.big, now.small
    across = p.rod_mass * centre[2]
    up = p.rod_mass * (centre[3] + p.gravity)
    if p.scene == BOTH:
        return big.fx, big.fy, small.fx, small.fy
    if p.scene == SMALL_END:
        return across - small.fx, up - small.fy, small.fx, small.fy
    small_x = -now.load - p.reciprocating_mass * now.a
    if p.scene == BIG_END:
        return big.fx, big.fy, small_x, up - big.fy
    big_x = across - small_x
    sin_phi, cos_phi = now.motion.sin_phi, now.motion.cos_phi
    c = p.rod_centre
    b = p.rod_length - c
    small_y = -p.rod_inertia * now.spin_up + c * (cos_phi * up + sin_phi * big_x)
    small_y = (small_y - b * sin_phi * small_x) / (p.rod_length * cos_phi)
    return big_x, up - small_y, small_x, small_y


@jit
def elastic_energy(contact, stiffness, p):
    """Energy (J) in a contact's spring, K delta^(p+1) / (p+1)."""
    if contact.penetration <= 0.0:
        return 0.0
    return (
        stiffness
        * power(contact.penetration, p.exponent)
        * contact.penetration
        / (p.exponent + 1.0)
    )


@jit
def damping_power(contact, stiffness, p):
    """Power (W) a contact loses in its normal direction, the clamp's included; never negative."""
    if contact.penetration <= 0.0:
        return 0.0
    return (contact.normal - stiffness * power(contact.penetration, p.exponent)) * contact.rate


@jit
def write_powers(now, y, forces, p, out):
    """Write the four powers (W) into out[0:4]: of crank and load, lost to damping and friction."""
    motion, big, small = now.motion, now.big, now.small
    crank = p.crank_radius * p.omega
    out[0] = crank * (motion.cos_theta * forces[1] - motion.sin_theta * forces[0])
    if p.clearance[0] > 0.0:
        out[0] -= p.omega * (p.pin_radius - big.penetration) * big.friction
    out[1] = -now.load * (motion.v + y[y.size // 2])
    out[2] = damping_power(big, p.stiffness[0], p) + damping_power(small, p.stiffness[1], p)
    out[3] = -big.friction * big.slip - small.friction * small.slip


@jit
def write_energies(now, y, centre, p, row):
    """Write kinetic and potential energy (J) into the row."""
    v = now.motion.v + y[y.size // 2]
    rate = now.motion.rate + y[y.size - 1]
    kinetic = p.reciprocating_mass * v * v + p.rod_inertia * rate * rate
    kinetic += p.rod_mass * (centre[0] * centre[0] + centre[1] * centre[1])
    row[KINETIC] = 0.5 * kinetic
    potential = elastic_energy(now.big, p.stiffness[0], p)
    potential += elastic_energy(now.small, p.stiffness[1], p)
    row[POTENTIAL] = potential + p.rod_mass * p.gravity * centre[4]


@jit
def observe(t, y, phase, p, row):
    """Write all quantities of `Column` at time t (s) and state y into row, shape (COLUMNS,).

    In the ideal scene y is four zeros.
    """
    now = evaluate(t, y, phase, p)
    motion, turn = now.motion, now.turn
    centre = centre_motion(now, y, p)
    forces = joint_forces(now, centre, p)
    row[DISPLACEMENT] = motion.x + y[0]
    row[VELOCITY] = motion.v + y[y.size // 2]
    row[ACCELERATION] = now.a
    row[ROD_ANGLE] = math.atan2(motion.sin_phi + turn.ds, motion.cos_phi + turn.dc)
    row[PISTON_FORCE] = now.load
    for i in range(4):
        row[FORCE + i] = forces[i]
    eccentricity_row(y, turn, p, row)
    row[PENETRATION], row[PENETRATION + 1] = now.big.penetration, now.small.penetration
    row[NORMAL], row[NORMAL + 1] = now.big.normal, now.small.normal
    row[FORCE_SIZE] = math.sqrt(forces[0] * forces[0] + forces[1] * forces[1])
    row[FORCE_SIZE + 1] = math.sqrt(forces[2] * forces[2] + forces[3] * forces[3])
    row[DEVIATION] = now.a - motion.a
    write_powers(now, y, forces, p, row[CRANK_POWER:KINETIC])
    write_energies(now, y, centre, p, row)


@jit
def observe_all(times, states, phases, p, rows):
    """`observe` at each of m times: states (m, k), phases (m,) integers, rows (m, COLUMNS)."""
    for i in range(times.size):
        observe(times[i], states[i], phases[i], p, rows[i])


@jit
def derivative_with_flows(t, z, phase, p, out):
    """dz/dt of the motion and of its four energy flows, z = (y, flows)."""
    n = z.size - 4
    y = z[:n]
    now = evaluate(t, y, phase, p)
    centre = centre_motion(now, y, p)
    write_derivative(now, y, p, out[:n])
    write_powers(now, y, joint_forces(now, centre, p), p, out[n:])
