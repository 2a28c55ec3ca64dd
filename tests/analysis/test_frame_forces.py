"""Forces on the frame from stored series: those that the equations of motion give."""

import numpy as np
import pytest
import xarray as xr

from compressor.analysis.shaking import NoSeriesError, frame_forces, healthy_twin, whole_revolutions
from compressor.cases.case import Case
from compressor.solve.series import SIGNALS
from compressor.solve.simulate import simulate

DRAFT = {"accuracy": "draft", "duration_rev": 2.5, "error_bars": False}


@pytest.mark.parametrize(
    ("joint", "weight", "more"),
    [("none", 0, {}), ("big_end", 900, {}), ("small_end", 0, {}), ("both", 0, {}),
     ("big_end", 900, {"guide": True})],
)  # fmt: skip
def test_forces_are_the_signals_of_the_run(joint, weight, more):
    """Those of the series alone: what is stored is taken as it is."""
    clearance = {} if joint == "none" else {"clearance_mm": 0.2}
    machine = {"gravity_m_per_s2": 9.81, "counterweight_kg_mm": weight}
    case = {"joint": joint, **clearance, **more, "machine": machine, "output": {"signals": True}}
    run = simulate(Case.from_values({**case, "solve": DRAFT}))
    found = frame_forces(run.drop_vars([*SIGNALS]))
    assert found.keys() == SIGNALS.keys()
    for name, values in found.items():
        size = np.abs(run[name].values).max()
        np.testing.assert_allclose(values, run[name].values, rtol=0, atol=1e-9 * size)


@pytest.mark.parametrize("load", ["spring", "gas"])
def test_an_oiled_machine_is_simulated_again_as_it_was(load):
    """With `auto` another span was found anew; what a sweep leaves unread was refused."""
    solve = {"accuracy": "fine", "settle_rev": "auto", "duration_rev": "auto"}
    values = {"joint": "big_end", "clearance_mm": 0.1, "lubricant": True, "load": load,
              "spring": {"stiffness_N_per_mm": 30}, "solve": solve}  # fmt: skip
    run = simulate(Case.resolve({**values, "output": {"signals": True}}))
    found = frame_forces(run.drop_vars([*SIGNALS]))
    for name, values in found.items():
        size = np.abs(run[name].values).max()
        np.testing.assert_allclose(values, run[name].values, rtol=0, atol=1e-4 * size)


def test_whole_revolutions_leave_the_rest():
    run = simulate(Case.from_values({"solve": {**DRAFT, "duration_rev": 3.7}}))
    kept, count = whole_revolutions(run)
    assert count == 2
    assert np.ptp(kept["crank_angle"].values) == pytest.approx(4 * np.pi)
    with pytest.raises(NoSeriesError, match="no whole settled revolution"):
        whole_revolutions(run.isel(time=slice(None, 1800)))
    with pytest.raises(NoSeriesError, match="no time series"):
        whole_revolutions(run.isel(time=0))
    with pytest.raises(NoSeriesError, match="no time series"):
        frame_forces(run.isel(time=0))


def test_the_healthy_twin_has_ideal_joints_on_the_same_grid():
    values = {"joint": "both", "clearance_mm": 0.2, "load": "gas", "solve": DRAFT}
    run = simulate(Case.from_values(values))
    twin = healthy_twin(run)
    assert np.array_equal(twin["time"].values, run["time"].values)
    assert not twin["eccentricity"].values.any()
    assert Case.from_attribute(twin.attrs["case"]).load == "gas"


@pytest.mark.parametrize("more", [{"lubricant": True}, {"wear": True}])
def test_the_healthy_twin_has_nothing_that_only_a_clearance_can_have(more):
    worn = Case.from_values({"joint": "big_end", "clearance_mm": 0.2, **more, "solve": DRAFT})
    plain = Case.from_values({"solve": DRAFT})
    one, other = (healthy_twin(xr.Dataset(attrs=case.attributes())) for case in (worn, plain))
    assert one["status"].item() == "ok"
    np.testing.assert_array_equal(one["acceleration"].values, other["acceleration"].values)
