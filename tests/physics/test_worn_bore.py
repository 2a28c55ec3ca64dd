"""Worn bores: forces follow from the energy, round ones are met as ever, and wear adds up."""

import math
from dataclasses import replace

import numpy as np
import pytest
from published import COEFFICIENT, lobes, uneven
from scipy.integrate import quad, solve_ivp
from scipy.optimize import minimize_scalar

from compressor.cases.case import Case
from compressor.cases.optional_groups import Drive
from compressor.physics import FLOWS, derivative_with_flows, state_names
from compressor.physics.mechanism_rows import contact_at
from compressor.physics.record import BIG_END
from compressor.physics.worn_bore import (
    depth_of,
    penetration_of,
    unworn_energy,
    worn_contact,
    write_overlaps,
)
from compressor.solve.attempts import build_request, integrate, times_of
from compressor.solve.error_bars import energy_residual
from compressor.solve.run_metrics import metrics
from compressor.solve.si_record import initial_state, record

C = 2e-4  # m
WEAR = {"joint": "both", "clearance_mm": 0.2, "wear": True}


def made(worn=0.0, sectors=72, **values):
    """A record whose bores are worn by numbers (m) or by functions of the angle."""
    angles = 2 * math.pi / sectors * np.arange(sectors)
    depth = worn(angles) if callable(worn) else np.full(sectors, worn)
    case = Case.resolve(WEAR | values)
    return case, record(case, np.array([depth, depth]))


@pytest.mark.parametrize("x", [1e-6, 1e-3, 0.02, 0.0299, 0.0301, 0.3, 1.0, 4.0])
def test_the_foundation_of_a_round_bore(x):
    """S is the integral of the overlap squared, and its inverse gives the penetration back."""
    end = math.acos(1.0 / (1.0 + x))
    area, _ = quad(lambda b: ((1 + x) * math.cos(b) - 1) ** 2, 0, end, epsabs=0, epsrel=1e-10)
    energy, slope = unworn_energy(x * C, C)
    assert energy == pytest.approx(2 * area * C**2, rel=1e-7)
    depth, again = depth_of(energy, C)
    assert depth == pytest.approx(x * C, rel=1e-12)
    assert again == pytest.approx(slope, rel=1e-12)
    more, less = (unworn_energy(x * C * (1 + shift), C)[0] for shift in (1e-5, -1e-5))
    assert (more - less) / (2e-5 * x * C) == pytest.approx(slope, rel=1e-8)


@pytest.mark.parametrize("depth", [4e-6, 5e-5])
def test_an_unworn_bore_is_a_round_one_as_sectors_grow(depth):
    """The penetration is |e| - c; errors fall with at least the square of the sector."""
    errors = []
    for sectors in (45, 90, 180):
        _, p = made(sectors=sectors)
        found = [
            penetration_of((C + depth) * math.cos(b), (C + depth) * math.sin(b), BIG_END, p)
            for b in np.linspace(0, 0.5, 101)
        ]
        errors.append(max(abs(one[0] / depth - 1) for one in found))
    assert errors[2] < 3e-3
    assert errors[0] / errors[2] > 13.0


def test_a_gap_is_told_in_the_direction_of_the_nearest_wall():
    _, p = made(lobes)
    gap, gx, gy = penetration_of(1e-4 * math.cos(2.0), 1e-4 * math.sin(2.0), BIG_END, p)
    every = np.empty(72)
    assert (
        write_overlaps(1e-4 * math.cos(2.0), 1e-4 * math.sin(2.0), BIG_END, p, every) == gap < 0.0
    )
    assert math.hypot(gx, gy) == pytest.approx(1.0, abs=1e-3)
    toward = math.atan2(gy, gx)
    assert toward == pytest.approx(2 * math.pi / 72 * every.argmax(), abs=math.pi / 72)
    nearest = minimize_scalar(
        lambda b: C + lobes(b) - 1e-4 * math.cos(b - 2.0), (toward - 0.2, toward + 0.2)
    )
    assert toward == pytest.approx(nearest.x, abs=2e-3)


def test_an_evenly_worn_bore_is_a_greater_clearance_on_the_same_foundation():
    """Hertz's stiffness falls with the root of the clearance, as Eq. 15 has it inside a bore."""
    more, depth = 1e-4, 1e-6
    _, p = made(more, sectors=180)
    found = []
    for b in np.linspace(0.0, 2 * math.pi / 180, 40):
        e = C + more + depth
        found.append(penetration_of(e * math.cos(b), e * math.sin(b), BIG_END, p)[0])
    energy = (np.mean(found) / depth) ** 2.5  # elastic energy over that of the same penetration
    assert energy == pytest.approx(math.sqrt(C / (C + more)), rel=5e-3)


