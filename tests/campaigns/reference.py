"""An independent formulation of the model (physics/README.md): the truth for the tests.

Nothing here comes from the product. SymPy derives Lagrange's equations in *absolute* coordinates
(the product integrates eccentricities), contact and loads are written down anew
from the text, and the result is evaluated with 40 digits, with floats, or integrated by SciPy.
SI units and radians throughout. A scene's coordinates, with the crank angle omega * t prescribed:

    big_end, small_end   x, phi         crosshead, rod angle
    both                 x, X, Y, phi   crosshead, rod centre, rod angle
"""

from __future__ import annotations

import math
from collections import namedtuple
from functools import lru_cache

import mpmath
import numpy as np
import sympy
from scipy.integrate import solve_ivp

DIGITS = 40
JOINTS = ("big_end", "small_end")
LOADS = ("none", "gas", "spring")
COORDINATES = {"big_end": ("x", "phi"), "small_end": ("x", "phi"), "both": ("x", "X", "Y", "phi")}

MACHINE = "crank_radius rod_length omega rod_mass rod_centre rod_inertia reciprocating_mass gravity"
SCALARS = (
    f"{MACHINE} pin_radius piston_area head_clearance suction discharge exponent back_pressure "
    "beyond spring_stiffness spring_damping preload stroke contact_exponent contact_damping "
    "full_damping mu_static mu_dynamic stiction_velocity friction_velocity"
).split()
Record = namedtuple(
    "Record", [*SCALARS, "load", *(f"{k}_{j}" for k in ("clearance", "stiffness") for j in JOINTS)]
)


# ---------------------------------------------------------------- parameters


def paper_params(load="spring", joint="both", clearance=1e-4, **changes) -> dict:
    """The default parameters as a dict in SI units; `changes` replaces any key.

    clearance [m] goes to the joints of the scene `joint`, the others get 0; a dict is taken as it
    is. The corners follow from the changed values.
    """
    if not isinstance(clearance, dict):
        clearance = {name: clearance if joint in (name, "both") else 0.0 for name in JOINTS}
    machine = {
        "crank_radius": 0.12, "rod_length": 0.6, "omega": 500 * 2 * math.pi / 60, "rod_mass": 4.7,
        "rod_centre": 0.3, "rod_inertia": 0.141, "reciprocating_mass": 14.0, "pin_radius": 0.01,
        "gravity": 0.0,
    }  # fmt: skip
    loads = {
        "load": load, "piston_area": math.pi * 0.05**2, "head_clearance": 0.02,
        "suction": 0.105e6, "discharge": 0.393e6, "exponent": 1.4, "back_pressure": 0.0,
        "beyond": 0.0,  # m, of its ideal place: the piston at the dead centre that shut the gas in
        "spring_stiffness": 2e4, "spring_damping": 23.0, "preload": 800.0, "stroke": 0.12,
    }  # fmt: skip
    contact = {
        "clearance": clearance, "contact_stiffness": dict.fromkeys(JOINTS, 3.36e5 * 1e3**1.5),
        "contact_exponent": 1.5, "contact_damping": 3.36e5, "full_damping": 1e-4,
        "mu_static": 0.23, "mu_dynamic": 0.15, "stiction_velocity": 0.01, "friction_velocity": 0.1,
    }  # fmt: skip
    params = machine | loads | contact | changes
    return {"corners": corners(params)} | params


def corners(params) -> tuple:
    """The crank angles [rad] at which phases 1, 2 and 3 begin; phase 0 begins at top dead centre.

    The gas load has the paper's printed angles; the design cam's are exact.
    """
    if params["load"] == "gas":
        return math.radians(38.95), math.pi, math.radians(294.2)
    R, L = params["crank_radius"], params["rod_length"]
    first, third = L + R - params["stroke"], L - R + params["stroke"]
    return (
        math.acos((first**2 + R**2 - L**2) / (2 * first * R)),
        math.pi,
        2 * math.pi - math.acos((third**2 + R**2 - L**2) / (2 * third * R)),
    )


def _record(params, backend):
    """The values of `params` by attribute: mpf or floats."""
    values = [params[name] for name in SCALARS] + [LOADS.index(params["load"])]
    values += [params[k][j] for k in ("clearance", "contact_stiffness") for j in JOINTS]
    return Record(*map(mpmath.mpf if backend == "mpmath" else float, values))


# ---------------------------------------------------------------- contact and loads
# Operators only, so that floats and mpf numbers are served by the same text.


def step(u, u0, h0, u1, h1):
    """The cubic from h0 at u0 to h1 at u1, constant outside."""
    if u <= u0:
        return h0
    if u >= u1:
        return h1
    s = (u - u0) / (u1 - u0)
    return h0 + (h1 - h0) * s * s * (3 - 2 * s)


