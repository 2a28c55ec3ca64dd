"""The oil film of a journal bearing under a load that moves: its forces, moments and loss.

Holland's superposition: a part of the rotation and one of the squeeze, each by a Sommerfeld number
of a bearing of finite length,

    F_D = So_D(eps) B D eta |w| / psi^2     at the angle beta behind the line of centres
    F_V = So_V(eps) B D eta eps' / psi^2    along it

with the eccentricity eps over the clearance, w = w_J + w_B - 2 delta', delta the angle of the line
of centres, B and D length and diameter, psi the clearance over the radius. The film that is pulled
apart is the other half, as of -eps.

The numbers are Butenschoen's approximations (Das hydrodynamische, zylindrische Gleitlager
endlicher Breite unter instationaerer Belastung, Karlsruhe 1976), which are some per cent off his
tables, times polynomials that make them those of Reynolds' equation (`solve.bearing`), which his
tables are.

Where both parts act, |w| and |eps'| of the formulas along the line of centres are made smooth:

    |w eps|  becomes  (w eps)^2 / sqrt((w eps)^2 + eps'^2)
    |eps'|   becomes  eps'^2 / sqrt(eps'^2 + ((1 - eps) w eps)^2)

which is nearer to one Reynolds field than the sum is (physics/README.md, Oil film); of a film that
only turns, or is only squeezed, the numbers are exact.

Below `CENTRE_ECCENTRICITY` the numbers go to those that make the centre smooth: a force against
the velocity.
In the film's last share the numbers stay what they are where it begins, as if the film could get
no thinner than half of it, the height of the surfaces' asperities. Beyond the wall dry contact adds
to it (mixed lubrication), so that the force never falls with depth, and as the share goes to 0 the
motion goes to that of Reynolds' film. Where the film faded beyond the wall instead (Flores,
Ambrosio, Claro and Lankarani, Proc. IMechE K 218, 2004), a journal fell through before dry contact
bore its load, and struck: how hard, followed from the share.
"""

import math

import numpy as np

from compressor.physics._jit import jit, uncompiled
from compressor.physics.contact_laws import rise

CENTRE_ECCENTRICITY = 0.1
SHAPES = {"rotation": 14, "attitude": 14, "squeeze": 22}  # numbers, and terms of each polynomial
TERMS = sum(SHAPES.values())
TURNED, SQUEEZED = 14, 28  # where the second and the third begin


@jit
def polynomial(constants, begin, end, x):
    """Return the value of the polynomial whose constants, lowest first, stand from begin to end."""
    total = 0.0
    for i in range(end - 1, begin - 1, -1):
        total = total * x + constants[i]
    return total


@jit
def end_factor(eps, b):
    """Return by what factor the open ends weaken a film: Butenschoen's, of a1 and a2.

    b: length over diameter.
    """
    a1 = 1.1642 + b * (-1.9456 + b * (7.1161 + b * (-10.1073 + b * 5.0141)))
    a2 = 1.000026 + b * (0.023634 + b * (0.4215 + b * (0.038817 + b * 0.090551)))
    return b * b * a1 * (1.0 - eps) / (a2 - eps)


@jit
def rotation_shape(eps, b):
    """Return the Sommerfeld number of the rotation over eps, which stays finite at the centre."""
    room = 1.0 - eps * eps
    size = math.sqrt(math.pi * math.pi * room + 16.0 * eps * eps)
    return size / (2.0 * room * room) * end_factor(eps, b)


@jit
def squeeze_shape(eps, b):
    """Return the Sommerfeld number of the squeeze; eps negative: of a film that is pulled apart."""
    room = 1.0 - eps * eps
    half = (0.5 * math.pi - 0.5 * math.acos(eps)) * (1.0 + 2.0 * eps * eps)
    shape = half + 1.5 * eps * math.sqrt(room)
    return 4.0 * shape / (room * room * math.sqrt(room)) * end_factor(eps, b)


@jit
def attitude_shape(eps, b):
    """Return the angle (rad) from the load to the line of centres, along the rotation."""
    series = 6.6294 - 1.591732 * b
    series = series * eps - 13.3415 + 3.424337 * b
    series = series * eps + 8.73393 - 2.3291 * b
    series = series * eps - 2.5905 + 0.798745 * b
    series = series * eps + 1.152624 - 0.105465 * b
    return math.atan2(math.pi * math.sqrt(1.0 - eps * eps), 2.0 * eps) * series


