"""Machines and numbers that others have published, and their equations written anew.

For the tests, and for the table of what was expected and what came out (`make validation`).
"""

import math
from functools import cache

import numpy as np
import sympy
from scipy.integrate import solve_ivp

from compressor.cases.case import Case
from compressor.physics.observe import COLUMNS, Column
from compressor.physics.record import state_names
from compressor.physics.systems import observe_at
from compressor.solve import simulate
from compressor.solve.run import run_at_tolerance
from compressor.solve.si_record import record
from compressor.solve.simulate import with_series

# by law: what comes back with 0.9, 0.7, 0.5 and 0.3 asked for, from the closed form
GIVEN = {
    "lankarani_nikravesh": (0.9132, 0.7960, 0.7252, 0.6842),
    "hunt_crossley": (0.9090, 0.7680, 0.6630, 0.5813),
    "flores": (0.8939, 0.6832, 0.4704, 0.2562),
    "gonthier": (0.8764, 0.6696, 0.4877, 0.3042),
    "hu_guo": (0.8999, 0.6973, 0.4877, 0.2707),
}
ASKED = (0.9, 0.7, 0.5, 0.3)
CLEARANCE = 2e-4  # m


def drop(joint, speed, method="auto", mass=5.0, rtol=1e-8, **contact):
    """The crosshead flying at a speed (m/s) against the rod's end, along the rod, at almost no
    crank speed: the rows observed at 400 times until it has come and gone.
    """
    depth = (1.25 * mass * speed**2 / (3.36e5 * 1000**1.5)) ** 0.4
    span = 2.0 * CLEARANCE / speed + 2.0 * 2.9432 * depth / speed  # there and back; Hertz's contact
    values = {
        "joint": joint,
        "clearance_mm": 1000 * CLEARANCE,
        "load": "none",
        "friction": False,
        "contact": contact,
        "machine": {"speed_rpm": 1e-3, "reciprocating_mass_kg": mass},
        "solve": {"duration_s": span, "settle_rev": 0, "rtol": rtol, "method": method,
                  "output_step_s": span / 400, "error_bars": False},
    }  # fmt: skip
    case = Case.resolve(values)
    p = record(case)
    state = np.zeros(len(state_names(p)))
    state[p["freedoms"]] = speed
    if state.size > 2 * p["freedoms"]:
        state[2 * p["freedoms"] :][:2] = p["least_approach"]
    run = run_at_tolerance(case, case.rtol, 60.0, True, state=state)
    assert run.reason == ""
    rows = np.empty((run.trajectory.times.size, COLUMNS))
    for i, (t, y) in enumerate(zip(run.trajectory.times, run.trajectory.states, strict=True)):
        observe_at(t, y, int(run.trajectory.phases[i]), p, rows[i])
    return run, rows


def given_back(rows):
    """Share of the speed after the first contact in that before it."""
    touching = rows[:, Column.NORMAL + 1] > 0.0
    after = np.flatnonzero(touching[:-1] & ~touching[1:])[0] + 1
    return -rows[after, Column.VELOCITY] / rows[0, Column.VELOCITY]


# P. Flores and co-workers' studies of a dry clearance joint: crank 50 mm, rod 120 mm, 5000 rpm,
# clearance 0.5 mm at the small end, restitution 0.9
MACHINE = {
    "crank_radius_mm": 50, "rod_length_mm": 120, "rod_mass_kg": 0.21, "rod_inertia_kg_m2": 2.5e-4,
    "reciprocating_mass_kg": 0.14, "speed_rpm": 5000, "pin_radius_mm": 9.5,
}  # fmt: skip
STIFFNESS = 6.61e10  # N/m^1.5
DRY = {
    "joint": "small_end",
    "clearance_mm": 0.5,
    "load": "none",
    "machine": MACHINE,
    "contact": {"law": "lankarani_nikravesh", "restitution": 0.9,
                "stiffness_N_per_mm15": STIFFNESS / 1000**1.5},
    "friction": {"law": "ambrosio", "dynamic": 0.03, "stiction_velocity_mm_per_s": 0.1,
                 "friction_velocity_mm_per_s": 1.0},
}  # fmt: skip

