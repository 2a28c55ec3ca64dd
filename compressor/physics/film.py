"""The oil film of a journal bearing under a load that moves: its forces, moments and loss.

physics/README.md, Oil film. eps is the eccentricity over the clearance; the journal's motion enters
by one velocity, eps' along the line of centres and eps w / 2 across it. The force follows from that
of a short bearing, which has a closed form (`short_film`), by numbers of Reynolds' equation for the
bearing's length over its diameter (`solve.bearing`): pressed, pulled apart, turned.

Below `CENTRE_ECCENTRICITY` the numbers go to those that make the centre smooth: a force against
the velocity. In the film's last share they stay what they are in its middle, so that the force
never falls with depth: where it faded beyond the wall, a journal fell through before dry contact
bore its load, and struck.
"""

import math

from compressor.physics._jit import inline_llvm, square_root
from compressor.physics.contact_laws import rise
from compressor.physics.record import FILM_TERMS

CENTRE_ECCENTRICITY = 0.1


@inline_llvm
def bounded_eccentricity(eps, share):
    """Return eps up to the film's last share, and from there to the wall smoothly to its middle."""
    begin = 1.0 - share
    if eps <= begin:
        return eps
    s = min(1.0, (eps - begin) / share)
    return begin + share * (s - 0.5 * s * s)


@inline_llvm
def short_film(eps, wedge, closing):
    """Return the force of a short bearing along the line of centres and across, over (B / D)^2.

    Away from the wall and along the rotation; wedge: eps w, closing: eps', over one speed. Half of
    the bearing bears, from an angle on: there the integrals of sin^2, sin cos and cos^2 over h^3
    have a closed form (Booker 1965), written so that nothing cancels at the centre.
    """
    speed = square_root(closing * closing + 0.25 * wedge * wedge)
    if not speed > 0.0:
        return 0.0, 0.0
    per_speed = 1.0 / speed
    sin_begin, cos_begin = closing * per_speed, 0.5 * wedge * per_speed
    x = eps * cos_begin
    room, ends = 1.0 - eps * eps, 1.0 - x * x
    root, per_room, per_ends = square_root(room), 1.0 / room, 1.0 / ends
    angle = math.pi + math.atan2(2.0 * eps * root * sin_begin, 1.0 - 2.0 * eps * eps + x * x)
    first = angle * root * per_room  # integral of 1 / h
    part = 2.0 * eps * sin_begin * per_ends
    second = (first + part) * per_room  # of 1 / h^2
    third = 0.5 * (3.0 * second - first + part * (1.0 + x * x) * per_ends) * per_room  # of 1 / h^3
    wide = 2.0 * eps * cos_begin * cos_begin * per_ends * per_ends
    sines, mixed = 0.5 * second - wide * sin_begin, -wide * cos_begin
    cosines = third - sines
    return 2.0 * closing * cosines - wedge * mixed, wedge * sines - 2.0 * closing * mixed


@inline_llvm
def short_bearing_shares(eps, constants):
    """Return a bearing's numbers over the short one's: pressed, pulled apart, turned; its attitude.

    Of that, tan(beta / 2) over that of Ocvirk's angle. constants: of
    `solve.bearing.film_constants`.
    """
    left, u = 1.0 - eps, square_root(1.0 - eps)
    pressed, pulled, turned, further = 0.0, 0.0, 0.0, 0.0
    for i in range(FILM_TERMS - 2, -1, -2):  # in pairs: half as many steps wait for each other
        pressed = pressed * left + (constants[i, 0] + u * constants[i + 1, 0])
        pulled = pulled * left + (constants[i, 1] + u * constants[i + 1, 1])
        turned = turned * left + (constants[i, 2] + u * constants[i + 1, 2])
        further = further * left + (constants[i, 3] + u * constants[i + 1, 3])
    pressed, pulled, turned = (1.0 - eps) / pressed, (1.0 + eps) / pulled, (1.0 - eps) / turned
    if eps < CENTRE_ECCENTRICITY:
        centre = 0.0
        for i in range(FILM_TERMS):
            centre += constants[i, 2]
        centre, out = 1.0 / centre, rise(eps / CENTRE_ECCENTRICITY)
        pressed = centre + (pressed - centre) * out
        pulled = centre + (pulled - centre) * out
        turned = centre + (turned - centre) * out
        further = 1.0 + (further - 1.0) * out
    return pressed, pulled, turned, further


