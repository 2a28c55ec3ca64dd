"""What is ahead of a sweep: counts at once, and costs from some of its jobs."""

from pathlib import Path

import pytest
from conftest import write_cases

from compressor.cases.load import load_studies
from compressor.sweep import plan
from compressor.sweep.plan import START_SECONDS, add_times, forecast
from compressor.sweep.warm_up import Part

SHORT = {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}
NINE = {"machine": {"rod_mass_kg": {"linspace": [3, 5, 9]}}}


@pytest.fixture
def studies(tmp_path, monkeypatch):
    """Makes the studies of some values by name, in the present folder (JSON is YAML)."""
    monkeypatch.chdir(tmp_path)

    def make(**values):
        whole = {name: {"output": {"keep": "metrics"}, **content,
                        "solve": SHORT | content.get("solve", {})}
                 for name, content in values.items()}  # fmt: skip
        return load_studies(*write_cases(Path(), **whole))

    return make


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
    """What is ahead of studies in an empty folder, with its time."""
    return add_times(*forecast(studies, "results", 0), workers, remark)


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
    monkeypatch.setattr(plan, "MAX_CASES", 1)
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
