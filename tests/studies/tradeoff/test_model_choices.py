"""Choices of the model: which a case has, what they assume, and that they move metrics so far."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compressor.cases import Lubricant
from compressor.cases.case import Case
from compressor.cases.load import load_studies
from compressor.cases.materials import contact_stiffness
from compressor.metrics import JOINTS, METRICS
from compressor.solve.si_record import stiffness_of
from compressor.solve.simulate import simulate
from compressor.store.series_file import write_dataset
from compressor.store.status import verify
from compressor.studies.tradeoff import model_choices as module
from compressor.studies.tradeoff.model_choices import (
    GRID,
    ITSELF,
    Choice,
    explain_models,
    model_choices,
    model_variants,
    run_choices,
    tabulate,
    trade,
)
from compressor.studies.tradeoff.page import models_file

SHORT = {"duration_rev": 0.25, "settle_rev": 0}
THREE = ("contact stiffness × 2", "friction law: Threlfall", "contact law: Flores")


def case(**values):
    base = {"joint": "big_end", "clearance_mm": 0.2, "solve": SHORT}
    return Case.from_values({**base, **values})


def by_name(values):
    return {choice.name: choice for choice in model_choices(values)}


def run_by_hand(itself, choices):
    every = [Choice(ITSELF, itself), *choices]
    return tabulate(every, run_choices(itself, choices, 1, lambda *_: None))


@pytest.fixture
def few(monkeypatch):
    """Of the choices those named, which need no equations of features."""

    def kept(names=THREE):
        whole = module.model_choices
        monkeypatch.setattr(
            module, "model_choices", lambda case: [one for one in whole(case) if one.name in names]
        )

    return kept


def test_the_choices_of_a_plain_case():
    assert [*by_name(case())] == [
        "contact law: Hertz", "contact law: Lankarani-Nikravesh", "contact law: Flores",
        "contact law: Johnson", "contact law: Liu", "contact stiffness × 2",
        "contact stiffness ÷ 2", "contact damping × 2", "contact damping ÷ 2",
        "friction law: Coulomb (tanh)", "friction law: Threlfall", "friction law: Ambrósio",
        "friction law: LuGre", "50 µm of play in the guide", "oil film", "elastic rod",
    ]  # fmt: skip


def test_what_a_case_has_is_varied_the_other_way():
    found = by_name(
        case(lubricant=True, rod=True, guide={"clearance_mm": 0.1},
             contact={"law": "flores", "restitution": 0.8}, friction={"law": "threlfall"})
    )  # fmt: skip
    assert found["dry joints"].case.lubricant is None
    assert found["rigid rod"].case.rod is None
    assert found["guide without play"].case.guide.clearance_mm == 0
    assert found["contact law: IMPACT (ADAMS)"].case.contact.law == "impact"
    assert found["friction law: ADAMS"].case.friction.law is None
    assert not {"oil film", "elastic rod", "contact law: Flores"} & {*found}
    without = by_name(case(friction=False))
    assert without["friction"].case.friction == Case().friction
    assert not [name for name in without if name.startswith("friction law")]


def test_pins_that_are_not_the_paper_s_have_a_choice_of_their_own_stiffness():
    values = {"joint": "small_end", "clearance_mm": 0.2}
    name = "contact stiffness of its pins (Eq. 15)"
    assert name not in {one.name for one in model_choices(Case.from_values(values))}
    odd = Case.from_values(values | {"machine": {"pin_radius_mm": 35}})
    (one,) = (choice for choice in model_choices(odd) if choice.name == name)
    assert one.case.contact.materials == ("steel", "steel")
    expected = contact_stiffness("steel", "steel", 0.035, 0.0352, internal=True)
    assert stiffness_of(one.case, "small_end") == pytest.approx(expected)


def test_equations_are_compiled_before_a_choice_has_its_time(few, monkeypatch):
    few()
    done = []
    monkeypatch.setattr(module, "compile_once", lambda needs, remark: done.append(needs))
    real = module.fastest_run
    monkeypatch.setattr(module, "fastest_run", lambda *of: done.append("run") or real(*of))
    case = Case.from_values({"joint": "big_end", "clearance_mm": 0.2, "solve": SHORT})
    others = [Choice("oil", replace(case, lubricant=Lubricant())), *module.model_choices(case)]
    run_choices(case, others, 1, lambda *_: None)
    needs, *runs = done
    assert (needs.horizon, needs.features) == (True, True)
    assert runs == ["run"] * (1 + len(others))


def test_stiffness_and_damping_are_doubled_and_halved_where_the_law_reads_them():
    found = by_name(case())
    contact = found["contact stiffness × 2"].case.contact
    assert contact == replace(Case().contact, stiffness_N_per_mm15=6.72e5)
    assert found["contact damping ÷ 2"].case.contact.damping_N_s_per_mm == 168
    restituting = by_name(case(contact={"law": "flores", "restitution": 0.8}))
    assert restituting["contact damping × 2"].case.contact.restitution == pytest.approx(0.6)
    plastic = by_name(case(contact={"law": "flores", "restitution": 0.4}))["contact damping × 2"]
    assert plastic == Choice("contact damping × 2", None, "needs a restitution above 0.5")
    assert "contact damping × 2" not in by_name(case(contact={"law": "hertz"}))
    liu = {"law": "liu", "length_mm": 20, "materials": ["steel", "steel"]}
    line = by_name(case(contact=liu))["contact stiffness × 2"].case.contact
    assert line.modulus_GPa == pytest.approx(207 / (1 - 0.29**2), rel=1e-9)  # E* doubled
    steel = {"materials": ["steel", "steel"]}
    made = by_name(case(joint="both", clearance_mm=0.1, contact=steel))["contact stiffness ÷ 2"]
    assert made.case.contact.stiffness_N_per_mm15 == pytest.approx(1.68e5, rel=0.01)
    assert made.note.startswith("stiffness_N_per_mm15 ")
    apart = {"joint": "both", "clearance_mm": {"big_end": 0.1, "small_end": 0.2}}
    two = case(**apart, contact=steel | {"geometry": "internal"})
    each = [stiffness_of(two, joint) / 1000**1.5 for joint in JOINTS]
    made = by_name(two)["contact stiffness × 2"]
    assert made.case.contact.stiffness_N_per_mm15 == pytest.approx(2 * math.prod(each) ** 0.5)
    assert made.note.startswith("of both joints, stiffness_N_per_mm15 ")


def test_a_choice_that_cannot_be_says_why():
    off = case(machine={"rod_centre_mm": 200})
    rod = by_name(off)["elastic rod"]
    assert rod.case is None
    assert rod.note.startswith("cannot be: machine.rod_centre_mm: an elastic rod is a uniform bar")


def test_an_oiled_joint_is_tried_with_other_films():
    case = Case.from_values({"joint": "big_end", "clearance_mm": 0.2, "lubricant": True})
    found = {choice.name: choice.case.lubricant for choice in model_choices(case) if choice.case}
    share = case.lubricant.last_share
    assert found["last share of the oil film × 2"].last_share == 2 * share
    assert found["last share of the oil film ÷ 2"].last_share == share / 2
    assert found["viscosity ÷ 2"].viscosity_mPa_s == case.lubricant.viscosity_mPa_s / 2
    assert found["dry joints"] is None
    dry = model_choices(replace(case, lubricant=None))
    assert not [choice.name for choice in dry if "share" in choice.name or "visc" in choice.name]


def test_play_in_the_guide_is_that_of_the_machine_s_own_crosshead():
    """Its inertia was that of the default machine's 14 kg."""
    case = Case.from_values({"joint": "big_end", "clearance_mm": 0.2,
                             "machine": {"reciprocating_mass_kg": 150}})  # fmt: skip
    (own,) = (one.case for one in model_choices(case) if "play" in one.name and one.case)
    given = Case.from_values(case.values() | {"guide": {"clearance_mm": own.guide.clearance_mm}})
    assert own.guide.crosshead_inertia_kg_m2 == given.guide.crosshead_inertia_kg_m2 > 0.2


