"""Data sets on disk: a file that leaves nothing out, and what spoils a score."""

import json

import numpy as np
import pytest
import xarray as xr

from compressor.studies.diagnosis.dataset import list_warnings, make_data_set


@pytest.fixture(scope="module")
def made(worn):
    return make_data_set(worn, "worn")


def test_what_spoils_a_score_is_warned_of(made):
    warnings = [*list_warnings(made)]
    assert warnings[0] == "too few machines to test on: both, none"
    assert "sound joints are ideal" in warnings[1]
    clipped = [*list_warnings(made.assign_attrs(clipped_records=3, clipped_most=0.25))]
    assert clipped[0].startswith("3 records are clipped at sensor.range_m_per_s2, at worst 25 %")
    fixed = json.loads(made.attrs["fixed"]) | {"healthy_clearance_mm": {"big_end": 0.1}}
    assert len([*list_warnings(made.assign_attrs(fixed=json.dumps(fixed)))]) == 1


def test_the_command(made, worn, tmp_path, compsim):
    place = tmp_path / "inner" / "faults"
    out, err = compsim("dataset", "worn", "-r", str(worn), "-o", str(place))
    assert "big_end  train         2        8\n" in out
    assert "warning: too few machines to test on: both, none\n" in err
    assert "left out: 2 budget_steps\n" in out
    assert f"{place}/windows.nc" in out
    with xr.open_dataset(place / "windows.nc", engine="h5netcdf") as found:
        assert found["signal"].attrs["units"] == "m/s2"
        assert found.attrs["comment"].startswith("Everything is simulated")
        assert found.attrs["program"].startswith("compsim ")
        for name in made.variables:
            there, here = found[name].values, made[name].values
            assert np.array_equal(there, here, equal_nan=here.dtype.kind == "f"), name
