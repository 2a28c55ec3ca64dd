"""Sweeps: only what is missing runs, and no failure of a job, or of us, costs another job."""

import os
import re
import sys
from functools import partial
from pathlib import Path

import bad_jobs
import h5py
import numpy as np
import pytest
from conftest import flip

from compressor.cases.case import Case
from compressor.store import netcdf
from compressor.store import reader as store
from compressor.store.batch import make_batches
from compressor.store.files import FolderLost, StoreError
from compressor.store.status import verify
from compressor.sweep.sweep import RequestedJobs, sweep
from compressor.sweep.worker import attempt

SWEEP = sys.modules["compressor.sweep.sweep"]  # the function of its name hides it

BOTH = {"joint": "both", "clearance_mm": 0.1}
LATE = {**BOTH, "solve": {"method": "DOP853", "timeout_s": 1e-9, "duration_rev": 0.05}}  # at once


def statuses(folder, study):
    return [store.read_store(folder).status(case.key).status for case in study.cases]


@pytest.mark.parametrize(
    ("first", "then", "runs"),
    [
        ({"output": {"keep": "metrics"}}, {"output": {"keep": "series"}}, 1),
        ({"output": {"precision": "single"}}, {}, 1),
        ({"output": {"precision": "single"}}, {"output": {"keep": "metrics"}}, 0),
        ({"solve": {"error_bars": False}}, {}, 1),
        ({**BOTH, "solve": {"max_steps": 5, "error_bars": False}},
         {**BOTH, "solve": {"max_steps": 5}}, 0),  # a failed job can have none
        ({"solve": {"horizon": False}}, {"solve": {"horizon": True}}, 1),
        ({}, {"output": {"signals": True}}, 1),
        ({"name": "one"}, {"name": "other"}, 0),
        (LATE, {**LATE, "solve": LATE["solve"] | {"timeout_s": 100}}, 1),
        ({"machine": {"speed_rpm": 500}}, {"machine": {"speed_rpm": 501}}, 1),
    ],
)  # fmt: skip
def test_what_a_changed_case_file_runs_again(first, then, runs, studies, tmp_path, in_process):
    """What holds more serves both."""
    sweep(studies(one=first), tmp_path / "out", 1)
    assert sweep(studies(one=then), tmp_path / "out", 1).run_now == runs
    for values in (then, first):
        assert sweep(studies(one=values), tmp_path / "out", 1).run_now == 0


def test_where_studies_share_a_job_the_greater_demand_counts(studies):
    few = {"output": {"keep": "metrics"}, "solve": {"error_bars": False, "horizon": False}}
    more = {"output": {"signals": True}, "solve": {"horizon": True}}
    for made in (studies(few=few, all=more), studies(all=more, few=few)):
        (case,) = RequestedJobs(made).cases()
        assert (case.output.keep, case.output.signals) == ("series", True)
        assert (case.solve.error_bars, case.solve.horizon) == (True, True)


@pytest.mark.parametrize("damage", [lambda _: b"", lambda data: data[:-9]])
def test_damage_is_mended_by_the_same_run(damage, studies, tmp_path, in_process):
    made = studies(one={"load": ["none", "spring"]})
    sweep(made, tmp_path / "out", 1)
    victim = min((tmp_path / "out/batches").glob("*"))
    victim.write_bytes(damage(victim.read_bytes()))
    told = []
    assert sweep(made, tmp_path / "out", 1, lambda *event: told.append(event[2])).run_now == 1
    assert verify(tmp_path / "out") == []
    assert statuses(tmp_path / "out", made[0]) == ["ok", "ok"]
    assert any(str(victim) in remark for remark in told)


def test_damaged_numbers_are_mended_with_series_as_exact_as_they_were(
    studies, tmp_path, in_process, monkeypatch
):
    monkeypatch.setattr(netcdf, "MAX_COMPACT", 0)  # as in batches of many jobs
    sweep(studies(one={}), tmp_path / "out", 1)
    for rough in ({"keep": "metrics"}, {"precision": "single"}):
        (path,) = tmp_path.glob("out/batches/*.h5")
        made = studies(one={"output": rough})
        job = store.read_job(tmp_path / "out", made[0].cases[0].key)
        flip(path, job.peak_acceleration.values)
        assert sweep(made, tmp_path / "out", 1).run_now == 1
        assert sweep(made, tmp_path / "out", 1).run_now == 0
        again = store.read_job(tmp_path / "out", made[0].cases[0].key[:10])
        assert again.acceleration.identical(job.acceleration)
        assert verify(tmp_path / "out") == []


def test_a_damaged_failed_job_is_mended(studies, tmp_path, in_process, monkeypatch):
    """It was an error, since why the job failed is read from what is damaged."""
    monkeypatch.setattr(netcdf, "MAX_COMPACT", 0)
    made, out = studies(stuck={**BOTH, "solve": {"max_steps": 5}}), tmp_path / "out"
    first = sweep(made, out, 1)
    (path,) = out.glob("batches/*.h5")
    with h5py.File(path) as file:
        attributes = file["attributes"][()]
    flip(path, attributes)
    again = sweep(made, out, 1)
    assert (again.run_now, again.failed) == (1, first.failed)
    assert verify(out) == []
    assert sweep(made, out, 1).run_now == 0


HARM = {  # by load and rod mass: the reason, the detail
    ("none", 4): ("internal_error", "KeyError: 'the bug'"),
    ("none", 5): ("worker_died", ".*SIGSEGV.*ran again alone"),
    ("spring", 4): ("out_of_memory", "needs more .*"),
}


