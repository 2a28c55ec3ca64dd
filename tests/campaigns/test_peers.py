"""The comparison with other tools: they solve our problem, and the contest is fair."""

import json

import measure_peers
import numpy as np
import page_tables
import pytest
from measure_peers import Contest, Peer
from peers import mechanism, multibody, notebook, soda, sweeps
from peers.mechanism import loosest

from compressor.cases.case import Case
from compressor.solve.simulate import simulate

SHORT = 0.03  # s: a quarter of a revolution, with landings and two phases of the load


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
    found = notebook.acceleration(notebook.by_scipy, scene, 1e-9, SHORT)
    assert mechanism.error(found, exact[scene]) < 2e-5


def test_agreement_would_show_a_wrong_lever_arm(exact, monkeypatch):
    monkeypatch.setattr(mechanism, "BORE", mechanism.PIN)
    found = notebook.acceleration(notebook.by_scipy, "small_end", 1e-9, SHORT)
    assert mechanism.error(found, exact["small_end"]) > 1e-3


@pytest.mark.parametrize("scene", mechanism.SCENES)
def test_exudyn_agrees(exact, scene):
    pytest.importorskip("exudyn", reason="exudyn is not installed (make peers)")
    found = multibody.acceleration(scene, rtol=1e-9, duration=SHORT)
    assert mechanism.error(found, exact[scene]) < 1e-4


def test_exudyn_agrees_with_fixed_steps(exact):
    pytest.importorskip("exudyn", reason="exudyn is not installed (make peers)")
    found = multibody.acceleration("both", step=2e-6, duration=SHORT)
    assert mechanism.error(found, exact["both"]) < 2e-3


@pytest.mark.parametrize("scene", mechanism.SCENES)
def test_cvode_agrees(exact, scene):
    pytest.importorskip("sksundae", reason="sksundae is not installed (make peers)")
    found = notebook.acceleration(notebook.by_cvode, scene, 1e-9, SHORT)
    assert mechanism.error(found, exact[scene]) < 1e-4


@pytest.mark.parametrize("scene", mechanism.SCENES)
def test_numbalsoda_agrees(exact, scene):
    pytest.importorskip("numbalsoda", reason="numbalsoda is not installed (make peers)")
    found = soda.acceleration(scene, 1e-9, SHORT)
    assert mechanism.error(found, exact[scene]) < 1e-4


def test_script_agrees_on_a_finer_grid(monkeypatch):
    pytest.importorskip("numbalsoda", reason="numbalsoda is not installed (make peers)")
    from peers import script

    monkeypatch.setattr(script, "TIMES", np.linspace(0.0, 0.48, 480_001))
    monkeypatch.setattr(script, "SETTLED", 120_000)
    found = np.array([script.run(2e-4, 1e-9)[:2]])
    assert sweeps.peak_errors(found, sweeps.our_peaks([0.2], 1e-11)).max() < 2e-5


def test_script_and_our_sweep_find_the_peaks(tmp_path):
    pytest.importorskip("numbalsoda", reason="numbalsoda is not installed (make peers)")
    found, (wall, cpu) = sweeps.run_script(3, tmp_path, 1e-6)
    errors = sweeps.peak_errors(found, sweeps.our_peaks(sweeps.clearances(3), 1e-11))
    assert 1e-4 < errors.max() < 0.1  # of the output grid
    assert wall > 0 < cpu


def test_our_sweep_finds_the_peaks_in_order(tmp_path):
    found, (wall, cpu) = sweeps.run_ours(3, tmp_path, {"error_bars": False})
    truth = sweeps.our_peaks(sweeps.clearances(3), 1e-11)
    assert sweeps.peak_errors(found, truth).max() < 1e-3
    assert sweeps.peak_errors(found[::-1], truth).max() > 0.1
    assert wall > 0 < cpu


def test_rows_of_sweeps_have_medians_and_ratios():
    times = {"a": [((5, 6), (9, 14)), ((5, 6), (13, 14))], "b": [((1, 2), (3, 4))] * 2}
    errors = {"a": [(0.1, 0.2), (0.3, 0.4)], "b": [(0.0, 0.0)] * 2}
    theirs, ours = sweeps.make_rows(times, errors, 1000)
    assert (theirs["seconds"], theirs["ms_a_job"], theirs["cpu_ms_a_job"]) == (11, 6, 8)
    assert (theirs["peak_acceleration_error"], theirs["worst_peak_contact_force_error"]) == (
        0.2, 0.4
    )  # fmt: skip
    assert (ours["ratio"], ours["ratio_a_job"], ours["cpu_ratio_a_job"]) == (3.67, 3, 4)
    assert "ratio" not in theirs


def test_pieces_share_out_the_grid():
    taken = mechanism.pieces(mechanism.DURATION)
    samples = np.concatenate([piece[0] for piece in taken])
    assert samples.tolist() == list(range(4801))
    for _, times, wanted, _ in taken:
        assert (np.diff(times) > 0).all()
        assert wanted.max() < times.size


def test_loosest_tolerance_that_is_no_worse():
    errors = {1e-3: 3e-2, 1e-4: 4e-3, 1e-5: 5e-3, 1e-6: 1e-4}
    assert loosest(errors, 4e-3) == 1e-4  # equal is enough
    assert loosest(errors, 3.9e-3) == 1e-6
    assert loosest(errors, 1e-5) is None


def test_row_of_a_contest_has_medians_and_ratios():
    peer = Peer("a", "", None)
    contest = Contest(peer, "both", 1e-3, 9.0, 1e-4)
    contest.theirs = [(4.0, 9.0), (1.0, 2.0), (2.0, 3.0)]
    contest.ours, contest.kernel = [(0.1, 0.3), (0.5, 0.6), (0.2, 0.2)], [0.1, 0.2, 0.1]
    row = contest.row({1e-4: 5e-4})
    assert (row["seconds"], row["setup_seconds"], row["our_seconds"]) == (2.0, 7.0, 0.2)
    assert (row["ratio"], row["wall_ratio"], row["kernel_wall_ratio"]) == (10.0, 10.0, 30.0)
    assert (row["error"], row["our_error"]) == (1e-3, 5e-4)


def test_kept_contests_are_at_equal_or_better_error():
    kept = json.loads((page_tables.RESULTS / "peers.json").read_text(encoding="utf-8"))
    tools = {(row["tool"], row["scene"]) for row in kept["rows"]}
    assert tools == {(p.tool, s) for p in measure_peers.PEERS for s in mechanism.SCENES}
    for row in kept["rows"]:
        assert "reason" in row or row["our_error"] <= row["error"]
    for check in kept["agreement"]:  # wrong lever arms would leave 1e-3 and more
        assert check["ours_to_reference"] < 1e-6
        assert "reason" in check or check["exudyn_to_ours"] < 1e-4
