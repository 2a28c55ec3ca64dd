"""Forces on the frame from stored series, and how joints shake it: equations, Parseval, cases."""

import math

import numpy as np
import pytest
import xarray as xr

from compressor.analysis import NoSeriesError, frame_forces, healthy_twin, shaking
from compressor.analysis.shaking import whole_revolutions
from compressor.cases.case import Case
from compressor.solve import SIGNALS, simulate
from compressor.vibration import RecordError

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


def test_an_oiled_machine_is_simulated_again_as_it_was():
    """With `auto` another span was found anew; what a sweep leaves unread was refused."""
    solve = {"settle_rev": "auto", "duration_rev": "auto"}
    values = {"joint": "big_end", "clearance_mm": 0.1, "lubricant": True, "load": "gas",
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


@pytest.mark.parametrize("more", [{"lubricant": True}, {"wear": True}])
def test_the_healthy_twin_has_nothing_that_only_a_clearance_can_have(more):
    worn = Case.from_values({"joint": "big_end", "clearance_mm": 0.2, **more, "solve": DRAFT})
    plain = Case.from_values({"solve": DRAFT})
    one, other = (healthy_twin(xr.Dataset(attrs=case.attributes())) for case in (worn, plain))
    assert one["status"].item() == "ok"
    assert not one["eccentricity"].values.any()
    np.testing.assert_array_equal(one["acceleration"].values, other["acceleration"].values)


@pytest.mark.parametrize(
    ("name", "above"),
    [("big_end 0.1", 475), ("big_end 0.3", 1025), ("small_end 0.1", 639), ("small_end 0.3", 555)],
)
def test_force_above_order_12_of_the_paper_s_cases(name, above, paper_runs):
    """Once measured apart from this code, by numpy's Fourier transform of 3 revolutions."""
    run = paper_runs[name]
    assert shaking(run).above == pytest.approx(above, rel=0.02)
    kept = slice(1200, 4800)
    force = frame_forces(run)["shaking_force"][kept, 0]
    lines = 2 * np.abs(np.fft.rfft(force) / force.size) ** 2
    root = math.sqrt(lines[12 * 3 + 1 :].sum() - lines[-1] / 2)
    assert shaking(run).above == pytest.approx(root, rel=1e-3)


def test_a_known_force_has_its_lines(paper_runs):
    """30 N of order 20 everywhere, and nothing else above order 12."""
    run = paper_runs["design"]
    angle = run["crank_angle"].values
    known = run.assign(piston_force=run["piston_force"] + 30 * np.sin(20 * angle))
    found = shaking(known)
    assert found.above == pytest.approx(30 / math.sqrt(2), rel=1e-4)
    assert found.amplitudes[20] == pytest.approx(30, rel=1e-4)


def test_samples_too_coarse_for_its_orders_are_refused(paper_runs):
    """Without lines above order 12 their rms would be 0."""
    run = paper_runs["big_end 0.3"]
    assert shaking(run.isel(time=slice(None, None, 40))).above > 0  # 12 degrees
    with pytest.raises(RecordError, match="order 12 is not below 12, half the samples a turn: run"):
        shaking(run.isel(time=slice(None, None, 50)))
