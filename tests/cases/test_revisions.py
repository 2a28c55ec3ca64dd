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
        ({"rod": True}, "losses of an elastic rod"),
        ({"guide": {"clearance_mm": 0.1}, **RUBS, "contact": FLORES},
         "damping of the crosshead in its guide"),
        (RUBS | {"friction": {"law": "lugre", "static": 0, "dynamic": 0}},
         "LuGre friction without a coefficient"),
        (RUBS | BODY, "moment on the guide"),
        (BODY | {"friction": {"ideal_joints": True}}, "moment on the guide"),
    ],
)  # fmt: skip
def test_results_of_model_2_are_other_ones_now(values, what):
    case = Case.from_values(values)
    assert changes_since("2", case.values()) == [what]
    assert changes_since(MODEL, case.values()) == []
    assert model_of(case.values()) == "2.1"
    assert SUSPECT.search(case.attributes()["case"].encode())


def test_oil_films_are_other_ones_since_2_and_since_2_2():
    case = Case.from_values(RUBS | {"lubricant": True})
    assert [changes_since(model, case.values()) for model in ("2", "2.2")] == [["oil film"]] * 2
    assert changes_since(MODEL, case.values()) == []
    assert model_of(case.values()) == "2.3"
    assert SUSPECT.search(case.attributes()["case"].encode())


def test_the_tacho_between_dead_centres_is_another_one_since_2_1():
    solve = {"duration_rev": 6.5, "settle_rev": 1.5}
    case = Case.from_values({"body": True, "sensor": True, "solve": solve})
    assert changes_since("2.1", case.values()) == ["tacho of a sensor's record"]
    assert changes_since(MODEL, case.values()) == []
    assert model_of(case.values()) == "2.2"
    assert SUSPECT.search(case.attributes()["case"].encode())


@pytest.mark.parametrize("values", [{}, RUBS])
def test_the_rod_load_s_peaks_are_other_ones_since_2_3(values):
    case = Case.from_values(values | {"output": {"signals": True}})
    rod_load, guide = "peaks of the rod load", "moment on the guide"
    assert changes_since("2.3", case.values()) == [rod_load]
    assert changes_since("2", case.values()) == [guide, rod_load][values == {} :]
    assert changes_since(MODEL, case.values()) == []
    assert model_of(case.values()) == MODEL
    assert SUSPECT.search(case.attributes()["case"].encode())


@pytest.mark.parametrize(
    "values",
    [
        {},
        RUBS,
        RUBS | {"contact": FLORES},
        {"guide": {"clearance_mm": 0.1}},
        RUBS | {"friction": {"law": "lugre"}},
        BODY,
        RUBS | BODY | {"friction": False},
        {"body": True, "sensor": True, "solve": {"duration_rev": 6, "settle_rev": 2}},
        {"body": {"start": "rest"}, "sensor": True,
         "solve": {"duration_rev": 6, "settle_rev": 1.5}},
    ],
)  # fmt: skip
def test_results_of_all_other_cases_stay(values):
    case = Case.from_values(values)
    assert changes_since("2", case.values()) == []
    assert model_of(case.values()) == MODEL_VERSION
