"""The explicit Runge-Kutta pair TSIT5 as a table, its step, and its dense output.

Order 5 with an error estimate of order 4, and a continuous extension of order 4 without further
stages; the last of seven is the next step's first. Tsitouras, Comput. Math. Appl. 62 (2011).
"""

import numpy as np

from compressor.physics._jit import inline_llvm, inline_once, inner, square_root
from compressor.physics.kinematics import ideal_after
from compressor.physics.systems import evaluate, write_flowing_rates, write_row

STAGES = 7
FLOWS = 4
A = np.zeros((STAGES, STAGES))
A[1, :1] = 0.161
A[2, :2] = -0.008480655492356989, 0.335480655492357
A[3, :3] = 2.8971530571054935, -6.359448489975075, 4.3622954328695815
A[4, :4] = 5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525
A[5, :5] = (
    5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401,
    -0.028269050394068383,
)  # fmt: skip
A[6, :6] = (  # the weights of the step
    0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081,
    2.324710524099774,
)  # fmt: skip
C = A.sum(axis=1)
C[-2:] = 1.0  # whose sums they are to rounding
E = np.array(
    [
        -0.00178001105222577714, -0.0008164344596567469, 0.007880878010261995,
        -0.1447110071732629, 0.5823571654525552, -0.45808210592918697, 1 / 66,
    ]
)  # fmt: skip
# dense output: y(t + s h) = y + h sum_i k_i sum_j P[i, j] s^(j + 1)
P = np.array(
    [
        [1, -2.763706197274826, 2.9132554618219126, -1.0530884977290216],
        [0, 0.13169999999999998, -0.2234, 0.1017],
        [0, 3.9302962368947516, -5.941033872131505, 2.490627285651253],
        [0, -12.411077166933676, 30.33818863028232, -16.548102889244902],
        [0, 37.50931341651104, -88.1789048947664, 47.37952196281928],
        [0, -27.896526289197286, 65.09189467479366, -34.87065786149661],
        [0, 1.5, -4, 2.5],
    ]
)


@inline_llvm
def add_stages(weights, count, h, z, k, out):
    """Write z plus h times the first stages, `count` of them, by their weights into out, (m,).

    Four numbers at a time, which LLVM makes vectors of.
    """
    whole = out.size // 4 * 4
    for i in range(0, whole, 4):
        a, b, c, d = z[i], z[i + 1], z[i + 2], z[i + 3]
        for j in range(count):
            weight = h * weights[j]
            a += weight * k[j, i]
            b += weight * k[j, i + 1]
            c += weight * k[j, i + 2]
            d += weight * k[j, i + 3]
        out[i], out[i + 1], out[i + 2], out[i + 3] = a, b, c, d
    for i in range(whole, out.size):
        a = z[i]
        for j in range(count):
            a += h * weights[j] * k[j, i]
        out[i] = a


@inline_once
def take_step(base, h, z, k, phase, p, new, row):
    """Take a step of length h from z: write stages 1 to 6 into k, and its end's state into new.

    base: cosine and sine of the crank angle at its begin; row: observed at the step's end. Only the
    motion enters the right-hand side, so flows are summed at the end alone.
    """
    n = z.size - FLOWS
    for stage in range(1, STAGES - 1):
        add_stages(A[stage], stage, h, z, k, new[:n])
        now = evaluate(ideal_after(base, C[stage] * h, p), new[:n], phase, p)
        write_flowing_rates(now, new[:n], p, k[stage])
    add_stages(A[STAGES - 1], STAGES - 1, h, z, k, new)
    now = evaluate(ideal_after(base, h, p), new[:n], phase, p)
    write_flowing_rates(now, new[:n], p, k[STAGES - 1])
    write_row(now, new[:n], p, row)


@inline_once
def error_norm(h, z, new, k, rtol, atol):
    """Return the root mean square over the motion of the estimated error over its tolerance."""
    n = z.size - FLOWS
    total = 0.0
    for i in range(n):
        error = 0.0
        for j in range(STAGES):
            error += E[j] * k[j, i]
        share = error / (rtol * max(abs(z[i]), abs(new[i])) + atol[i])
        total += share * share
    return h * square_root(total / n)


@inline_once
def weights_at(s, weights):
    """Write the weights of the stages at the fraction s of a step into weights, (STAGES,)."""
    for stage in range(STAGES):
        a, b, c, d = P[stage, 0], P[stage, 1], P[stage, 2], P[stage, 3]
        weights[stage] = s * (s * (s * (s * d + c) + b) + a)


@inner
def extend(h, z, k, dense):
    """Write a step's interpolant into dense, (5, n): y(s) = sum over j of dense[j] s^j."""
    n = dense.shape[1]
    for i in range(n):
        dense[0, i] = z[i]
    for j in range(4):
        for i in range(n):
            dense[j + 1, i] = 0.0
        for stage in range(STAGES):
            weight = h * P[stage, j]
            for i in range(n):
                dense[j + 1, i] += weight * k[stage, i]


@inline_llvm
def interpolate(s, dense, out):
    """Write the motion at the fraction s of a step into out, shape (n,)."""
    for i in range(out.size):
        out[i] = dense[0, i] + s * (
            dense[1, i] + s * (dense[2, i] + s * (dense[3, i] + s * dense[4, i]))
        )
