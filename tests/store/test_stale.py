"""Jobs that another version has stored: found, counted, and brought up to date."""

import json
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from compsim import cli

from compressor.cases.load import load_studies
from compressor.metrics import BARRED
from compressor.program import PROGRAM
from compressor.store import rows as segments
from compressor.store.reader import open_study, read_store
from compressor.store.rows import GIVEN, encode, merge, read_segment, segment_name
from compressor.store.status import verify
from compressor.sweep.sweep import Options, sweep

SHORT = {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}
NEW = ("rms_acceleration_deviation", "rms_acceleration_deviation_error")  # as if it were new


@pytest.fixture
def wear(tmp_path, monkeypatch, in_process):
    """Makes a study of three jobs, or of what is asked for (JSON is YAML)."""
    monkeypatch.chdir(tmp_path)

    def make(**values):
        values = {"joint": "both", "clearance_mm": [0.1, 0.2, 0.3], **values}
        values["solve"] = SHORT | values.get("solve", {})
        Path("wear.yaml").write_text(json.dumps(values))
        return load_studies("wear.yaml")

    return make


def made_older(monkeypatch, without=(), words=()):
    """Rewrite the rows of a store as an older version would have written them."""
    fewer = {name: value for name, value in segments.NUMBERS.items() if name not in without}
    for path in sorted(Path("results/rows").glob("*.h5")):
        segment = read_segment(path)
        lines = segments.unpack_lines(segment.texts, segment)
        texts = [line.replace(PROGRAM.encode(), b"compsim 0.0.9") for line in lines]
        blank = np.full(len(segment), b"", "S1")
        columns = segment.columns | dict.fromkeys(("given", *words), blank)
        old = replace(segment, columns=columns, texts=segments.pack_lines(texts))
        with monkeypatch.context() as patch:
            patch.setattr(segments, "NUMBERS", fewer)
            data = encode(old)
        path.unlink()
        path.with_name(segment_name(int(path.name[:9]), data)).write_bytes(data)


def found():
    store = read_store("results")
    return {what: len(keys) for what, keys in store.stale(store.keys()).items()}


def test_what_this_version_has_stored_is_not_stale(wear):
    summary = sweep(wear(), "results", 1)
    assert found() == {}
    assert (summary.stale, summary.gaining) == ({}, 0)
    again = sweep(wear(), "results", 1, options=Options(rerun_stale=True))
    assert again.run_now == 0


def test_a_sensor_s_job_of_before_its_metrics_is_stale(wear, monkeypatch):
    """Known by its clipped_fraction; a job without a sensor lacks nothing."""
    new = [name for name, row in segments.NUMBERS.items() if row.when in ("sensor", "threshold")]
    new = [name for name in new if name != "clipped_fraction"]
    body = {"frequency_x_Hz": 4.0, "frequency_y_Hz": 30.0}
    solve = {"duration_rev": 1}
    sweep(wear(clearance_mm=0.1, body=body, sensor=True, solve=solve), "results", 1)
    made_older(monkeypatch, new)
    assert found() == {name: 1 for name in BARRED if name in new and "counts" not in name}
    again = wear(clearance_mm=0.1, body=body, sensor=True, solve=solve)
    assert sweep(again, "results", 1, options=Options(rerun_stale=True)).run_now == 1
    assert found() == {}
    sweep(wear(), "results", 1)
    made_older(monkeypatch, new)
    assert {*found().values()} == {1}


def test_a_store_of_another_program_that_lacks_nothing_is_not_stale(wear, monkeypatch):
    sweep(wear(), "results", 1)
    made_older(monkeypatch)
    assert set(read_store("results").rows.columns["given"]) == {b""}
    assert found() == {}


