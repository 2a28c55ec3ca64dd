"""Equations of motion of the four scenes, in deviations from the ideal motion.

physics/README.md, Scenes and Contact.

State y: the deviations, then their rates, then what contacts carry where laws were chosen. Big end
and small end: (x, phi); both joints: (x, X, Y, phi) with (X, Y) the rod's centre. Eccentricities
come from difference identities, never from subtracting two cosines, so that a clearance of a
nanometre keeps its digits.

`systems` has what integrators call and what is observed, of scenes and of the mechanism.
"""

import math
from typing import NamedTuple

from compressor.physics._jit import inline_llvm, inline_once, jit
from compressor.physics.card import measured_force
from compressor.physics.contact import (
    LUGRE,
    NO_CONTACT,
    ContactState,
    bristle_rate,
    carried_numbers,
    joint_contact,
)
from compressor.physics.contact_laws import has_chosen_laws
from compressor.physics.film import add_film
from compressor.physics.kinematics import IdealMotion, small_angle
from compressor.physics.loads import piston_force
from compressor.physics.record import BIG_END as AT_BIG_END
from compressor.physics.record import SMALL_END as AT_SMALL_END
from compressor.physics.record import Scene

BIG_END = int(Scene.BIG_END)
SMALL_END = int(Scene.SMALL_END)
BOTH = int(Scene.BOTH)


class Turn(NamedTuple):
    """cos and sin of the rod's angle less those of its ideal angle, and their rates (1/s)."""

    dc: float
    ds: float
    dc_rate: float
    ds_rate: float


@inline_llvm
def rod_turn(motion, eta, eta_rate, p):
    """Return the `Turn` of the rod by eta from the ideal angle phi, without cancellation."""
    sin_half, cos_half = small_angle(0.5 * eta, p)
    dc = -2.0 * sin_half * (motion.sin_phi * cos_half + motion.cos_phi * sin_half)
    ds = 2.0 * sin_half * (motion.cos_phi * cos_half - motion.sin_phi * sin_half)
    dc_rate = -(ds * motion.rate + (motion.sin_phi + ds) * eta_rate)
    ds_rate = dc * motion.rate + (motion.cos_phi + dc) * eta_rate
    return Turn(dc, ds, dc_rate, ds_rate)


@inline_llvm
def eccentricity_big_end(y, turn, p):
    """Return the eccentricity (m) at the big end and its rate (m/s), small end ideal.

    Journal centre less bore centre: x, y and their rates.
    """
    dc, ds, dc_rate, ds_rate = turn
    length = p.rod_length
    return length * dc - y[0], -length * ds, length * dc_rate - y[2], -length * ds_rate


@inline_llvm
def eccentricity_small_end(y, turn, p):
    """Return the eccentricity (m) at the small end and its rate (m/s), big end ideal.

    Journal centre less bore centre: x, y and their rates.
    """
    dc, ds, dc_rate, ds_rate = turn
    length = p.rod_length
    return y[0] - length * dc, length * ds, y[2] - length * dc_rate, length * ds_rate


@inline_llvm
def eccentricities_both(y, turn, p):
    """Return the eccentricities with their rates at the big end and the small end of a free rod.

    A rod that two gaps let move freely in the plane.
    """
    dc, ds, dc_rate, ds_rate = turn
    a = p.rod_centre
    b = p.rod_length - a
    big = (a * dc - y[1], -y[2] - a * ds, a * dc_rate - y[5], -y[6] - a * ds_rate)
    small = (y[0] - y[1] - b * dc, b * ds - y[2], y[4] - y[5] - b * dc_rate, b * ds_rate - y[6])
    return big, small


@inline_llvm
def load_force(phase, y, motion, p):
    """Return the piston force (N) in the state y around the ideal motion."""
    n = p.freedoms
    load = piston_force(phase, motion.x + y[0], motion.v + y[n], y[0], y[n], p)
    return load + measured_force(motion.cos_theta, motion.sin_theta, p)


