"""What is ahead of a sweep: counts at once, and costs from some of its jobs."""

import json
import math
import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from compsim import cli, progress

from compressor.cases import load as cases
from compressor.cases.load import load_studies
from compressor.sweep import plan, warm_up
from compressor.sweep.plan import ROW_BYTES, forecast
from compressor.sweep.sweep import sweep

SHORT = {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}
NINE = {"machine": {"rod_mass_kg": {"linspace": [3, 5, 9]}}}


@pytest.fixture
def studies(tmp_path, monkeypatch, in_process):
    """Makes the studies of some values by name, in the present folder (JSON is YAML)."""
    monkeypatch.chdir(tmp_path)

    def make(only="", **values):
        for name, content in values.items():
            whole = {"output": {"keep": "metrics"}, **content}
            text = json.dumps(whole | {"solve": SHORT | content.get("solve", {})})
            (tmp_path / f"{name}.yaml").write_text(text)
        return load_studies(*(f"{name}.yaml" for name in values), only=only)

    return make


class Noted(tuple):
    """Cases that note which of them were made."""

    made: list

    def __getitem__(self, number):
        self.made.append(number)
        return super().__getitem__(number)


def noted(study):
    cases = Noted(study.cases)
    cases.made = []
    return replace(study, cases=cases)


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


def test_only_selected_jobs_are_ahead(studies):
    found = forecast(studies("machine.rod_mass_kg > 4", one=NINE), "results", 1)
    assert counts(found) == [("one", 4, 0, 4)]
    assert found.counts.first[0].coordinates == {"machine.rod_mass_kg": 4.25}


def test_a_job_that_is_stored_and_does_not_serve_is_missing(studies):
    sweep(studies(one=NINE), "results", 1)
    assert counts(forecast(studies(one=NINE), "results", 0)) == [("one", 9, 9, 0)]
    series = studies(one={**NINE, "output": {"keep": "series"}})
    assert counts(forecast(series, "results", 0)) == [("one", 9, 0, 9)]


def test_of_many_missing_jobs_some_are_looked_at(studies, monkeypatch):
    (study,) = studies(one=NINE)
    monkeypatch.setattr(plan, "TIMING_SECONDS", 60.0)
    monkeypatch.setattr(plan, "cores_at_work", float)
    monkeypatch.setattr(plan, "LOADED", {False, True})
    whole = forecast([study], "results", 0).with_times(2, str)
    monkeypatch.setattr(plan, "MAX_CASES", 3)
    study = noted(study)
    found = forecast([study], "results", 0)
    assert len({*study.cases.made}) == 3
    some = found.with_times(2, str)
    assert some.bytes == whole.bytes == 9 * ROW_BYTES
    assert (some.workers, some.missing, some.studies[0].missing) == (2, 9, 9)
    assert 10 / 9 * some.studies[0].seconds == pytest.approx(2 * some.seconds)  # five turns
    assert some.seconds > 0
    assert (whole.timed, some.timed) == (9, 3)
    assert whole.least == whole.seconds == whole.most
    assert some.least < some.seconds < some.most


def timed_as(monkeypatch, seconds):
    """Jobs that take so long by their rod's mass; the ones that were timed, in turn.

    Nothing is left to load, and workers have a core each.
    """
    made = []

    def ran(case):
        made.append(case)
        return seconds(case), 0, False

    monkeypatch.setattr(plan, "run_timed", ran)
    monkeypatch.setattr(plan, "LOADED", {False, True})
    monkeypatch.setattr(plan, "cores_at_work", float)
    monkeypatch.setattr(plan, "compile_once", lambda *_: None)
    return made


