"""Accelerations of the general mechanism, and the forces of its ideal joints and guide.

physics/README.md, The general mechanism.
"""

import math
from typing import NamedTuple

import numpy as np

from compressor.physics._jit import jit, square_root
from compressor.physics.contact import friction_coefficient
from compressor.physics.kinematics import IdealMotion
from compressor.physics.linear import factorize_positive, substitute_positive
from compressor.physics.mechanism import (
    ROWS,
    Joints,
    Pose,
    add_bodies,
    add_forces,
    add_on_rod,
    add_rod,
    apply_jacobian,
    apply_jacobian_transpose,
    fill_bias,
    guide_coefficient,
    joints_of,
    pose_of,
    unpack,
)

MAX_ROUNDS = 50  # in which friction and the forces that it depends on agree
FRICTION_TOLERANCE = 1e-14  # of the friction


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
    """A mechanism at one crank angle and state, with its accelerations; SI."""

    motion: IdealMotion  # ideal, of a steady crank
    pose: Pose
    joints: Joints
    reactions: Reactions
    w: np.ndarray  # coordinates, (11,)
    rates: np.ndarray
    accelerations: np.ndarray  # of the coordinates
    velocity: np.ndarray  # of the bodies, (11,)
    body: np.ndarray  # accelerations of the bodies
    mass: np.ndarray  # of the bodies, (11, 11)


@jit
def add_times(columns, vector, out):
    """Add to out a matrix times a vector; columns: of the matrix. Most of the numbers are zeros."""
    for i in range(ROWS):
        if vector[i] != 0.0:
            for row in range(ROWS):
                out[row] += columns[i, row] * vector[i]


@jit
def reduce_mass(pose, mass, p, memory, matrix):
    """Write the mass matrix of the coordinates that move; room: zeros, (4, 11)."""
    unit, velocity, momentum, pushed = memory[0], memory[1], memory[2], memory[3]
    for i in range(p.degrees):
        unit[p.coordinates[i]] = 1.0
        apply_jacobian(pose, unit, p, velocity)
        momentum[:] = 0.0
        add_times(mass, velocity, momentum)
        apply_jacobian_transpose(pose, momentum, p, pushed)
        for j in range(p.degrees):
            matrix[i, j] = pushed[p.coordinates[j]]
        unit[p.coordinates[i]] = 0.0


@jit
def row_times(row, vector):
    """Return the sum of a row's products with a vector, (11,) both."""
    total = 0.0
    for i in range(ROWS):
        total += row[i] * vector[i]
    return total


@jit
def reactions_of(pose, joints, needed, velocity, last, p):
    """Return the `Reactions` that the motion needs, with their friction where joints rub.

    needed: forces on the rod, its moment about the big end's bore, and the crosshead's force along
    x, that the accelerations need beside the bodies' weight, (4,); velocity: of the bodies; last:
    the `Reactions` before, whose friction has made these accelerations.
    """
    big, small = joints.big, joints.small
    small_x, small_y = small.fx, small.fy
    if not p.clearance[1] > 0.0:
        small_x = joints.guide.fx + last.rubbing - joints.load - needed[3]
        small_y = needed[1] - big.fy
        if not p.clearance[0] > 0.0:
            lever = (needed[2] - last.big_torque - last.small_torque) / pose.length
            small_y = (lever - pose.sin_phi * small_x) / pose.cos_phi
    big_x, big_y = big.fx, big.fy
    if not p.clearance[0] > 0.0:
        big_x, big_y = needed[0] - small_x, needed[1] - small_y
    big_torque, small_torque, rubbing = 0.0, 0.0, 0.0
    if p.rubbing and not p.clearance[0] > 0.0:
        turning = pose.speed - joints.big_spin
        big_torque = ideal_torque(turning, big_x, big_y, p.pin_radius[0], p)
    if p.rubbing and not p.clearance[1] > 0.0:
        turning = joints.pin_spin - joints.small_spin
        small_torque = ideal_torque(turning, small_x, small_y, p.pin_radius[1], p)
    guide = joints.guide.fy
    if not p.tilting:
        guide = p.reciprocating_mass * p.gravity + small_y
        rubbing = -guide_coefficient(velocity[8], p) * abs(guide)
    return Reactions(big_x, big_y, small_x, small_y, guide, big_torque, small_torque, rubbing)


