"""The stiff partner: RODAS, a Rosenbrock method of order 4(3), six stages, stiffly accurate.

One Jacobian by differences a step; no iteration that could fail to converge. Hairer & Wanner,
Solving Ordinary Differential Equations II, IV.7 and IV.10, with an extension of order 3.
"""

import numpy as np

from compressor.physics._jit import inline_once, jit, square_root
from compressor.physics.runge_kutta import FLOWS
from compressor.physics.systems import derivative_with_flows

STIFF_STAGES = 6
GAMMA = 0.25
# increments a_ij, couplings c_ij / h, nodes and the weights of df/dt
A = np.zeros((STIFF_STAGES, STIFF_STAGES))
A[1, :1] = 1.544
A[2, :2] = 0.9466785280815826, 0.2557011698983284
A[3, :3] = 3.314825187068521, 2.896124015972201, 0.9986419139977817
A[4, :4] = 1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950
A[5, :4] = A[4, :4]
A[5, 4] = 1.0
COUPLING = np.zeros((STIFF_STAGES, STIFF_STAGES))
COUPLING[1, :1] = -5.6688
COUPLING[2, :2] = -2.430093356833875, -0.2063599157091915
COUPLING[3, :3] = -0.1073529058151375, -9.594562251023355, -20.47028614809616
COUPLING[4, :4] = 7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160
COUPLING[5, :5] = (
    8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136,
    -6.058818238834054,
)  # fmt: skip
NODES = np.array([0.0, 0.386, 0.21, 0.63, 1.0, 1.0])
TIME = np.array([0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0])
DENSE = np.array(
    [
        [10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823,
         1.025137723295662, 0.0],
        [-0.6762803392806898, 6.087714651680015, 16.43084320892478, 24.76722511418386,
         -6.594389125716872, 0.0],
    ]
)  # fmt: skip
ROOT_EPSILON = 1.5e-8
POWER_ITERATIONS = 8
TIME_SHARE = 1e-3  # of a step, by which time is varied either way


@inline_once
def factorize(matrix, pivots):
    """Write the LU factors of a small square matrix in place; return False if it is singular."""
    n = pivots.size
    for j in range(n):
        best = j
        for i in range(j + 1, n):
            if abs(matrix[i, j]) > abs(matrix[best, j]):
                best = i
        pivots[j] = best
        if not abs(matrix[best, j]) > 0.0:
            return False
        if best != j:
            for m in range(n):
                matrix[j, m], matrix[best, m] = matrix[best, m], matrix[j, m]
        for i in range(j + 1, n):
            matrix[i, j] /= matrix[j, j]
            for m in range(j + 1, n):
                matrix[i, m] -= matrix[i, j] * matrix[j, m]
    return True


@inline_once
def substitute(matrix, pivots, b):
    """Solve with the factors of `factorize`, b (n,) being overwritten by the solution."""
    n = pivots.size
    for j in range(n):
        b[j], b[pivots[j]] = b[pivots[j]], b[j]
    for i in range(n):
        for m in range(i):
            b[i] -= matrix[i, m] * b[m]
    for i in range(n - 1, -1, -1):
        for m in range(i + 1, n):
            b[i] -= matrix[i, m] * b[m]
        b[i] /= matrix[i, i]


@inline_once
def differentiate(t, h, z, rates, size, phase, p, scratch, column, jacobian, time_rate):
    """Write the Jacobian of motion and flows by the motion, (n + 4, n), and d/dt of dz/dt.

    By forward differences from `rates`, at natural sizes; in time by central ones, on which the
    order depends.
    """
    n = z.size - FLOWS
    for i in range(z.size):
        scratch[i] = z[i]
    for j in range(n):
        scratch[j] = z[j] + ROOT_EPSILON * max(abs(z[j]), size[j])
        delta = scratch[j] - z[j]
        derivative_with_flows(t, scratch, phase, p, column)
        for i in range(z.size):
            jacobian[i, j] = (column[i] - rates[i]) / delta
        scratch[j] = z[j]
    later, earlier = t + TIME_SHARE * h, t - TIME_SHARE * h
    derivative_with_flows(later, scratch, phase, p, time_rate)
    derivative_with_flows(earlier, scratch, phase, p, column)
    for i in range(z.size):
        time_rate[i] = (time_rate[i] - column[i]) / (later - earlier)


@jit
def take_step(t, h, z, rates, size, phase, p, work, new, u, jacobian):
    """Take a step of length h from (t, z); return False where its linear system is singular.

    Writes its end into new and the increments, (6, n + 4), the last of which is the error, into u.
    """
    n = z.size - FLOWS
    time_rate = np.empty(z.size)
    differentiate(t, h, z, rates, size, phase, p, new, work, jacobian, time_rate)
    matrix = np.empty((n, n))
    pivots = np.empty(n, dtype=np.int64)
    for i in range(n):
        for j in range(n):
            matrix[i, j] = -jacobian[i, j]
        matrix[i, i] += 1.0 / (h * GAMMA)
    if not factorize(matrix, pivots):
        return False
    for stage in range(STIFF_STAGES):
        for i in range(z.size):
            total = z[i]
            for j in range(stage):
                total += A[stage, j] * u[j, i]
            new[i] = total
        if stage == 0:
            for i in range(z.size):  # a slice would have numba compile its error message: seconds
                work[i] = rates[i]
        else:
            derivative_with_flows(t + NODES[stage] * h, new, phase, p, work)
        for i in range(z.size):
            total = work[i] + h * TIME[stage] * time_rate[i]
            for j in range(stage):
                total += COUPLING[stage, j] / h * u[j, i]
            u[stage, i] = total
        substitute(matrix, pivots, u[stage, :n])
        for i in range(n, z.size):  # a flow feeds on the motion and nothing feeds on it
            for j in range(n):
                u[stage, i] += jacobian[i, j] * u[stage, j]
            u[stage, i] *= h * GAMMA
    for i in range(z.size):
        new[i] += u[STIFF_STAGES - 1, i]
    return True


@inline_once
def spectral_radius(jacobian, size, v, w):
    """Return an estimate of the largest eigenvalue's size (1/s) by power iterations from v."""
    n = size.size
    growth = 0.0
    for _ in range(POWER_ITERATIONS):
        before, after = 0.0, 0.0
        for i in range(n):
            w[i] = 0.0
            for j in range(n):
                w[i] += jacobian[i, j] * v[j]
            before += (v[i] / size[i]) ** 2
            after += (w[i] / size[i]) ** 2
        if not before > 0.0 or not after > 0.0:
            return growth
        growth = square_root(after / before)
        for i in range(n):
            v[i] = w[i] / growth
    return growth


@inline_once
def error_norm(z, new, u, rtol, atol):
    """Return the root mean square over the motion of the estimated error over its tolerance."""
    n = z.size - FLOWS
    total = 0.0
    for i in range(n):
        total += (u[STIFF_STAGES - 1, i] / (atol[i] + rtol * max(abs(z[i]), abs(new[i])))) ** 2
    return square_root(total / n)


@inline_once
def extend(z, new, u, dense):
    """Write the coefficients of the step's cubic interpolant into dense, as of `runge_kutta`."""
    for i in range(dense.shape[1]):
        first, second = 0.0, 0.0
        for j in range(STIFF_STAGES):
            first += DENSE[0, j] * u[j, i]
            second += DENSE[1, j] * u[j, i]
        dense[0, i] = z[i]
        dense[1, i] = new[i] - z[i] + first
        dense[2, i] = second - first
        dense[3, i] = -second
        dense[4, i] = 0.0