@pytest.mark.parametrize("place", [(2.3e-4, 1.9e-4), (-2.5e-4, 0.3e-4), (0.5e-4, -2.5e-4)])
def test_force_and_moment_are_those_of_the_energy(place):
    """Force on the rod: the energy's slope along the eccentricity; moment: minus that by its turn.

    By a central difference of the penetration, at a bore that is turned by any angle.
    """
    _, p = made(lobes, friction=False)
    turned, step = 0.7, 1e-9

    def depth(ex, ey, angle):
        c, s = math.cos(angle), math.sin(angle)
        return penetration_of(c * ex + s * ey, c * ey - s * ex, BIG_END, p)[0]

    ex, ey = place
    axes = math.cos(turned), math.sin(turned)
    found = worn_contact(BIG_END, (ex, ey, 0.0, 0.0), axes, (0.0, 0.0), (0.0, 0.0), p)
    assert found.normal > 100.0
    by_x = (depth(ex + step, ey, turned) - depth(ex - step, ey, turned)) / (2 * step)
    by_y = (depth(ex, ey + step, turned) - depth(ex, ey - step, turned)) / (2 * step)
    by_turn = (depth(ex, ey, turned + 1e-5) - depth(ex, ey, turned - 1e-5)) / 2e-5
    assert found.fx == pytest.approx(found.normal * by_x, rel=1e-6)
    assert found.fy == pytest.approx(found.normal * by_y, rel=1e-6)
    assert found.moment == pytest.approx(-found.normal * by_turn, rel=1e-5)
    moved = worn_contact(BIG_END, (ex, ey, 0.03, -0.02), axes, (0.0, 5.0), (0.0, 0.0), p)
    assert moved.rate == pytest.approx(0.03 * by_x - 0.02 * by_y + 5.0 * by_turn, rel=1e-6)


def test_a_groove_of_the_journals_own_shape_holds_it_on_both_sides():
    """In a round bore a journal that is pushed aside rolls on; in its own groove it is pushed back.

    The groove is what the journal has worn where it stood; the two differ in the stiffness across.
    """
    stood = C + 4e-5

    def groove(angles):
        return np.maximum(stood * np.cos(angles) - C, 0.0)

    across = []
    for worn in (0.0, groove):
        _, p = made(worn, friction=False)
        e = stood + 2e-5 if worn else C + 2e-5
        hands = (0.0, 0.0), (0.0, 0.0)
        found = worn_contact(BIG_END, (e, 1e-6, 0.0, 0.0), (1.0, 0.0), *hands, p)
        across.append(found.fy / found.fx * e / 1e-6)  # 1: straight from the centre
    assert across[0] == pytest.approx(1.0, abs=0.01)
    assert across[1] > 2.0


@pytest.mark.parametrize("features", [
    {"rod": True, "drive": True}, {"contact": {"law": "flores", "restitution": 0.8}},
])  # fmt: skip
def test_runs_on_worn_bores_keep_their_energy_and_agree(features):
    """With an elastic rod, too, whose end turns the bore; explicit, stiff and SciPy's."""
    runs = []
    onsets = "contact" in features  # on which LSODA does not stop
    for method in ("TSIT5", "RODAS", "DOPRI5" if onsets else "LSODA"):
        case, p = made(lobes, **features, solve={"duration_rev": 0.1, "settle_rev": 0,
                                                 "method": method, "rtol": 1e-8})  # fmt: skip
        run = integrate(build_request(case, 1e-8, p, times_of(case, False)))
        assert not run.reason
        assert energy_residual(run.tally) < 2e-5
        runs.append((metrics(p, run.tally), run.tally))
    first, tally = runs[0]
    for other, sums in runs[1:]:
        assert other["rms_acceleration"] == pytest.approx(first["rms_acceleration"], rel=1e-5)
        assert sums["slid"] == pytest.approx(tally["slid"], rel=1e-5)
        assert sums["worn"] == pytest.approx(tally["worn"], rel=1e-3, abs=1e-4 * tally["slid"][0])


@pytest.mark.parametrize("joint", ["big_end", "small_end"])
def test_what_slides_is_what_friction_takes_over_its_coefficient(joint):
    """The sum over all sectors is that over time, to 1e-6, by the ledger's own quadrature."""
    case, p = uneven(joint)
    tally = integrate(build_request(case, case.rtol, p, times_of(case, False))).tally
    here = 0 if joint == "big_end" else 1
    assert tally["slid"][here] == pytest.approx(tally["friction_loss"] / COEFFICIENT, rel=1e-6)
    assert tally["worn"][here].sum() == pytest.approx(tally["slid"][here], rel=1e-12)
    assert not tally["slid"][1 - here]
    assert not tally["worn"][1 - here].any()


def test_what_slides_is_told_in_time_where_the_speed_gives_way():
    """With a light flywheel: the ledger is of time, too, while steps are of the crank's angle."""
    case, _ = uneven("big_end")
    case = replace(case, drive=Drive(flywheel_kg_m2=0.5), wear=None)
    p = record(case, np.zeros((2, 72)))
    tally = integrate(build_request(case, case.rtol, p, times_of(case, False))).tally
    assert tally["slid"][0] == pytest.approx(tally["friction_loss"] / COEFFICIENT, rel=1e-6)


def test_what_slides_is_found_by_another_integrator_and_quadrature():
    """SciPy's DOP853, with the integral of N |v| as one more unknown."""
    case, p = made(lobes, joint="small_end", load="none",
                   solve={"duration_rev": 0.25, "settle_rev": 0, "rtol": 1e-10})  # fmt: skip
    ours = integrate(build_request(case, 1e-10, p, times_of(case, False))).tally
    start, n = initial_state(case, p), len(state_names(p))
    out = np.empty(n + FLOWS)

    def rates(t, z):
        derivative_with_flows(t, np.append(z[:n], np.zeros(FLOWS)), 0, p, out)
        found = contact_at(1, t, np.ascontiguousarray(z[:n]), 0, p)
        pressing = math.sqrt(max(found.fx**2 + found.fy**2 - found.friction**2, 0.0))
        return np.append(out[:n], pressing * abs(found.slip))

    end = case.duration
    theirs = solve_ivp(rates, (0, end), np.append(start, 0.0), "DOP853", rtol=1e-11, atol=1e-13)
    assert ours["slid"][1] == pytest.approx(theirs.y[n, -1], rel=1e-6)
