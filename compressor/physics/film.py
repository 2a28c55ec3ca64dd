"""The oil film of a journal bearing under a load that moves: its forces, moments and loss.

The journal's motion enters Reynolds' equation by one velocity: with the eccentricity eps over the
clearance, eps' along the line of centres and eps w / 2 across it, w = w_J + w_B - 2 delta', delta
the angle of the line of centres. The film bears on the half of the bearing that this velocity
presses on. Of a short bearing that force has a closed form (`short_film`). Of a bearing of finite
length it is known in three directions,

    F_D = So_D(eps) B D eta |w| / psi^2   of rotation, at the angle beta behind the line of centres
    F_V = So_V(eps) B D eta eps' / psi^2  of squeeze, along it; pulled apart: as of -eps

B and D length and diameter, psi the clearance over the radius. Between them it follows from the
short bearing's direction (`film_numbers_at`), to some per cent of one Reynolds field
(physics/README.md, Oil film). Holland's sum of F_D and F_V is no such thing: where a journal leaves
the wall slowly it keeps the force of rotation, most of which the opening takes away.

The numbers are Butenschoen's approximations (Das hydrodynamische, zylindrische Gleitlager
endlicher Breite unter instationaerer Belastung, Karlsruhe 1976), which are some per cent off his
tables, times polynomials that make them those of Reynolds' equation (`solve.bearing`), which his
tables are. They are the short bearing's times what its open ends take away.

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

from compressor.physics._jit import dispatch_on_record, inline_llvm, jit, uncompiled
from compressor.physics.contact import ContactState
from compressor.physics.contact_laws import rise
from compressor.physics.record import CHOICE

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
def short_rotation(eps):
    """Return `rotation_shape` of a short bearing, over (B / D)^2."""
    room = 1.0 - eps * eps
    return math.sqrt(math.pi * math.pi * room + 16.0 * eps * eps) / (2.0 * room * room)


@jit
def short_squeeze(eps):
    """Return `squeeze_shape` of a short bearing, over (B / D)^2."""
    room = 1.0 - eps * eps
    half = (0.5 * math.pi - 0.5 * math.acos(eps)) * (1.0 + 2.0 * eps * eps)
    shape = half + 1.5 * eps * math.sqrt(room)
    return 4.0 * shape / (room * room * math.sqrt(room))


@jit
def rotation_shape(eps, b):
    """Return the Sommerfeld number of the rotation over eps, which stays finite at the centre."""
    return short_rotation(eps) * end_factor(eps, b)


@jit
def squeeze_shape(eps, b):
    """Return the Sommerfeld number of the squeeze; eps negative: of a film that is pulled apart."""
    return short_squeeze(eps) * end_factor(eps, b)


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
def short_film(eps, wedge, closing):
    """Return the force of a short bearing along the line of centres and across, over (B / D)^2.

    Away from the wall and along the rotation, as `solve.bearing.Reynolds`; wedge: eps w, closing:
    eps', over one speed. Half of the bearing bears, from an angle `begin` on, from the widest
    gap: there the integrals of sin^2, sin cos and cos^2 over h^3 have a closed form (Booker 1965),
    written so that nothing cancels at the centre.
    """
    speed = math.sqrt(closing * closing + 0.25 * wedge * wedge)
    if not speed > 0.0:
        return 0.0, 0.0
    sin_begin, cos_begin = closing / speed, 0.5 * wedge / speed
    x = eps * cos_begin
    room, ends = 1.0 - eps * eps, 1.0 - x * x
    root = math.sqrt(room)
    angle = math.pi + math.atan2(2.0 * eps * root * sin_begin, 1.0 - 2.0 * eps * eps + x * x)
    first = angle / root  # integral of 1 / h
    second = (first + 2.0 * eps * sin_begin / ends) / room  # of 1 / h^2
    third = 3.0 * second - first + 2.0 * eps * sin_begin * (1.0 + x * x) / (ends * ends)
    third *= 0.5 / room  # of 1 / h^3
    sines = 0.5 * second - 2.0 * eps * cos_begin * cos_begin * sin_begin / (ends * ends)
    mixed = -2.0 * eps * cos_begin**3 / (ends * ends)
    cosines = third - sines
    return 2.0 * closing * cosines - wedge * mixed, wedge * sines - 2.0 * closing * mixed


@jit
def film_numbers_at(eps, wedge, closing, b, constants):
    """Return the numbers of `short_film` of a bearing of finite length, with the factor (B / D)^2.

    The short bearing's force at the angle psi from the line of centres is turned to beta, with
    tan(beta / 2) in proportion to tan(psi / 2), and enlarged by a factor that is a line in cos(psi)
    between the pressed film's and that of the one pulled apart; what the film that only turns has
    more is added about its own direction. In these three directions the numbers are exact.
    """
    normal, across = short_film(eps, wedge, closing)
    size = math.sqrt(normal * normal + across * across)
    if not size > 0.0:
        return 0.0, 0.0
    cosine, sine = normal / size, across / size
    pressed = squeeze_number(eps, b, constants) / short_squeeze(eps)
    pulled = squeeze_number(-eps, b, constants) / short_squeeze(-eps)
    turned = rotation_number(eps, b, constants) / short_rotation(eps)
    middle, slope = 0.5 * (pressed + pulled), 0.5 * (pressed - pulled)
    # the direction of a short bearing that turns: Ocvirk's attitude
    wide, far = math.pi * math.sqrt(1.0 - eps * eps), 4.0 * eps
    length = math.sqrt(wide * wide + far * far)
    ocvirk = far / length
    from_pressed = (1.0 - cosine) / (1.0 - ocvirk)
    near = 2.0 * from_pressed / (1.0 + from_pressed * from_pressed)
    near *= (1.0 + cosine) / (1.0 + ocvirk)
    size *= middle + slope * cosine + (turned - middle - slope * ocvirk) * near
    further = math.tan(0.5 * attitude(eps, b, constants)) * (length + far) / wide
    towards, away = 1.0 + cosine, further * further * (1.0 - cosine)
    size /= towards + away
    return size * (towards - away), size * 2.0 * further * sine


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
    away, along = film_numbers_at(eps, wedge, radial / clearance, ratio, constants)
    normal, side = -size * away, size * along
    fx, fy = normal * nx - side * ny, normal * ny + side * nx
    shear = 2.0 * math.pi * p.viscosity * length * pin**3
    shear *= (journal_spin - bore_spin) / (clearance * math.sqrt(1.0 - eps * eps))
    half = 0.5 * distance * side
    lost = shear * (journal_spin - bore_spin) + half * (journal_spin + bore_spin)
    lost -= normal * radial + side * across
    return fx, fy, -shear - half, shear - half, lost


@jit
def oiled_contact(joint, contact, eccentricity, spins, p):
    """Return a joint's `ContactState` with the force, the moments and the loss of its film."""
    if p.viscosity == 0.0:
        return contact
    fx, fy, journal, bore, lost = film(joint, eccentricity, spins, p)
    return ContactState(
        contact.fx - fx, contact.fy - fy, contact.moment + bore, contact.normal, contact.friction,
        contact.penetration, contact.rate, contact.slip, contact.elastic, contact.unclamped,
        journal, lost,
    )  # fmt: skip


@inline_llvm
def dry_contact(joint, contact, eccentricity, spins, p):
    """Return the contact: records of the default forces have no oil."""
    return contact


add_film = dispatch_on_record(CHOICE, oiled_contact, dry_contact)
