"""Work and precision: errors that fall, failures that stay, references that know their limits."""

import numpy as np
import pytest
from conftest import write_cases

from compressor.program import no_progress
from compressor.report.figures.drawing import panels_of
from compressor.solve.simulate import simulate
from compressor.studies.tradeoff import work_precision
from compressor.sweep.sweep import Options, in_this_process, sweep

SHORT = {"duration_rev": 0.25, "settle_rev": 0}
METHODS = ("auto", "RODAS", "LSODA")
SOME = ["solve.method=[auto, RODAS, LSODA]", "solve.rtol=[1.0e-3, 1.0e-7, 1.0e-5, 1.0e-12]"]


def made(place, *overrides, **values):
    values = {"joint": "big_end", "clearance_mm": 0.2, "solve": SHORT} | values
    (path,) = write_cases(place, worn=values)
    study, texts = work_precision.load_methods(str(path), overrides, place / "kept")
    sweep([study], place / "kept", 1, no_progress, Options("", texts, backend=in_this_process))
    return work_precision.work_precision(place / "kept", study), study, place / "kept"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return made(tmp_path_factory.mktemp("methods"), *SOME, "solve.timeout_s=600")


@pytest.fixture(scope="module")
def study(whole):
    return whole[0]


def test_errors_fall_with_the_tolerance(study):
    assert study["rtol"].values.tolist() == [1e-3, 1e-5, 1e-7, 1e-12]
    assert (study["error_acceleration"].sel(rtol=1e-7) < 1e-5).all()
    compared = study["error_acceleration"].sel(rtol=[1e-3, 1e-5, 1e-7])
    assert (compared.diff("rtol") < 0).all()
    # none is judged by itself: RODAS at 1e-12 is the truth of others, the tightest other one its
    apart = study["reference_uncertainty"].item()
    rodas = study["error_acceleration"].sel({"method": "RODAS", "rtol": 1e-12}).item()
    assert 0 < apart == rodas < 1e-8
    assert compared.min() > apart


def test_errors_are_those_of_runs_made_by_hand(whole):
    found, study, _ = whole
    cases = {(one.solve.method, one.rtol): one for one in study.cases}
    run, truth = (simulate(cases[which]) for which in (("auto", 1e-5), ("RODAS", 1e-12)))
    a, b = (one["acceleration"].values for one in (run, truth))
    one = found.sel({"method": "auto", "rtol": 1e-5}).squeeze()
    assert one["error_acceleration"] == np.linalg.norm(a - b) / np.linalg.norm(b)


def test_a_job_that_fails_has_no_error(tmp_path):
    found = made(tmp_path, "solve.method=[auto, RODAS]", "solve.max_steps=900")[0]
    failed = found["status"] == "failed"
    assert failed.any()
    assert not failed.all()
    assert (found["error_acceleration"].isnull() == failed).all()
    assert {*found["reason"].values.ravel()} == {"", "budget_steps"}


def test_a_run_that_finds_its_own_length_gives_it_to_all(tmp_path, in_process):
    """A draft of this one settles after one revolution."""
    solve = {"duration_rev": "auto", "settle_rev": "auto", "accuracy": "draft"}
    (path,) = write_cases(tmp_path, auto={"joint": "big_end", "clearance_mm": 0.2, "solve": solve})
    study, texts = work_precision.load_methods(str(path), SOME, tmp_path)
    assert {(one.solve.duration_rev, one.solve.settle_rev) for one in study.cases} == {(4.0, 1.0)}
    assert "solve.settle_rev=1.0" in texts


def synthetic(errors, seconds, unknown):
    rows = [
        {"scene": "s", "method": method, "rtol": rtol, "error_acceleration": errors[m][n],
         "seconds": seconds[m][n], "reference_uncertainty": unknown}
        for m, method in enumerate("ab") for n, rtol in enumerate((1e-2, 1e-5))
    ]  # fmt: skip
    return work_precision.tabulate(rows)


def test_the_fastest_of_each_decade():
    data = synthetic([[0.05, 2e-5], [0.5, 1e-4]], [[1.0, 9.0], [0.1, 3.0]], 1e-12)
    found = {
        row["error_below"]: (row["method"], row["seconds"]) for row in work_precision.fastest(data)
    }
    assert found == {0.1: ("a", 1.0), 0.01: ("b", 3.0), 1e-3: ("b", 3.0), 1e-4: ("b", 3.0)}
    # nothing is fastest below what the references know
    data = synthetic([[0.05, 1e-9], [np.nan, np.nan]], [[1.0, 9.0], [np.nan, 4.0]], 5e-5)
    assert [row["error_below"] for row in work_precision.fastest(data)] == [0.1, 0.01, 1e-3, 1e-4]


def test_the_figure_draws_what_is_there(study):
    figure = work_precision.draw_work_precision(study)
    (panel,) = panels_of(figure)
    assert panel.x.type == panel.y.type == "log"
    lines = [trace.y for trace in panel.traces if trace.y.size == 4 and trace.name]
    assert len(lines) == len(METHODS)
    first = study["error_acceleration"].values[0, 0]
    assert any(line == pytest.approx(first) for line in lines)
