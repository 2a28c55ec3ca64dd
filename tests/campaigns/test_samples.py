"""Samples of campaigns, run again: they give what is kept."""

import measure_validation
import pytest
from measure_chaotic import OTHER, compare_rms
from measure_claims import CLAIMS, judged_alone
from page_tables import kept
from published import guided

from compressor.cases.case import Case
from compressor.cases.examples import templates
from compressor.cases.load import load_studies


@pytest.mark.compiled
def test_published_numbers_come_out_again():
    """What is kept was found by this code, to the digits that are shown.

    Bearings and wear are held to the published numbers by physics/test_film.py and
    analysis/test_wear_hours.py.
    """
    found = {(one["what"], one["source"]): one["found"] for one in kept("validation.json")["rows"]}
    subjects = ("play", "dry_joint", "frame", "elastic_rod")
    again = [one for name in subjects for one in getattr(measure_validation, name)()]
    for one in again:
        same = found[one["what"], one["source"]]
        assert one["found"] == pytest.approx(same, rel=1e-6, abs=one["within"])
        assert abs(one["found"] - one["expected"]) <= one["within"]
    assert len(again) >= 27


def test_the_free_crank_keeps_its_energy():
    """Nothing drives it: what is lost is lost to the guide, before and after the first contact."""
    run = guided(rtol=1e-9, duration_s=8e-3)
    assert float(run.guide_gap.min()) < 0.0
    assert float(run.crank_work) == 0.0
    assert float(run.contact_damping_loss + run.friction_loss) > 0.0
    assert float(run.energy_residual) < 1e-6


def test_the_default_machine_has_its_margins_of_claims():
    stored, found = kept("claims.json")["default"], judged_alone(Case.from_values({}))
    for claim in CLAIMS:
        both = stored["error"][claim - 1] + found["error"][claim - 1] + 1e-9
        assert abs(stored["margin"][claim - 1] - found["margin"][claim - 1]) <= both, claim


def test_all_claims_but_one_hold_in_the_consistent_machine():
    (study,) = load_studies(templates()["consistent"].path)
    margins = judged_alone(study.cases[0])["margin"]
    assert [claim for claim in CLAIMS if margins[claim - 1] > 0.05] == [1, 2, 3, 4, 5, 6, 8]


@pytest.mark.slow
def test_a_chaotic_case_says_so_and_knows_its_rms():
    row = compare_rms({"joint": "both", "clearance_mm": 0.2}, OTHER)
    assert row["regime"] == "chaotic"
    assert row["apart"] < 4.0  # standard errors
    assert row["known"] < 0.1
