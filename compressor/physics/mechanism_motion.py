"""Accelerations of the general mechanism, and the forces of its ideal joints and guide.

physics/README.md, The general mechanism.
"""

import math
from typing import NamedTuple

from compressor.physics._jit import inner, square_root
from compressor.physics.contact import friction_coefficient
from compressor.physics.kinematics import IdealMotion
from compressor.physics.linear import factorize_positive, substitute_positive
from compressor.physics.mechanism import (
    ROWS,
    Joints,
    Pose,
    add_forces,
    add_on_rod,
    apply_jacobian,
    apply_jacobian_transpose,
    apply_mass,
    dot_rows,
    fill_bias,
    fill_rod,
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
    """A mechanism at one crank angle and state; SI.

    What else `solve` finds stands in the record, as long as nothing else is solved: `w`, `rates`
    and `accelerations` of the coordinates, `velocity` and `body`, the accelerations, of the bodies.
    """

    motion: IdealMotion  # ideal, of a steady crank
    pose: Pose
    joints: Joints
    reactions: Reactions


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

    arms: as by `friction_arms`; last: the `Reactions` before, whose friction has made these
    accelerations.
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
    """Return what the rod needs beside its weight: force along x, along y, or the moment.

    row: 1 to 3, of the bodies; the moment is about the big end's bore.
    """
    return dot_rows(p.mass[row], 1, 8 if p.elastic else 4, p.body) - p.own[row]


@inner
def friction_differs(one, other):
    """Return whether the friction of two `Reactions` differs beyond rounding.

    That of the guide goes by what presses on the crosshead: where the guide's own force passes
    through 0, it has no digits.
    """
    size = abs(other.big_torque) + abs(other.small_torque)
    torque = abs(one.big_torque - other.big_torque) + abs(one.small_torque - other.small_torque)
    force, most = abs(one.rubbing - other.rubbing), abs(other.small_x) + abs(other.small_y)
    return torque > FRICTION_TOLERANCE * size or force > FRICTION_TOLERANCE * most


@inner
def solve(motion, y, phase, p):
    """Return the mechanism `Solved` around the ideal motion, in the load's phase.

    Friction of ideal joints and of an ideal guide depends on their forces, and these on it: both
    are found in rounds; each leaves some hundredths of the last one's error.
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
    return Solved(motion, pose, joints, reactions)


@inner
def add_rubbing(pose, reactions, p, force):
    """Add to the bodies' forces the friction of ideal joints and of an ideal guide."""
    big, small = reactions.big_torque, reactions.small_torque
    add_on_rod(pose, (0.0, 0.0, big), (0.0, 0.0, small), p, force)
    force[0] -= big
    force[8] += reactions.rubbing
    force[10] -= small
