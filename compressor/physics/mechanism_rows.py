"""Rates, powers, energies and columns of the general mechanism.

`motion` and `observe` have the same calls for scenes; `systems` chooses between them.
"""

import math

from compressor.physics._jit import inline_llvm, inner
from compressor.physics.contact import write_carried_rates
from compressor.physics.kinematics import ideal
from compressor.physics.mechanism import (
    ACROSS,
    COORDINATES,
    FIRST,
    MODES,
    ROWS,
    apply_mass,
    dot_rows,
    material_work,
    motor_torque,
    pose_of,
    unpack,
)
from compressor.physics.observe import (
    ACCELERATION,
    CRANK_SPEED,
    CRANK_TORQUE,
    DEVIATION,
    DISPLACEMENT,
    ECCENTRICITY,
    GUIDE_GAP,
    GUIDE_MOMENT,
    JOURNAL_ACCELERATION,
    KINETIC,
    MOTOR_TORQUE,
    PISTON_FORCE,
    POTENTIAL,
    ROD_ANGLE,
    VELOCITY,
    contact_power,
    write_contacts,
    write_frame_forces,
)

STALLED = 0.01  # of the steady speed: a crank that is slower has all but stopped
IMPLAUSIBLE = 0.1  # of half the crosshead, or of the rod: more than any contact or bar bears


@inline_llvm
def pace_of(now, p):
    """Return the time that passes over the time in which a steady crank would turn as far."""
    return 1.0 / (1.0 + now.pose.slip)


@inline_llvm
def write_rates(now, y, p, out):
    """Write dy/dt, of a steady crank's t, into out."""
    n, pace = p.freedoms, pace_of(now, p)
    for i in range(n):
        coordinate = p.coordinates[p.driven + i]
        out[i], out[n + i] = p.rates[coordinate] * pace, p.accelerations[coordinate] * pace
    if p.carries:
        write_carried_rates(now.big, now.small, pace, y, p, out)
    if p.driven:
        out[p.at[0] - 1] = pace - 1.0
        out[p.at[0]] = p.accelerations[0] / p.omega * pace
    if p.elastic:
        out[p.rod_loss] = rod_damping_power(now, p) * pace


@inline_llvm
def rod_damping_power(now, p):
    """Return the power (W) that the rod's material takes."""
    modes = p.rates[7:11]
    return p.rod_damping * material_work(modes, modes, p)


@inline_llvm
def crank_torque(now, p):
    """Return the torque (N m) that drives the crank against the rod."""
    pose, forces, big = now.pose, now.reactions, now.big
    torque = p.crank_radius * (pose.cos_theta * forces.big_y - pose.sin_theta * forces.big_x)
    torque += forces.big_torque
    return torque - (p.pin_radius[0] - big.penetration) * big.friction - big.film_moment


@inline_llvm
def guide_moment(now, p):
    """Return the moment (N m) of the crosshead on its guide, counter-clockwise about the crank.

    An ideal guide lets no crosshead tilt: it bears the couple on the pin as well.
    """
    pose, guide, forces = now.pose, now.joints.guide, now.reactions
    moment = guide.moment - pose.height * (guide.fx + forces.rubbing)
    moment = -(pose.x * forces.guide + moment)
    if not p.tilting:
        small = now.small
        moment += (p.pin_radius[1] - small.penetration) * small.friction
        moment += small.film_moment - forces.small_torque
    return moment


@inline_llvm
def write_powers(now, y, p, row):
    """Write four powers (W) into row, (4,): of crank and load, into contacts, lost to friction."""
    big, small, guide, pose = now.big, now.small, now.joints.guide, now.pose
    forces = now.reactions
    torque = crank_torque(now, p) + p.unbalance * p.gravity * pose.cos_theta
    row[0] = (motor_torque(pose, p) if p.driven else torque) * pose.speed
    row[1] = -now.joints.load * p.velocity[8]
    pressed = contact_power(big) + contact_power(small) + guide.damped
    pressed += big.film_loss + small.film_loss
    row[2] = pressed + rod_damping_power(now, p)
    friction = guide.rubbed - big.friction * big.slip - small.friction * small.slip
    friction += forces.big_torque * (pose.speed - now.joints.big_spin)
    friction += forces.small_torque * (now.joints.pin_spin - now.joints.small_spin)
    row[3] = friction - forces.rubbing * p.velocity[8]