RPM = 150.0 * 30.0 / math.pi  # 150 rad/s, in both

# P. Flores, R. Leine and C. Glocker, Multibody Syst. Dyn. 23 (2010): a slider with play in its
# guide, driven by a crank that runs free, its own centre halfway
GUIDED = {
    "load": "none",
    "friction": False,
    "machine": {
        "crank_radius_mm": 153, "rod_length_mm": 306, "speed_rpm": RPM, "rod_mass_kg": 0.038,
        "rod_inertia_kg_m2": 5.9e-4, "reciprocating_mass_kg": 0.076, "gravity_m_per_s2": 9.81,
    },
    "guide": {
        "clearance_mm": 1.0, "friction": 0.01, "crosshead_length_mm": 100,
        "crosshead_height_mm": 50, "crosshead_inertia_kg_m2": 2.7e-6,
    },
    "drive": {
        "flywheel_kg_m2": 7.4e-5 + 0.038 * 0.0765**2, "slope_N_m_s": 0,
        "unbalance_kg_mm": 0.038 * 76.5,
    },
}  # fmt: skip


def guided(**solve):
    how = {"duration_s": 2.8e-3, "output_step_s": 2e-6, "settle_rev": 0, **solve}
    run = simulate(Case.resolve({**GUIDED, "solve": how}))
    assert run.status == "ok"
    return run


# B. Simeon, Math. Modelling of Systems 2 (1996); IVP test set, "crank", linear stiffness, which
# publishes its start: an elastic rod between a steady crank and a slider
R, L, M2, M3, J2 = 0.15, 0.30, 0.151104, 0.075552, 0.0045339259
E, WIDTH, DENSITY = 2.0e11, 0.008, 7870.0
# phi2, x3, and q: two modes across the rod, its stretch to the middle and to the end
POSITION = np.array([0.0, 0.450016933, 0.0, 0.0, 0.103339863e-4, 0.169327969e-4])
RATE = np.array(
    [-74.9957670, -0.268938672e-5, 0.444896105, 0.463434311e-2, -0.178591076e-5, -0.268938672e-5]
)
ACCELERATION = np.array(
    [-1.344541576e-3, -5062.194923, -6.833142733e-5, 0.0, -4.268463211, 0.2098334688]
)
# its published end, at 0.1 s: phi2 and x3, and the deflections across
END_TIME = 0.1
END = {"φ₂": (0, -0.3311734987910881), "x₃": (1, 0.1697373326718410),
       "q₁": (2, 1.893192460247178e-4), "q₂": (3, 2.375751865617931e-5)}  # fmt: skip
# In the public source the shapes along the rod have so many times their mass: 8, 1, 2 in place of
# 8/15, 1/15, 2/15. The published accelerations depend on it.
PUBLIC = 15.0

SLIDER_CRANK = {
    "load": "none",
    "friction": False,
    "machine": {
        "crank_radius_mm": 150, "rod_length_mm": 300, "speed_rpm": RPM, "rod_mass_kg": M2,
        "rod_inertia_kg_m2": J2 - M2 * L**2 / 4, "reciprocating_mass_kg": M3,
    },
    "rod": {"youngs_modulus_GPa": 200, "depth_mm": 8, "width_mm": 8, "damping_ratio": 0},
}  # fmt: skip


