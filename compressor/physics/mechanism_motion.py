"""Accelerations of the general mechanism, and the forces of its ideal joints and guide.

physics/README.md, The general mechanism.
"""

import math
from typing import NamedTuple

import numpy as np

from compressor.physics._jit import jit, square_root
from compressor.physics.elastic_rod import add_rod, summed
from compressor.physics.friction_laws import friction_coefficient
from compressor.physics.guide import guide_coefficient
from compressor.physics.kinematics import Motion
from compressor.physics.linear import factorize, substitute
from compressor.physics.mechanism import (
    COORDINATES,
    ROWS,
    Joints,
    Pose,
    add_bodies,
    add_forces,
    add_on_rod,
    fill_bias,
    fill_jacobian,
    joints_of,
    pose_of,
    unpack,
)

MOST_ROUNDS = 50  # in which friction and the forces that it depends on agree
AGREED = 1e-14  # of the friction


class Reactions(NamedTuple):
    """Forces on the rod at both ends, of the guide upwards, and friction of what is ideal."""

    big_x: float
    big_y: float
    small_x: float
    small_y: float
    guide: float
    big_torque: float  # on the rod, N m
    small_torque: float
    rubbing: float  # of the guide on the crosshead along x, N


class Solved(NamedTuple):
    """A mechanism at one crank angle and state, with its accelerations; SI."""

    motion: Motion  # ideal, of a steady crank
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
def columns_of(p, columns):
    """Write the coordinates that move, in their order; returns how many."""
    count = 0
    for i in range(COORDINATES):
        if p.at[i] >= 0:
            columns[count] = i
            count += 1
    return count


@jit
def times(matrix, vector, out):
    """Write a matrix times a vector."""
    for i in range(matrix.shape[0]):
        total = 0.0
        for j in range(vector.size):
            total += matrix[i, j] * vector[j]
        out[i] = total


@jit
def reduce(jacobian, mass, columns, matrix):
    """Write the mass matrix of the coordinates that move; columns: their numbers."""
    carried = np.zeros(ROWS)
    for i in range(columns.size):
        for row in range(ROWS):
            carried[row] = 0.0
            for other in range(ROWS):
                carried[row] += jacobian[other, columns[i]] * mass[other, row]
        for j in range(columns.size):
            matrix[i, j] = 0.0
            for row in range(ROWS):
                matrix[i, j] += carried[row] * jacobian[row, columns[j]]


@jit
def reactions_of(pose, joints, needed, velocity, last, p):
    """`Reactions` that the motion asks for, with the friction that they make where joints rub.

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
        big_torque = ideal_torque(pose.speed - joints.big_spin, big_x, big_y, p)
    if p.rubbing and not p.clearance[1] > 0.0:
        small_torque = ideal_torque(joints.pin_spin - joints.small_spin, small_x, small_y, p)
    guide = joints.guide.fy
    if not p.tilting:
        guide = p.reciprocating_mass * p.gravity + small_y
        rubbing = -guide_coefficient(velocity[8], p) * abs(guide)
    return Reactions(big_x, big_y, small_x, small_y, guide, big_torque, small_torque, rubbing)


@jit
def ideal_torque(turning, fx, fy, p):
    """Friction torque (N m) on the rod in an ideal joint; turning: the journal's spin in it."""
    size = square_root(fx * fx + fy * fy) * p.pin_radius
    return friction_coefficient(turning * p.pin_radius, 0.0, p) * size


@jit
def apart(one, other):
    """Whether the friction of two `Reactions` differs beyond rounding."""
    size = abs(other.big_torque) + abs(other.small_torque)
    far = abs(one.big_torque - other.big_torque) + abs(one.small_torque - other.small_torque)
    pushed = abs(one.rubbing - other.rubbing)
    return far > AGREED * size or pushed > AGREED * abs(other.rubbing)


@jit
def solve(motion, y, phase, p):
    """The mechanism `Solved` around the ideal motion, in the load's phase.

    Friction of ideal joints and of an ideal guide depends on their forces, and these on it: both
    are found in rounds, of which each leaves some hundredths of the last one's error.
    """
    w, rates, velocity, bias = (
        np.zeros(COORDINATES),
        np.zeros(COORDINATES),
        np.zeros(ROWS),
        np.zeros(ROWS),
    )
    jacobian, mass, own = np.zeros((ROWS, COORDINATES)), np.zeros((ROWS, ROWS)), np.zeros(ROWS)
    unpack(y, p, w, rates)
    pose = pose_of(motion, w, rates, p)
    fill_jacobian(pose, p, jacobian)
    times(jacobian, rates, velocity)
    fill_bias(pose, rates, p, bias)
    axes = pose.cos_phi, -pose.sin_phi, pose.sin_phi, pose.cos_phi
    add_rod(axes, pose.spin, w[7:11], rates[7:11], p, mass, own)
    add_bodies(p, mass)
    joints = joints_of(phase, y, motion, pose, w, velocity, p)
    columns = np.zeros(COORDINATES, dtype=np.int64)
    columns = columns[: columns_of(p, columns)]
    count = columns.size
    matrix, pivots = np.zeros((count, count)), np.zeros(count, dtype=np.int64)
    reduce(jacobian, mass, columns, matrix)
    regular = factorize(matrix, pivots)
    steady, force, body = own.copy(), np.zeros(ROWS), np.zeros(ROWS)
    add_forces(pose, joints, p, steady)
    accelerations, pushed, needed = np.zeros(COORDINATES), np.zeros(count), np.zeros(4)
    reactions = Reactions(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for _ in range(MOST_ROUNDS):
        force[:] = steady
        add_rubbing(pose, reactions, p, force)
        times(mass, bias, body)
        for i in range(count):
            pushed[i] = 0.0
            for row in range(ROWS):
                pushed[i] += jacobian[row, columns[i]] * (force[row] - body[row])
        substitute(matrix, pivots, pushed)
        for i in range(count):
            accelerations[columns[i]] = pushed[i] if regular else math.nan
        times(jacobian, accelerations, body)
        for row in range(ROWS):
            body[row] += bias[row]
        for i in range(3):
            needed[i] = summed(mass[1 + i], 0, ROWS, body) - own[1 + i]
        needed[3] = p.reciprocating_mass * body[8]
        last = reactions
        reactions = reactions_of(pose, joints, needed, velocity, last, p)
        if not apart(last, reactions):
            break
    return Solved(
        motion, pose, joints, reactions, w, rates, accelerations, velocity, body, mass
    )  # fmt: skip


@jit
def add_rubbing(pose, reactions, p, force):
    """Add to the bodies' forces the friction of ideal joints and of an ideal guide."""
    big, small = reactions.big_torque, reactions.small_torque
    add_on_rod(pose, (0.0, 0.0, big), (0.0, 0.0, small), p, force)
    force[0] -= big
    force[8] += reactions.rubbing
    force[10] -= small