def friction_coefficient(slip, p):
    """ADAMS's odd, smoothed coefficient of friction at the slip velocity [m/s]."""
    size = step(abs(slip), p.stiction_velocity, p.mu_static, p.friction_velocity, p.mu_dynamic)
    return step(slip, -p.stiction_velocity, -1.0, p.stiction_velocity, 1.0) * size


def contact_action(ex, ey, ux, uy, clearance, stiffness, spin_journal, spin_rod, p):
    """Force [N] and moment [N m] on the rod at the centre of its bore: (fx, fy, moment).

    (ex, ey) is journal centre minus bore centre, (ux, uy) its rate; spins are counter-clockwise.
    """
    distance = (ex * ex + ey * ey) ** 0.5
    depth = distance - clearance
    if distance == 0 or depth <= 0:
        return 0.0, 0.0, 0.0
    nx, ny = ex / distance, ey / distance
    damping = step(depth, 0.0, 0.0, p.full_damping, p.contact_damping)
    normal = stiffness * depth**p.contact_exponent + damping * (ux * nx + uy * ny)
    if normal <= 0:
        return 0.0, 0.0, 0.0
    bore_radius = p.pin_radius + clearance
    slip = -ux * ny + uy * nx + spin_journal * (p.pin_radius - depth) - spin_rod * bore_radius
    friction = -friction_coefficient(slip, p) * normal  # on the journal, along (-ny, nx)
    return normal * nx + friction * ny, normal * ny - friction * nx, -bore_radius * friction


def piston_force(x, v, x_ideal, v_ideal, phase, p):
    """Force [N] on the crosshead towards the crank; the cam follows the ideal motion."""
    if p.load == 1:
        return gas_force(x, phase, p)
    if p.load == 2:
        return spring_force(x, v, x_ideal, v_ideal, phase, p)
    return 0.0


def gas_force(x, phase, p):
    """Expansion, suction, compression, discharge; less the pressure on the other face."""
    z = p.rod_length + p.crank_radius + p.head_clearance - x
    clearance = p.head_clearance - p.beyond
    pressure = p.discharge
    if phase == 0:
        pressure = p.discharge * (clearance / z) ** p.exponent
    elif phase == 1:
        pressure = p.suction
    elif phase == 2:
        pressure = p.suction * ((2 * p.crank_radius + clearance) / z) ** p.exponent
    return (pressure - p.back_pressure) * p.piston_area


def spring_force(x, v, x_ideal, v_ideal, phase, p):
    """Preloaded spring and damper between the piston and the cam's follower (at s, moving at w)."""
    top, dwell_end = p.rod_length + p.crank_radius, p.rod_length + p.crank_radius - p.stroke
    s, w = top - x_ideal, -v_ideal
    if phase == 0:
        s, w = 0 * x, 0 * v
    elif phase == 1:
        s = dwell_end - x_ideal
    elif phase == 2:
        s, w = 2 * p.crank_radius - p.stroke + 0 * x, 0 * v
    return p.preload + p.spring_stiffness * (x - dwell_end + s) + p.spring_damping * (v + w)


# ---------------------------------------------------------------- Lagrange's equations

T = sympy.Symbol("t")
CONSTANTS = R, L, OMEGA, M_ROD, A, I_ROD, M_CROSS, G = sympy.symbols("R L omega m a I mp g")
ACTIONS = F_P, FBX, FBY, MB, FSX, FSY, MS = sympy.symbols("Fp fbx fby Mb fsx fsy Ms")
Y, W = sympy.DeferredVector("y"), sympy.DeferredVector("w")  # (q, q'), q''
CRANKPIN = sympy.Matrix([R * sympy.cos(OMEGA * T), R * sympy.sin(OMEGA * T)])
X_IDEAL = CRANKPIN[0] + sympy.sqrt(L**2 - CRANKPIN[1] ** 2)
PHI_IDEAL = sympy.asin(CRANKPIN[1] / L)
WEIGHT = sympy.Matrix([0, -M_ROD * G])


def _along(phi):
    """The rod's direction from the big end to the small end."""
    return sympy.Matrix([sympy.cos(phi), -sympy.sin(phi)])


def _rate(expression, n):
    """The total time derivative of an expression in t, q = y[:n] and q' = y[n:]."""
    total = expression.diff(T)
    for i in range(n):
        total += expression.diff(Y[i]) * Y[n + i] + expression.diff(Y[n + i]) * W[i]
    return total


def _positions(scene):
    """Crosshead x, rod angle, rod centre, big-end bore and small-end bore, as expressions in q."""
    n = len(COORDINATES[scene])
    x, phi = Y[0], Y[n - 1]
    along = _along(phi)
    centre = {
        "big_end": sympy.Matrix([x, 0]) - (L - A) * along,
        "small_end": CRANKPIN + A * along,
        "both": sympy.Matrix([Y[1], Y[2]]),
    }[scene]
    return x, phi, centre, (centre - A * along).expand(), (centre + (L - A) * along).expand()


