"""Studies with regimes from the command line to a Dataset."""

import json

import numpy as np
import pytest
import xarray as xr
from compsim import cli
from conftest import jobs_here

from compressor.cases.case import Case
from compressor.cases.load import load_studies
from compressor.store.files import StoreError
from compressor.store.studies import swept_column
from compressor.studies.regimes.chains import FOLDER
from compressor.studies.regimes.dataset import is_oiled, of_joint, open_regimes
from compressor.studies.regimes.values import NUMBERS, TEXTS

TEXT = """
joint: big_end
machine: {rod_mass_kg: [3, 4.7]}
solve: {accuracy: draft, max_steps: %s}
regimes: {over: clearance_mm, from: 0.1, to: 0.3, n: 3, direction: both, measure_rev: 8,
          exponent: false}
report: {title: Unit 3}
"""


def write(path, most=100000, text=TEXT):
    path.write_text(text % most if "%s" in text else text, encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with the results of a study of four chains."""
    place = tmp_path_factory.mktemp("regimes")
    path = write(place / "wear.yaml")
    with jobs_here():
        assert cli.main(["run", path, "-r", str(place / "r"), "-j", "2", "--quiet"]) == 0
    return place


def run(place, capsys, *words):
    code = cli.main([*words[:1], str(place / "wear.yaml"), "-r", str(place / "r"), *words[1:]])
    return code, *capsys.readouterr()


def test_the_dataset_has_the_study_s_axes_and_both_ways(place):
    found = open_regimes(place / "r", "wear")
    assert found["period"].dims == ("rod_mass_kg", "direction", "clearance_mm")
    assert found["section"].dims[3:] == ("revolution", "joint", "coordinate")
    assert found["clearance_mm"].values.tolist() == [0.1, 0.2, 0.3]
    assert found["clearance_mm"].attrs["units"] == "mm"
    assert found["clearance_mm"].attrs["long_name"] == "radial clearance of the big end"
    assert found["direction"].values.tolist() == ["up", "down"]
    assert found["coordinate"].values.tolist() == ["x", "y", "x_rate", "y_rate"]
    assert found["mode"].values.tolist() == ["flight", "impact", "following"]
    assert (found["status"] == "ok").all()
    assert (found["period"] == 1).all()
    assert found["differs"].dims == ("rod_mass_kg", "clearance_mm")
    assert not found["differs"].any()
    assert (found.attrs["over"], found.attrs["title"]) == ("clearance_mm", "Unit 3")
    assert (found.attrs["log"], found.attrs["section_deg"]) == (0, 0)
    for name in found.data_vars:
        assert found[name].attrs["long_name"], name
        assert name in TEXTS or found[name].attrs["units"], name
    assert {*NUMBERS, *TEXTS} <= {*found.data_vars}


@pytest.mark.parametrize(
    ("joints", "told"),
    [
        (["small_end"], " of the small end"), (["both"], " of both joints"), (["none"], ""),
        (["big_end", "small_end"], ""), ([], ""),
    ],
)  # fmt: skip
def test_what_is_followed_names_the_joint_of_the_study(joints, told):
    """A bifurcation of the small end was said to be over the clearance of the big end."""
    worn = {"clearance_mm": 0.2}
    cases = [
        Case.from_values({"joint": joint, **(worn if joint != "none" else {})}) for joint in joints
    ]
    chains = [[None, xr.Dataset(attrs=case.attributes())] for case in cases]
    assert swept_column("clearance_mm", [0.1])[1]["long_name"] == "radial clearance"
    assert of_joint("clearance_mm", chains) == told
    assert of_joint("machine.speed_rpm", chains) == ""
    assert not is_oiled(chains)


def test_a_study_says_whether_its_joints_have_oil(place):
    worn = {"joint": "big_end", "clearance_mm": 0.2}
    cases = Case.from_values(worn), Case.from_values(worn | {"lubricant": True})
    chains = [[None, xr.Dataset(attrs=case.attributes())] for case in cases]
    assert is_oiled(chains)
    assert open_regimes(place / "r", "wear").attrs["oiled"] == 0


def test_values_belong_to_the_parameter_whichever_way_it_goes(place):
    """Of a motion that is the same both ways: its numbers stand at the same place."""
    found = open_regimes(place / "r", "wear")["rms_acceleration"]
    np.testing.assert_allclose(found[:, 0], found[:, 1], rtol=1e-3)
    assert (np.abs(found.diff("clearance_mm")) > 0.5).all()


def test_a_second_run_has_nothing_to_do(place, capsys):
    code, out, said = run(place, capsys, "run")
    assert code == 0
    assert "wear  4 chains x 3 values    12 ok     0 failed" in out
    assert "wear  12 periodic; periods: 12 of 1 rev" in out
    assert "nothing to do: all 12 values are stored" in said


def test_a_chain_that_is_missing_is_run_alone_and_is_the_same(place, capsys, in_process):
    before = open_regimes(place / "r", "wear")
    folder = place / "r" / FOLDER / "wear"
    manifest = json.loads((folder / "study.json").read_text())
    chains = [folder / f"{key}.nc" for keys in manifest["chains"] for key in keys]
    (gone := folder / f"{manifest['chains'][1][0]}.nc").unlink()
    others = {path: path.stat().st_mtime_ns for path in chains if path != gone}
    missing = open_regimes(place / "r", "wear")
    assert (missing["status"] == "missing").sum() == 3
    assert (missing["status"][1, 0] == "missing").all()
    code, out, _ = run(place, capsys, "plan")
    assert (code, out) == (0, "wear  4 chains x 3 values     9 done     3 missing\n")
    assert run(place, capsys, "run", "--only", "machine.rod_mass_kg < 4")[0] == 0
    assert not gone.exists()
    assert run(place, capsys, "run", "--quiet")[0] == 0
    assert len(others) == 3
    assert all(path.stat().st_mtime_ns == when for path, when in others.items())
    xr.testing.assert_identical(open_regimes(place / "r", "wear"), before)


def test_plan_tells_chains_and_values_as_json(place, capsys):
    code, out, _ = run(place, capsys, "plan", "--json")
    assert code == 0
    assert json.loads(out)["regimes"] == [{"study": "wear", "chains": 4, "values": 3, "done": 12}]


def test_failed_values_end_with_3_and_say_why(in_process, capsys, tmp_path):
    path = write(tmp_path / "short.yaml", 60)
    code = cli.main(["run", path, "-r", str(tmp_path), "-j", "1"])
    out, said = capsys.readouterr()
    assert code == 3
    assert "0 ok    12 failed" in out
    assert "short machine.rod_mass_kg=3.0 down at 0.3: budget_steps: more than 60 steps" in said
    assert "budget_steps: raise solve.max_steps" in said
    found = open_regimes(tmp_path, "short")
    assert (found["reason"] == "budget_steps").all()


def test_a_study_that_is_not_there_is_told(tmp_path):
    with pytest.raises(StoreError, match="there is no regimes study of this name"):
        open_regimes(tmp_path, "wear")


def test_a_study_that_is_no_grid_has_jobs(in_process, tmp_path):
    text = """
blocks:
  - {joint: big_end, clearance_mm: 0.2}
  - {joint: both, clearance_mm: 0.1}
solve: {accuracy: draft}
regimes: {over: machine.speed_rpm, from: 450, to: 500, n: 2, measure_rev: 8,
          exponent: false}
"""
    path = write(tmp_path / "blocks.yaml", text=text)
    (study,) = load_studies(path)
    assert study.jobs == 2
    assert cli.main(["run", path, "-r", str(tmp_path), "-j", "1", "--quiet"]) == 0
    found = open_regimes(tmp_path, "blocks")
    assert found["section"].dims[:3] == ("job", "direction", "speed_rpm")
    assert found["fault"].values.tolist() == ["big_end", "both"]
    assert found["end_state"].shape[-1] == 8
    assert np.isnan(found["end_state"].values[0, ..., 4:]).all()
    assert np.isfinite(found["end_state"].values[1]).all()
    assert "differs" not in found
