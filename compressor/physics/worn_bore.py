"""Contact of a journal with a bore that wear has made out of round, and what its sliding wears off.

A bore is divided by angle into sectors, and w is what was worn off it at each node between them.
In the direction u of a node the journal's circle overlaps the bore by o = e u - c - w (e: the
eccentricity in the rod's frame, c: the clearance). Overlap spreads over an arc, as in an elastic
foundation, and its energy is the integral S of o^2 over the angle. The penetration is that of an
unworn bore with the same S, and the contact law gives the force at it. So every law works
on every bore, an unworn one meets it by its own, and Hertz's exponent 3/2 is the foundation itself.

Forces follow from the energy: those of the bore pass through the journal's centre, in the direction
of the gradient of the penetration. physics/README.md, Worn bores.
"""

import math

import numpy as np

from compressor.physics._jit import jit, square_root
from compressor.physics.contact import ContactState, friction_coefficient
from compressor.physics.contact_laws import in_contact, normal_force
from compressor.physics.record import MAX_SECTORS

FULL = 16.0 * math.sqrt(2.0) / 15.0  # S = FULL c^2 x^(5/2) (1 + ...) at a small depth x = delta / c
SERIES = np.array(
    [1.0, -13 / 28, 73 / 224, -7565 / 29568, 186335 / 878592, -212835 / 1171456,
     2305295 / 14483456, -12001985 / 84672512]
)  # fmt: skip
MAX_SERIES_DEPTH = 0.03  # x up to which the series is exact, and from which on the closed form is
NEWTON_ROUNDS, NEWTON_TOLERANCE = 20, 1e-15  # of Newton's method, which has 3 to 5


def bore_fields(sectors: int) -> dict:
    """Return the fields of a record for unworn bores of so many sectors, at most `MAX_SECTORS`.

    Directions are longer than 1 by what the straight lines between two nodes are short of.
    """
    width = 2.0 * math.pi / sectors
    angles = width * np.arange(sectors)
    towards = np.zeros((MAX_SECTORS, 2))
    towards[:sectors] = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    longer = 1.0 + width**2 / 12.0
    return {"sectors": sectors, "sector": width, "towards": longer * towards}


@jit
def unworn_energy(depth, clearance):
    """Return S (m^2) of an unworn bore at a penetration (m), and its derivative (m)."""
    x = depth / clearance
    if x < MAX_SERIES_DEPTH:
        total, slope = 0.0, 0.0
        for k in range(SERIES.size - 1, -1, -1):
            total = total * x + SERIES[k]
            slope = slope * x + (2.5 + k) * SERIES[k]
        root = FULL * clearance * clearance * x * square_root(x)
        return root * x * total, root * slope / clearance
    e = 1.0 + x
    chord = square_root(x * (2.0 + x))  # e sin(eps), where cos(eps) = 1 / e
    eps = math.atan2(chord, 1.0)
    area = e * e * eps - 3.0 * chord + 2.0 * eps
    return clearance * clearance * area, clearance * 2.0 * (e * eps - chord / e)


@jit
def depth_of(energy, clearance):
    """Return the penetration (m) of an unworn bore whose S is `energy` (m^2), and dS by it (m)."""
    depth = clearance * (energy / (FULL * clearance * clearance)) ** 0.4
    slope = 0.0
    for _ in range(NEWTON_ROUNDS):
        reached, slope = unworn_energy(depth, clearance)
        change = (energy - reached) / slope
        depth += change
        if abs(change) <= NEWTON_TOLERANCE * depth:
            break
    return depth, slope


@jit
def write_overlaps(ex, ey, joint, p, overlap):
    """Write the overlap (m) at each node, and return the greatest.

    ex, ey: eccentricity in the frame of the rod's bore (m).
    """
    deepest = -math.inf
    for i in range(p.sectors):
        depth = p.towards[i, 0] * ex + p.towards[i, 1] * ey - p.clearance[joint] - p.worn[joint, i]
        overlap[i] = depth
        deepest = max(deepest, depth)
    return deepest


@jit
def foundation(overlap, p):
    """Return S (m^2) of overlaps that are straight lines between nodes, and its gradient (m)."""
    energy, gx, gy = 0.0, 0.0, 0.0
    for i in range(p.sectors):
        j = i + 1 if i + 1 < p.sectors else 0
        a, b = overlap[i], overlap[j]
        if a <= 0.0 and b <= 0.0:
            continue
        if a >= 0.0 and b >= 0.0:
            energy += (a * a + a * b + b * b) / 3.0
            by_a, by_b = (2.0 * a + b) / 3.0, (a + 2.0 * b) / 3.0
        else:
            high, low = max(a, b), min(a, b)
            share = high / (high - low)  # of the sector, that overlaps
            energy += high * high * share / 3.0
            by_high, by_low = high * share * (3.0 - share) / 3.0, high * share * share / 3.0
            by_a, by_b = (by_high, by_low) if a > b else (by_low, by_high)
        gx += by_a * p.towards[i, 0] + by_b * p.towards[j, 0]
        gy += by_a * p.towards[i, 1] + by_b * p.towards[j, 1]
    return energy * p.sector, gx * p.sector, gy * p.sector


