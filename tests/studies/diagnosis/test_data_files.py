"""Data sets on disk: three files that say the same, and a card that leaves nothing out."""

import io
import json
import sys

import numpy as np
import pytest
import xarray as xr

from compressor.studies.diagnosis.dataset import (
    LABELS,
    list_warnings,
    make_data_set,
    write_card,
    write_data_set,
)
from compressor.studies.diagnosis.features import FEATURES


@pytest.fixture(scope="module")
def made(worn):
    return make_data_set(worn, "worn", noise=(0.0, 0.5))


@pytest.fixture(scope="module")
def folder(made, tmp_path_factory):
    place = tmp_path_factory.mktemp("faults")
    write_data_set(place, made)
    return place


@pytest.fixture
def without_pyarrow(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)


def test_netcdf_opens_in_xarray(folder, made):
    with xr.open_dataset(folder / "windows.nc", engine="h5netcdf") as found:
        assert found["signal"].attrs["units"] == "m/s2"
        assert found.attrs["program"] == made.attrs["program"]
        for name in made.variables:
            there, here = found[name].values, made[name].values
            assert np.array_equal(there, here, equal_nan=here.dtype.kind == "f"), name


def test_parquet_has_a_row_for_each_window_and_level(folder, made):
    parquet = pytest.importorskip(
        "pyarrow.parquet", reason="pyarrow is not installed: pip install 'compsim[dataset]'"
    )
    table = parquet.read_table(io.BytesIO((folder / "features.parquet").read_bytes()))
    found = {name: table[name].to_numpy() for name in table.column_names}
    assert {*found} == {*FEATURES, *LABELS, "window", "split", "first_pulse", "noise"}
    assert table.num_rows == 2 * made.sizes["window"]
    for number in (0, 1, 17, table.num_rows - 1):
        row = made.sel(window=found["window"][number], noise=found["noise"][number])
        for name in (*LABELS, "split"):
            assert found[name][number] == row[name].item()
        values = [found[name][number] for name in FEATURES]
        assert values == row["features"].values.tolist()


def test_the_card_has_its_facts_in_tables(folder):
    card = (folder / "README.md").read_text(encoding="utf-8")
    for name in (*FEATURES, *LABELS):
        assert f"| `{name}` |" not in card
        assert f"| {name} |" in card
    for row in (
        "| simulated jobs | 14 |", "| jobs that gave windows | 10 |", "| machines | 5 |",
        "| jobs left out: budget_steps | 2 |", "| jobs left out: too_short | 2 |",
        "| machine.speed_rpm | rpm | 400 to 600 |", "| rms of added noise, m/s² | 0, 0.5 |",
        "| joint |  | joints with clearance, or with more than is healthy: the fault "
        "| big_end (12), both (4), none (4) |", "| big_end | test | 1 | 4 |",
        "| body.mass_kg | 500.0 |", "| contact.law | impact |",
    ):  # fmt: skip
        assert f"{row}\n" in card
    assert "{" not in card.partition("## The case")[0]  # no place of the template is left


def test_the_card_warns_of_what_spoils_a_score(made):
    warnings = [*list_warnings(made)]
    assert warnings[0] == "too few machines to test on: both, none"
    assert "sound joints are ideal" in warnings[1]
    card = write_card(made.assign_attrs(clipped_records=3, clipped_most=0.25))
    assert "- **Warning:** 3 records are clipped at sensor.range_m_per_s2, at worst 25 %" in card
    fixed = json.loads(made.attrs["fixed"]) | {"healthy_clearance_mm": {"big_end": 0.1}}
    assert "sound joints are ideal" not in write_card(made.assign_attrs(fixed=json.dumps(fixed)))


def test_without_pyarrow_the_rest_is_written(made, tmp_path, without_pyarrow):
    (tmp_path / "features.parquet").write_bytes(b"of an earlier data set")
    written = {path.name for path in write_data_set(tmp_path, made)}
    assert written == {"windows.nc", "README.md"} == {path.name for path in tmp_path.iterdir()}


def test_the_command(worn, tmp_path, compsim):
    place = tmp_path / "inner" / "faults"
    words = ["-r", str(worn), "-o", str(place), "--noise", "0,0.5", "--no-signals"]
    out, err = compsim("dataset", "worn", *words)
    assert "big_end  train         2        8\n" in out
    assert "warning: too few machines to test on: both, none\n" in err
    assert "left out: 2 budget_steps\n" in out
    assert f"{place}/windows.nc" in out
    assert f"next: read {place}/README.md" in err
    with xr.open_dataset(place / "windows.nc", engine="h5netcdf") as found:
        assert found["noise"].values.tolist() == [0.0, 0.5]
