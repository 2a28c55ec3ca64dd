"""Equations of motion of the four scenes, in the joints' eccentricities.

physics/README.md, Clearance configurations, Contact. State y: the eccentricities of the joints with
clearance, then their rates, then what contacts carry where laws were chosen. Where rod and
crosshead are follows from the loop over both joints, so that a clearance of a nanometre keeps its
digits.
"""

from typing import NamedTuple

from compressor.physics._jit import inline_llvm, inner, square_root
from compressor.physics.contact import NO_CONTACT, ContactState, joint_contact, write_carried_rates
from compressor.physics.contact_laws import has_chosen_laws
from compressor.physics.kinematics import IdealMotion, ideal
from compressor.physics.loads import piston_force
from compressor.physics.record import BIG_END as AT_BIG_END
from compressor.physics.record import SMALL_END as AT_SMALL_END
from compressor.physics.record import Scene

BIG_END = int(Scene.BIG_END)
SMALL_END = int(Scene.SMALL_END)
BOTH = int(Scene.BOTH)


class RodPlace(NamedTuple):
    """Where rod and crosshead are and how they move: SI, phi in rad; x counts from the crank."""

    big: tuple[float, float, float, float]  # eccentricity x and y, and its rate
    small: tuple[float, float, float, float]
    sin_phi: float
    cos_phi: float
    rate: float  # of phi
    x: float
    v: float


@inline_llvm
def eccentricities(y, p):
    """Return both joints' eccentricities, x and y (m), with their rates; zeros of ideal ones."""
    ideal_joint = 0.0, 0.0, 0.0, 0.0
    if p.scene == BOTH:
        return (y[0], y[1], y[4], y[5]), (y[2], y[3], y[6], y[7])
    if p.scene == BIG_END:
        return (y[0], y[1], y[2], y[3]), ideal_joint
    if p.scene == SMALL_END:
        return ideal_joint, (y[0], y[1], y[2], y[3])
    return ideal_joint, ideal_joint


@inline_llvm
def place_of(motion, y, p):
    """Return the `RodPlace` in a state."""
    big, small = eccentricities(y, p)
    crank, length = p.crank_radius * p.omega, p.rod_length
    sin_phi = (p.crank_radius * motion.sin_theta + (small[1] - big[1])) * p.per_rod_length
    cos_phi = square_root((1.0 - sin_phi) * (1.0 + sin_phi))
    falling = crank * motion.cos_theta + (small[3] - big[3])
    rate = falling * p.per_rod_length / cos_phi
    x = p.crank_radius * motion.cos_theta + (small[0] - big[0]) + length * cos_phi
    v = (small[2] - big[2]) - crank * motion.sin_theta - length * sin_phi * rate
    return RodPlace(big, small, sin_phi, cos_phi, rate, x, v)


@inline_llvm
def solve_big_end(at, load, contact, p):
    """Return accelerations (x, phi) of the rod hung on the crosshead and struck at the big end."""
    b = p.rod_length - p.rod_centre
    coupling = p.rod_mass * b * at.sin_phi
    mass = p.reciprocating_mass + p.rod_mass
    inertia = p.rod_inertia + p.rod_mass * b * b
    push = contact.fx - load - p.rod_mass * b * at.cos_phi * at.rate * at.rate
    moment = p.rod_length * (at.sin_phi * contact.fx + at.cos_phi * contact.fy) - contact.moment
    moment -= p.rod_mass * p.gravity * b * at.cos_phi
    per_determinant = 1.0 / (mass * inertia - coupling * coupling)
    a = (inertia * push - coupling * moment) * per_determinant
    spin_up = (mass * moment - coupling * push) * per_determinant
    return a, spin_up


@inline_llvm
def solve_small_end(motion, at, load, contact, p):
    """Return accelerations (x, phi) of the rod hung on the crankpin and struck at the small end."""
    sin_phi, cos_phi = at.sin_phi, at.cos_phi
    a = (-load - contact.fx) * p.per_reciprocating_mass
    moment = -p.rod_length * (sin_phi * contact.fx + cos_phi * contact.fy) - contact.moment
    pin = p.crank_radius * p.omega * p.omega  # the crankpin's centripetal acceleration
    carried = pin * (sin_phi * motion.cos_theta + cos_phi * motion.sin_theta)
    moment += p.rod_mass * p.rod_centre * (p.gravity * cos_phi - carried)
    inertia = p.rod_inertia + p.rod_mass * p.rod_centre * p.rod_centre
    return a, moment / inertia


@inline_llvm
def solve_both(at, load, big, small, p):
    """Return the accelerations (x, phi) of a rod between two clearance joints."""
    sin_phi, cos_phi = at.sin_phi, at.cos_phi
    a = (-load - small.fx) * p.per_reciprocating_mass
    moment = p.rod_centre * (cos_phi * big.fy + sin_phi * big.fx)
    moment -= (p.rod_length - p.rod_centre) * (cos_phi * small.fy + sin_phi * small.fx)
    moment -= big.moment + small.moment
    return a, moment * p.per_rod_inertia


