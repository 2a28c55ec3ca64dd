"""The loads: printed numbers, corners, continuity, the segments they cut, and measured cards."""

import math

import numpy as np
import pytest
from cylinder_made import DOUBLE, MACHINE, pressures

from compressor.cases.case import Case
from compressor.physics.kinematics import exact_motion, ideal
from compressor.physics.loads import (
    card_force,
    greatest_load,
    piston_force,
    sample_segments,
    segments,
    static_load,
)
from compressor.physics.record import CARD_NODES, new_record
from compressor.solve.si_record import card_nodes, record

EXACT = {"load": "gas", "gas": {"switching": "exact"}}
GAS, SPRING = {"load": "gas"}, {"load": "spring"}


def ideal_force(p, degrees, phase):
    x, v, _ = exact_motion(math.radians(degrees), p.crank_radius, p.rod_length, p.omega)
    return press(p, phase, float(x), float(v))


def press(p, phase, x, v=0.0, deviation=0.0, rate=0.0):
    """The force on a crosshead at x that is so far from its ideal place, and so much faster."""
    return piston_force(phase, x, v, ideal(0.0, p)._replace(x=x - deviation), rate, p)


@pytest.mark.parametrize(
    ("values", "corners"),
    [
        (GAS, (38.95, 180, 294.2)),
        (EXACT, (38.886, 180, 294.003)),
        (SPRING, (84.2608, 180, 275.7392)),
    ],
)
def test_corners(values, corners):
    assert np.degrees(record(Case.from_values(values)).corners) == pytest.approx(corners, abs=5e-4)


@pytest.mark.parametrize(
    ("values", "degrees", "phase", "force"),
    [
        (GAS, 0, 0, 3086.61),
        (GAS, 100, 1, 824.67),
        (GAS, 180, 2, 824.67),
        (GAS, 330, 3, 3086.61),
        (SPRING, 0, 0, 3200),
        (SPRING, 84.2608, 0, 653.28),  # 800 N less the damper's share
        (SPRING, 120, 1, 800),
        (SPRING, 180, 2, 800),
        (SPRING, 275.7392, 2, 3346.72),
        (SPRING, 300, 3, 3200),
        ({"load": "none"}, 50, 0, 0),
        ({"load": "gas", "gas": {"back_pressure_MPa": 0.105}}, 100, 1, 0),  # on the other face
    ],
)
def test_ideal_force(values, degrees, phase, force):
    assert ideal_force(record(Case.from_values(values)), degrees, phase) == pytest.approx(
        force, abs=0.05
    )


def test_segments_cover_the_run_in_order():
    p = record(Case())
    edges, phases = segments(p, 0.48)
    assert phases.tolist() == [0, 1, 2, 3] * 4
    assert edges[0] == 0
    assert edges[-1] == 0.48
    assert (np.diff(edges) > 0).all()
    turn = np.degrees(p.omega * edges[:5])
    assert turn == pytest.approx([0, 84.2608, 180, 275.7392, 360], abs=1e-4)
    times = np.array([0.0, 0.06, 0.12, 0.47, 0.48])  # a corner's phase is that which begins
    assert phases[sample_segments(times, edges)].tolist() == [0, 2, 0, 3, 3]
    assert segments(record(Case.from_values({"load": "none"})), 0.48)[0].tolist() == [0, 0.48]


@pytest.mark.parametrize("stroke_mm", [60, 90, 120, 200])
def test_a_follower_of_any_stroke_dwells_for_it_each_way(stroke_mm):
    p = record(Case.from_values({"spring": {"stroke_mm": stroke_mm, "damping_N_s_per_mm": 0}}))
    x = [exact_motion(a, p.crank_radius, p.rod_length, p.omega)[0] for a in (0, *p.corners)]
    assert (x[0] - x[1], x[3] - x[2]) == pytest.approx((p.spring_stroke, p.spring_stroke))
    for phase, corner in enumerate([*np.degrees(p.corners), 360]):
        before, after = ideal_force(p, corner, phase), ideal_force(p, corner, (phase + 1) % 4)
        assert before == pytest.approx(after, abs=1e-8)


@pytest.mark.parametrize(
    ("values", "at_rest", "greatest"),
    [
        (GAS, 3086.61, 3086.61),
        ({"load": "gas", "gas": {"back_pressure_MPa": 1.0}}, 3086.61, 7853.98),
        (SPRING, 3200, 3200 + 0.023 * 6283.19),
        ({"load": "none"}, 0, 0),
    ],
)
def test_greatest_loads(values, at_rest, greatest):
    p = record(Case.from_values(values))
    assert static_load(p) == pytest.approx(at_rest, abs=0.01)
    assert greatest_load(p) == pytest.approx(greatest, abs=0.01)


