"""What is ahead of a sweep: counts at once, and costs from some of its jobs."""

from pathlib import Path

import pytest
from conftest import write_cases

from compressor.cases.load import load_studies
from compressor.sweep import plan
from compressor.sweep.plan import forecast
from compressor.sweep.sweep import sweep

SHORT = {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}
NINE = {"machine": {"rod_mass_kg": {"linspace": [3, 5, 9]}}}


@pytest.fixture
def studies(tmp_path, monkeypatch, in_process):
    """Makes the studies of some values by name, in the present folder (JSON is YAML)."""
    monkeypatch.chdir(tmp_path)

    def make(only="", **values):
        whole = {name: {"output": {"keep": "metrics"}, **content,
                        "solve": SHORT | content.get("solve", {})}
                 for name, content in values.items()}  # fmt: skip
        return load_studies(*write_cases(Path(), **whole), only=only)

    return make


def counts(found):
    return [(part.study, part.jobs, part.done, part.missing) for part in found.counts.studies]


def test_counts_follow_from_the_store_and_shared_jobs_count_once(studies):
    both = studies(one=NINE, two={"machine": {"rod_mass_kg": [3, 4, 7]}})
    assert counts(forecast(both, "results", 0)) == [("one", 9, 0, 9), ("two", 1, 0, 1)]
    sweep(studies("machine.rod_mass_kg < 3.6", one=NINE), "results", 1)
    found = forecast(both, "results", 3)
    assert counts(found) == [("one", 9, 3, 6), ("two", 1, 0, 1)]
    assert (found.counts.jobs, found.counts.done, found.counts.missing) == (10, 3, 7)
    assert [one.coordinates["machine.rod_mass_kg"] for one in found.counts.first] == [
        3.75, 4.0, 4.25
    ]  # fmt: skip
    assert len(forecast(both, "results", 50).counts.first) == 7

    series = studies(one={**NINE, "output": {"keep": "series"}})  # which stored jobs do not serve
    assert counts(forecast(series, "results", 0)) == [("one", 9, 0, 9)]
    selected = forecast(studies("machine.rod_mass_kg > 4", one=NINE), "results", 1)
    assert counts(selected) == [("one", 4, 0, 4)]
    assert selected.counts.first[0].coordinates == {"machine.rod_mass_kg": 4.25}


def timed_as(monkeypatch, seconds, size=0):
    """Jobs that take so long by their rod's mass, and so many bytes; the ones that were timed."""
    made = []

    def ran(case):
        made.append(case)
        return seconds(case), size

    monkeypatch.setattr(plan, "time_job", ran)
    monkeypatch.setattr(plan, "cores", lambda: 4)
    monkeypatch.setattr(plan, "compile_once", lambda *_: None)
    return made


def test_one_job_of_each_study_tells_the_time_of_all(studies, monkeypatch):
    made = timed_as(monkeypatch, lambda case: case.machine.rod_mass_kg)
    slow = {**NINE, "solve": {"duration_rev": 0.5}}
    found = forecast(studies(one=NINE, two=slow), "results", 0).with_times(2, str)
    assert [case.machine.rod_mass_kg for case in made] == [4, 4]  # the middle one
    assert [part.seconds for part in found.studies] == pytest.approx([9 * 4, 9 * 4])
    assert found.seconds == pytest.approx(18 * 4 / 2)
    assert found.bytes == 18 * plan.ROW_BYTES
    assert forecast(studies(one=NINE), "results", 0).with_times(300, str).seconds == 9.0  # 4 cores
    monkeypatch.setattr(plan, "MAX_CASES", 3)  # of the missing jobs that are looked at
    some = forecast(studies(one=NINE), "results", 0).with_times(1, str)
    assert some.missing == 9
    assert some.seconds == pytest.approx(9 * made[-1].machine.rod_mass_kg)


def test_time_follows_revolutions_and_bytes_samples(studies, monkeypatch):
    timed_as(monkeypatch, lambda case: 3.0 * plan.revolutions(case), plan.ROW_BYTES + 1000)
    axes = {"solve": {"duration_rev": [0.25, 0.5, 1.0]}, "output": {"keep": "series"}}
    found = forecast(studies(one=axes), "results", 0).with_times(1, str)
    assert found.seconds == pytest.approx(3.0 * 1.75)
    assert found.bytes == pytest.approx(3 * plan.ROW_BYTES + 1000 * 3.5, rel=0.01)


def test_a_job_that_is_timed_is_a_job_of_the_sweep(studies, monkeypatch):
    """Its bytes are those of its batch, and what loads with it the first time is no time of it."""
    (case,) = studies(one={"output": {"keep": "series"}})[0].cases
    assert plan.time_job(case)[1] > 8 * case.steps
    clock = iter([0.0, 5.0, 5.0, 7.0])
    monkeypatch.setattr(plan.time, "process_time", lambda: next(clock))
    assert plan.time_job(case)[0] == 2.0
    clock = iter([0.0, 60.0])
    assert plan.time_job(case)[0] == 60.0  # a long one runs once


def test_nothing_ahead_costs_nothing(studies):
    made = studies(one=NINE)
    sweep(made, "results", 1)
    found = forecast(made, "results", 5).with_times(2, pytest.fail)
    assert (found.missing, found.seconds, found.bytes, found.first) == (0, 0, 0, ())
