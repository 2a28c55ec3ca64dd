"""The comparison with other tools: they solve our problem, and the contest is fair."""

import json

import measure_peers
import page_tables
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
    found = notebook.acceleration(scene, 1e-9, SHORT)
    assert mechanism.error(found, exact[scene]) < 2e-5


def test_agreement_would_show_a_wrong_lever_arm(exact, monkeypatch):
    monkeypatch.setattr(mechanism, "BORE", mechanism.PIN)
    found = notebook.acceleration("small_end", 1e-9, SHORT)
    assert mechanism.error(found, exact["small_end"]) > 1e-3


def test_kept_contests_are_at_equal_or_better_error():
    kept = json.loads((page_tables.RESULTS / "peers.json").read_text(encoding="utf-8"))
    tools = {(row["tool"], row["scene"]) for row in kept["rows"]}
    assert tools == {(p.tool, s) for p in measure_peers.PEERS for s in mechanism.SCENES}
    for row in kept["rows"]:
        assert "reason" in row or row["our_error"] <= row["error"]
    for check in kept["agreement"]:  # wrong lever arms would leave 1e-3 and more
        assert check["ours_to_reference"] < 1e-6
        assert "reason" in check or check["exudyn_to_ours"] < 1e-4
