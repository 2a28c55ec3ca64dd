"""The columns of an observed row, and what a scene writes into them.

`systems` calls these, or what `mechanism_rows` has of the same names.
"""

import math
from enum import IntEnum

from compressor.physics._jit import inline_llvm, inline_once, inner, jit, square_root
from compressor.physics.contact import nearness


class Column(IntEnum):
    """Columns of an observed row (SI); pairs are big end, small end; forces act on the rod."""

    DISPLACEMENT = 0
    VELOCITY = 1
    ROD_ANGLE = 2
    PISTON_FORCE = 3
    ECCENTRICITY = 4  # four: (joint, axis)
    ACCELERATION = 8  # from here on: what `systems.write_row` writes
    FORCE = 9  # four: (joint, axis)
    FORCE_SIZE = 13  # two
    JOURNAL_ACCELERATION = 15  # two: along x, of a journal against its bore; 0 of an ideal joint
    DEVIATION = 17  # of the acceleration from the ideal motion
    PENETRATION = 18  # two
    NORMAL = 20  # two
    NEARNESS = 22  # two: of contact
    CRANK_TORQUE = 24  # that drives the crank against the rod, along its rotation
    GUIDE_MOMENT = 25  # of the crosshead on its guide, about the crank's centre
    CRANK_POWER = 26  # put into the mechanism by the crank, or by the motor that drives it
    LOAD_POWER = 27  # put into the mechanism by the piston force
    CONTACT_POWER = 28  # into the contacts' normal direction and an elastic rod's material
    FRICTION_POWER = 29  # lost to friction
    KINETIC = 30
    POTENTIAL = 31  # of gravity, a guide's contacts and an elastic rod
    PACE = 32  # time that passes over that of a steady crank
    SHAKING_FORCE = 33  # two: of the machine on its frame; from here on: not in a march
    BEARING_FORCE = 35  # two: on the main bearing
    GUIDE_FORCE = 37  # of the crosshead on its guide, upwards
    GUIDE_GAP = 38  # least one of its corners, negative where one presses; from here on: features
    CRANK_SPEED = 39  # rad/s
    MOTOR_TORQUE = 40


COLUMNS = int(Column.PACE) + 1  # that a march reads
WIDE = int(Column.MOTOR_TORQUE) + 1  # that series are made of
# numba wants plain integers
(
    DISPLACEMENT, VELOCITY, ROD_ANGLE, PISTON_FORCE, ECCENTRICITY, ACCELERATION, FORCE, FORCE_SIZE,
    JOURNAL_ACCELERATION, DEVIATION, PENETRATION, NORMAL, NEARNESS, CRANK_TORQUE, GUIDE_MOMENT,
    CRANK_POWER, LOAD_POWER, CONTACT_POWER, FRICTION_POWER, KINETIC, POTENTIAL, PACE,
    SHAKING_FORCE, BEARING_FORCE, GUIDE_FORCE, GUIDE_GAP, CRANK_SPEED, MOTOR_TORQUE,
) = map(int, Column)  # fmt: skip


@inline_llvm
def contact_power(contact):
    """Return the power (W) that a contact takes in its normal direction: its spring's and its loss.

    While the force is held at 0 the spring gives its energy up to the loss, without any effect.
    """
    return contact.normal * contact.rate


@inline_once
def torque_and_moment(crank, x, forces, friction, penetration, film, p):
    """Return the torque (N m) that drives the crank, and the moment of the crosshead on its guide.

    The guide bears the crosshead's force at its lever and the couple of the small end's friction.
    """
    torque = p.crank_radius * (crank[0] * forces[1] - crank[1] * forces[0])
    if p.clearance[0] > 0.0:
        torque -= (p.pin_radius[0] - penetration[0]) * friction[0] + film[0]
    moment = -x * (forces[3] + p.reciprocating_mass * p.gravity)
    if p.clearance[1] > 0.0:
        moment += (p.pin_radius[1] - penetration[1]) * friction[1] + film[1]
    return torque, moment


@inner
def write_frame_forces(on_guide, turning, row):
    """Write the machine's forces (N) on its frame.

    on_guide: of the crosshead, x and y; turning: of the unbalance on the crank, x and y.
    """
    row[BEARING_FORCE] = -row[FORCE] - turning[0]
    row[BEARING_FORCE + 1] = -row[FORCE + 1] - turning[1]
    row[GUIDE_FORCE] = on_guide[1]
    row[SHAKING_FORCE] = row[BEARING_FORCE] + (row[PISTON_FORCE] + on_guide[0])
    row[SHAKING_FORCE + 1] = row[BEARING_FORCE + 1] + on_guide[1]