def _lagrange(scene):
    """The accelerations q'' of a scene as a tuple of expressions in t, y and the ACTIONS."""
    n = len(COORDINATES[scene])
    x, phi, centre, big, small = _positions(scene)
    speed = _rate(centre, n)
    twice = M_CROSS * _rate(x, n) ** 2 + M_ROD * speed.dot(speed) + I_ROD * _rate(phi, n) ** 2
    energy = twice / 2
    residual = sympy.zeros(n, 1)
    for i in range(n):
        residual[i] = _rate(energy.diff(Y[n + i]), n) - energy.diff(Y[i])
        residual[i] -= sympy.Matrix([FBX, FBY]).dot(big.diff(Y[i]))  # virtual work
        residual[i] -= sympy.Matrix([FSX, FSY]).dot(small.diff(Y[i]))
        residual[i] -= WEIGHT.dot(centre.diff(Y[i])) - (MB + MS) * phi.diff(Y[i])
        residual[i] += (FSX + F_P) * x.diff(Y[i])  # reaction and load on the crosshead
    unknowns = [W[i] for i in range(n)]
    mass = residual.jacobian(unknowns).applyfunc(sympy.trigsimp)
    return tuple(mass.LUsolve(-residual.subs(dict.fromkeys(unknowns, 0))))


def _kinematics(scene):
    """Eccentricity and its rate at the big, then at the small end, and the ideal x and x'."""
    n = len(COORDINATES[scene])
    x, _, _, big, small = _positions(scene)
    big, small = CRANKPIN - big, sympy.Matrix([x, 0]) - small
    return (*big, *_rate(big, n), *small, *_rate(small, n), X_IDEAL, X_IDEAL.diff(T))


def _rod_forces(scene):
    """Forces on the rod (big x, y, small x, y): the ideal joint's by Newton's law for the rod."""
    n = len(COORDINATES[scene])
    big, small = sympy.Matrix([FBX, FBY]), sympy.Matrix([FSX, FSY])
    needed = M_ROD * _rate(_rate(_positions(scene)[2], n), n) - WEIGHT
    if scene == "big_end":
        small = needed - big
    elif scene == "small_end":
        big = needed - small
    return (*big, *small)


@lru_cache
def _functions(scene, backend):
    """The compiled (kinematics, accelerations, rod forces) of a scene for one backend."""
    state = (Y, T, *CONSTANTS)
    pairs = (
        (state, _kinematics(scene)),
        ((*state, *ACTIONS), _lagrange(scene)),
        ((W, *state, *ACTIONS), _rod_forces(scene)),
    )
    return tuple(sympy.lambdify(names, found, backend, cse=True) for names, found in pairs)


@lru_cache
def _ideal_functions():
    """The compiled ideal motion (x, x', x'', phi, phi', phi'')."""
    motion = tuple(e.diff(T, k) if k else e for e in (X_IDEAL, PHI_IDEAL) for k in range(3))
    return sympy.lambdify((T, *CONSTANTS), motion, "math", cse=True)


def _machine(p):
    """The values of CONSTANTS."""
    return (
        p.crank_radius, p.rod_length, p.omega, p.rod_mass, p.rod_centre, p.rod_inertia,
        p.reciprocating_mass, p.gravity,
    )  # fmt: skip


@lru_cache
def _actions(scene, backend):
    """A function (y, t, phase, p) -> the values of ACTIONS."""
    kinematics = _functions(scene, backend)[0]

    def actions(y, t, phase, p):
        n = len(y) // 2
        bx, by, bu, bv, sx, sy, su, sv, x_ideal, v_ideal = kinematics(y, t, *_machine(p))
        spin = -y[2 * n - 1]
        big = contact_action(
            bx, by, bu, bv, p.clearance_big_end, p.stiffness_big_end, p.omega, spin, p
        )
        small = contact_action(
            sx, sy, su, sv, p.clearance_small_end, p.stiffness_small_end, 0.0, spin, p
        )
        return piston_force(y[0], y[n], x_ideal, v_ideal, phase, p), *big, *small

    return actions


# ---------------------------------------------------------------- what tests call


def _numbers(values, backend):
    return [mpmath.mpf(v) if backend == "mpmath" else float(v) for v in values]


def _ideal_motion(t, params):
    """(x, x', x'', phi, phi', phi'') of the mechanism without clearance at the time t [s]."""
    return _ideal_functions()(t, *_machine(_record(params, "math")))