@pytest.mark.parametrize(
    ("older", "told"),
    [
        ({"without": NEW}, {NEW[0]: 2}),  # the failed job has no metrics
        ({"words": ["promise"]}, {"promise": 2}),
    ],
)
def test_what_another_version_has_stored_is_told_by_what_it_lacks(older, told, wear, monkeypatch):
    fails = {"clearance_mm": 0.1, "solve": {"max_steps": 5}}
    made = wear(blocks=[fails, {"clearance_mm": [0.2, 0.3]}])
    sweep(made, "results", 1)
    made_older(monkeypatch, **older)
    assert found() == told
    summary = sweep(made, "results", 1)
    assert (summary.run_now, summary.stale) == (0, told)
    assert summary.gaining == max(told.values())
    again = sweep(made, "results", 1, options=Options(rerun_stale=True))
    assert (again.run_now, again.stale) == (max(told.values()), {})
    assert found() == {}
    assert sweep(made, "results", 1, options=Options(rerun_stale=True)).run_now == 0


def test_what_a_revision_has_changed_is_told_though_keys_stay(wear, monkeypatch):
    """Jobs with oil of model 2 are stale under 2.1; those without are not."""
    made = wear(blocks=[{"lubricant": True}, {"friction": False}], clearance_mm=[0.1, 0.2])
    with monkeypatch.context() as patch:
        patch.setattr(import_module("compressor.solve.simulate"), "MODEL", "2")
        sweep(made, "results", 1)
    made_older(monkeypatch)
    assert found() == {"this version's oil film": 2}
    assert sweep(made, "results", 1).stale == {"this version's oil film": 2}
    again = sweep(made, "results", 1, options=Options(rerun_stale=True))
    assert (again.run_now, again.stale) == (2, {})
    assert found() == {}


def test_a_metric_without_a_value_is_not_missed_twice(wear, monkeypatch):
    """A metric that a job of this version has no value of does not make the job stale."""
    sweep(wear(), "results", 1)
    store = read_store("results")
    assert set(store.rows.columns["given"]) == {GIVEN.encode()}
    store.rows.numbers["impact_count"][:] = np.nan
    assert store.stale(store.keys()) == {}


def test_a_job_that_runs_again_keeps_all_that_it_had(wear, monkeypatch):
    sweep(wear(clearance_mm=0.1, output={"signals": True}), "results", 1)
    before = open_study("results").load()
    made_older(monkeypatch, NEW)
    assert np.isnan(open_study("results")[NEW[0]])
    less = wear(clearance_mm=0.1, output={"keep": "metrics"}, solve={"error_bars": False})
    assert sweep(less, "results", 1, options=Options(rerun_stale=True)).run_now == 1
    assert found() == {}
    assert verify("results") == []
    after = open_study("results").load()
    names = [name for name in before.data_vars if name not in ("seconds", "study")]
    assert before[names].identical(after[names])
    sweep(less, "results", 1)  # removes the file that was replaced
    assert len([*Path("results/jobs").iterdir()]) == 1


def test_merged_segments_keep_what_each_row_was_given(wear, monkeypatch):
    sweep(wear(clearance_mm=0.1), "results", 1)
    made_older(monkeypatch, NEW)
    sweep(wear(), "results", 1)
    paths = sorted(Path("results/rows").glob("*.h5"))
    merged = merge([read_segment(path) for path in paths])
    data = encode(merged)
    for path in paths:
        path.unlink()
    Path("results/rows", segment_name(9, data)).write_bytes(data)
    assert found() == {NEW[0]: 1}


def test_run_says_how_many_would_gain_and_by_what(wear, monkeypatch, capsys):
    wear()
    assert cli.main(["run", "wear.yaml", "-j", "1"]) == 0
    assert "stale" not in capsys.readouterr().err
    made_older(monkeypatch, NEW)
    assert cli.main(["run", "wear.yaml", "-j", "1"]) == 0
    assert (
        f"3 jobs of another version would gain by running again (3 lack {NEW[0]}): --rerun stale"
    ) in " ".join(capsys.readouterr().err.split())
    assert cli.main(["run", "wear.yaml", "-j", "1", "--rerun", "stale", "--rerun", "failed"]) == 0
    err = capsys.readouterr().err
    assert "3 jobs run in" in err
    assert "--rerun stale" not in err
