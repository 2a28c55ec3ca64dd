"""The oil film: Reynolds' equation, Butenschoen's tables, limits, symmetry and smoothness."""

import functools
import math

import numpy as np
import pytest
from published import BEARING

from compressor.cases.case import Case
from compressor.physics import FILM_TERMS
from compressor.physics.film import film, film_numbers_at, short_film
from compressor.solve.bearing import film_constants, reynolds
from compressor.solve.si_record import record

CLEARANCE = 5e-5  # m
SPEED = 60.0  # rad/s
# eccentricity, and the greatest error (%) in all directions: of the force where the film is
# pressed, of the force of turning alone where it is pulled apart; the page has the greatest of all
DIRECTIONS = ((0.1, 7.9, 8.0), (0.3, 5.5, 5.5), (0.6, 2.6, 2.5), (0.9, 0.5, 1.3), (0.97, 0.4, 4.1))


@functools.cache  # its constants take a second, which collecting the tests need not wait for
def record_of(ratio=1.0, share=0.02):
    lubricant = {"bearing_length_mm": 20 * ratio, "last_share": share}
    values = {"joint": "big_end", "clearance_mm": 1000 * CLEARANCE, "lubricant": lubricant}
    return record(Case.from_values(values))


def force(e, rate=(0.0, 0.0), spins=(SPEED, 0.0), p=None):
    return np.array(film(0, (*e, *rate), spins, record_of() if p is None else p))


@pytest.mark.parametrize(("ratio", "eps", "number", "angle"), BEARING)
def test_numbers_are_those_of_the_tables(ratio, eps, number, angle):
    """To 0.4 %, which is how far the tables are from finer grids; angles to a tenth of a degree."""
    ours = film_numbers_at(eps, 1.0, 0.0, film_constants(ratio, 0.02)[0])
    found = reynolds(eps, ratio)
    assert eps * math.hypot(*found) == pytest.approx(number, rel=4e-3)
    assert math.hypot(*ours) == pytest.approx(math.hypot(*found), rel=1.5e-3)
    if angle:
        for one, within in ((found, 0.1), (ours, 0.1 if eps > 0.1 else 0.4)):
            assert math.degrees(math.atan2(one[1], one[0])) == pytest.approx(angle, abs=within)


