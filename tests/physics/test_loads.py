"""Both loads: printed numbers, corners, continuity, and the segments they cut."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.physics.kinematics import exact_motion
from compressor.physics.loads import (
    greatest_load,
    piston_force,
    sample_segments,
    segments,
    static_load,
)
from compressor.solve.si_record import record

EXACT = {"load": "gas", "gas": {"switching": "exact"}}
GAS, SPRING = {"load": "gas"}, {"load": "spring"}


def ideal_force(p, degrees, phase):
    x, v, _ = exact_motion(math.radians(degrees), p.crank_radius, p.rod_length, p.omega)
    return piston_force(phase, float(x), float(v), 0.0, 0.0, p)


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
    ],
)
def test_ideal_force(values, degrees, phase, force):
    assert ideal_force(record(Case.from_values(values)), degrees, phase) == pytest.approx(
        force, abs=0.05
    )


def test_undamped_spring_is_continuous_at_its_corners():
    p = record(Case.from_values({"spring": {"damping_N_s_per_mm": 0}}))
    for phase, corner in enumerate([*np.degrees(p.corners), 360]):
        before, after = ideal_force(p, corner, phase), ideal_force(p, corner, (phase + 1) % 4)
        assert before == pytest.approx(after, abs=1e-9)


def test_gas_is_continuous_at_exact_corners_only():
    exact, printed = (record(Case.from_values(values)) for values in (EXACT, GAS))
    jumps = []
    for p in (exact, printed):
        corner = np.degrees(p.corners[2])
        jumps.append(abs(ideal_force(p, corner, 2) - ideal_force(p, corner, 3)))
    assert jumps[0] < 1e-8
    assert 10 < jumps[1] < 100


def test_back_pressure_acts_on_the_other_face():
    p = record(Case.from_values({"load": "gas", "gas": {"back_pressure_MPa": 0.105}}))
    assert ideal_force(p, 100, 1) == pytest.approx(0, abs=1e-9)


def test_spring_follows_the_actual_motion():
    p = record(Case())
    rising = piston_force(1, 0.6, -1.0, 1e-4, 0.5, p) - piston_force(1, 0.6, -1.0, 0.0, 0.0, p)
    assert rising == pytest.approx(20e3 * 1e-4 + 23 * 0.5)
    moving = piston_force(0, 0.7, -1.0, 0.0, 0.0, p) - piston_force(0, 0.69, -2.0, 0.0, 0.0, p)
    assert moving == pytest.approx(20e3 * 0.01 + 23)


def test_segments_cover_the_run_in_order():
    p = record(Case())
    edges, phases = segments(p, 0.48)
    assert phases.tolist() == [0, 1, 2, 3] * 4
    assert edges[0] == 0
    assert edges[-1] == 0.48
    assert (np.diff(edges) > 0).all()
    assert np.degrees(p.omega * edges[:5]) == pytest.approx(
        [0, 84.2608, 180, 275.7392, 360], abs=1e-4
    )


@pytest.mark.parametrize("stroke_mm", [60, 90, 200])
def test_a_follower_of_any_stroke_dwells_for_it_each_way(stroke_mm):
    p = record(Case.from_values({"spring": {"stroke_mm": stroke_mm, "damping_N_s_per_mm": 0}}))
    x = [exact_motion(a, p.crank_radius, p.rod_length, p.omega)[0] for a in (0, *p.corners)]
    assert (x[0] - x[1], x[3] - x[2]) == pytest.approx((p.spring_stroke, p.spring_stroke))
    for phase, corner in enumerate([*np.degrees(p.corners), 360]):
        before, after = ideal_force(p, corner, phase), ideal_force(p, corner, (phase + 1) % 4)
        assert before == pytest.approx(after, abs=1e-8)


def test_no_load_has_no_corners():
    assert segments(record(Case.from_values({"load": "none"})), 0.48)[0].tolist() == [0, 0.48]


def test_a_sample_on_a_corner_takes_the_phase_that_begins():
    edges, phases = segments(record(Case()), 0.48)
    times = np.array([0.0, 0.06, 0.12, 0.47, 0.48])
    assert phases[sample_segments(times, edges)].tolist() == [0, 2, 0, 3, 3]


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
