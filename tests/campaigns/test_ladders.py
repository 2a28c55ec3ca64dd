"""Errors fall with the tolerance; the motion goes to the ideal one as the clearance vanishes."""

import numpy as np
import pytest
from measure_ladders import AUDIT, TOLERANCES, limit, slopes
from page_tables import kept

from compressor.cases.case import Case
from compressor.solve.simulate import measure

NEAR_ONE = pytest.approx(1.0, abs=0.1)


def test_what_is_kept_has_slope_one_to_a_nanometre():
    measured = kept("ladders.json")
    assert measured["slopes"] == slopes(measured["limit"])
    for scene in measured["slopes"]:
        widths = [row["clearance"] for row in measured["limit"] if row["scene"] == scene]
        assert (max(widths), min(widths)) == pytest.approx((1e-3, 1e-9), rel=1e-9, abs=0)
    for found in measured["slopes"].values():
        assert [*found.values()] == [NEAR_ONE] * 3


def test_the_motion_goes_to_the_ideal_one_with_the_clearance():
    rows = limit(clearances=[1.0, 0.01, 1e-4])
    for scene, found in slopes(rows).items():
        assert [*found.values()] == [NEAR_ONE] * 3, scene


@pytest.mark.parametrize("name", ["error_acceleration", "energy_residual"])
def test_a_kept_ladder_falls_rung_by_rung(name):
    """By as much as the tolerance on the whole: 0.7 to 1.5 decades a rung from 1e-3 on.

    Over two rungs at least: one run of fifty is three to six times worse than its neighbours in
    tolerance (an impact met at an unlucky moment), so that a single rung may rise by as much.
    """
    measured = kept("ladders.json")
    for scene, apart in measured["references_apart"].items():
        rungs = [row for row in measured["ladder"] if row["scene"] == scene]
        assert [row["rtol"] for row in rungs] == TOLERANCES
        errors = np.log10([row[name] for row in rungs])
        assert (np.diff(errors) < 0.5).all()
        assert (errors[2:] < errors[:-2]).all()
        assert 0.7 < -np.polyfit(range(len(errors) - 1), errors[1:], 1)[0] < 1.5
        assert apart < 0.1 * rungs[-1]["error_acceleration"] or apart < 1e-8


@pytest.mark.parametrize("joint", ["big_end", "small_end", "both"])
@pytest.mark.parametrize("clearance", [1e-6, 1.0])
def test_a_nanometre_and_a_millimetre_pass_the_audit(joint, clearance):
    """The paper's contact; in mm."""
    solve = {"duration_rev": 2, "error_bars": False}
    case = Case.from_values({"joint": joint, "clearance_mm": clearance, "solve": solve})
    found = measure(case)
    assert (found.status, found.reason) == ("ok", "")
    assert 0 < found.numbers["energy_residual"] < AUDIT * case.rtol * 2