@jit
def ideal_torque(turning, fx, fy, pin, p):
    """Return the friction torque (N m) on the rod in an ideal joint.

    turning: the journal's spin in it (rad/s); pin: the journal's radius (m).
    """
    size = square_root(fx * fx + fy * fy) * pin
    return friction_coefficient(turning * pin, 0.0, p) * size


@jit
def friction_differs(one, other):
    """Return whether the friction of two `Reactions` differs beyond rounding."""
    size = abs(other.big_torque) + abs(other.small_torque)
    torque = abs(one.big_torque - other.big_torque) + abs(one.small_torque - other.small_torque)
    force, most = abs(one.rubbing - other.rubbing), abs(other.rubbing)
    return torque > FRICTION_TOLERANCE * size or force > FRICTION_TOLERANCE * most


@jit
def solve(motion, y, phase, p):
    """Return the mechanism `Solved` around the ideal motion, in the load's phase.

    Friction of ideal joints and of an ideal guide depends on their forces, and these on it: both
    are found in rounds; each leaves some hundredths of the last one's error.
    """
    # one array of them all: to ask for memory takes longer than to use it
    memory = np.zeros((2 * ROWS + 13, ROWS))
    mass, matrix, vectors = memory[:ROWS], memory[ROWS : 2 * ROWS], memory[2 * ROWS :]
    w, rates, velocity, bias, own = vectors[0], vectors[1], vectors[2], vectors[3], vectors[4]
    unpack(y, p, w, rates)
    pose = pose_of(motion, w, rates, p)
    apply_jacobian(pose, rates, p, velocity)
    fill_bias(pose, rates, p, bias)
    axes = pose.cos_phi, -pose.sin_phi, pose.sin_phi, pose.cos_phi
    add_rod(axes, pose.spin, w[7:11], rates[7:11], p, mass, own)
    add_bodies(p, mass)
    joints = joints_of(phase, y, motion, pose, w, velocity, p)
    reduce_mass(pose, mass, p, vectors[5:9], matrix)
    regular = factorize_positive(matrix, p.degrees)
    accelerations, body, steady, force = vectors[9], vectors[10], vectors[11], vectors[12]
    pushed, solution = vectors[5], vectors[6, : p.degrees]
    add_times(mass, bias, steady)
    for row in range(ROWS):
        steady[row] = own[row] - steady[row]
    add_forces(pose, joints, p, steady)
    reactions = Reactions(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(MAX_ROUNDS):
        force[:] = steady
        add_rubbing(pose, reactions, p, force)
        apply_jacobian_transpose(pose, force, p, pushed)
        for i in range(p.degrees):
            solution[i] = pushed[p.coordinates[i]]
        substitute_positive(matrix, solution)
        for i in range(p.degrees):
            accelerations[p.coordinates[i]] = solution[i] if regular else math.nan
        apply_jacobian(pose, accelerations, p, body)
        for row in range(ROWS):
            body[row] += bias[row]
        last = reactions
        reactions = reactions_of(pose, joints, needed_of(mass, body, own, p), velocity, last, p)
        if not friction_differs(last, reactions):
            break
    return Solved(
        motion, pose, joints, reactions, w, rates, accelerations, velocity, body, mass
    )  # fmt: skip


@jit
def needed_of(mass, body, own, p):
    """Return what `reactions_of` needs, by the bodies' accelerations and their own forces."""
    return (
        row_times(mass[1], body) - own[1],
        row_times(mass[2], body) - own[2],
        row_times(mass[3], body) - own[3],
        p.reciprocating_mass * body[8],
    )


@jit
def add_rubbing(pose, reactions, p, force):
    """Add to the bodies' forces the friction of ideal joints and of an ideal guide."""
    big, small = reactions.big_torque, reactions.small_torque
    add_on_rod(pose, (0.0, 0.0, big), (0.0, 0.0, small), p, force)
    force[0] -= big
    force[8] += reactions.rubbing
    force[10] -= small