def test_the_ideal_machine_has_choices_beyond_its_contacts():
    assert [*by_name(Case.from_values({"load": "none"}))] == [
        "50 µm of play in the guide",
        "elastic rod",
    ]


def test_the_table_is_that_of_runs_made_by_hand(few, tmp_path):
    few()
    path = Path(tmp_path / "worn.yaml")
    values = {
        "joint": "big_end",
        "clearance_mm": [0.1, 0.2],
        "solve": SHORT,
        "body": {"start": "rest"},
    }
    path.write_text(json.dumps(values))
    seen = []
    data = explain_models(load_studies(path)[0], lambda done, total, _: seen.append((done, total)))
    assert data["choice"].values.tolist() == [ITSELF, *sorted(THREE)]
    assert seen == sorted(seen)  # each several times where equations are compiled meanwhile
    assert [*dict.fromkeys(seen)] == [(n, 4) for n in (0, 1, 2, 3, 4)]
    assert data.attrs["study"] == "worn"
    by_hand = {
        ITSELF: {},
        "contact stiffness × 2": {"contact": {"stiffness_N_per_mm15": 6.72e5}},
        "friction law: Threlfall": {"friction": {"law": "threlfall"}},
        "contact law: Flores": {"contact": {"law": "flores", "restitution": 0.9}},
    }
    for name, more in by_hand.items():
        run = simulate(case(clearance_mm=0.1, **more))
        row = data.sel(choice=name)
        for metric in METRICS:
            np.testing.assert_array_equal(row[metric], run[metric])
            np.testing.assert_array_equal(row[f"{metric}_error"], run[f"{metric}_error"])
        assert row["regime"] == run.attrs["regime"]
    assert data.attrs["key"] == load_studies(path)[0].cases[0].key


