"""Margins: by hand, with errors that are known, and on the paper's claims."""

import math

import numpy as np
import pytest

from compressor.analysis.claims import claims
from compressor.analysis.margins import Margin, Measure, above, at_least, at_most, least


def test_margins_by_hand():
    assert at_least(Measure(3.3, 0.3), 3.0) == pytest.approx((0.1, 0.1))
    assert at_least(Measure(2.4, 0.3), 3.0) == pytest.approx((-0.2, 0.1))
    assert at_most(Measure(0.02, 0.01), 0.05) == pytest.approx((0.6, 0.2))
    assert above(Measure(2.0), 2.0).value < 0.0 == at_least(Measure(2.0), 2.0).value


def test_a_ratio_s_relative_errors_add():
    ratio = Measure(6.0, 0.06).over(Measure(2.0, 0.04))
    assert ratio == pytest.approx((3.0, 3.0 * 0.03))
    assert Measure(1.0).over(Measure(0.0)).value == math.inf


def test_the_least_margin_reaches_as_low_as_any_may_be():
    assert least([Margin(0.1, 0.01), Margin(0.3, 0.05)]) == pytest.approx((0.1, 0.01))
    assert least([Margin(0.1, 0.01), Margin(0.3, 0.5)]) == pytest.approx((0.1, 0.3))
    unknown = least([Margin(0.1, 0.01), Margin(0.3, math.nan)])
    assert unknown.value == 0.1
    assert math.isnan(unknown.error)


def test_what_is_said_of_a_margin():
    assert Margin(0.0783, 0.00024).said == "+7.83 % (± 0.024 %)"
    assert Margin(-0.01, 0.02).said == "-1 % (± 2 %, undecided)"
    assert Margin(-0.01, math.nan).said == "-1 % (no error bar)"


def test_a_claim_holds_where_its_margin_is_not_negative(paper_runs):
    for claim in claims(paper_runs):
        assert claim.held is (claim.margin.value >= 0.0), claim.number
        assert claim.margin.error >= 0.0, claim.number


def test_a_margin_moves_with_its_measure(paper_runs):
    """Claim 5: each vertical peak lowered by a tenth raises the ratio, and the margin with it."""
    runs = {name: run.copy(deep=True) for name, run in paper_runs.items()}
    for run in runs.values():
        run["peak_contact_force_axis"].loc[{"axis": "y"}] *= 0.9
    before, after = (claims(one)[4].margin.value for one in (paper_runs, runs))
    assert (1.0 + after) == pytest.approx((1.0 + before) / 0.9)


def test_error_bars_are_carried_through(paper_runs):
    """Claim 4's error is that of the two peaks beside its smallest ratio, or of a larger one."""
    runs = {name: run.copy(deep=True) for name, run in paper_runs.items()}
    for run in runs.values():
        for name in ("peak_acceleration", "peak_contact_force"):
            run[f"{name}_error"] = 0.01 * np.abs(run[name])
    margin = claims(runs)[3].margin
    assert margin.error >= 0.0199 * (1.0 + margin.value)
    for run in runs.values():
        run["peak_acceleration_error"][...] = np.nan
    assert math.isnan(claims(runs)[3].margin.error)


def test_runs_without_bars_have_margins_without_error(paper_runs):
    runs = {name: run.copy(deep=True) for name, run in paper_runs.items()}
    for run in runs.values():
        run["acceleration_error"][...] = np.nan
    for number in (3, 6, 7):
        claim = claims(runs)[number - 1]
        assert math.isnan(claim.margin.error), number
        assert claim.held in (True, False)