def film_constants(ratio, share, number):
    """Return the constants of the film's polynomials, and the squeeze's number at the wall.

    (`TERMS` + 1,) numbers. The polynomials lead from Butenschoen's approximations to other numbers
    at Chebyshev's points of the eccentricities that a film with this last share may have. ratio: B
    / D; number: a function of a name in `SHAPES`, an eccentricity and a ratio.
    """
    shape_of = {"rotation": rotation_shape, "attitude": attitude_shape, "squeeze": squeeze_shape}
    max_eps, constants = 1.0 - 0.5 * share, []
    for name, count in SHAPES.items():
        least = -max_eps if name == "squeeze" else 0.0
        nodes = np.cos(np.pi * (np.arange(count) + 0.5) / count)
        eps = least + (max_eps - least) * (nodes + 1.0) / 2.0
        quotient = [number(name, one, ratio) / shape_of[name](one, ratio) for one in eps]
        fit = np.polynomial.Chebyshev.fit(eps, quotient, count - 1)
        constants += fit.convert(kind=np.polynomial.Polynomial).coef.tolist()
    wall = uncompiled(bounded_eccentricity)(1.0, share)
    return (*constants, uncompiled(squeeze_number)(wall, ratio, np.array(constants)))


@jit
def rotation_number(eps, b, constants):
    """Return `rotation_shape` as Reynolds' equation has it; level at the centre."""
    number = rotation_shape(eps, b) * polynomial(constants, 0, TURNED, eps)
    centre = rotation_shape(0.0, b) * constants[0]
    return centre + (number - centre) * rise(eps / CENTRE_ECCENTRICITY)


@jit
def attitude(eps, b, constants):
    """Return `attitude_shape` as Reynolds' equation has it; a right angle at the centre."""
    angle = attitude_shape(eps, b) * polynomial(constants, TURNED, SQUEEZED, eps)
    return 0.5 * math.pi + (angle - 0.5 * math.pi) * rise(eps / CENTRE_ECCENTRICITY)


@jit
def squeeze_number(eps, b, constants):
    """Return `squeeze_shape` as Reynolds' equation has it.

    At the centre the same in all directions.
    """
    number = squeeze_shape(eps, b) * polynomial(constants, SQUEEZED, TERMS, eps)
    centre = 2.0 * rotation_number(0.0, b, constants)
    return centre + (number - centre) * rise(abs(eps) / CENTRE_ECCENTRICITY)


@jit
def bounded_eccentricity(eps, share):
    """Return eps up to the film's last share, and from there to the wall smoothly to its middle."""
    begin = 1.0 - share
    if eps <= begin:
        return eps
    s = min(1.0, (eps - begin) / share)
    return begin + share * (s - 0.5 * s * s)


@jit
def film(joint, eccentricity, spins, p):
    """Return the force on the journal x, y (N), both moments (N m), and the power lost (W).

    eccentricity: journal centre less bore centre, x and y (m), and its rate (m/s); spins: of
    journal and bore (rad/s). The moments, on journal and bore, balance: both have half of that of
    the force pair, and the shear of the film (Petroff's over sqrt(1 - eps^2)) against their spin.
    """
    ex, ey, ex_rate, ey_rate = eccentricity
    pin, clearance, constants = p.pin_radius[joint], p.clearance[joint], p.film_constants[joint]
    distance = math.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / distance, ey / distance) if distance > 0.0 else (1.0, 0.0)
    radial, across = ex_rate * nx + ey_rate * ny, ey_rate * nx - ex_rate * ny
    eps = bounded_eccentricity(distance / clearance, p.film_share)
    length = p.film_length[joint]
    ratio = 0.5 * length / pin
    relative = clearance / pin
    size = 2.0 * length * pin * p.viscosity / (relative * relative)
    journal_spin, bore_spin = spins
    per_distance = eps / distance if distance > 0.0 else 1.0 / clearance
    wedge = eps * (journal_spin + bore_spin) - 2.0 * across * per_distance  # eps w
    rotation = size * rotation_number(eps, ratio, constants)
    beta = attitude(eps, ratio, constants)
    # speeds along and across the line of centres, each smooth where the other one is not zero
    closing = radial / clearance
    speed = math.sqrt(wedge * wedge + closing * closing)
    turning = wedge * wedge / speed if speed > 0.0 else 0.0
    # sharper near the wall, where a film that is pulled apart has next to nothing of a pressed one
    sharp = math.sqrt(closing * closing + ((1.0 - eps) * wedge) ** 2)
    pressing = closing * closing / sharp if sharp > 0.0 else 0.0
    pressed = size * squeeze_number(eps, ratio, constants)
    pulled = size * squeeze_number(-eps, ratio, constants)
    normal = -rotation * turning * math.cos(beta)
    normal -= 0.5 * (pressed + pulled) * closing + 0.5 * (pressed - pulled) * pressing
    side = rotation * wedge * math.sin(beta)
    fx, fy = normal * nx - side * ny, normal * ny + side * nx
    shear = 2.0 * math.pi * p.viscosity * length * pin**3
    shear *= (journal_spin - bore_spin) / (clearance * math.sqrt(1.0 - eps * eps))
    half = 0.5 * distance * side
    lost = shear * (journal_spin - bore_spin) + half * (journal_spin + bore_spin)
    lost -= normal * radial + side * across
    return fx, fy, -shear - half, shear - half, lost
