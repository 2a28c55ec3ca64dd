"""The rod as a body in the plane: rigid, or an elastic bar in a frame that floats with its ends.

The frame's origin is the big end's bore, its first axis runs to the small end's. A point at the
fraction s of the rod is displaced along it by two quadratic shapes, of its middle and of its small
end, and across it by half a sine wave and a whole one: the modes of a bar with pinned ends. This is
the model of Simeon's slider-crank (IVP test set, "crank"; linear stiffness). The mass of the
displaced rod is spread evenly.

Axes: u along the rod, (cos phi, -sin phi), and v across it, (sin phi, cos phi); the rod's spin is
counter-clockwise, -phi'. Rows and columns of a mechanism's bodies: `mechanism.Row`.
"""

import math

import numpy as np

from compressor.physics._jit import jit

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
def summed(row, begin, end, q):
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
    along = m * (p.rod_centre + summed(FIRST, ACROSS, MODES, q))
    across = m * summed(FIRST, 0, ACROSS, q)
    along_rate = m * summed(FIRST, ACROSS, MODES, rates)
    across_rate = m * summed(FIRST, 0, ACROSS, rates)
    polar = p.rod_inertia + m * p.rod_centre * p.rod_centre
    polar += 2.0 * m * length * summed(MOMENT, ACROSS, MODES, q)
    swelling = m * length * summed(MOMENT, ACROSS, MODES, rates)  # half the polar inertia's rate
    for i in range(MODES):
        begin, end = (0, ACROSS) if i < ACROSS else (ACROSS, MODES)
        polar += m * q[i] * summed(PRODUCT[i], begin, end, q)
        swelling += m * q[i] * summed(PRODUCT[i], begin, end, rates)
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
    """`add_rod` of the modes: their inertia, their coupling and the material's forces."""
    ux, uy, vx, vy = axes
    m = p.rod_mass
    for i in range(MODES):
        if i < ACROSS:
            x, y, begin, end, others, last = vx, vy, 0, ACROSS, ACROSS, MODES
            arm = p.rod_length * MOMENT[i] + summed(PRODUCT[i], others, last, q)
            turning = spin * summed(PRODUCT[i], begin, end, q)
            turning -= 2.0 * summed(PRODUCT[i], others, last, rates)
        else:
            x, y, begin, end, others, last = ux, uy, ACROSS, MODES, 0, ACROSS
            arm = -summed(PRODUCT[i], others, last, q)
            turning = spin * (p.rod_length * MOMENT[i] + summed(PRODUCT[i], begin, end, q))
            turning += 2.0 * summed(PRODUCT[i], others, last, rates)
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
    """Return the sum of the elastic forces of deflections q times others, both (4,): twice the
    energy (J).
    """
    total = 0.0
    if p.elastic:
        for i in range(MODES):
            total += material(i, q, p) * other[i]
    return total