def test_a_film_is_reynolds_at_the_polynomials_own_places():
    """Turned, pressed and pulled apart; near the centre the film is made to resist alike."""
    share, ratio = 0.02, 0.5
    constants, stiffest = film_constants(ratio, share)
    assert stiffest == pytest.approx(film_numbers_at(1 - 0.5 * share, 0.0, 1.0, constants)[0])
    nodes = np.cos(np.pi * (np.arange(FILM_TERMS) + 0.5) / FILM_TERMS)
    least = math.sqrt(0.5 * share)
    places = 1.0 - (least + 0.5 * (1.0 - least) * (nodes + 1.0)) ** 2
    for eps in places[places > 0.2].tolist():
        for wedge, closing in ((1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
            exact = reynolds(eps, ratio, wedge, closing)
            found = np.array(film_numbers_at(eps, wedge, closing, constants))
            assert np.linalg.norm(found - exact) < 1e-12 * np.linalg.norm(exact)


def test_at_the_centre_the_film_resists_alike_in_all_directions():
    for angle in np.linspace(0.0, 6.0, 9):
        rate = 0.01 * np.array([math.cos(angle), math.sin(angle)])
        fx, fy = force((1e-12, 0.0), rate, (0.0, 0.0))[:2]
        straight = force((0.0, 0.0), rate, (0.0, 0.0))[:2]
        assert np.array([fx, fy]) == pytest.approx(straight, rel=1e-6)
        against = -math.hypot(fx, fy) / 0.01
        assert np.array([fx, fy]) == pytest.approx(against * rate, rel=1e-6, abs=1e-9)


def test_a_mirrored_bearing_is_pressed_alike_moments_balance_and_the_loss_is_what_is_put_in():
    rng = np.random.default_rng(5)
    for _ in range(20):
        e, rate = rng.normal(size=2) * 2e-5, rng.normal(size=2) * 0.01
        spins = rng.normal(size=2) * 50
        fx, fy, journal, bore, lost = force(e, rate, spins)
        other = force((e[0], -e[1]), (rate[0], -rate[1]), -spins)
        assert other == pytest.approx([fx, -fy, -journal, -bore, lost], rel=1e-9, abs=1e-9)
        assert journal + bore + e[0] * fy - e[1] * fx == pytest.approx(0.0, abs=1e-9)
        put_in = fx * rate[0] + fy * rate[1] + journal * spins[0] + bore * spins[1]
        assert lost == pytest.approx(-put_in, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("begin", "end"),
    [((0.9, 0.0), (1.1, 0.0)), ((-0.1, 0.0), (0.1, 0.0)), ((0.3, -0.3), (0.3, 0.3))],
    ids=["hand-over", "centre", "beside"],
)
def test_forces_are_smooth_in_the_place(begin, end):
    """Slopes on either side of each point differ as little as neighbours of a smooth curve do."""
    steps, worst = 4000, 0.0
    path = np.linspace(begin, end, steps + 1) * CLEARANCE
    found = np.array([force(e, (0.002, -0.003))[:2] for e in path])
    slopes = np.diff(found, axis=0)
    worst = np.abs(np.diff(slopes, axis=0)).max()
    assert worst < 0.02 * np.abs(slopes).max()


def test_beyond_the_wall_the_film_stays_what_it_is_in_the_middle_of_its_last_share():
    """So that film and dry contact together never bear less for being pressed deeper."""
    p, pin = record_of(), record_of()["pin_radius"][0]
    unit = p["viscosity"] * p["film_length"][0] * 2 * pin * (pin / CLEARANCE) ** 2
    exact = unit * SPEED * 0.99 * math.hypot(*reynolds(0.99, 1.0))
    assert math.hypot(*force((CLEARANCE, 0.0))[:2]) == pytest.approx(exact, rel=5e-3)
    for radial, turning in ((0.0, 0.0), (0.01, 0.0), (-0.01, 400.0)):
        found = [
            force((depth * CLEARANCE, 0.0), (radial, turning * depth * CLEARANCE))[:2]
            for depth in (1.0, 1.000001, 1.01, 1.1)
        ]
        np.testing.assert_allclose(found, found[:1] * len(found), rtol=1e-9)


def test_a_short_bearing_that_turns_and_is_squeezed_is_the_closed_form():
    """In all directions: Reynolds' equation of a bearing that is a hundredth as long as wide."""
    for eps in (0.2, 0.9):
        for angle in np.arange(0.0, 6.2, 0.4):
            turning, squeeze = math.cos(angle), math.sin(angle)
            exact = reynolds(eps, 0.01, turning, squeeze) * 1e4
            found = np.array(short_film(eps, turning, squeeze))
            assert np.linalg.norm(found - exact) < 0.02 * np.linalg.norm(exact), (eps, angle)


@pytest.mark.parametrize(("eps", "pressed", "apart"), DIRECTIONS)
def test_the_film_in_all_directions_is_near_to_reynolds(eps, pressed, apart):
    """Relative where it is pressed; where it is pulled apart, of the force of turning alone."""
    errors = [], []
    for ratio in (0.25, 1.0):
        p, turning = record_of(ratio), np.linalg.norm(reynolds(eps, ratio, 1.0, 0.0))
        size_of_force = 2.0 * p["film_length"][0] * p["pin_radius"][0] ** 3 * p["viscosity"]
        for angle in np.radians([*np.arange(0.0, 360.0, 22.5), 350.0, 355.0, 357.5]):
            wedge, closing = math.cos(angle), math.sin(angle)
            rate = (closing * CLEARANCE, 0.0)
            fx, fy = force((eps * CLEARANCE, 0.0), rate, (wedge / eps, 0.0), p)[:2]
            ours = np.array([-fx, fy]) * CLEARANCE**2 / size_of_force
            exact = reynolds(eps, ratio, wedge, closing)
            back = int(angle > 3.15)
            size = turning if back else np.linalg.norm(exact)
            errors[back].append(100.0 * np.linalg.norm(ours - exact) / size)
    assert [max(of) for of in errors] == pytest.approx([pressed, apart], abs=0.1)
