"""What a revision of the model has changed: for these cases, and for no others."""

import pytest

from compressor.cases.case import MODEL, MODEL_VERSION, SUSPECT, Case, changes_since, model_of

RUBS = {"joint": "small_end", "clearance_mm": 0.2}
BODY = {"body": True, "solve": {"duration_rev": 3, "settle_rev": 1}}
FLORES = {"law": "flores", "restitution": 0.5}


@pytest.mark.parametrize(
    ("values", "what"),
    [
        ({"drive": True}, "times, torques and forces of a drive"),
        (RUBS | {"lubricant": True}, "oil film"),
        ({"rod": True}, "losses of an elastic rod"),
        ({"guide": {"clearance_mm": 0.1}, **RUBS, "contact": FLORES},
         "damping of the crosshead in its guide"),
        (RUBS | {"friction": {"law": "lugre", "static": 0, "dynamic": 0}},
         "LuGre friction without a coefficient"),
        (RUBS | {"output": {"signals": True}}, "moment on the guide"),
        (RUBS | BODY, "moment on the guide"),
        (BODY | {"friction": {"ideal_joints": True}}, "moment on the guide"),
    ],
)  # fmt: skip
def test_results_of_model_2_are_other_ones_now(values, what):
    case = Case.from_values(values)
    assert changes_since("2", case.values()) == [what]
    assert changes_since(MODEL, case.values()) == []
    assert model_of(case.values()) == MODEL
    assert SUSPECT.search(case.attributes()["case"].encode())


@pytest.mark.parametrize(
    "values",
    [
        {},
        RUBS,
        {"joint": "big_end", "clearance_mm": 0.2, "output": {"signals": True}},
        RUBS | {"contact": FLORES},
        {"guide": {"clearance_mm": 0.1}},
        RUBS | {"friction": {"law": "lugre"}},
        BODY,
        RUBS | BODY | {"friction": False},
    ],
)
def test_results_of_all_other_cases_stay(values):
    case = Case.from_values(values)
    assert changes_since("2", case.values()) == []
    assert model_of(case.values()) == MODEL_VERSION