@inline_llvm
def solve_big_end(y, motion, turn, load, contact, p):
    """Return accelerations (x, phi) of the rod hung on the crosshead and struck at the big end."""
    sin_phi = motion.sin_phi + turn.ds
    cos_phi = motion.cos_phi + turn.dc
    rate = motion.rate + y[3]
    b = p.rod_length - p.rod_centre
    coupling = p.rod_mass * b * sin_phi
    mass = p.reciprocating_mass + p.rod_mass
    inertia = p.rod_inertia + p.rod_mass * b * b
    push = contact.fx - load - p.rod_mass * b * cos_phi * rate * rate
    moment = p.rod_length * (sin_phi * contact.fx + cos_phi * contact.fy) - contact.moment
    moment -= p.rod_mass * p.gravity * b * cos_phi
    per_determinant = 1.0 / (mass * inertia - coupling * coupling)
    a = (inertia * push - coupling * moment) * per_determinant
    spin_up = (mass * moment - coupling * push) * per_determinant
    return a, spin_up


@inline_llvm
def solve_small_end(motion, turn, load, contact, p):
    """Return accelerations (x, phi) of the rod hung on the crankpin and struck at the small end."""
    sin_phi = motion.sin_phi + turn.ds
    cos_phi = motion.cos_phi + turn.dc
    a = (-load - contact.fx) * p.per_reciprocating_mass
    moment = -p.rod_length * (sin_phi * contact.fx + cos_phi * contact.fy) - contact.moment
    pin = p.crank_radius * p.omega * p.omega  # the crankpin's centripetal acceleration
    carried = pin * (sin_phi * motion.cos_theta + cos_phi * motion.sin_theta)
    moment += p.rod_mass * p.rod_centre * (p.gravity * cos_phi - carried)
    inertia = p.rod_inertia + p.rod_mass * p.rod_centre * p.rod_centre
    return a, moment / inertia


@inline_llvm
def solve_both(motion, turn, load, big, small, p):
    """Return the accelerations (x, X, Y, phi) of a rod between two clearance joints."""
    sin_phi = motion.sin_phi + turn.ds
    cos_phi = motion.cos_phi + turn.dc
    a = (-load - small.fx) * p.per_reciprocating_mass
    per_mass = p.per_rod_mass
    centre_x = (big.fx + small.fx) * per_mass
    centre_y = (big.fy + small.fy) * per_mass - p.gravity
    moment = p.rod_centre * (cos_phi * big.fy + sin_phi * big.fx)
    moment -= (p.rod_length - p.rod_centre) * (cos_phi * small.fy + sin_phi * small.fx)
    moment -= big.moment + small.moment
    return a, centre_x, centre_y, moment * p.per_rod_inertia


@inline_once
def contact_big_end(y, motion, turn, p):
    """Return `joint_contact` of the big end in scene big_end."""
    big = eccentricity_big_end(y, turn, p)
    spins = p.omega, -motion.rate - y[3]
    bearing = p.pin_radius[0], p.clearance[0], p.stiffness[0]
    contact = joint_contact(big, spins, bearing, carried_numbers(AT_BIG_END, y, p), p)
    return add_film(AT_BIG_END, contact, big, spins, p)


@inline_once
def contact_small_end(y, motion, turn, p):
    """Return `joint_contact` of the small end in scene small_end."""
    small = eccentricity_small_end(y, turn, p)
    spins = 0.0, -motion.rate - y[3]
    bearing = p.pin_radius[1], p.clearance[1], p.stiffness[1]
    contact = joint_contact(small, spins, bearing, carried_numbers(AT_SMALL_END, y, p), p)
    return add_film(AT_SMALL_END, contact, small, spins, p)


@inline_once
def contacts_both(y, motion, turn, p):
    """Return `joint_contact` of the big end and of the small end in scene both."""
    big, small = eccentricities_both(y, turn, p)
    spin = -motion.rate - y[7]
    spins = p.omega, spin
    bearing = p.pin_radius[0], p.clearance[0], p.stiffness[0]
    at_big = joint_contact(big, spins, bearing, carried_numbers(AT_BIG_END, y, p), p)
    at_big = add_film(AT_BIG_END, at_big, big, spins, p)
    spins = 0.0, spin
    bearing = p.pin_radius[1], p.clearance[1], p.stiffness[1]
    at_small = joint_contact(small, spins, bearing, carried_numbers(AT_SMALL_END, y, p), p)
    return at_big, add_film(AT_SMALL_END, at_small, small, spins, p)


