"""The comparison with other tools: they solve our problem, and the contest is fair."""

import pytest
from peers import mechanism, notebook

from compressor.cases.case import Case
from compressor.solve.simulate import simulate

SHORT = 0.07  # s: past the dead centre that shuts the gas in, with landings


@pytest.fixture(scope="module")
def exact():
    """Our acceleration over SHORT in each scene, at a tight tolerance."""
    runs = {}
    for scene in mechanism.SCENES:
        values = mechanism.case_values(scene, SHORT, rtol=1e-10, settle_rev=0)
        runs[scene] = simulate(Case.from_values(values))["acceleration"].values
    return runs


@pytest.mark.parametrize("scene", mechanism.SCENES)
def test_plain_scipy_agrees(exact, scene):
    assert mechanism.error(notebook.acceleration(scene, 1e-9, SHORT), exact[scene]) < 2e-5


def test_agreement_would_show_a_wrong_lever_arm(exact, monkeypatch):
    monkeypatch.setattr(mechanism, "BORE", mechanism.PIN)
    found = notebook.acceleration("small_end", 1e-9, SHORT)
    assert mechanism.error(found, exact["small_end"]) > 1e-3