def simeon(t, position, rate, along):
    """Accelerations (phi2, x3, q) with the constraints' multipliers, the crank turning steadily.

    along: times the shapes along the rod have their mass.
    """
    phi, q = position[0], position[2:]
    v, qd = rate[0], rate[2:]
    pi, mass = math.pi, DENSITY * WIDTH**2 * L
    mq = mass * np.diag([0.5, 0.5, 0.0, 0.0])
    mq[2:, 2:] = mass * along * np.array([[8.0, 1.0], [1.0, 2.0]]) / 15.0
    stiff = E * WIDTH**2 / L
    k = stiff * np.diag([pi**4 / 24, pi**4 * 2 / 3, 0.0, 0.0]) * (WIDTH / L) ** 2
    k[2:, 2:] = stiff * np.array([[16.0, -8.0], [-8.0, 7.0]]) / 3.0
    one, two = 16 / pi**3, 8 / pi**3 - 1 / pi
    b = np.zeros((4, 4))
    b[0, 2], b[0, 3], b[1, 3] = -one, two, 0.5 / pi
    b = mass * (b - b.T)
    c1, c2 = mass * np.array([0, 0, 2 / 3, 1 / 6]), mass * np.array([2 / pi, 0, 0, 0])
    c12 = mass * L * np.array([0, 0, 1 / 3, 1 / 6])
    c21 = mass * L * np.array([1 / pi, -0.5 / pi, 0, 0])
    turn = RPM * pi / 30
    theta = turn * t
    sine, cosine = math.sin(theta - phi), math.cos(theta - phi)
    inertia = np.zeros((6, 6))
    inertia[0, 0] = J2 + q @ mq @ q + 2 * c12 @ q
    inertia[0, 2:] = inertia[2:, 0] = c21 + b.T @ q
    inertia[1, 1] = M3
    inertia[2:, 2:] = mq
    force = np.zeros(6)
    force[0] = R * turn**2 * (sine * (0.5 * L * M2 + c1 @ q) - cosine * (c2 @ q))
    force[0] -= 2 * v * (c12 @ qd + qd @ mq @ q) + qd @ b @ qd
    force[2:] = v**2 * (mq @ q + c12) + R * turn**2 * (cosine * c1 + sine * c2)
    force[2:] += 2 * v * (b @ qd) - k @ q
    reach = L + q[3]
    g = np.zeros((2, 6))
    g[0, 0], g[0, 5] = reach * math.cos(phi), math.sin(phi)
    g[1, 0], g[1, 1], g[1, 5] = reach * math.sin(phi), 1.0, -math.cos(phi)
    bent = np.array(
        [
            R * math.sin(theta) * turn**2 + reach * math.sin(phi) * v**2
            - 2 * v * math.cos(phi) * qd[3],
            -R * math.cos(theta) * turn**2 - reach * math.cos(phi) * v**2
            - 2 * v * math.sin(phi) * qd[3],
        ]
    )  # fmt: skip
    system = np.block([[inertia, g.T], [g, np.zeros((2, 2))]])
    return np.linalg.solve(system, np.concatenate((force, bent)))[:6]


def integrate_simeon(times, along, rtol):
    """Return position and rate, (12, times), from the published start: SciPy's DOP853."""

    def flow(t, y):
        return np.concatenate((y[6:], simeon(t, y[:6], y[6:], along)))

    scale = np.tile([1.0, 1.0, 1e-5, 1e-5, 1e-5, 1e-5], 2)
    start = np.concatenate((POSITION, RATE))
    span = 0.0, times[-1]
    return solve_ivp(flow, span, start, "DOP853", times, rtol=rtol, atol=rtol / 10 * scale).y


def rod_apart(duration):
    """How far the elastic rod's motion is from an independent integration, over its size, by name.

    From the published start, with the shapes' own masses; duration: s.
    """
    solve = {"rtol": 1e-11, "duration_s": duration, "output_step_s": 1e-4, "settle_rev": 0}
    case = Case.resolve({**SLIDER_CRANK, "solve": solve})
    state = np.zeros(len(state_names(record(case))))
    state[:8] = np.concatenate((POSITION[2:], RATE[2:]))
    solution = run_at_tolerance(case, case.rtol, math.inf, True, state)
    found, variables = with_series(case, solution)
    run = found.table(variables)

    other = integrate_simeon(run["time"].values, 1.0, 1e-11)
    rows = {"displacement": 1, "rod_bend": 2, "rod_stretch": 5, "velocity": 7}
    return {
        name: float(np.abs(run[name].values - other[at]).max() / np.abs(other[at]).max())
        for name, at in rows.items()
    }


