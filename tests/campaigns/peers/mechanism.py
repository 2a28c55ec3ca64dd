"""The one problem of the comparison with other tools, and its equations as a notebook has them.

Rod 3 kg, reciprocating mass 6 kg, gas load, clearance 0.2 mm, four revolutions at 500 rpm, all
else as in physics/README.md. The equations are Newton's and Lagrange's for absolute coordinates,
worked out by hand with scalars; nothing comes from the product, and the numbers come from
reference.py.
`register_jitable` leaves a function plain Python for those who call it from Python.
"""

import math

import numpy as np
import reference
from numba.extending import register_jitable

SCENES = ("big_end", "small_end", "both")
CLEARANCE = 2e-4  # m
MASSES = {"rod_mass": 3.0, "rod_inertia": 3.0 * 0.6**2 / 12, "reciprocating_mass": 6.0}
DURATION = 0.48  # s
OUTPUT_STEP = 1e-4  # s


def params(scene):
    """The scene's parameters for reference.py."""
    return reference.paper_params("gas", scene, CLEARANCE, **MASSES)


def case_values(scene, duration=DURATION, **solve):
    """The same problem as values of a case file."""
    return {
        "load": "gas",
        "joint": scene,
        "clearance_mm": CLEARANCE * 1e3,
        "machine": {
            "rod_mass_kg": MASSES["rod_mass"],
            "reciprocating_mass_kg": MASSES["reciprocating_mass"],
        },
        "solve": {"duration_s": duration, "output_step_s": OUTPUT_STEP, **solve},
    }


def output_grid(duration):
    """Output times (s), shape (m,)."""
    steps = round(duration / OUTPUT_STEP)
    return duration * (np.arange(steps + 1) / steps)


def pieces(duration):
    """[(samples, times, wanted, phase)] between the load's corners.

    `times` (s) run from corner to corner by way of the output grid; times[wanted] are those of the
    grid's `samples`. A sample on a corner belongs to the phase that begins there.
    """
    grid, found = output_grid(duration), []
    for start, stop, phase in reference.segments(PARAMS, duration):
        inside = (grid >= start - 1e-12) & ((grid < stop - 1e-12) | (stop == duration))
        at = np.clip(grid[inside], start, stop)
        times = np.unique(np.concatenate(([start], at, [stop])))
        found.append((np.flatnonzero(inside), times, np.searchsorted(times, at), phase))
    return found


def error(found, truth):
    """Relative L2 error of one series against another."""
    return float(np.linalg.norm(found - truth) / np.linalg.norm(truth))


def loosest(errors, limit):
    """The loosest tolerance of {rtol: error} whose error is at most `limit`, or None."""
    return max([rtol for rtol, found in errors.items() if found <= limit], default=None)


PARAMS = params("both")
R, L, OMEGA, M_ROD, A, I_ROD, M_CROSS = (
    PARAMS[key]
    for key in ("crank_radius", "rod_length", "omega", "rod_mass", "rod_centre", "rod_inertia",
                "reciprocating_mass")
)  # fmt: skip
B = L - A  # from the rod's mass centre to the small end
PIN = PARAMS["pin_radius"]
BORE = PIN + CLEARANCE
STIFFNESS = PARAMS["contact_stiffness"]["big_end"]  # N/m^1.5, both joints
DAMPING, FULL_DAMPING = PARAMS["contact_damping"], PARAMS["full_damping"]
MU_STATIC, MU_DYNAMIC = PARAMS["mu_static"], PARAMS["mu_dynamic"]
V_STICTION, V_FRICTION = PARAMS["stiction_velocity"], PARAMS["friction_velocity"]
HEAD = L + R + PARAMS["head_clearance"]  # the cylinder head's position, m
GAS_EXPONENT = PARAMS["exponent"]
SUCTION = PARAMS["suction"] * PARAMS["piston_area"]  # N
DISCHARGE = PARAMS["discharge"] * PARAMS["piston_area"]

# coordinates, then their rates, at top dead centre; phi is the rod's angle, clockwise
START = {
    "big_end": (R + L, 0.0, 0.0, R * OMEGA / L),
    "small_end": (R + L, 0.0, 0.0, R * OMEGA / L),
    "both": (R + L, R + A, 0.0, 0.0, 0.0, 0.0, R * OMEGA * (1 - A / L), R * OMEGA / L),
}


@register_jitable
def cubic(s):
    """ADAMS's STEP from 0 to 1 within 0 <= s <= 1."""
    return s * s * (3.0 - 2.0 * s)


@register_jitable
def friction(slip):
    """ADAMS's signed coefficient of friction at a slip velocity (m/s)."""
    size = abs(slip)
    if size >= V_FRICTION:
        mu = MU_DYNAMIC
    elif size > V_STICTION:
        part = (size - V_STICTION) / (V_FRICTION - V_STICTION)
        mu = MU_STATIC + (MU_DYNAMIC - MU_STATIC) * cubic(part)
    else:
        return MU_STATIC * (2.0 * cubic(0.5 + 0.5 * slip / V_STICTION) - 1.0)
    return mu if slip > 0.0 else -mu


