"""Studies as their sweeps are drawn: grids in order, and lists."""

import numpy as np
import pytest
import xarray as xr
from swept_made import grid, listed

from compressor.report.figures.sweep_data import MEASURES, sweep_of

PEAK = next(m for m in MEASURES if m.variable == "peak_acceleration")
RMS = next(m for m in MEASURES if m.variable == "rms_acceleration")


def test_numbers_of_a_grid_are_sorted_and_words_are_not():
    axes = {"clearance_mm": [0.3, 0.1, 0.2], "load": ["gas", "spring"], "rod_mass_kg": [4.0]}
    sweep = sweep_of(grid(axes, lambda c, load, m: 100 * c + load))
    assert [axis.name for axis in sweep.axes] == ["clearance_mm", "load"]  # what has two values
    assert sweep.axes[0].values.tolist() == [0.1, 0.2, 0.3]
    assert sweep.axes[1].words == ["gas", "spring"]
    assert PEAK.of(sweep.data) == pytest.approx(np.array([[10, 11], [20, 21], [30, 31]]))
    assert sweep.keys.tolist() == [["k2", "k3"], ["k4", "k5"], ["k0", "k1"]]
    assert sweep.axes[0].title == "clearance (mm)"
    assert sweep.axes[0].value_text(1) == "clearance 0.2 mm"


def test_a_list_of_jobs_is_no_grid_even_where_it_fills_one():
    columns = {"clearance_mm": [0.1, 0.1, 0.2, 0.2], "speed_rpm": [400.0, 500.0] * 2}
    sweep = sweep_of(listed(columns, range(4)))
    assert not sweep.is_grid
    assert sweep.status.shape == (4,)


def test_what_is_rounding_beside_the_other_axis_is_0():
    """It was told as 9.764e-14 mm/s, and a worn machine's as 1.6e+11 times that."""
    values = xr.DataArray([[9.79e-3, 9.764e-17], [9.79e-3, 1.6e-5]], dims=("job", "axis"))
    data = xr.Dataset(
        {"body_velocity_rms": values, "body_velocity_rms_error": 0.8 * values}, {"axis": ["x", "y"]}
    )
    x, y = (m for m in MEASURES if m.variable == "body_velocity_rms")
    assert y.of(data) == pytest.approx([0.0, 0.016])
    assert y.of(data)[0] == y.bar(data)[0] == 0.0
    assert x.of(data) == pytest.approx([9.79, 9.79])


def test_what_a_bar_does_not_vouch_for_is_not_known():
    regime = ["predictable", "chaotic"]
    sweep = sweep_of(grid({"clearance_mm": [0.1, 0.2]}, lambda c: 100 * c, regime=regime))
    assert np.isnan(sweep.known(PEAK)).tolist() == [False, True]
    assert np.isnan(sweep.known(RMS)).tolist() == [False, False]
    assert sweep.chaotic.tolist() == [False, True]
