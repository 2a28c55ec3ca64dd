"""Sweep the big end's clearance as an engineer does by hand: numba, numbalsoda, joblib, one file.

    python script.py 2000 peaks.csv 1e-5

The paper's machine under the spring load, four revolutions at 500 rpm, states every 0.1 ms. A line
of peaks.csv is a clearance (m) and, after the first revolution, the greatest |acceleration| of the
crosshead (m/s2), force (N) and penetration (m) at the big end. Nothing comes from the product.

What is faster, or as exact and no slower, stands here: one call for all phases of the load, fast
mathematics, absolute coordinates, peaks of the settled samples alone. DOP853 of the same package
takes a fifth less time than LSODA at 1e-6, but may step over a contact.
"""

import math
import sys

import numpy as np
from joblib import Parallel, delayed
from numba import carray, cfunc, njit
from numbalsoda import lsoda, lsoda_sig

R, L, OMEGA = 0.12, 0.6, 500 * 2 * math.pi / 60
M_ROD, M_CROSS, B = 4.7, 14.0, 0.3  # kg, kg, m: mass centre to small end
I_END = M_ROD * L * L / 12 + M_ROD * B * B  # of the rod about the small end
TOTAL = M_ROD + M_CROSS
PIN, STIFFNESS, DAMPING, FULL_DAMPING = 0.01, 3.36e5 * 1e3**1.5, 3.36e5, 1e-4
MU_STATIC, MU_DYNAMIC, V_STICTION, V_FRICTION = 0.23, 0.15, 0.01, 0.1
PRELOAD, SPRING, SPRING_DAMPING, STROKE = 800.0, 2e4, 23.0, 0.12
TOP, DWELL = L + R, L + R - STROKE
CORNER = math.acos((DWELL**2 + R**2 - L**2) / (2 * DWELL * R))
TIMES = np.linspace(0.0, 0.48, 4801)
SETTLED = 1200  # samples of the first revolution

fast = njit(fastmath=True, error_model="numpy")


@fast
def piston_force(angle, x, v):
    """Force (N) of the spring between piston and cam follower."""
    angle %= 2 * math.pi
    s = w = 0.0
    if CORNER <= angle < math.pi or angle >= 2 * math.pi - CORNER:
        root = math.sqrt(L * L - (R * math.sin(angle)) ** 2)
        s = (DWELL if angle < math.pi else TOP) - R * math.cos(angle) - root
        w = R * OMEGA * math.sin(angle) * (1 + R * math.cos(angle) / root)
    elif angle >= math.pi:
        s = 2 * R - STROKE
    return PRELOAD + SPRING * (x - DWELL + s) + SPRING_DAMPING * (v + w)


@fast
def cubic(s):
    return s * s * (3.0 - 2.0 * s)


@fast
def friction(slip):
    size = abs(slip)
    if size < V_STICTION:
        return MU_STATIC * (2.0 * cubic(0.5 + 0.5 * slip / V_STICTION) - 1.0)
    mu = MU_DYNAMIC
    if size < V_FRICTION:
        fall = cubic((size - V_STICTION) / (V_FRICTION - V_STICTION))
        mu = MU_STATIC + (MU_DYNAMIC - MU_STATIC) * fall
    return math.copysign(mu, slip)


@fast
def motion(t, x, phi, v, w, clearance):
    """x'' (m/s2), phi'' (1/s2), force (N) and penetration (m) at the big end."""
    s, c = math.sin(phi), math.cos(phi)
    px, py = R * math.cos(OMEGA * t), R * math.sin(OMEGA * t)
    ex, ey = px - x + L * c, py - L * s
    distance = math.sqrt(ex * ex + ey * ey)
    depth = distance - clearance
    fx = fy = moment = 0.0
    if depth > 0.0:
        nx, ny = ex / distance, ey / distance
        ux, uy = -OMEGA * py - v - L * s * w, OMEGA * px - L * c * w
        full = cubic(depth / FULL_DAMPING) if depth < FULL_DAMPING else 1.0
        normal = STIFFNESS * depth * math.sqrt(depth) + DAMPING * full * (ux * nx + uy * ny)
        if normal > 0.0:
            bore = PIN + clearance
            slip = uy * nx - ux * ny + OMEGA * (PIN - depth) + w * bore
            tangential = -friction(slip) * normal
            fx, fy = normal * nx + tangential * ny, normal * ny - tangential * nx
            moment = -bore * tangential
    coupling = M_ROD * B * s
    force = fx - piston_force(OMEGA * t, x, v) - M_ROD * B * c * w * w
    torque = L * (s * fx + c * fy) - moment
    determinant = TOTAL * I_END - coupling * coupling
    ax = (I_END * force - coupling * torque) / determinant
    spin = (TOTAL * torque - coupling * force) / determinant
    return ax, spin, math.sqrt(fx * fx + fy * fy), depth


@cfunc(lsoda_sig)
def rates(t, state, out, data):
    y, dy = carray(state, 4), carray(out, 4)
    dy[0], dy[1] = y[2], y[3]
    dy[2], dy[3], _, _ = motion(t, y[0], y[1], y[2], y[3], carray(data, 1)[0])


@fast
def observe(times, states, clearance):
    """Acceleration, force and penetration at some times, shape (times, 3)."""
    seen = np.empty((times.size, 3))
    for i in range(times.size):
        x, phi, v, w = states[i]
        seen[i, 0], _, seen[i, 1], seen[i, 2] = motion(times[i], x, phi, v, w, clearance)
    return seen


def run(clearance, rtol):
    """Peaks of one clearance (m)."""
    start = np.array([R + L, 0.0, 0.0, R * OMEGA / L])
    states, ok = lsoda(
        rates.address, start, TIMES, np.array([clearance]), rtol=rtol, atol=rtol * clearance,
        mxstep=1_000_000,
    )  # fmt: skip
    if not ok:
        raise RuntimeError(f"no solution at {clearance} m")
    return np.abs(observe(TIMES[SETTLED:], states[SETTLED:], clearance)).max(axis=0)


if __name__ == "__main__":
    jobs, target, rtol = int(sys.argv[1]), sys.argv[2], float(sys.argv[3])
    clearances = np.linspace(1e-4, 3e-4, jobs)
    run(clearances[0], rtol)  # compiled once: forked workers inherit it
    parallel = Parallel(n_jobs=2, backend="multiprocessing")  # loky cannot pickle a cfunc
    peaks = parallel(delayed(run)(clearance, rtol) for clearance in clearances)
    np.savetxt(target, np.column_stack([clearances, peaks]), delimiter=",")
