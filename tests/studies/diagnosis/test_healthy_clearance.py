"""A joint with no more than a healthy clearance is sound: its label, data set, and library."""

import json

import pytest

from compressor.cases.case import Case, CaseError
from compressor.cases.load import CaseFileError, load_studies
from compressor.cases.study import Study
from compressor.studies.diagnosis.dataset import make_data_set, write_card
from compressor.studies.diagnosis.identify import read_library
from compressor.sweep.sweep import sweep

BOTH = {"joint": "both", "clearance_mm": {"big_end": 0.08, "small_end": 0.25}}


@pytest.mark.parametrize(
    ("healthy", "worn"),
    [
        (None, "both"),
        (0, "both"),
        (0.07, "both"),
        (0.08, "small_end"),
        (0.25, "none"),
        ({"big_end": 0.1}, "small_end"),
        ({"small_end": 0.3}, "big_end"),
        ({"big_end": 0.1, "small_end": 0.3}, "none"),
    ],
)
def test_a_joint_is_worn_beyond_its_healthy_clearance(healthy, worn):
    named = {} if healthy is None else {"healthy_clearance_mm": healthy}
    case = Case.from_values(BOTH | named)
    assert case.worn_joint == worn
    assert case.key == Case.from_values(BOTH).key
    assert case.physics_key == Case.from_values(BOTH).physics_key
    assert Case.from_values(case.values()) == case
    assert Case.from_attribute(case.attributes()["case"]) == case


@pytest.mark.parametrize("joint", ["none", "big_end"])
def test_joints_that_are_ideal_are_never_worn(joint):
    clearance = {} if joint == "none" else {"clearance_mm": 0.2}
    case = Case.from_values({"joint": joint, **clearance, "healthy_clearance_mm": 0.1})
    assert case.worn_joint == joint


def test_what_is_wrong_with_it_is_told(tmp_path):
    with pytest.raises(CaseError, match=r"healthy_clearance_mm: -1 is outside"):
        Case.from_values(BOTH | {"healthy_clearance_mm": -1})
    (tmp_path / "s.yaml").write_text(json.dumps(BOTH | {"healthy_clearance_mm": [0.1, 0.2]}))
    with pytest.raises(CaseFileError, match="cannot be swept"):
        load_studies(tmp_path / "s.yaml")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """A folder with the same jobs as two studies, one of which names a healthy clearance."""
    folder = tmp_path_factory.mktemp("healthy")
    brief = {"duration_rev": 2, "settle_rev": 1, "accuracy": "draft", "output_step_deg": 0.9}
    values = {
        "joint": ["none", "both"],
        "clearance_mm": {"big_end": 0.08, "small_end": [0.05, 0.25]},
        "exclude": ["joint == none and clearance_mm.small_end > 0.1"],
        "solve": brief | {"error_bars": False},
        "body": True,
        "sensor": {"length_rev": 5, "noise_m_per_s2": 0.05},
    }
    paths: list[Study] = []
    for name, more in {"plain": {}, "sound": {"healthy_clearance_mm": 0.1}}.items():
        (folder / f"{name}.yaml").write_text(json.dumps(values | more))
        paths += load_studies(folder / f"{name}.yaml")
    for study in paths:
        sweep([study], folder / "results", workers=1)
    return folder / "results"


def test_the_data_set_and_the_library_say_worn_beyond_it(results):
    labels, library = {}, {}
    for name in ("plain", "sound"):
        found = make_data_set(results, name, revolutions=4)
        labels[name] = found["joint"].values.tolist()
        jobs = read_library(results, name)
        library[name] = jobs.joints.tolist()
        assert sorted(jobs.clearances[:, 1].tolist()) == [0.0, 0.05, 0.25]
        machines = {*found["machine"].values.tolist()}
        card = write_card(found)
        assert ("| healthy_clearance_mm.big_end | 0.1 |" in card) == (name == "sound")
        assert ("**Warning:** sound joints are ideal" in card) == (name == "plain")
    assert labels["plain"] == library["plain"] == ["none", "both", "both"]
    assert labels["sound"] == library["sound"] == ["none", "none", "small_end"]
    assert len(machines) == 3