@inline_llvm
def film_numbers_at(eps, wedge, closing, constants):
    """Return the numbers of `short_film` of a bearing of finite length, with the factor (B / D)^2.

    The short bearing's force at the angle psi from the line of centres is turned to beta, with
    tan(beta / 2) in proportion to tan(psi / 2), and enlarged by a factor that is a line in cos(psi)
    between the pressed film's and that of the one pulled apart; what the film that only turns has
    more is added about its own direction. In these three directions the numbers are exact.
    """
    normal, across = short_film(eps, wedge, closing)
    size = square_root(normal * normal + across * across)
    if not size > 0.0:
        return 0.0, 0.0
    per_size = 1.0 / size
    cosine, sine = normal * per_size, across * per_size
    pressed, pulled, turned, further = short_bearing_shares(eps, constants)
    middle, slope = 0.5 * (pressed + pulled), 0.5 * (pressed - pulled)
    # the direction of a short bearing that turns: Ocvirk's attitude
    wide, far = math.pi * square_root(1.0 - eps * eps), 4.0 * eps
    ocvirk = far / square_root(wide * wide + far * far)
    one, other = 1.0 - cosine, 1.0 - ocvirk
    near = 2.0 * one * other * (1.0 + cosine) / ((one * one + other * other) * (1.0 + ocvirk))
    size *= middle + slope * cosine + (turned - middle - slope * ocvirk) * near
    towards, away = 1.0 + cosine, further * further * (1.0 - cosine)
    size /= towards + away
    return size * (towards - away), size * 2.0 * further * sine


@inline_llvm
def film(joint, eccentricity, spins, p):
    """Return the force on the journal x, y (N), both moments (N m), and the power lost (W).

    The moments, on journal and bore, balance: both have half of that of the force pair, and the
    shear of the film (Petroff's over sqrt(1 - eps^2)) against their spin.
    """
    ex, ey, ex_rate, ey_rate = eccentricity
    pin, clearance, constants = p.pin_radius[joint], p.clearance[joint], p.film_constants[joint]
    distance = square_root(ex * ex + ey * ey)
    per_clearance, per_distance = 1.0 / clearance, 1.0 / distance if distance > 0.0 else 0.0
    nx, ny = (ex * per_distance, ey * per_distance) if distance > 0.0 else (1.0, 0.0)
    radial, across = ex_rate * nx + ey_rate * ny, ey_rate * nx - ex_rate * ny
    eps, length = bounded_eccentricity(distance * per_clearance, p.film_share), p.film_length[joint]
    size = 2.0 * length * pin**3 * p.viscosity * per_clearance * per_clearance
    journal_spin, bore_spin = spins
    near = eps * per_distance if distance > 0.0 else per_clearance
    wedge = eps * (journal_spin + bore_spin) - 2.0 * across * near  # eps w
    away, along = film_numbers_at(eps, wedge, radial * per_clearance, constants)
    normal, side = -size * away, size * along
    fx, fy = normal * nx - side * ny, normal * ny + side * nx
    shear = 2.0 * math.pi * p.viscosity * length * pin**3
    shear *= (journal_spin - bore_spin) * per_clearance / square_root(1.0 - eps * eps)
    half = 0.5 * distance * side
    lost = shear * (journal_spin - bore_spin) + half * (journal_spin + bore_spin)
    lost -= normal * radial + side * across
    return fx, fy, -shear - half, shear - half, lost