def test_a_dozen_jobs_drawn_over_the_design_tell_the_time(studies, monkeypatch):
    """A fifth of them twenty times as long as the first one, which alone was timed before."""
    monkeypatch.setattr(plan, "TIMING_SECONDS", 1e9)
    made = timed_as(monkeypatch, lambda case: 1.0 if case.machine.rod_mass_kg < 4.6 else 20.0)
    axes = {"machine": {"rod_mass_kg": {"linspace": [3, 5, 100]}}}
    found = forecast(studies(one=axes), "results", 0).with_times(1, str)
    true = 80 * 1.0 + 20 * 20.0
    assert found.timed == len(made) == plan.TIMED_JOBS
    assert 0.5 * true < found.seconds < 2.0 * true
    assert found.least <= true <= found.most
    masses = sorted(case.machine.rod_mass_kg for case in made)
    stretches = np.histogram(masses, np.linspace(3, 5.0001, plan.TIMED_JOBS + 1))[0]
    assert (stretches >= 1).sum() >= plan.TIMED_JOBS - 2
    again = timed_as(monkeypatch, lambda case: 1.0)
    forecast(studies(one=axes), "results", 0).with_times(1, str)
    assert [case.key for case in again] == [case.key for case in made]


def test_timing_ends_when_its_seconds_are_over_with_one_job_of_each_study(studies, monkeypatch):
    monkeypatch.setattr(plan, "TIMING_SECONDS", 0.0)
    made = timed_as(monkeypatch, lambda case: 1.0)
    both = studies(one=NINE, two={**NINE, "load": "none"})
    found = forecast(both, "results", 0).with_times(1, str)
    assert [case.load for case in made] == ["spring", "none"]
    assert [part.timed for part in found.studies] == [1, 1]
    assert found.seconds == pytest.approx(18.0)
    assert math.isnan(found.most)


def test_the_range_is_student_s_and_knows_what_was_timed():
    mean, least, most = plan.mean_with_range([1.0, 2.0, 3.0], 10**9)
    half = 4.302652 / math.sqrt(3.0)
    assert (mean, least) == (2.0, 1.0)  # nothing is cheaper than the cheapest
    assert most == pytest.approx(2.0 + half, rel=1e-6)
    fewer = plan.mean_with_range([1.0, 2.0, 3.0], 6)[2]
    assert fewer == pytest.approx(2.0 + half * math.sqrt(0.5), rel=1e-6)
    assert plan.mean_with_range([1.0, 3.0], 2) == (2.0, 2.0, 2.0)


def test_loading_the_search_for_chaos_is_no_part_of_a_job_s_time(studies, monkeypatch):
    took = iter([60.0, 2.0, 3.0])
    monkeypatch.setattr(plan, "run_timed", lambda case: (next(took), 0, True))
    monkeypatch.setattr(plan, "LOADED", set())
    (case,) = studies(one={})[0].cases
    turns = case.duration / case.turn
    costs = [plan.measure_cost(case) for _ in range(2)]
    assert [cost.turn * turns for cost in costs] == pytest.approx([2.0, 3.0])
    assert [cost.loading for cost in costs] == [58.0, 0.0]


def test_load_of_the_machine_and_of_workers_is_time_of_a_run(studies, monkeypatch, capsys):
    """Two workers on half a core: 7 s of loading each, and 1 s for each of nine jobs.

    It was told as if each worker had a core, and began at once: 4.5 s.
    """
    took = iter([8.0, *[1.0] * 9])
    timed_as(monkeypatch, lambda case: next(took))
    monkeypatch.setattr(plan, "LOADED", set())
    monkeypatch.setattr(plan, "TIMING_SECONDS", 60.0)
    monkeypatch.setattr(plan, "cores_at_work", lambda workers: 0.5)
    studies(one=NINE)
    assert cli.main(["plan", "one.yaml", "-j", "2"]) == 0
    # of an even number of jobs, since one worker idles in the end
    told = (2 * 7.0 + 10 * 1.0) / 0.5
    assert f"about {told:.0f} s with 2 workers (by 9 timed jobs), or " in capsys.readouterr().out


