"""The energy audit: what it lets pass, what is repeated tighter, what fails by its name."""

import numpy as np
import pytest
from test_rod_load import FLIES

from compressor.cases.case import Case
from compressor.metrics import METRICS
from compressor.solve import run as run_module
from compressor.solve.run_metrics import MAX_AUDIT_REPEATS, allowed_residual, energy_residual
from compressor.solve.simulate import measure, simulate

SHORT = {"duration_rev": 0.5, "settle_rev": 0}
BIG_END = {"joint": "big_end", "clearance_mm": 0.2}


def case(**solve):
    return Case.from_values({**BIG_END, "solve": SHORT | solve})


@pytest.fixture
def unbalance(monkeypatch):
    """Runs with an energy imbalance of so many times what their case allows."""
    asked = []
    original = run_module.integrate

    def made(*times):
        def run(request):
            found = original(request)
            if request.rtol <= 1e-5 * (1 + 1e-9):  # the bars' own run apart
                factor = times[min(len(asked), len(times) - 1)]
                asked.append(request.rtol)
                ratio = factor * allowed_residual(1e-5, 0.5) / energy_residual(found.tally)
                found.tally.worst_imbalance *= ratio
            return found

        monkeypatch.setattr(run_module, "integrate", run)
        return asked

    return made


@pytest.mark.parametrize("damping", [5000, 20000])
def test_a_heavily_damped_contact_balances_as_tightly_as_its_steps(damping):
    """Its force is held at 0 for long, while its spring gives its energy up: nothing is moved."""
    values = {
        "joint": "small_end", "clearance_mm": 0.3, "load": "gas", "machine": FLIES["machine"],
        "contact": {"damping_N_s_per_mm": damping}, "gas": FLIES["gas"],
    }  # fmt: skip
    for rtol in (1e-8, 1e-10):
        solve = {**SHORT, "rtol": rtol, "error_bars": False}
        found = measure(Case.from_values({**values, "solve": solve}))
        assert (found.status, found.attributes["rtol"]) == ("ok", rtol)  # at its first tolerance
        assert found.numbers["energy_residual"] < 10 * rtol


def test_what_springs_hold_at_the_end_is_not_lost():
    """A contact that rests on its spring: energy that is lost by a shorter run is no less."""
    values = {"joint": "big_end", "clearance_mm": 0.2, "contact": {"damping_N_s_per_mm": 30}}
    losses = [
        measure(Case.from_values({**values, "solve": {**SHORT, "duration_rev": rev}})).numbers
        for rev in np.linspace(0.01, 0.05, 9)
    ]
    lost = [numbers["contact_damping_loss"] for numbers in losses]
    assert (np.diff(lost) >= -1e-9 * max(lost)).all()
    assert lost[0] >= 0


def test_light_masses_with_ideal_joints_balance():
    """Nothing is integrated: gas does work, and next to no kinetic energy is there beside it."""
    masses = {"rod_mass_kg": 1e-6, "reciprocating_mass_kg": 1e-6}
    values = {"joint": "none", "load": "gas", "machine": masses, "output": {"signals": True}}
    light, heavy = (
        measure(Case.from_values({**values, "machine": machine})) for machine in (masses, {})
    )
    assert (light.status, light.reason) == ("ok", "")
    assert light.numbers["energy_residual"] < 1e-9
    assert light.numbers["crank_work"] == pytest.approx(heavy.numbers["crank_work"], rel=1e-9)
    assert (
        0
        < light.numbers["peak_contact_force_error"][0]
        < 1e-3 * light.numbers["peak_contact_force"][0]
    )


def test_a_run_that_does_not_balance_is_repeated_tighter(unbalance):
    asked = unbalance(5, 0.5)
    found = measure(case(rtol=1e-5))
    assert found.status == "ok"
    assert asked == pytest.approx([1e-5, 1e-6, 4e-7])  # the last one for the error bars
    assert found.attributes["rtol"] == pytest.approx(1e-6)
    assert np.isfinite(found.numbers["peak_acceleration_error"])


def test_a_run_that_never_balances_fails_and_its_metrics_are_not_stored(unbalance):
    asked = unbalance(5)
    found = simulate(case(rtol=1e-5))
    assert len(asked) == MAX_AUDIT_REPEATS + 1
    assert (found["status"].item(), found["reason"].item()) == ("failed", "energy_audit_failed")
    assert found.attrs["detail"] == "energy residual 0.0005, more than 0.0001; at rtol 1e-07"
    assert found.attrs["complete"] == 1
    assert np.isfinite(found["acceleration"]).all()
    assert float(found["energy_residual"]) == pytest.approx(5e-4)
    for name in METRICS:
        assert np.isnan(found[name]).all(), name


@pytest.mark.parametrize(
    ("solve", "times"),
    [({"accuracy": "standard"}, 1e3), ({"accuracy": {"peak_acceleration": 1e-3}}, 1e3),
     ({"rtol": 1e-5}, np.nan)],
)  # fmt: skip
def test_neither_a_promise_nor_a_missing_number_outweighs_the_audit(solve, times, unbalance):
    asked = unbalance(times)
    found = measure(case(**solve))
    assert found.reason == "energy_audit_failed"
    assert len(asked) == MAX_AUDIT_REPEATS + 1
    assert np.isnan(found.numbers["acceleration_error"])


EXTREMES = {
    "stiff contact": {"contact": {"stiffness_N_per_mm15": 3.36e8}},
    "undamped": {"contact": {"damping_N_s_per_mm": 0}},
    "sticking": {"friction": {"stiction_velocity_mm_per_s": 0.1}},
    "rough": {"friction": {"static": 0.5, "dynamic": 0.4}},
    "light rod": {"machine": {"rod_mass_kg": 0.1, "reciprocating_mass_kg": 50}},
    "slow": {"machine": {"speed_rpm": 50}},
    "nanometre": {"clearance_mm": 1e-6},
    "millimetre": {"clearance_mm": 1.0},
}


@pytest.mark.parametrize("joint", ["big_end", "small_end", "both"])
@pytest.mark.parametrize("extreme", EXTREMES)
def test_good_runs_of_extremes_pass(extreme, joint):
    """Within the supported range, at standard; a few only at a tenth of the tolerance."""
    values = {"joint": joint, "clearance_mm": 0.2, **EXTREMES[extreme]}
    solve = SHORT | {"error_bars": False}
    found = measure(Case.from_values({**values, "solve": solve}))
    assert (found.status, found.reason) == ("ok", "")
    assert found.numbers["energy_residual"] <= allowed_residual(4e-6, 0.5)
