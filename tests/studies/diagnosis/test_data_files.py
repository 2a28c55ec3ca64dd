"""Data sets on disk: three files that say the same, and a card that leaves nothing out."""

import io
import json
import sys

import numpy as np
import pytest
import xarray as xr
from compsim import cli

from compressor.cases.case import Case
from compressor.studies.diagnosis.data_card import ABSENT, counts, data_card, escape_cell
from compressor.studies.diagnosis.data_set import (
    LABELS,
    WORDS,
    DataSetError,
    DataSetOptions,
    make_data_set,
    models_of,
)
from compressor.studies.diagnosis.features import FEATURES
from compressor.studies.diagnosis.record_files import write_data_set


@pytest.fixture(scope="module")
def made(worn):
    return make_data_set(worn, "worn", DataSetOptions(noise=(0.0, 0.5)))


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
    assert {*found} == {*FEATURES, *LABELS, *WORDS, "window", "split", "first_pulse", "noise"}
    assert table.num_rows == 2 * made.sizes["window"]
    for number in (0, 1, 17, table.num_rows - 1):
        row = made.sel(window=found["window"][number], noise=found["noise"][number])
        for name in (*LABELS, *WORDS, "split"):
            assert found[name][number] == row[name].item()
        values = [found[name][number] for name in FEATURES]
        assert values == row["features"].values.tolist()


def test_the_card_tells_what_is_and_what_is_not_in_it(folder):
    card = (folder / "README.md").read_text(encoding="utf-8")
    for name in (*FEATURES, *LABELS, *WORDS, "body.mass_kg", "sensor.place"):
        assert f"| `{name}` |" in card
    for line in ABSENT:
        assert f"- {line}\n" in card
    assert "14 simulated jobs. 10 of them, of 5 machines, gave windows" in card
    assert "- 2 budget_steps: failed" in card
    assert "- 2 too_short: fewer revolutions than a window" in card
    assert "| `machine.speed_rpm` | rpm | 400 to 600 | 2 |" in card
    assert "| `joint` |  | big_end, both, none | 3 |" in card
    assert "0, 0.5 m/s² rms of white noise" in card
    assert "500 kg and natural frequencies of 30 Hz and 30 Hz" in card
    assert "| big_end | test | 1 | 4 |" in card


def test_the_card_names_the_models_of_the_jobs_that_gave_windows(folder):
    card = (folder / "README.md").read_text(encoding="utf-8")
    assert "| contact law of joints with clearance | impact (8) |" in card
    assert "| friction law of the joints | none (2), adams (8) |" in card
    assert "| between journal and bore | dry (8) |" in card
    assert "Crank, crosshead and guide are rigid, the rod too. The casing" in card
    assert "- **Oil.** No film carries, damps or separates the journals.\n" in card
    assert "- **Changing speed.** But for the sensor's slow jitter, the speed of a record" in card


def absent_words(made, **models):
    """What the card says is missing from a data set of other models."""
    known = json.loads(made.attrs["models"]) | models
    return data_card(made.assign_attrs(models=json.dumps(known)), False).partition(
        "## What is not in it"
    )[2]


def test_the_card_does_not_deny_what_the_study_has(made):
    """Every card said "no oil", "the rod is rigid" and "one contact law"."""
    rich = absent_words(
        made, journals={"oil": 8}, rod={"elastic": 10}, crank={"of a motor": 10},
        contact={"impact": 4, "flores": 4}, friction={"adams": 4, "lugre": 4},
    )  # fmt: skip
    assert "the rod is elastic. The casing" in rich
    for word in ("Oil", "rigid, the rod too", "Changing speed", "Other laws"):
        assert word not in rich
    mixed = absent_words(
        made, journals={"oil": 6, "dry": 2}, crank={"constant": 3, "of a motor": 7}
    )
    assert "separates the journals. This is said of 2 of 8 jobs.\n" in mixed
    assert "speed of a record is constant. This is said of 3 of 10 jobs.\n" in mixed
    assert "The joints have one law of contact and one law of friction" in mixed


@pytest.mark.parametrize(
    ("values", "kinds"),
    [
        ({"lubricant": True}, {"journals": "oil"}),
        ({"rod": True}, {"rod": "elastic", "journals": "dry"}),
        ({"contact": {"law": "flores", "restitution": 0.5}}, {"contact": "flores"}),
        ({"friction": {"law": "lugre"}}, {"friction": "lugre"}),
        ({"friction": False}, {"friction": "none"}),
        ({"guide": True}, {"guide": "with friction"}),
        ({"guide": {"clearance_mm": 0.1}}, {"guide": "with play"}),
        ({"drive": True}, {"crank": "of a motor"}),
    ],
)
def test_a_case_has_its_models(values, kinds):
    plain = {"contact": "impact", "friction": "adams", "journals": "dry", "rod": "rigid",
             "guide": "ideal", "crank": "constant"}  # fmt: skip
    case = Case.from_values({"joint": "big_end", "clearance_mm": 0.1, **values})
    assert models_of(case) == plain | kinds
    ideal = models_of(Case.from_values({}))
    assert ideal == {"friction": "none", "rod": "rigid", "guide": "ideal", "crank": "constant"}


def test_counts(made):
    rows = {(joint, split): (machines, n) for joint, split, machines, n in counts(made)}
    assert rows == {
        ("big_end", "train"): (2, 8), ("big_end", "test"): (1, 4), ("both", "train"): (1, 4),
        ("both", "test"): (0, 0), ("none", "train"): (1, 4), ("none", "test"): (0, 0),
    }  # fmt: skip


def test_cells_cannot_break_a_table():
    assert escape_cell("a|b\nc") == r"a\|b c"


def test_without_pyarrow_the_rest_is_written(made, tmp_path, without_pyarrow):
    (tmp_path / "features.parquet").write_bytes(b"of an earlier data set")
    written = write_data_set(tmp_path, made)
    assert [*written.files] == ["windows.nc", "README.md"]
    assert {path.name for path in tmp_path.iterdir()} == {*written.files}
    assert "pip install 'compsim[dataset]'" in written.remark
    assert "No Parquet file" in (tmp_path / "README.md").read_text(encoding="utf-8")


def test_a_readme_of_something_else_is_not_replaced(worn, made, tmp_path, capsys):
    card = tmp_path / "README.md"
    card.write_text("mine")
    assert cli.main(["dataset", "worn", "-r", str(worn), "-o", str(tmp_path)]) == 2
    assert "choose another folder" in capsys.readouterr().err
    with pytest.raises(DataSetError, match=r"README\.md of something else"):
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
    assert "too few machines to test on: both, none\n" in out
    assert "left out: 2 budget_steps\n" in out
    assert f"{place}/windows.nc" in out
    assert f"next: read {place}/README.md" in err
    with xr.open_dataset(place / "windows.nc", engine="h5netcdf") as found:
        assert found["noise"].values.tolist() == [0.0, 0.5]
