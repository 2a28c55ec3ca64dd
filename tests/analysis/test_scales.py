"""Scales known before a run, against closed forms, compiled constants and runs."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from compressor.analysis.cautions import contact_depths, greatest_force
from compressor.cases.case import Case
from compressor.metrics import JOINTS
from compressor.physics.contact_laws import Power
from compressor.solve import record, simulate
from compressor.solve.request import Stop, check_depth


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
    values = {"load": load, "machine": {"speed_rpm": speed, "gravity_m_per_s2": 9.81},
              "spring": {"damping_N_s_per_mm": 0.5}}  # fmt: skip
    case = Case.resolve(values)
    found = simulate(case)["peak_contact_force"].values
    most = [greatest_force(record(case), joint) for joint in JOINTS]
    for bound, force in zip(most, found, strict=True):
        assert force <= bound <= 3 * force
    worn = Case.resolve(values | {"joint": "both", "clearance_mm": 0.1})
    static = (np.array(most) / 1.0625e10) ** (2 / 3)  # of K delta^1.5 under that force
    assert [depth for _, depth in contact_depths(worn)] == pytest.approx(static, rel=1e-3)


@pytest.mark.parametrize(
    ("stiffness", "reason"), [(300, "penetration_implausible"), (1e15, "contact_underresolved")]
)
def test_a_journal_too_deep_is_soft_or_stepped_over(stiffness, reason):
    """No motion of the machine has the energy to go so deep into a stiff contact: a step has."""
    values = {"joint": "big_end", "clearance_mm": 0.2, "load": "gas"}
    p = record(Case.from_values({**values, "contact": {"stiffness_N_per_mm15": stiffness}}))
    with pytest.raises(Stop, match=f"^{reason}"):
        check_depth(np.array([1.38, 0.0]), p)