@inline_llvm
def ideal_centre_acceleration(motion, p):
    """Return the acceleration (m/s^2) of the rod's centre in the ideal motion, x and y."""
    pin = p.crank_radius * p.omega * p.omega
    inward = motion.rate * motion.rate
    ax = p.rod_centre * (motion.cos_phi * inward + motion.sin_phi * motion.spin_up)
    ay = p.rod_centre * (motion.sin_phi * inward - motion.cos_phi * motion.spin_up)
    return -pin * motion.cos_theta - ax, ay - pin * motion.sin_theta


@inline_once
def centre_acceleration(accelerations, y, motion, turn, p):
    """Return the acceleration (m/s^2), x and y, of the centre of a rod with an ideal joint.

    accelerations: of the crosshead (m/s^2) and of phi (rad/s^2).
    """
    a, spin_up = accelerations
    sin_phi = motion.sin_phi + turn.ds
    cos_phi = motion.cos_phi + turn.dc
    rate = motion.rate + y[2 * p.freedoms - 1]
    if p.scene == BIG_END:
        b = p.rod_length - p.rod_centre
        ax = a + b * (cos_phi * rate * rate + sin_phi * spin_up)
        return ax, b * (cos_phi * spin_up - sin_phi * rate * rate)
    c = p.rod_centre
    pin = p.crank_radius * p.omega * p.omega
    ax = -pin * motion.cos_theta - c * (cos_phi * rate * rate + sin_phi * spin_up)
    return ax, c * (sin_phi * rate * rate - cos_phi * spin_up) - pin * motion.sin_theta


@inline_llvm
def joint_forces(big, small, load, accelerations, y, motion, turn, p):
    """Return the forces (N) on the rod: big end x and y, small end x and y.

    Those of a clearance joint are the contact's. At an ideal joint they follow by inverse dynamics:
    Newton-Euler of the rod with the crosshead's x balance. big, small: `ContactState`; load: N;
    accelerations: as of `centre_acceleration`.
    """
    if p.scene == BOTH:
        return big.fx, big.fy, small.fx, small.fy
    ax, ay = centre_acceleration(accelerations, y, motion, turn, p)
    across = p.rod_mass * ax
    up = p.rod_mass * (ay + p.gravity)
    if p.scene == SMALL_END:
        return across - small.fx, up - small.fy, small.fx, small.fy
    a, spin_up = accelerations
    small_x = -load - p.reciprocating_mass * a
    if p.scene == BIG_END:
        return big.fx, big.fy, small_x, up - big.fy
    big_x = across - small_x
    sin_phi, cos_phi = motion.sin_phi, motion.cos_phi
    c = p.rod_centre
    b = p.rod_length - c
    small_y = -p.rod_inertia * spin_up + c * (cos_phi * up + sin_phi * big_x)
    small_y = (small_y - b * sin_phi * small_x) / (p.rod_length * cos_phi)
    return big_x, up - small_y, small_x, small_y


class Instant(NamedTuple):
    """All that the forces and accelerations at one time and state depend on, evaluated once."""

    motion: IdealMotion
    turn: Turn
    load: float
    big: ContactState
    small: ContactState
    forces: tuple[float, float, float, float]  # on the rod: big end x and y, small end x and y, N
    a: float  # crosshead's acceleration
    spin_up: float  # second derivative of phi
    centre_x: float  # rod centre's acceleration; 0 unless it is an unknown of the scene
    centre_y: float


@inline_llvm
def evaluate(motion, y, phase, p):
    """Return the `Instant` of a state around the ideal motion, in the load's phase.

    motion: `IdealMotion` at the time; y: zeros (4) in the ideal scene.
    """
    n = p.freedoms
    turn = rod_turn(motion, y[n - 1], y[2 * n - 1], p)
    load = load_force(phase, y, motion, p)
    big = NO_CONTACT
    small = NO_CONTACT
    a = motion.a
    spin_up = motion.spin_up
    centre_x = 0.0
    centre_y = 0.0
    if p.scene == BIG_END:
        big = contact_big_end(y, motion, turn, p)
        a, spin_up = solve_big_end(y, motion, turn, load, big, p)
    elif p.scene == SMALL_END:
        small = contact_small_end(y, motion, turn, p)
        a, spin_up = solve_small_end(motion, turn, load, small, p)
    elif p.scene == BOTH:
        big, small = contacts_both(y, motion, turn, p)
        a, centre_x, centre_y, spin_up = solve_both(motion, turn, load, big, small, p)
    forces = joint_forces(big, small, load, (a, spin_up), y, motion, turn, p)
    return Instant(motion, turn, load, big, small, forces, a, spin_up, centre_x, centre_y)