def _evaluate(scene, q, qd, t, phase, params, backend):
    """Accelerations, the actions on the bodies and the forces on the rod in one state."""
    p, y = _record(params, backend), _numbers([*q, *qd], backend)
    (t,) = _numbers([t], backend)
    _, accelerate, rod_forces = _functions(scene, backend)
    acts = _actions(scene, backend)(y, t, phase, p)
    found = accelerate(y, t, *_machine(p), *acts)
    return found, acts, rod_forces(found, y, t, *_machine(p), *acts)


def accelerations(scene, q, qd, t, phase, params):
    """q'' for the scene's absolute COORDINATES; mpf of 40 digits."""
    with mpmath.workdps(DIGITS):
        return list(_evaluate(scene, q, qd, t, phase, params, "mpmath")[0])


def joint_forces(scene, q, qd, t, phase, params):
    """{joint: (fx, fy)} [N] on the rod: contact, or the constraint of an ideal joint."""
    with mpmath.workdps(DIGITS):
        forces = _evaluate(scene, q, qd, t, phase, params, "mpmath")[2]
        return {"big_end": tuple(forces[:2]), "small_end": tuple(forces[2:])}


def segments(params, end):
    """[(start, stop, phase)] from 0 to `end` [s], cut at the load's corners."""
    if params["load"] == "none":
        return [(0.0, end, 0)]
    cuts, k = [], 0
    while not cuts or cuts[-1][0] < end - 1e-12:
        angle = 2 * math.pi * (k // 4) + (0.0, *params["corners"])[k % 4]
        cuts, k = [*cuts, (angle / params["omega"], k % 4)], k + 1
    stops = [start for start, _ in cuts[1:-1]] + [end]
    return [(a, b, phase) for (a, phase), b in zip(cuts, stops, strict=False)]


def _right_hand_side(scene):
    """A function (t, y, phase, p) -> y'."""
    accelerate, actions = _functions(scene, "math")[1], _actions(scene, "math")

    def rates(t, y, phase, p):
        y = y.tolist()
        return [*y[len(y) // 2 :], *accelerate(y, t, *_machine(p), *actions(y, t, phase, p))]

    return rates


def _start(scene, params):
    """Ideal position and rates at top dead centre: (q, q') as one array."""
    x, v, _, phi, phi_rate, _ = _ideal_motion(0.0, params)
    if scene != "both":
        return np.array([x, phi, v, phi_rate])
    R, L, a, omega = (params[k] for k in ("crank_radius", "rod_length", "rod_centre", "omega"))
    return np.array([x, R + a, 0.0, phi, v, 0.0, R * omega * (1 - a / L), phi_rate])


def _tolerances(scene, params, rtol):
    """Absolute tolerances: a share of the clearance for positions, of 0.01 m/s for velocities."""
    clearance = min(c for c in params["clearance"].values() if c > 0)
    scale = np.array([1.0] * (len(COORDINATES[scene]) - 1) + [1 / params["rod_length"]])
    return rtol * np.concatenate([clearance * scale, 0.01 * scale])


# without it DOP853 steps over returns of contact. Measured: a relative L2 error in a of 2e-2 in the
# case with a 144 us pulse; none (under 1e-8) in the paper's nine cases. LSODA at 1e-12 without a
# limit agrees to 3e-9 in all of these, in half the time. Halving rtol changes a by less than 3e-9
LONGEST_STEP = 1e-5  # s


def reference_solution(params, scene, t_grid, rtol=1e-11, method="DOP853"):
    """The crosshead's acceleration on `t_grid` [s] (n, ascending, from >= 0), (n).

    The motion starts from top dead centre at t = 0. The tolerance is absolute (see `_tolerances`):
    a relative one on x would be coarse beside c.
    """
    t_grid, a = np.asarray(t_grid, dtype=float), np.empty(len(t_grid))
    atol, y = _tolerances(scene, params, rtol), _start(scene, params)
    rates, n = _right_hand_side(scene), len(y) // 2
    for start, stop, phase in segments(params, t_grid[-1]):
        if phase in (0, 2):  # which begin at a dead centre
            params = params | {"beyond": y[0] - _ideal_motion(start, params)[0]}
        p = _record(params, "math")
        last = stop == t_grid[-1]
        inside = (t_grid >= start - 1e-12) & ((t_grid < stop - 1e-12) | last)
        times = np.append(np.clip(t_grid[inside], start, stop), stop)
        found = solve_ivp(
            rates, (start, stop), y, method, np.unique(times), args=(phase, p),
            rtol=3e-14, atol=atol, max_step=LONGEST_STEP,
        )  # fmt: skip
        assert found.success, found.message
        states, y = found.y.T[np.searchsorted(found.t, times[:-1])], found.y[:, -1]
        a[inside] = [
            _evaluate(scene, state[:n], state[n:], t, phase, params, "math")[0][0]
            for state, t in zip(states, t_grid[inside], strict=True)
        ]
    return a
