"""The kept measurement of alarms is of the cases and the model of today."""

import measure_alarms
import page_tables

from compressor.cases.load import load_studies

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
