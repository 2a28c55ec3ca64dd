"""One case to a Dataset: schema, units, ideal numbers, metrics against the series, failures."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.cases.groups import METHODS
from compressor.solve.simulate import measure, simulate

SHORT = {"duration_rev": 1, "settle_rev": 0.5, "accuracy": "draft"}


def run(**values):
    return simulate(Case.from_values({"solve": SHORT, **values}))


@pytest.fixture(scope="module")
def faulty():
    return run(joint="both", clearance_mm={"big_end": 0.1, "small_end": 0.2})


@pytest.mark.parametrize("load", ["spring", "gas", "none"])
def test_ideal_machine(load):
    found = simulate(Case.from_values({"load": load, "solve": {"accuracy": "reference"}}))
    assert found.attrs["promise"] == "kept"
    assert not found.acceleration_error
    assert float(found.peak_acceleration) == pytest.approx(394.784, abs=5e-4)
    assert float(found.energy_residual) < 1e-10
    assert int(found.steps) == int(found.evaluations) == 0
    peak = {"spring": 3346.7, "gas": 3086.6, "none": 0}[load]
    assert float(found.piston_force.max()) == pytest.approx(peak, abs=2)


def test_dims_are_the_same_in_all_scenes(faulty):
    for other in (run(), run(joint="big_end", clearance_mm=0.1)):
        assert {n: v.dims for n, v in other.items()} == {n: v.dims for n, v in faulty.items()}
    assert faulty.contact_force.dims == ("time", "joint", "axis")
    assert faulty.joint.values.tolist() == ["big_end", "small_end"]


def test_metrics_agree_with_the_series(faulty):
    kept = faulty.isel(time=faulty.time.values >= 0.06)
    a = kept.acceleration.values
    # the dense solution sees at least what the grid sees, and seldom much more
    assert 1 - 1e-6 <= float(faulty.peak_acceleration) / np.abs(a).max() <= 1.1
    assert float(faulty.rms_acceleration) == pytest.approx(np.sqrt(np.mean(a**2)), rel=0.01)
    size = np.hypot(*kept.contact_force.sel(joint="small_end").values.T)
    peak = float(faulty.peak_contact_force.sel(joint="small_end"))
    assert 1 - 1e-6 <= peak / size.max() <= 1.1
    depth = float(kept.penetration.sel(joint="big_end").max())
    assert float(faulty.max_penetration.sel(joint="big_end")) == pytest.approx(depth, rel=0.1)


def test_impacts_of_one_motion_are_as_many_a_revolution_however_long_it_is_watched():
    """The count grows with the window: 2, 6 and 12 impacts of one motion."""
    values = {"joint": "small_end", "clearance_mm": 0.2, "contact": {"damping_N_s_per_mm": 50}}
    found = [
        simulate(Case.from_values(
            {**values, "solve": {"duration_rev": 3 + n, "settle_rev": 3, "accuracy": "draft"}}
        )).sel(joint="small_end")
        for n in (1, 3, 6)
    ]  # fmt: skip
    assert [run["impact_count"].item() for run in found] == [2, 6, 12]
    assert [run["impacts_per_rev"].item() for run in found] == [2, 2, 2]
    assert [run["impacts_per_rev_error"].item() for run in found] == [0, 0, 0]
    assert found[0]["impacts_per_rev"].attrs["units"] == "1/rev"


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"solve": {"max_steps": 50}}, "budget_steps"),
        ({"solve": {"max_steps": 50, "method": "DOP853"}}, "budget_steps"),
        ({"solve": {"accuracy": "reference", "timeout_s": 1e-3}}, "budget_seconds"),
        ({"solve": {"timeout_s": 1e-3, "method": "DOP853"}}, "budget_seconds"),
        ({"contact": {"stiffness_N_per_mm15": 300}}, "penetration_implausible"),
        ({"contact": {"stiffness_N_per_mm15": 3, "damping_N_s_per_mm": 0},
          "solve": {"method": "DOP853"}}, "penetration_implausible"),
        # at the second top dead centre the piston is flung past the cylinder head
        ({"load": "gas", "gas": {"head_clearance_mm": 0.601, "switching": "exact"},
          "solve": {"duration_rev": 1.25}}, "non_finite"),
    ],
)  # fmt: skip
def test_a_run_that_cannot_go_on_says_why(values, reason):
    """Of SciPy's methods what is not finite: test_integrate.py."""
    solve = {**SHORT, **values.get("solve", {})}
    found = run(joint="both", clearance_mm=0.3, **{**values, "solve": solve})
    # gas that is pressed to nothing refuses a step before a number is lost
    reasons = {reason, "step_underflow"} if reason == "non_finite" else {reason}
    assert str(found.status.values) == "failed"
    assert str(found.reason.values) in reasons
    assert found.attrs["complete"] == 0
    assert 0 <= found.attrs["stop_time"] < 0.1201
    assert found.attrs["stop_crank_angle"] == pytest.approx(
        found.attrs["stop_time"] * 500 * math.pi / 30
    )
    assert len(found.attrs["stop_state"]) == 8
    assert np.isnan(found.peak_acceleration)
    kept = np.isfinite(found.acceleration.values)
    assert kept[0]
    assert not kept[-1]
    assert (np.diff(kept.astype(int)) <= 0).all()  # nothing after the stop


BOTH = {"joint": "both", "clearance_mm": 0.3}


@pytest.mark.parametrize("method", [*METHODS])
@pytest.mark.parametrize("most", [1, 37])
def test_the_budget_of_steps_is_kept_exactly(method, most):
    found = measure(Case.from_values({**BOTH, "solve": {"max_steps": most, "method": method}}))
    assert found.reason == "budget_steps"
    assert found.numbers["steps"] + found.numbers["rejected"] == most


def test_a_contact_that_lies_within_one_step_is_named():
    """RK45 at a loose tolerance steps over a pulse (physics/README.md, Reference numbers)."""
    values = {"load": "gas", "joint": "big_end", "clearance_mm": 0.2,
              "machine": {"rod_mass_kg": 3, "reciprocating_mass_kg": 6}}  # fmt: skip
    solve = {"duration_rev": 0.25, "settle_rev": 0, "rtol": 1e-5}
    case = Case.from_values({**values, "solve": solve | {"method": "RK45"}})
    found = measure(case)
    assert found.reason == "contact_underresolved"
    assert "N within one step of" in found.detail
    assert 4.6e-3 < found.attributes["stop_time"] < 5.0e-3  # where the step begins
    assert measure(Case.from_values({**values, "solve": solve})).status == "ok"