@register_jitable
def contact(ex, ey, ux, uy, journal_spin, rod_spin):
    """Force (N) and moment (N m) on the rod's bore: e = journal less bore centre, u its rate."""
    distance = math.sqrt(ex * ex + ey * ey)
    depth = distance - CLEARANCE
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    nx, ny = ex / distance, ey / distance
    full = cubic(depth / FULL_DAMPING) if depth < FULL_DAMPING else 1.0
    normal = STIFFNESS * depth * math.sqrt(depth) + DAMPING * full * (ux * nx + uy * ny)
    if normal <= 0.0:
        return 0.0, 0.0, 0.0
    slip = uy * nx - ux * ny + journal_spin * (PIN - depth) - rod_spin * BORE
    tangential = -friction(slip) * normal  # on the journal, along (-ny, nx)
    return normal * nx + tangential * ny, normal * ny - tangential * nx, -BORE * tangential


def load_of(phase, x):
    """Constants of the piston force in a phase that begins with the piston at x (m): see `gas`.

    Gas is shut in at a dead centre, with the space that is there.
    """
    if phase in (1, 3):
        return 0.0, SUCTION if phase == 1 else DISCHARGE
    return (SUCTION if phase == 2 else DISCHARGE) * (HEAD - x) ** GAS_EXPONENT, 0.0


@register_jitable
def gas(x, shut, still):
    """Piston force (N) towards the crank: shut in, shut / (HEAD - x)^n, or a constant one."""
    return shut * (HEAD - x) ** -GAS_EXPONENT if shut > 0.0 else still


@register_jitable
def big_end(t, x, phi, v, w, shut, still):
    """x'' and phi'' of a rod that hangs on the crosshead."""
    s, c = math.sin(phi), math.cos(phi)
    px, py = R * math.cos(OMEGA * t), R * math.sin(OMEGA * t)
    fx, fy, moment = contact(
        px - x + L * c, py - L * s, -OMEGA * py - v - L * s * w, OMEGA * px - L * c * w, OMEGA, -w
    )
    coupling = M_ROD * B * s
    turning = I_ROD + M_ROD * B * B
    force = fx - gas(x, shut, still) - M_ROD * B * c * w * w
    torque = L * (s * fx + c * fy) - moment
    total = M_CROSS + M_ROD
    determinant = total * turning - coupling * coupling
    return (
        (turning * force - coupling * torque) / determinant,
        (total * torque - coupling * force) / determinant,
    )


@register_jitable
def small_end(t, x, phi, v, w, shut, still):
    """x'' and phi'' of a crosshead and of a rod that hangs on the crankpin."""
    s, c = math.sin(phi), math.cos(phi)
    px, py = R * math.cos(OMEGA * t), R * math.sin(OMEGA * t)
    fx, fy, moment = contact(
        x - px - L * c, L * s - py, v + OMEGA * py + L * s * w, L * c * w - OMEGA * px, 0.0, -w
    )
    carried = M_ROD * A * OMEGA * OMEGA * (px * s + py * c)
    torque = -L * (s * fx + c * fy) - moment - carried
    return (-gas(x, shut, still) - fx) / M_CROSS, torque / (I_ROD + M_ROD * A * A)


@register_jitable
def both(t, x, X, Y, phi, v, U, V, w, shut, still):
    """x'', X'', Y'', phi'' of a crosshead and of a rod between two clearance joints."""
    s, c = math.sin(phi), math.cos(phi)
    px, py = R * math.cos(OMEGA * t), R * math.sin(OMEGA * t)
    bx, by, big_moment = contact(
        px - X + A * c, py - Y - A * s,
        -OMEGA * py - U - A * s * w, OMEGA * px - V - A * c * w, OMEGA, -w,
    )  # fmt: skip
    sx, sy, small_moment = contact(
        x - X - B * c, B * s - Y, v - U + B * s * w, B * c * w - V, 0.0, -w
    )
    torque = A * (s * bx + c * by) - B * (s * sx + c * sy) - big_moment - small_moment
    return (
        (-gas(x, shut, still) - sx) / M_CROSS,
        (bx + sx) / M_ROD,
        (by + sy) / M_ROD,
        torque / I_ROD,
    )


ACCELERATIONS = {"big_end": big_end, "small_end": small_end, "both": both}


def tolerances(scene, rtol):
    """Absolute tolerances of a careful user: shares of the clearance, and of 0.01 m/s."""
    per_unit = np.ones(len(START[scene]) // 2)
    per_unit[-1] = 1 / L  # an angle
    return rtol * np.concatenate((CLEARANCE * per_unit, 0.01 * per_unit))
