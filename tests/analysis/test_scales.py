"""Scales known before a run, against closed forms, compiled constants and runs."""

import numpy as np
import pytest
from random_cases import strangers
from scipy.integrate import solve_ivp

from compressor.analysis.cautions import contact_depths, greatest_force
from compressor.cases.case import Case
from compressor.metrics import JOINTS
from compressor.physics.contact_laws import Power
from compressor.solve.request import Stop, check_depth
from compressor.solve.run import run_at_tolerance
from compressor.solve.si_record import record
from compressor.solve.simulate import simulate


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_contact_time_of_any_exponent(exponent):
    """The bounce of a mass on K delta^p, integrated."""
    mass, speed, stiffness = 2.0, 0.5, 1e9
    contact = Power(stiffness, exponent)
    depth = contact.impact_depth(mass, speed)

    def leaves(t, y):
        return y[0] if t > 0 else 1.0

    leaves.terminal = True
    found = solve_ivp(
        lambda t, y: [y[1], -stiffness * max(y[0], 0.0) ** exponent / mass],
        (0, 1), [0.0, speed], events=leaves, rtol=1e-10, atol=1e-15, max_step=1e-3,
    )  # fmt: skip
    assert found.y[0].max() <= depth * (1 + 1e-9)
    assert found.t[-1] == pytest.approx(contact.impact_time(depth, speed), rel=1e-6)


@pytest.mark.parametrize("load", ["spring", "gas", "none"])
@pytest.mark.parametrize("speed", [200, 2000])
def test_the_greatest_force_bounds_the_ideal_machine_s(load, speed):
    values = {"load": load, "machine": {"speed_rpm": speed, "gravity_m_per_s2": 9.81}}
    case = Case.resolve(values | {"spring": {"damping_N_s_per_mm": 0.5}})
    found = simulate(case)["peak_contact_force"].values
    for joint, force in zip(JOINTS, found, strict=True):
        assert force <= greatest_force(record(case), joint) <= 3 * force


def test_the_ideal_machine_has_no_scales():
    case = Case.resolve({"joint": "both", "clearance_mm": 0})
    assert list(contact_depths(case)) == []


@pytest.fixture(scope="module")
def runs():
    """Random cases at two tolerances, and how they ended."""
    found = []
    for values in strangers(2021, 30):
        for rtol in (1e-4, 1e-7):
            solve = {"rtol": rtol, "duration_rev": 2, "settle_rev": 0}
            case = Case.resolve({**values, "solve": solve})
            found.append((case, run_at_tolerance(case, case.rtol, 600, False).trajectory))
    return found


def test_penetration_of_random_cases(runs):
    """The deepest contact of a run, by the static penetration under the greatest force."""
    ratios = np.array([
        run.tally.deepest.max() / max(depth for _, depth in contact_depths(case))
        for case, run in runs
    ])  # fmt: skip
    assert ((ratios > 0.5) & (ratios < 2)).mean() >= 0.9


@pytest.mark.parametrize(
    ("stiffness", "reason"), [(300, "penetration_implausible"), (1e15, "contact_underresolved")]
)
def test_a_journal_too_deep_is_soft_or_stepped_over(stiffness, reason):
    """No motion of the machine has the energy to go so deep into a stiff contact: a step has."""
    values = {"joint": "big_end", "clearance_mm": 0.2, "load": "gas"}
    p = record(Case.from_values({**values, "contact": {"stiffness_N_per_mm15": stiffness}}))
    with pytest.raises(Stop, match=f"^{reason}"):
        check_depth(np.array([1.38, 0.0]), p)