# H. J. Butenschoen's tables (1976), as in DIN 31652: length over diameter, eccentricity, Sommerfeld
# number and attitude (degrees; 0 where it was not at hand)
BEARING = [
    (1.0, 0.1, 0.1196, 79.41), (1.0, 0.5, 0.8903, 56.71), (1.0, 0.8, 3.5663, 36.24),
    (1.0, 0.95, 18.79, 19.45), (0.5, 0.1, 0.0368, 0.0), (0.5, 0.5, 0.3124, 0.0),
    (0.5, 0.8, 1.7339, 0.0), (0.5, 0.95, 13.31, 0.0),
]  # fmt: skip


COEFFICIENT = 0.1  # of friction, the same at any speed


def rubbing(joint, **values):
    """A case of Coulomb's friction, whose energy over the coefficient is what rubs."""
    friction = {
        "law": "coulomb_tanh", "static": COEFFICIENT, "dynamic": COEFFICIENT,
        "stiction_velocity_mm_per_s": 0.01, "friction_velocity_mm_per_s": 0.01,
    }  # fmt: skip
    return Case.resolve({
        "joint": joint, "clearance_mm": 0.2, "load": "none", "friction": friction,
        "solve": {"duration_rev": 1, "settle_rev": 0, "rtol": 1e-9, "error_bars": False}, **values,
    })  # fmt: skip


# Exudyn's test model `sliderCrankFloatingTest`: a crank of 0.1 m and a rod of 0.3 m on a frame that
# springs and dampers hold, driven by a torque of 0.1 N m from the dead centre on. Its result is the
# slider's x after 0.3 s with the frame held, plus that with the frame free
FLOATING = {
    "lengths": (0.1, 0.3),  # m: crank, rod
    "masses": (2.0, 0.2, 0.2, 0.4),  # kg: frame, crank, rod, slider
    "inertias": (1.0, 0.2 * 0.1**2 / 12, 0.2 * 0.3**2 / 12, 0.4e-3),  # kg m2, of the same
}
FLOATING_STIFFNESS, FLOATING_DAMPING, TORQUE = 5000.0, 50.0, 0.1  # of x, y and rocking; N m
SLIDERS = 0.5916491633788333  # m
SLIDERS_WITHIN = 1e-8  # the tolerance of Exudyn's own test


@cache
def floating_slider_crank(lengths, masses, inertias):
    """Functions of coordinates and rates, of a slider-crank on a frame that moves in the plane.

    The first: mass matrix and bias forces, (4, 4) and (4, 1), by Lagrange's equations; the second:
    the slider's place. Coordinates: the frame's x, y and angle, and the crank's angle on it.
    """
    at = x, y, rocking, crank = sympy.symbols("x y rocking crank")
    rates = sympy.Matrix(sympy.symbols("vx vy spin rate"))
    tilt = sympy.Matrix([
        [sympy.cos(rocking), -sympy.sin(rocking)], [sympy.sin(rocking), sympy.cos(rocking)]
    ])  # fmt: skip
    rod = -sympy.asin(lengths[0] * sympy.sin(crank) / lengths[1])
    pin = lengths[0] * sympy.Matrix([sympy.cos(crank), sympy.sin(crank)])
    arm = lengths[1] * sympy.Matrix([sympy.cos(rod), sympy.sin(rod)])
    centres = sympy.zeros(2, 1), pin / 2, pin + arm / 2, pin + arm
    angles = rocking, rocking + crank, rocking + rod, rocking
    mass, bias = sympy.zeros(4, 4), sympy.zeros(4, 1)
    for kg, inertia, centre, angle in zip(masses, inertias, centres, angles, strict=True):
        place = sympy.Matrix([x, y]) + tilt * centre
        jacobian = sympy.Matrix([place[0], place[1], angle]).jacobian(at)
        weights = sympy.diag(kg, kg, inertia)
        mass += jacobian.T * weights * jacobian
        bias += jacobian.T * weights * (jacobian * rates).jacobian(at) * rates
    slider = list(sympy.Matrix([x, y]) + tilt * centres[3])
    return (
        sympy.lambdify((at, list(rates)), (mass, bias), "numpy", cse=True),
        sympy.lambdify((at,), slider, "numpy"),
    )


