"""Samples of campaigns, run again: they give what is kept."""

import measure_validation
import pytest
from page_tables import kept

from compressor.analysis import cases_of, claims
from compressor.cases.examples import templates
from compressor.cases.load import load_studies
from compressor.solve.simulate import simulate


@pytest.mark.compiled
def test_published_numbers_come_out_again():
    """What is kept was found by this code, to the digits that are shown.

    Bearings and wear are held to the published numbers by physics/test_film.py and
    analysis/test_wear_hours.py.
    """
    found = {(one["what"], one["source"]): one["found"] for one in kept("validation.json")["rows"]}
    subjects = ("play", "dry_joint", "frame")
    again = [one for name in subjects for one in getattr(measure_validation, name)()]
    again += measure_validation.elastic_rod(0.003)
    for one in again:
        if one["expected"]:  # else it is an error itself
            same = found[one["what"], one["source"]]
            assert one["found"] == pytest.approx(same, rel=1e-6, abs=one["within"])
        assert abs(one["found"] - one["expected"]) <= one["within"]
    assert len(again) >= 27


@pytest.mark.parametrize(
    ("machine", "margins"),
    [
        ("paper", (1.0, 0.073, 0.078, -0.042, 0.99, 0.046, -0.05, -0.10)),
        ("consistent", (1.0, 0.073, 0.111, 0.289, 1.57, 0.098, -0.05, 0.119)),
        ("agreeing", (1.0, 0.073, 0.233, 0.148, 0.47, 0.095, 0.024, 0.012)),
    ],
)
def test_claims_hold_where_the_page_of_the_paper_says_so(machine, margins):
    """Beyond their errors: five, all but 7, and all eight."""
    case = load_studies(templates()[machine].path)[0].cases[0]
    judged = claims({name: simulate(one) for name, one in cases_of(case).items()})
    for claim, expected in zip(judged, margins, strict=True):
        value, error = claim.margin
        assert abs(value) > error, claim
        assert value == pytest.approx(expected, rel=0.02, abs=0.001), claim
