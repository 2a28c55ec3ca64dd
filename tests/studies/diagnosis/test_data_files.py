"""Data sets on disk: three files that say the same, and a card that leaves nothing out."""

import io
import json
import sys

import numpy as np
import pytest
import xarray as xr
from compsim import cli

from compressor.studies.diagnosis.dataset import (
    LABELS,
    StudyError,
    count_windows,
    list_warnings,
    make_data_set,
    tabulate,
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


def test_counts(made):
    rows = {(joint, split): (machines, n) for joint, split, machines, n in count_windows(made)}
    assert rows == {
        ("big_end", "train"): (2, 8), ("big_end", "test"): (1, 4), ("both", "train"): (1, 4),
        ("both", "test"): (0, 0), ("none", "train"): (1, 4), ("none", "test"): (0, 0),
    }  # fmt: skip


def test_cells_cannot_break_a_table():
    assert tabulate(["x"], [["a|b\nc"]]).splitlines()[2] == r"| a\|b c |"


def test_without_pyarrow_the_rest_is_written(made, tmp_path, without_pyarrow):
    (tmp_path / "features.parquet").write_bytes(b"of an earlier data set")
    written = {path.name for path in write_data_set(tmp_path, made)}
    assert written == {"windows.nc", "README.md"} == {path.name for path in tmp_path.iterdir()}


def test_the_command_says_how_to_get_parquet(worn, tmp_path, without_pyarrow, capsys):
    assert cli.main(["dataset", "worn", "-r", str(worn), "-o", str(tmp_path / "to")]) == 0
    assert "pip install 'compsim[dataset]'" in " ".join(capsys.readouterr().err.split())


def test_a_readme_of_something_else_is_not_replaced(worn, made, tmp_path, capsys):
    card = tmp_path / "README.md"
    card.write_text("mine")
    assert cli.main(["dataset", "worn", "-r", str(worn), "-o", str(tmp_path)]) == 2
    assert "choose another folder" in capsys.readouterr().err
    with pytest.raises(StudyError, match=r"README\.md of something else"):
        write_data_set(tmp_path, made)
    assert [*tmp_path.iterdir()] == [card]
    assert card.read_text() == "mine"


def test_an_earlier_data_set_is_replaced(made, tmp_path):
    write_data_set(tmp_path, made)
    write_data_set(tmp_path, made.isel(window=slice(0, 4)))
    with xr.open_dataset(tmp_path / "windows.nc", engine="h5netcdf") as found:
        assert found.sizes["window"] == 4


def test_the_command(worn, tmp_path, capsys):
    place = tmp_path / "inner" / "faults"
    words = ["-r", str(worn), "-o", str(place), "--noise", "0,0.5", "--no-signals"]
    assert cli.main(["dataset", "worn", *words]) == 0
    out, err = capsys.readouterr()
    assert "big_end  train         2        8\n" in out
    assert "warning: too few machines to test on: both, none\n" in err
    assert "left out: 2 budget_steps\n" in out
    assert f"{place}/windows.nc" in out
    assert f"next: read {place}/README.md" in err
    with xr.open_dataset(place / "windows.nc", engine="h5netcdf") as found:
        assert found["noise"].values.tolist() == [0.0, 0.5]