def test_workers_are_not_worth_more_than_cores(studies, monkeypatch):
    """It divided by the number of workers, however few cores there were."""
    timed_as(monkeypatch, lambda case: 1.0)
    monkeypatch.setattr(plan, "TIMING_SECONDS", 60.0)
    asked = []
    monkeypatch.setattr(plan, "cores_at_work", lambda workers: asked.append(workers) or 2.0)
    found = forecast(studies(one=NINE), "results", 0).with_times(300, str)
    assert (found.seconds, found.workers, asked) == (pytest.approx(4.5), 9, [9])


def test_compiling_that_is_ahead_is_told(studies, monkeypatch, tmp_path, capsys):
    """Before anything is timed, `plan` compiles what it times; the rest is left to `run`."""
    timed_as(monkeypatch, lambda case: 0.01)
    monkeypatch.setattr(warm_up, "machine_code_folder", lambda: tmp_path)
    monkeypatch.setattr(warm_up, "slowness", lambda: 1.0)
    studies(one={**NINE, "joint": "both", "clearance_mm": 0.1})
    assert cli.main(["plan", "one.yaml", "-j", "1"]) == 0
    said = capsys.readouterr().out
    assert "(by 9 timed jobs), after about 26 s of compiling, and " in said
    warm_up.marker("auto").touch()
    assert cli.main(["plan", "one.yaml", "-j", "1"]) == 0
    assert "compiling" not in capsys.readouterr().out


def test_the_range_is_told_and_json_has_no_nan(studies, monkeypatch, capsys):
    monkeypatch.setattr(plan, "TIMING_SECONDS", 1e9)
    timed_as(monkeypatch, lambda case: 60.0 * case.machine.rod_mass_kg)
    studies(one={"machine": {"rod_mass_kg": {"linspace": [3, 5, 40]}}})
    assert cli.main(["plan", "one.yaml", "-j", "2"]) == 0
    words = r"about \d+ min with 2 workers \(\d+ min to \d+ min by 12 timed jobs\)"
    assert re.search(words, capsys.readouterr().out)
    monkeypatch.setattr(plan, "TIMING_SECONDS", 0.0)
    assert cli.main(["plan", "one.yaml", "-j", "2"]) == 0
    assert "with 2 workers (by 1 timed job)" in capsys.readouterr().out
    assert cli.main(["plan", "one.yaml", "--json"]) == 0
    found = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert (found["timed"], found["least"], found["studies"][0]["most"]) == (1, None, None)


def test_nothing_ahead_costs_nothing(studies):
    made = studies(one=NINE)
    sweep(made, "results", 1)
    found = forecast(made, "results", 5).with_times(2, pytest.fail)
    assert (found.missing, found.seconds, found.bytes, found.first) == (0, 0, 0, ())


@pytest.mark.parametrize("command", ["plan", "run"])
def test_large_files_are_counted_before_they_are_read(command, studies, monkeypatch, capsys):
    studies(one=NINE)
    monkeypatch.setattr(cases, "MANY_CASES", 9)
    monkeypatch.setattr(progress, "FIRST_SECONDS", 0)
    assert cli.main([command, "one.yaml", "-j", "1"]) == 0
    assert capsys.readouterr().err.startswith("one: 9 jobs\n0 of 9 cases read, 0 %\n")


def test_counts_are_told_before_anything_is_timed(studies, monkeypatch, capsys):
    studies(one=NINE)
    seen = []
    monkeypatch.setattr(plan, "compile_once", lambda *_: seen.append(capsys.readouterr().out))
    assert cli.main(["plan", "one.yaml", "-j", "1"]) == 0
    assert [" ".join(out.split()) for out in seen] == ["one 9 jobs 0 done 9 missing"]
    assert capsys.readouterr().out.startswith("about ")


def test_a_study_that_is_prepared_for_long_says_so(studies, monkeypatch):
    told = []
    monkeypatch.setattr(sys.modules["compressor.sweep.sweep"], "MANY_JOBS", 8)
    sweep(studies(one=NINE), "results", 1, lambda *event: told.append(event))
    assert told[0] == (0, 9, "preparing 9 jobs")