def test_a_damaged_table_is_named(few, tmp_path):
    few(())
    path = Path(tmp_path / "worn.yaml")
    path.write_text(json.dumps({"joint": "big_end", "clearance_mm": 0.1, "solve": SHORT}))
    kept = write_dataset(
        models_file(tmp_path, "worn", "0" * 20), explain_models(load_studies(path)[0])
    )
    assert verify(tmp_path) == []
    kept.write_bytes(kept.read_bytes()[:-1])
    (damage,) = verify(tmp_path)
    assert damage.path == kept
    assert "the command that made it makes it again" in damage.remedy


def test_failed_and_impossible_choices_have_no_numbers():
    good = case()
    choices = [
        Choice("short", replace(good, solve=replace(good.solve, max_steps=20))),
        Choice("none", None, "needs more"),
    ]
    data = tabulate(
        [Choice(ITSELF, good), *choices], run_choices(good, choices, 1, lambda *_: None)
    )
    assert data["status"].values.tolist() == ["ok", "failed", "missing"]
    assert data["reason"].values.tolist() == ["", "budget_steps", ""]
    assert data["note"].values.tolist() == ["", "", "needs more"]
    assert data["peak_acceleration"].isnull().values.tolist() == [False, True, True]


def test_a_case_that_fails_is_the_only_row():
    bad = case(solve={**SHORT, "max_steps": 20})
    choices = model_choices(bad)
    data = run_by_hand(bad, choices)
    assert data["reason"].values.tolist() == ["budget_steps"]
    assert data.attrs["detail"] == "more than 20 steps"


def test_variants_of_one_faulty_joint_and_of_two():
    one, two = ({v.name: v for v in model_variants(case(joint=j))} for j in ("big_end", "both"))
    assert [*one][:4] == ["no friction", "no spring damping", "gravity 9.81 m/s²",
                          "1 µm in the ideal joint"]  # fmt: skip
    assert {choice.name for choice in model_choices(case())} < {*one}
    assert {"gas load", "friction of ideal joints"} < {*one}
    assert "friction of ideal joints" not in two  # both are worn
    assert one["1 µm in the ideal joint"].case.clearance_mm.small_end == 0.001
    assert two["ideal big end"].case.joint == "small_end"
    assert {"ideal big end", "ideal small end"} < {*two}


def test_a_trade_has_a_row_for_each_change_of_each_scene(few, monkeypatch):
    few(("contact law: Flores",))
    names = {
        "contact law flores",
        "friction",
        "clearance of the big end",
        "clearance of the small end",
    }
    rows = tuple(feature for feature in module.FEATURES if feature.name in names)
    monkeypatch.setattr(module, "FEATURES", rows)
    found = trade({"one": case(), "two": case(joint="both")}, repeats=1)
    assert found["peak_acceleration"].dims == ("scene", "choice")
    assert {GRID, "gas load", "ideal big end", "contact law: Flores"} < {*found["choice"].values}
    lacking = found.sel(scene="one", choice="ideal big end")
    assert lacking["status"] == "missing"
    assert np.isnan(lacking["peak_acceleration"])
    for scene in ("one", "two"):
        one = found.sel(scene=scene)
        itself = one.sel(choice=ITSELF)["peak_acceleration"]
        assert abs(one.sel(choice="no friction")["peak_acceleration"] / itself - 1) > 1e-3
        assert one.sel(choice=GRID)["peak_acceleration"] < itself
    assert found["place_error"].values == pytest.approx(0.6123, abs=1e-3)
