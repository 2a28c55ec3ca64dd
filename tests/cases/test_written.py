"""Cases as text: the whole case, and what differs from the defaults (see also `test_load`)."""

import pytest

from compressor.cases.case import Case, to_yaml
from compressor.cases.load import load_cases


def test_what_is_written_stays_readable():
    assert to_yaml(Case()).startswith("name: case\nload: spring\njoint: none\nmachine:\n")


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({}, "load: spring\n"),
        ({"load": "gas", "joint": "none"}, "load: gas\n"),
        (
            {"joint": "big_end", "clearance_mm": 0.2, "machine": {"rod_length_mm": 500}},
            "joint: big_end\nclearance_mm:\n  big_end: 0.2\nmachine:\n  rod_length_mm: 500.0\n",
        ),
        ({"machine": {"rod_centre_mm": 300, "speed_rpm": 500}}, "load: spring\n"),  # by default
        ({"friction": False, "solve": {"rtol": 1e-7}}, "friction: false\nsolve:\n  rtol: 1e-07\n"),
        ({"body": True, "sensor": {"seed": 7}}, "body: true\nsensor:\n  seed: 7\n"),
        ({"solve": {"duration_s": 0.36, "settle_rev": 0}},
         "solve:\n  duration_s: 0.36\n  settle_rev: 0.0\n"),
    ],
)  # fmt: skip
def test_what_is_written_in_brief(values, text, tmp_path):
    case = Case.from_values({"name": "mine", **values})
    assert to_yaml(case, brief=True) == text
    path = tmp_path / "again.yaml"
    path.write_text(text)
    (again,) = load_cases(path)
    assert again.key == case.key