def cylinder(**gas):
    """The record of a double-acting cylinder, with other keys of `gas`."""
    values = {key: value for key, value in (DOUBLE | gas).items() if value is not None}
    return record(Case.from_values({"load": "gas", "machine": MACHINE, "gas": values}))


HEAD_ALONE = {"action": "single", "rod_diameter_mm": None, "clearance_percent": 12}
CRANK_ALONE = {"action": "crank_end", "clearance_percent": 14}


def in_segments(p, degrees):
    """The force of the ideal machine in the phase of the segment that a crank angle lies in."""
    edges, phases = segments(p, 2 * math.pi / p.omega)
    time = np.array([math.radians(degrees) / p.omega])
    return ideal_force(p, degrees, int(phases[sample_segments(time, edges)][0]))


@pytest.mark.parametrize(
    ("gas", "head", "crank"),
    [({}, 1, 1), (HEAD_ALONE, 1, 0), (CRANK_ALONE, 0, 1), ({"unloaded": "head"}, 0.2e6, 1),
     ({"unloaded": "crank"}, 1, 0.2e6), ({**HEAD_ALONE, "unloaded": "head"}, 0.2e6, 0)],
)  # fmt: skip
def test_forces_of_both_faces(gas, head, crank):
    """1: an end's cycle, 0: the back pressure, else its constant pressure."""
    faces, p = [math.pi * 0.11**2, math.pi * (0.11**2 - 0.03**2)], cylinder(**gas)
    for degrees in np.linspace(0.5, 359.5, 30):
        cycle = zip((head, crank), pressures(degrees), strict=True)
        inside = [{0: 0.1e6, 1: 1e6 * one}.get(kind, kind) for kind, one in cycle]
        expected = faces[0] * (inside[0] - 0.1e6) - faces[1] * (inside[1] - 0.1e6)
        assert in_segments(p, degrees) == pytest.approx(expected, rel=1e-12, abs=1e-8), degrees


def test_a_cylinder_is_continuous_at_its_corners():
    p = cylinder()
    edges, phases = segments(p, 2 * math.pi / p.omega)
    assert [(int(phase) & 3, int(phase) >> 2) for phase in phases] == [
        (0, 2), (1, 2), (1, 3), (2, 0), (2, 1), (3, 1)
    ]  # fmt: skip
    for edge, before, after in zip(edges[1:], phases, [*phases[1:], phases[0]], strict=True):
        degrees = math.degrees(edge * p.omega)
        change = ideal_force(p, degrees, int(before)) - ideal_force(p, degrees, int(after))
        assert abs(change) < 1e-7


@pytest.mark.parametrize("away", [0.0, 1e-11, -1e-11])
def test_corners_that_coincide_open_one_segment(away):
    """The crank end's discharge begins where the head end's suction does."""
    p = cylinder()
    p.crank_corners[0] = p.corners[0] + away
    edges, phases = segments(p, 2 * math.pi / p.omega)
    assert phases.size == 5
    assert (np.diff(edges) > 1e-3).all()
    assert int(phases[1]) == 1 + 4 * 3


@pytest.mark.parametrize("gas", [{}, HEAD_ALONE, CRANK_ALONE, {"unloaded": "head"}])
def test_the_greatest_load_of_a_cylinder(gas):
    p = cylinder(**gas)
    most = max(abs(in_segments(p, degrees)) for degrees in np.linspace(0, 359.5, 720))
    assert most == pytest.approx(greatest_load(p), rel=1e-6)
    assert static_load(p) == greatest_load(p)


# ---- a card's curve: Akima's, closed


@pytest.mark.parametrize("count", [20, 97, 360])
def test_a_card_s_curve_is_closed(count):
    """A card that is measured from another angle on is the same curve, turned."""
    rng = np.random.default_rng(count)
    angles, values = np.sort(rng.uniform(0, 360, count)), rng.normal(size=count)
    moved = np.argsort((angles + 90) % 360)
    other = card_nodes(((angles + 90) % 360)[moved], values[moved])
    found = card_nodes(angles, values)
    np.testing.assert_allclose(other, np.roll(found, CARD_NODES // 4, axis=0), atol=1e-11)
    assert np.abs(found[:, 0]).max() > 1.0


def test_a_card_s_force_between_its_nodes():
    """Of a smooth card, to the fourth order of the table's step; continuous over 0 and 360."""
    p = new_record(featured=True)
    step = 2 * math.pi / CARD_NODES
    theta = step * np.arange(CARD_NODES)
    p.card[:, 0], p.card[:, 1] = np.sin(3 * theta), 3 * step * np.cos(3 * theta)
    for angle in np.linspace(-1, 13, 997):
        found = card_force(math.cos(angle), math.sin(angle), p)
        assert found == pytest.approx(math.sin(3 * angle), abs=81 * step**4 / 300)