class Instant(NamedTuple):
    """All that the forces and accelerations at one time and state depend on, evaluated once."""

    motion: IdealMotion
    at: RodPlace
    load: float
    big: ContactState
    small: ContactState
    forces: tuple[float, float, float, float]  # on the rod: big end x and y, small end x and y, N
    a: float  # crosshead's acceleration
    spin_up: float  # second derivative of phi
    # of the journals against their bores
    big_away: tuple[float, float]
    small_away: tuple[float, float]


@inline_llvm
def evaluate(motion, y, phase, p):
    """Return the `Instant` of a state around the ideal motion; y: zeros (4) in the ideal scene."""
    at = place_of(motion, y, p)
    load = piston_force(phase, at.x, at.v, motion, at.v - motion.v, p)
    big, small = NO_CONTACT, NO_CONTACT
    if p.scene & BIG_END:  # once each, not once a scene: the machine code is half as long
        big = joint_contact(AT_BIG_END, at.big, (p.omega, -at.rate), y, p)
    if p.scene & SMALL_END:
        small = joint_contact(AT_SMALL_END, at.small, (0.0, -at.rate), y, p)
    a, spin_up = motion.a, motion.spin_up
    if p.scene == BIG_END:
        a, spin_up = solve_big_end(at, load, big, p)
    elif p.scene == SMALL_END:
        a, spin_up = solve_small_end(motion, at, load, small, p)
    elif p.scene == BOTH:
        a, spin_up = solve_both(at, load, big, small, p)
    # second derivatives of the rod's direction, (cos, -sin) of phi, with the other sign
    along = at.cos_phi * at.rate * at.rate + at.sin_phi * spin_up
    across = at.cos_phi * spin_up - at.sin_phi * at.rate * at.rate
    c, b = p.rod_centre, p.rod_length - p.rod_centre
    pin = p.crank_radius * p.omega * p.omega
    pin_x, pin_y = -pin * motion.cos_theta, -pin * motion.sin_theta
    if p.scene == BOTH:
        centre_x = (big.fx + small.fx) * p.per_rod_mass
        centre_y = (big.fy + small.fy) * p.per_rod_mass - p.gravity
    elif p.scene == BIG_END:
        centre_x, centre_y = a + b * along, b * across
    else:
        centre_x, centre_y = pin_x - c * along, pin_y - c * across
    big_away = pin_x - centre_x - c * along, pin_y - centre_y - c * across
    small_away = a - centre_x + b * along, b * across - centre_y
    forces = joint_forces(big, small, load, (a, spin_up, centre_x, centre_y), at, p)
    return Instant(motion, at, load, big, small, forces, a, spin_up, big_away, small_away)


@inline_llvm
def joint_forces(big, small, load, accelerations, at, p):
    """Return the forces (N) on the rod, x and y at both ends; of ideal joints by Newton-Euler."""
    if p.scene == BOTH:
        return big.fx, big.fy, small.fx, small.fy
    a, spin_up, centre_x, centre_y = accelerations
    across = p.rod_mass * centre_x
    up = p.rod_mass * (centre_y + p.gravity)
    if p.scene == SMALL_END:
        return across - small.fx, up - small.fy, small.fx, small.fy
    small_x = -load - p.reciprocating_mass * a
    if p.scene == BIG_END:
        return big.fx, big.fy, small_x, up - big.fy
    big_x = across - small_x
    c, b = p.rod_centre, p.rod_length - p.rod_centre
    small_y = -p.rod_inertia * spin_up + c * (at.cos_phi * up + at.sin_phi * big_x)
    small_y = (small_y - b * at.sin_phi * small_x) / (p.rod_length * at.cos_phi)
    return big_x, up - small_y, small_x, small_y


@inline_llvm
def write_rates(now, y, p, out):
    """Write dy/dt at an evaluated instant into out."""
    n = p.freedoms
    for i in range(n):
        out[i] = y[n + i]
    if p.scene == SMALL_END:
        out[n], out[n + 1] = now.small_away
    else:
        out[n], out[n + 1] = now.big_away
    if p.scene == BOTH:
        out[n + 2], out[n + 3] = now.small_away
    if has_chosen_laws(p) and p.carries:
        write_carried_rates(now.big, now.small, 1.0, y, p, out)


@inline_llvm
def pace_of(now, p):
    """Return the time that passes over that of a steady crank, which turns a scene: 1."""
    return 1.0


@inner
def deviation(t, y, p):
    """Return how far (m) the crosshead is from its ideal place."""
    motion = ideal(t, p)
    return place_of(motion, y, p).x - motion.x


@inner
def is_within_model(y, p):
    """Return 0: how deep contacts of a scene are is watched by the tally."""
    return 0