@inline_once
def deviation_accelerations(now, p):
    """Return the accelerations (x, X, Y, phi) at an evaluated instant less the ideal motion's.

    Those of the rod's centre are 0 unless it is an unknown of the scene.
    """
    x, y = 0.0, 0.0
    if p.scene == BOTH:
        ideal_x, ideal_y = ideal_centre_acceleration(now.motion, p)
        x, y = now.centre_x - ideal_x, now.centre_y - ideal_y
    return now.a - now.motion.a, x, y, now.spin_up - now.motion.spin_up


@inline_once
def write_carried_rates(now, y, p, out):
    """Write the rates of what contacts carry: an approach speed stays until the bodies meet again.

    Bristles bend while the bodies slide, also where they do not touch.
    """
    place = 2 * p.freedoms
    out[place], out[place + 1], out[place + 2], out[place + 3] = 0.0, 0.0, 0.0, 0.0
    if p.friction == LUGRE:
        if p.clearance[0] > 0.0:
            out[place + 2] = bristle_rate(now.big.slip, y[place + 2], p)
        if p.clearance[1] > 0.0:
            out[place + 3] = bristle_rate(now.small.slip, y[place + 3], p)


@inline_llvm
def write_rates(now, y, p, out):
    """Write dy/dt at an evaluated instant into out."""
    n = p.freedoms
    for i in range(n):
        out[i] = y[n + i]
    accelerations = deviation_accelerations(now, p)
    out[n] = accelerations[0]
    if p.scene == BOTH:
        out[n + 1], out[n + 2] = accelerations[1], accelerations[2]
    out[2 * n - 1] = accelerations[3]
    if has_chosen_laws(p) and p.carries:
        write_carried_rates(now, y, p, out)


@inline_llvm
def pace_of(now, p):
    """Return the time that passes over that of a steady crank, which turns a scene: 1."""
    return 1.0


@inline_llvm
def contacts_of(now, p):
    """Return the `ContactState` of the big end and of the small end."""
    return now.big, now.small


@inline_llvm
def deviation(t, y, p):
    """Return how far (m) the crosshead is from its ideal place."""
    return y[0]


@jit
def is_within_model(y, p):
    """Return 0: how deep contacts of a scene are is watched by the tally."""
    return 0


@jit
def versine(angle):
    """Return 1 - cos(angle) without cancellation."""
    return 2.0 * math.sin(0.5 * angle) ** 2


@jit
def start(offset, y, p):
    """Write the state at top dead centre, ideal rates, journals shifted by `offset`, into y.

    offset: (joint, axis) in m, shape (2, 2), of the journal from its bore's centre; only joints
    with clearance are read.
    """
    for i in range(y.size):
        y[i] = 0.0
    if p.carries:
        for joint in range(2):
            y[2 * p.freedoms + joint] = p.least_approach
    if p.scene == BIG_END:
        eta = math.asin(-offset[0, 1] / p.rod_length)
        y[0] = -offset[0, 0] - p.rod_length * versine(eta)
        y[1] = eta
    elif p.scene == SMALL_END:
        eta = math.asin(offset[1, 1] / p.rod_length)
        y[0] = offset[1, 0] - p.rod_length * versine(eta)
        y[1] = eta
    elif p.scene == BOTH:
        eta = math.asin((offset[1, 1] - offset[0, 1]) / p.rod_length)
        less = -versine(eta)
        y[0] = p.rod_length * less + offset[1, 0] - offset[0, 0]
        y[1] = p.rod_centre * less - offset[0, 0]
        y[2] = -p.rod_centre * math.sin(eta) - offset[0, 1]
        y[3] = eta
