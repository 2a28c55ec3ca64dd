"""The claims over machines: a sample again, and what is kept says the same in words and numbers."""

import pytest
from measure_claims import CLAIMS, closed, midway
from page_tables import claims_table, claims_words, kept

from compressor.cases.case import Case
from compressor.cases.examples import example
from compressor.cases.load import load_studies
from compressor.studies.claims.study import judge


def machine(rod, reciprocating, **solve):
    masses = {"rod_mass_kg": rod, "reciprocating_mass_kg": reciprocating}
    return Case.from_values({"machine": masses, "solve": solve})


def test_the_default_machine_is_as_it_was():
    stored, found = kept("claims.json")["default"], judge(Case.from_values({}))
    for claim in CLAIMS:
        both = stored["error"][claim - 1] + found.error[claim - 1] + 1e-9
        assert abs(stored["margin"][claim - 1] - found.margin[claim - 1]) <= both, claim


def test_a_margin_is_followed_to_its_zero_between_two_machines():
    """Claim 6 fails with a light crosshead and holds with a heavy one."""
    quick = {"accuracy": "draft", "duration_rev": 2, "output_step_deg": 1}
    light, heavy = machine(4.7, 9.0, **quick), machine(4.7, 14.0, **quick)
    within, width = closed(light, heavy, 6)
    assert within
    assert width < 1.0


def test_a_machine_between_two_has_the_inertia_of_its_own_bar():
    found = midway(machine(3, 10), machine(5, 20)).machine
    assert (found.rod_mass_kg, found.reciprocating_mass_kg) == (4, 15)
    assert found.rod_inertia_kg_m2 == pytest.approx(4 * 0.36 / 12)


def test_the_map_was_made_in_time_and_changes_sides_by_passing_zero():
    found = kept("claims.json")
    assert found["map"]["judged"] + found["map"]["failed"] == 1600
    assert found["map"]["seconds"] < 300
    for claim in CLAIMS:
        inside = found["between"][str(claim)]
        assert inside["closed"] == inside["pairs"], claim


def test_the_example_is_the_most_consistent_machine():
    (study,) = load_studies(example("consistent"))
    found, best = study.cases[0].machine, kept("claims.json")["consistent"]
    assert (found.rod_mass_kg, found.reciprocating_mass_kg) == pytest.approx(
        (best["rod_mass"], best["reciprocating_mass"])
    )
    assert best["least"] > 0.05
    assert best["claims"] == [3, 4, 5, 6, 8]


def test_the_other_example_is_the_machine_in_which_all_claims_hold():
    (study,) = load_studies(example("agreeing"))
    case, best = study.cases[0].values(), kept("claims.json")["search"]
    groups = [case[name] for name in ("machine", "friction", "contact", "gas")]
    given = {key: value for group in groups for key, value in group.items()}
    assert {key: given[key] for key in best["values"]} == pytest.approx(best["values"])
    sure = [m - e for m, e in zip(best["margin"], best["error"], strict=True)]
    assert min(sure) >= 0.0
    assert 100 * best["margin"][7] == pytest.approx(1.1, abs=0.05)  # as its comment says


def test_the_words_are_those_of_the_numbers():
    found = kept("claims.json")
    each = found["map"]["each"]
    assert all(f"{claim} in {each[str(claim)]}" in found["map"]["said"][0] for claim in CLAIMS)
    assert f"hold in {found['map']['all'] or 'none'} of them" in " ".join(found["map"]["said"])
    search = found["search"]
    holds = all(m - e >= 0.0 for m, e in zip(search["margin"], search["error"], strict=True))
    assert search["said"][0].startswith("All eight claims hold, each beyond its error") == holds
    for place, said in enumerate(found["assumptions"]["deciding"]):
        total = [value or 0.0 for value in found["assumptions"]["total_order"][place]]
        name = found["assumptions"]["names"][total.index(max(total))]
        assert "same at all machines" in said or f"most by {name}, " in said
    assert claims_words().count("\n") == 3
    assert claims_table().count("\n") >= 9