@jit
def nearest_wall(overlap, deepest, p):
    """Return the direction of the nearest place on the bore: a parabola's vertex."""
    i = 0
    while overlap[i] < deepest:
        i += 1
    before = p.sectors - 1 if i == 0 else i - 1
    after = 0 if i == p.sectors - 1 else i + 1
    bend = 2.0 * deepest - overlap[before] - overlap[after]
    aside = 0.25 * (overlap[after] - overlap[before]) / bend if bend > 0.0 else 0.0
    x = p.towards[i, 0] + aside * (p.towards[after, 0] - p.towards[before, 0])
    y = p.towards[i, 1] + aside * (p.towards[after, 1] - p.towards[before, 1])
    size = square_root(x * x + y * y)
    return x / size, y / size


@jit
def penetration_of(ex, ey, joint, p):
    """Return the penetration (m) of a journal and its gradient in the rod's frame.

    The penetration is negative in a gap.
    """
    overlap = np.empty(p.sectors)
    deepest = write_overlaps(ex, ey, joint, p, overlap)
    if deepest <= 0.0:
        gx, gy = nearest_wall(overlap, deepest, p)
        return deepest, gx, gy
    energy, gx, gy = foundation(overlap, p)
    depth, slope = depth_of(energy, p.clearance[joint])
    return depth, gx / slope, gy / slope


@jit
def in_rod_frame(eccentricity, axes, rod_spin):
    """Return the eccentricity (m) and its rate (m/s) in the frame of the rod's bore.

    x, y, and their rates.
    """
    c, s = axes
    ex, ey = c * eccentricity[0] + s * eccentricity[1], c * eccentricity[1] - s * eccentricity[0]
    vx = c * eccentricity[2] + s * eccentricity[3] + rod_spin * ey
    return ex, ey, vx, c * eccentricity[3] - s * eccentricity[2] - rod_spin * ex


@jit
def contact_at_wall(joint, contact, eccentricity, axes, rod_spin, p):
    """Return a contact with the nearest wall's overlap (m) for penetration, and its rate.

    Both meet a wall at the speed at which its overlap begins. The penetration's own rate has a jump
    there: how fast an arc of contact grows depends on how it is curved.
    """
    ex, ey, vx, vy = in_rod_frame(eccentricity, axes, rod_spin)
    overlap = np.empty(p.sectors)
    deepest = write_overlaps(ex, ey, joint, p, overlap)
    x, y = nearest_wall(overlap, deepest, p)
    return ContactState(
        contact.fx, contact.fy, contact.moment, contact.normal, contact.friction, deepest,
        x * vx + y * vy, contact.slip, contact.elastic, contact.unclamped, contact.film_moment,
        contact.film_loss,
    )  # fmt: skip


@jit
def worn_contact(joint, eccentricity, axes, spins, carried, p):
    """Return `ContactState` between a joint's journal and its worn bore.

    eccentricity: journal centre minus bore centre, x and y (m), and its rate (m/s); axes: cosine
    and sine of the bore's angle, counter-clockwise; spins of journal and rod (rad/s); carried: as
    by `contact.carried_numbers`.
    """
    journal_spin, rod_spin = spins
    ex, ey, vx, vy = in_rod_frame(eccentricity, axes, rod_spin)
    penetration, gx, gy = penetration_of(ex, ey, joint, p)
    size = square_root(gx * gx + gy * gy)
    nx, ny = gx / size, gy / size
    rate = gx * vx + gy * vy
    arm = p.pin_radius[joint] - penetration
    bore = nx * ex + ny * ey + arm
    slip = nx * vy - ny * vx + (journal_spin - rod_spin) * arm
    approach, bristle = carried
    normal, elastic, unclamped = normal_force(
        penetration, rate, approach, p.stiffness[joint], p.clearance[joint], p
    )
    friction = 0.0
    if p.friction and in_contact(normal):
        friction = -friction_coefficient(slip, bristle, p) * normal * size
    fx, fy = normal * gx + friction * ny, normal * gy - friction * nx
    moment = normal * (ex * gy - ey * gx) - bore * friction
    c, s = axes
    return ContactState(
        c * fx - s * fy, s * fx + c * fy, moment, normal, friction, penetration, rate, slip,
        elastic, unclamped, 0.0, 0.0,
    )  # fmt: skip


@jit
def wear_off(joint, contact, eccentricity, axes, weight, p, tally):
    """Add the work of a contact's pressing and sliding, N |v| times `weight` (s), to the tally.

    By node, as the foundation presses; eccentricity, axes: as for `worn_contact`.
    """
    ex, ey, _, _ = in_rod_frame(eccentricity, axes, 0.0)
    overlap = np.empty(p.sectors)
    if write_overlaps(ex, ey, joint, p, overlap) <= 0.0 or not in_contact(contact.normal):
        return
    pressing = contact.fx**2 + contact.fy**2 - contact.friction**2
    work = weight * square_root(max(pressing, 0.0)) * abs(contact.slip)
    total = 0.0
    for i in range(p.sectors):
        total += max(overlap[i], 0.0)
    tally.slid[joint] += work
    for i in range(p.sectors):
        tally.worn[joint, i] += work * max(overlap[i], 0.0) / total