def exudyn_sliders():
    """The slider's x (m) at 0.3 s with the frame held, plus that with the frame free."""
    forces, slider = floating_slider_crank(**FLOATING)

    def total(free):
        moving = [0, 1, 2, 3] if free else [3]

        def flow(t, z):
            mass, bias = forces(z[:4], z[4:])
            load = -FLOATING_STIFFNESS * z[:3] - FLOATING_DAMPING * z[4:7]
            # the torque turns the crank against space, so that it does the work of both angles
            load = np.append(load, 0.0) + np.array([0.0, 0.0, TORQUE, TORQUE]) - bias[:, 0]
            rates = np.zeros(4)
            rates[moving] = np.linalg.solve(mass[np.ix_(moving, moving)], load[moving])
            return np.concatenate([z[4:], rates])

        end = solve_ivp(flow, (0.0, 0.3), np.zeros(8), "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        return slider(end[:4])[0]

    return total(False) + total(True)


FRAME = {
    "joint": "none", "load": "none", "friction": False,
    "machine": {"crank_radius_mm": 100, "rod_length_mm": 300, "speed_rpm": 300,
                "rod_mass_kg": 0.2, "reciprocating_mass_kg": 0.4},
    "body": {"mass_kg": 8, "frequency_x_Hz": 12, "frequency_y_Hz": 14, "damping_ratio": 0.1},
    "solve": {"duration_rev": 2, "settle_rev": 1, "output_step_deg": 1},
}  # fmt: skip


def frame_orders():
    """Orders 1 and 2 of a body's velocity (m/s) along x and y, (2, 2): ours, and the frame's.

    Complex. Ours is driven one way, and each line divided by 1 - m G / M, which that leaves out
    (`conflicts.body_rules`). The frame is that of Exudyn's model, kept from rocking, at a steady
    crank speed.
    """
    case = Case.from_values(FRAME)
    body, pace = case.body, 2.0 * math.pi / case.turn
    masses = body.mass_kg, 0.0, case.machine.rod_mass_kg, case.machine.reciprocating_mass_kg
    inertias = 1.0, 0.0, FLOATING["inertias"][2], 0.0
    forces, _ = floating_slider_crank(FLOATING["lengths"], masses, inertias)
    natural = 2.0 * math.pi * np.array([body.frequency_x_Hz, body.frequency_y_Hz])

    def flow(t, z):
        mass, bias = forces([z[0], z[1], 0.0, pace * t], [z[2], z[3], 0.0, pace])
        springs = natural**2 * z[:2] + 2.0 * body.damping_ratio * natural * z[2:]
        load = -body.mass_kg * springs - bias[:2, 0]
        return np.concatenate([z[2:], np.linalg.solve(mass[:2, :2], load)])

    settled = 14  # revolutions: what is left of the start is e^-21
    times = (settled + np.arange(361) / 360) * case.turn
    found = solve_ivp(flow, (0.0, times[-1]), np.zeros(4), "DOP853", times, rtol=1e-10, atol=1e-12)
    ours = simulate(case)["body_velocity"].values[-361:]
    lines = [np.fft.rfft(one[:-1], axis=0)[1:3] / 180 for one in (ours, found.y[2:].T)]
    orders = np.array([1.0, 2.0]) / case.turn
    pairs, own = orders[:, None], natural / (2.0 * math.pi)
    stiffness = own**2 - pairs**2 + 2j * body.damping_ratio * own * pairs
    return lines[0] / (1.0 - (sum(masses[2:]) / body.mass_kg * pairs**2 / stiffness)), lines[1]