@inner
def write_scene_frame(cos_theta, sin_theta, p, row):
    """Write `write_frame_forces` of a scene: a crosshead at its height, a steady crank."""
    on_guide = 0.0, -row[FORCE + 3] - p.reciprocating_mass * p.gravity
    inward = p.unbalance * p.omega * p.omega
    # 0 less a zero has no sign, so that a balanced crank leaves the bits of the forces
    write_frame_forces(on_guide, (0.0 - inward * cos_theta, 0.0 - inward * sin_theta), row)


@jit
def frame_of_series(crank, friction, p, rows):
    """Write a dry scene's torque, moment and forces on its frame into rows, (m, WIDE)."""
    for i in range(len(rows)):
        row = rows[i]
        forces, penetration = row[FORCE:FORCE_SIZE], row[PENETRATION:NORMAL]
        row[CRANK_TORQUE], row[GUIDE_MOMENT] = torque_and_moment(
            crank[:, i], row[DISPLACEMENT], forces, friction[i], penetration, (0.0, 0.0), p
        )
        write_scene_frame(crank[0, i], crank[1, i], p, row)


@inline_llvm
def write_powers(now, y, p, out):
    """Write four powers (W) into out, (4,): of crank and load, into contacts, lost to friction."""
    motion, big, small, forces = now.motion, now.big, now.small, now.forces
    crank = p.crank_radius * p.omega
    turning = crank * (motion.cos_theta * forces[1] - motion.sin_theta * forces[0])
    if p.clearance[0] > 0.0:
        turning -= p.omega * ((p.pin_radius[0] - big.penetration) * big.friction + big.film_moment)
    out[0], out[1] = turning, -now.load * now.at.v
    out[2] = contact_power(big) + contact_power(small) + big.film_loss + small.film_loss
    out[3] = -big.friction * big.slip - small.friction * small.slip


@inline_llvm
def write_energies(now, y, p, row):
    """Write the kinetic and potential energy (J), the latter without the contacts' springs."""
    at, b = now.at, p.rod_length - p.rod_centre
    kinetic = p.reciprocating_mass * at.v * at.v + p.rod_inertia * at.rate * at.rate
    # the centre, from the small end's bore
    vx = at.v - at.small[2] + b * at.sin_phi * at.rate
    vy = b * at.cos_phi * at.rate - at.small[3]
    height = b * at.sin_phi - at.small[1]
    kinetic += p.rod_mass * (vx * vx + vy * vy)
    row[KINETIC], row[POTENTIAL] = 0.5 * kinetic, p.rod_mass * p.gravity * height


@inline_llvm
def write_contacts(forces, big, small, p, row):
    """Write the forces on the rod and what is seen of its contacts; forces: big end first, x, y."""
    for i in range(4):
        row[FORCE + i] = forces[i]
    row[FORCE_SIZE] = square_root(forces[0] * forces[0] + forces[1] * forces[1])
    row[FORCE_SIZE + 1] = square_root(forces[2] * forces[2] + forces[3] * forces[3])
    row[PENETRATION], row[PENETRATION + 1] = big.penetration, small.penetration
    row[NORMAL], row[NORMAL + 1] = big.normal, small.normal
    row[NEARNESS] = nearness(big, p.stiffness[0], p.clearance[0], p)
    row[NEARNESS + 1] = nearness(small, p.stiffness[1], p.clearance[1], p)


@inline_llvm
def write_contact_columns(now, y, p, row):
    """Write the columns from ACCELERATION to GUIDE_MOMENT into the row."""
    big, small, motion = now.big, now.small, now.motion
    write_contacts(now.forces, big, small, p, row)
    row[ACCELERATION], row[DEVIATION] = now.a, now.a - motion.a
    row[JOURNAL_ACCELERATION] = now.big_away[0] if p.clearance[0] > 0.0 else 0.0
    row[JOURNAL_ACCELERATION + 1] = now.small_away[0] if p.clearance[1] > 0.0 else 0.0
    row[CRANK_TORQUE], row[GUIDE_MOMENT] = torque_and_moment(
        (motion.cos_theta, motion.sin_theta), now.at.x, now.forces,
        (big.friction, small.friction), (big.penetration, small.penetration),
        (big.film_moment, small.film_moment), p,
    )  # fmt: skip


@inline_llvm
def write_place(now, y, p, row):
    """Write the columns before ACCELERATION."""
    at = now.at
    row[DISPLACEMENT], row[VELOCITY] = at.x, at.v
    row[ROD_ANGLE] = math.atan2(at.sin_phi, at.cos_phi)
    row[PISTON_FORCE] = now.load
    row[ECCENTRICITY], row[ECCENTRICITY + 1] = at.big[0], at.big[1]
    row[ECCENTRICITY + 2], row[ECCENTRICITY + 3] = at.small[0], at.small[1]


@inner
def write_frame(now, p, row):
    """Write the columns behind PACE into a row that has the others."""
    write_scene_frame(now.motion.cos_theta, now.motion.sin_theta, p, row)
