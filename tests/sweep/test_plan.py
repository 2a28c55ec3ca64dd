"""What is ahead of a sweep: counts at once, and costs from some of its jobs."""

import pytest

from compressor.sweep import plan
from compressor.sweep.plan import START_SECONDS, add_times, forecast
from compressor.sweep.warm_up import Part

NINE = {"machine": {"rod_mass_kg": {"linspace": [3, 5, 9]}}, "output": {"keep": "metrics"}}


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


def timed(studies, workers, remark=str):
    """What is ahead of studies of which nothing is stored, with its time."""
    return add_times(*forecast(studies, "none/yet", 0), workers, remark)


def test_one_job_of_each_study_tells_the_time_of_all(studies, monkeypatch):
    made = timed_as(monkeypatch, lambda case: case.machine.rod_mass_kg, 1000)
    series = {**NINE, "output": {"keep": "series"}, "solve": {"duration_rev": 0.5}}
    found = timed(studies(one=NINE, two=series), 2)
    assert [case.machine.rod_mass_kg for case in made] == [4, 4]  # the middle one
    assert [part.seconds for part in found.studies] == pytest.approx([9 * 4, 9 * 4])
    assert found.seconds == pytest.approx(START_SECONDS + 18 * 4 / 2)
    assert [part.bytes for part in found.studies] == [9 * plan.ROW_BYTES, 9 * 1000]
    assert timed(studies(one=NINE), 300).seconds == START_SECONDS + 9.0  # 4 cores


def test_all_is_compiled_that_a_timed_job_needs(studies, monkeypatch):
    """Else its time would be that of compiling; of many jobs only some are looked at."""
    timed_as(monkeypatch, lambda case: 1.0)
    monkeypatch.setattr(plan, "MAX_SAMPLED", 1)
    compiled = []
    monkeypatch.setattr(plan, "compile_once", lambda parts, *_: compiled.append(parts))
    oiled = {"joint": "both", "clearance_mm": 0.1, "lubricant": True}
    timed(studies(one=NINE, two=oiled), 1)
    assert compiled == [(Part("laws"), Part("plain"))]  # none of a guide
    timed(studies(guided=oiled | {"guide": True}), 1)
    assert compiled[1:] == [(Part("features"),)]


def test_a_job_that_is_timed_is_a_job_of_the_sweep(studies, monkeypatch):
    """Its bytes are those of its batch, and what loads with it the first time is no time of it."""
    (case,) = studies(one={"output": {"keep": "series"}})[0].cases
    assert plan.time_job(case)[1] > 8 * case.steps
    clock = iter([0.0, 5.0, 5.0, 7.0])
    monkeypatch.setattr(plan.time, "process_time", lambda: next(clock))
    assert plan.time_job(case)[0] == 2.0
    clock = iter([0.0, 60.0])
    assert plan.time_job(case)[0] == 60.0  # a long one runs once
