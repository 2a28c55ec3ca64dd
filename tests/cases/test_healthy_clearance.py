"""A joint with no more than a healthy clearance is sound: its label."""

import json

import pytest

from compressor.cases.case import Case, CaseError
from compressor.cases.load import CaseFileError, load_studies

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
