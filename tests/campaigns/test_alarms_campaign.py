"""The kept measurement of alarms: that its numbers follow from each other, and from its cases."""

import json

import measure_alarms
import page_tables
import pytest
import xarray as xr

from compressor.cases import Case
from compressor.cases.load import load_studies
from compressor.studies.alarms.alarms import judge_alarms, rank_alarms

KEPT = page_tables.kept("alarms.json")


def test_the_cases_are_those_that_were_run(tmp_path):
    """The same machines, drawn alike, by the same model: else `make alarms` measures anew."""
    path, worn_path = tmp_path / "plant.yaml", tmp_path / "worn.yaml"
    path.write_text(measure_alarms.case_text(), encoding="utf-8")
    worn_path.write_text(measure_alarms.wear_text(), encoding="utf-8")
    (study,) = load_studies(path)
    assert measure_alarms.digest_keys([study], load_studies(worn_path)) == KEPT["keys"]
    assert len(study.cases) == KEPT["jobs"]
    worn = [case.worn_joint for case in study.cases]
    assert worn.count("none") == KEPT["sound_draws"] == measure_alarms.SOUND
    assert len(worn) - worn.count("none") == KEPT["worn_jobs"]


def test_rows_are_what_the_command_judges(worn_store, monkeypatch):
    """By the made-up records of the command's own tests."""
    monkeypatch.setattr(measure_alarms, "NOISE", (1.0,))
    monkeypatch.setattr(measure_alarms, "peaks", lambda folder, study: {})
    wear = {"limit_mm": 0.3, "coefficient_factor": 2}
    case = Case.from_values({"joint": "both", "clearance_mm": 0.1, "wear": wear})
    opened = [[1e-4, 1e-4], [3e-4, 2e-4]]
    run = xr.Dataset(
        {"hours": ("stage", [0.0, 1000.0]), "clearance": (("stage", "joint"), opened)},
        {"joint": ["big_end", "small_end"]},
    ).assign_attrs(case=case.attributes()["case"])
    found = measure_alarms.judge(worn_store, "worn", run, revolutions=2)
    json.dumps(found, allow_nan=False)
    assert (found["jobs"], found["sound_draws"], found["worn_jobs"]) == (240, 60, 180)
    whole = judge_alarms(worn_store, "worn", noise=(1.0,), revolutions=2)
    for joint in ("big_end", "small_end", "both"):
        row = next(r for r in found["rows"] if (r["joint"], r["noise"]) == (joint, 1.0))
        best = whole.isel(alarm=rank_alarms(whole, joint)[0], noise=0)
        assert (row["alarm"], row["filter"]) == (best["kind"].item(), best["filter"].item())
        mine = best["detection"].sel(end="value").values[best["worn_joint"].values == joint]
        assert row["detection"] == pytest.approx(mine, abs=5e-3)
        assert row["limit"] == pytest.approx(float(best["limit"]), rel=5e-3)
        assert (row["lead_hours"] is None) == (joint == "both")  # no run wears both as one
    first, last = found["rows"][0], found["at_looser"][0]
    assert first["first"] == last["first"] is not None  # strokes are far above either limit
    assert last["limit"] <= first["limit"]