def test_jobs_that_do_harm_are_failed_jobs(studies, tmp_path, monkeypatch):
    """Each in its place, an exception with its traceback; none is tried again."""
    monkeypatch.setattr(SWEEP, "run_job", bad_jobs.harmful)
    made = studies(one={"load": ["none", "spring"], "machine": {"rod_mass_kg": [4, 5]}})
    summary = sweep(made, tmp_path / "out", 1)
    assert statuses(tmp_path / "out", made[0]) == ["failed"] * 3 + ["ok"]
    assert [tuple(failure.coordinates.values()) for failure in summary.failed] == [*HARM]
    for failure, (reason, detail) in zip(summary.failed, HARM.values(), strict=True):
        assert failure.reason == reason
        assert re.fullmatch(detail, failure.detail)
        job = store.read_job(tmp_path / "out", failure.key)
        assert job.attrs["detail"] == failure.detail
        assert ("in harmful" in job.attrs.get("traceback", "")) == (reason == "internal_error")
        assert Case.from_attribute(job.attrs["case"]).key == failure.key
    assert sweep(made, tmp_path / "out", 1).run_now == 0
    found = store.open_study(tmp_path / "out")
    reasons = [reason for reason, _ in HARM.values()]
    assert found.reason.values.ravel().tolist() == [*reasons, ""]
    assert np.isnan(found.peak_acceleration).values.ravel().tolist() == [True] * 3 + [False]


def test_what_asks_the_program_to_end_is_no_failure_of_a_job():
    """Ctrl-C in a job of this process was stored as a bug of it."""

    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        attempt(interrupt, None)


@pytest.mark.parametrize("lost", ["", "studies/one.json", "batches"])
def test_a_folder_that_is_lost_amid_a_run_is_an_error(lost, studies, tmp_path, in_process):
    def clean(done, total, remark):
        if done == 1:
            (tmp_path / "out" / lost).rename(tmp_path / "lost")
            if lost == "batches":  # as another run may
                make_batches(tmp_path / "out")

    with pytest.raises(
        FolderLost, match=r"out: was removed, replaced or damaged.*again, in a folder that"
    ):
        sweep(studies(one={"load": ["none", "spring"]}), tmp_path / "out", 1, clean)
    assert (tmp_path / "out" / lost).exists() == (lost == "batches")  # not made anew


def test_what_a_killed_worker_stored_and_did_not_tell_of_stays(studies, tmp_path, monkeypatch):
    """Its jobs run again, to the same numbers, and are one job each."""
    (study,) = studies(few={**BOTH, "clearance_mm": [0.1, 0.2, 0.3]})
    out, store_and_die = tmp_path / "out", partial(bad_jobs.store_and_die, tmp_path)
    monkeypatch.setattr(SWEEP, "store_outcomes", store_and_die)
    assert sweep([study], out, 1).run_now == 3
    batches = [int(size) for size in (tmp_path / "stored").read_text().split()]
    assert sum(batches) == 3 + batches[0]
    found = store.read_store(out)
    assert len(found) == 3
    for case in study.cases:
        again, wanted = found.values(case.key, ["acceleration"]), SWEEP.run_job(case).series
        assert again["acceleration"].tobytes() == wanted["acceleration"].values.tobytes()
    assert not list(verify(out))


def test_a_run_on_windows_ends_with_one_clear_line(studies, tmp_path, monkeypatch, compsim):
    made = studies(one=BOTH)
    monkeypatch.setitem(sys.modules, "resource", None)
    for words in (["run"], ["follow", "--over", "machine.speed_rpm=300:500:2"]):
        err = compsim(*words, made[0].path, "-r", tmp_path / "out", code=2).err
        (line,) = [line for line in err.splitlines() if "has no resource, which a run" in line]
        assert "needs: run it under Linux, macOS or WSL, and open the folder" in line
        assert "Traceback" not in err


@pytest.mark.parametrize(
    ("spoil", "problem"),
    [(Path.touch, "Not a directory; choose another folder"),
     (lambda path: path.symlink_to("nowhere"), "out/batches: is a link that leads nowhere")],
)  # fmt: skip
def test_a_store_that_cannot_be_used_runs_nothing(spoil, problem, studies, tmp_path):
    (tmp_path / "out").mkdir()
    spoil(tmp_path / "out/batches")
    with pytest.raises(StoreError, match=problem):
        sweep(studies(one={}), tmp_path / "out", 1, lambda *event: pytest.fail("began to run"))


def test_an_interrupted_sweep_keeps_its_jobs_and_goes_on(studies, tmp_path, in_process):
    def stop(done, total, remark):
        if done:
            raise KeyboardInterrupt

    made = studies(one={**BOTH, "machine": {"rod_mass_kg": {"linspace": [4, 7, 4]}}})
    with pytest.raises(KeyboardInterrupt):
        sweep(made, tmp_path / "out", 1, stop)
    keys = store.read_store(tmp_path / "out").keys()
    before = {key: store.read_job(tmp_path / "out", key).seconds.item() for key in keys}
    assert 0 < len(before) < 4
    summary = sweep(made, tmp_path / "out", 1)
    assert (summary.done_before, summary.run_now) == (len(before), 4 - len(before))
    for key, seconds in before.items():  # none has run again
        assert store.read_job(tmp_path / "out", key).seconds.item() == seconds


def test_a_relative_folder_is_the_one_of_the_start(studies, tmp_path, monkeypatch, in_process):
    made = studies(one={})
    monkeypatch.chdir(tmp_path)
    sweep(made, "out", 1, lambda *event: os.chdir("/"))
    assert store.read_store(tmp_path / "out").keys() == {made[0].cases[0].key}
