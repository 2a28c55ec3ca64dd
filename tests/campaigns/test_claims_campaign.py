"""The claims over machines: a sample again, and what is kept holds."""

import pytest
from measure_claims import CLAIMS, judged_alone
from page_tables import kept

from compressor.cases.case import Case
from compressor.cases.examples import example
from compressor.cases.load import load_studies


def test_the_default_machine_is_as_it_was():
    stored, found = kept("claims.json")["default"], judged_alone(Case.from_values({}))
    for claim in CLAIMS:
        both = stored["error"][claim - 1] + found.error[claim - 1] + 1e-9
        assert abs(stored["margin"][claim - 1] - found.margin[claim - 1]) <= both, claim


def test_the_example_is_the_most_consistent_machine():
    (study,) = load_studies(example("consistent"))
    found, best = study.cases[0].machine, kept("claims.json")["consistent"]
    assert (found.rod_mass_kg, found.reciprocating_mass_kg) == pytest.approx(
        (best["rod_mass"], best["reciprocating_mass"])
    )
    assert best["least"] > 0.05
    assert best["claims"] == [3, 4, 5, 6, 8]


def test_in_the_other_example_all_claims_hold_beyond_their_errors():
    best = kept("claims.json")["agreeing"]
    sure = [m - e for m, e in zip(best["margin"], best["error"], strict=True)]
    assert min(sure) >= 0.0
    assert 100 * best["margin"][7] == pytest.approx(1.1, abs=0.05)  # as its comment says