@inline_llvm
def write_energies(now, y, p, row):
    """Write kinetic and potential energy (J) into the row, without the journals' contacts."""
    pose, joints, modes = now.pose, now.joints, p.w[7:11]
    apply_mass(p.velocity, p, p.momentum)
    row[KINETIC] = 0.5 * dot_rows(p.momentum, 0, ROWS, p.velocity)
    stored = joints.guide.stored + 0.5 * material_work(modes, modes, p)
    along = p.rod_centre + dot_rows(FIRST, ACROSS, MODES, modes)
    height = p.crank_radius * pose.sin_theta - p.w[2] - along * pose.sin_phi
    height += dot_rows(FIRST, 0, ACROSS, modes) * pose.cos_phi
    weight = p.rod_mass * height + p.reciprocating_mass * pose.height
    row[POTENTIAL] = stored + p.gravity * (weight + p.unbalance * pose.sin_theta)


@inline_llvm
def write_contact_columns(now, y, p, row):
    """Write the columns from ACCELERATION to GUIDE_MOMENT."""
    found = now.reactions
    forces = found.big_x, found.big_y, found.small_x, found.small_y
    write_contacts(forces, now.big, now.small, p, row)
    row[ACCELERATION] = p.body[8]
    row[JOURNAL_ACCELERATION] = p.accelerations[1]
    row[JOURNAL_ACCELERATION + 1] = p.accelerations[3]
    ideal = now.motion.a
    if p.driven:  # of an ideal machine's crosshead with this crank's motion
        speed = 1.0 + now.pose.slip
        ideal = ideal * speed * speed + now.motion.v / p.omega * p.accelerations[0]
    row[DEVIATION] = p.body[8] - ideal
    row[CRANK_TORQUE], row[GUIDE_MOMENT] = crank_torque(now, p), guide_moment(now, p)


@inner
def deviation(t, y, p):
    """Return how far (m) the crosshead is from its ideal place at the crank's angle."""
    motion = ideal(t, p)
    unpack(y, p)
    return pose_of(motion, p).x - motion.x


@inner
def write_place(now, y, p, row):
    """Write the columns before ACCELERATION."""
    row[DISPLACEMENT], row[VELOCITY] = now.pose.x, p.velocity[8]
    row[ROD_ANGLE] = math.atan2(now.pose.sin_phi, now.pose.cos_phi)
    row[PISTON_FORCE] = now.joints.load
    for i in range(4):
        row[ECCENTRICITY + i] = p.w[1 + i]


@inner
def write_frame(now, p, row):
    """Write the columns behind PACE into a row that has the others."""
    pose, guide, forces = now.pose, now.joints.guide, now.reactions
    row[GUIDE_GAP], row[CRANK_SPEED] = -guide.deepest, pose.speed
    row[MOTOR_TORQUE] = motor_torque(pose, p)
    inward, along = pose.speed * pose.speed, p.accelerations[0]
    c, s = pose.cos_theta, pose.sin_theta
    turning = -p.unbalance * (inward * c + along * s), -p.unbalance * (inward * s - along * c)
    write_frame_forces((-(guide.fx + forces.rubbing), -forces.guide), turning, row)


@inner
def beyond_model(y, p):
    """Return the number of what no machine can do in a state, or 0.

    1: a crank that has all but stopped, 2: a corner deep in its guide, 3: a rod out of shape.
    """
    if p.driven and y[p.at[0]] <= STALLED - 1.0:
        return 1
    if p.tilting:
        height, tilt = y[p.at[5]], y[p.at[6]]
        room = p.guide_clearance + p.guide_height * (1.0 - math.cos(tilt))
        deepest = abs(height) + p.guide_length * abs(math.sin(tilt)) - room
        if deepest > IMPLAUSIBLE * min(p.guide_length, p.guide_height):
            return 2
    if p.elastic:
        for i in range(7, COORDINATES):
            if abs(y[p.at[i]]) > IMPLAUSIBLE * p.rod_length:
                return 3
    return 0
