"""What is ahead of a sweep: counts at once, and costs from some of its jobs."""

import json
import sys
from dataclasses import replace

import pytest
from compsim import cli, screen

from compressor.cases.load import load_studies
from compressor.sweep import plan
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
    whole = forecast([study], "results", 0).timed(2, str)
    monkeypatch.setattr(plan, "MOST_CASES", 3)
    study = noted(study)
    found = forecast([study], "results", 0)
    assert len({*study.cases.made}) == 3
    some = found.timed(2, str)
    assert some.bytes == whole.bytes == 9 * ROW_BYTES
    assert (some.workers, some.missing, some.studies[0].missing) == (2, 9, 9)
    assert some.studies[0].seconds == pytest.approx(2 * some.seconds)
    assert some.seconds > 0


def test_nothing_ahead_costs_nothing(studies):
    made = studies(one=NINE)
    sweep(made, "results", 1)
    found = forecast(made, "results", 5).timed(2, pytest.fail)
    assert (found.missing, found.seconds, found.bytes, found.first) == (0, 0, 0, ())


@pytest.mark.parametrize("command", ["plan", "run"])
def test_large_files_are_counted_before_they_are_read(command, studies, monkeypatch, capsys):
    studies(one=NINE)
    monkeypatch.setattr(screen, "MANY", 9)
    monkeypatch.setattr(screen, "FIRST_SECONDS", 0)
    assert cli.main([command, "one.yaml", "-j", "1"]) == 0
    assert capsys.readouterr().err.startswith("one: 9 jobs\n0 of 9 cases read, 0 %\n")


def test_counts_are_told_before_anything_is_timed(studies, monkeypatch, capsys):
    studies(one=NINE)
    seen = []
    monkeypatch.setattr(plan, "load_telling", lambda *_: seen.append(capsys.readouterr().out))
    assert cli.main(["plan", "one.yaml", "-j", "1"]) == 0
    assert [" ".join(out.split()) for out in seen] == ["one 9 jobs 0 done 9 missing"]
    assert capsys.readouterr().out.startswith("about ")


def test_a_study_that_is_prepared_for_long_says_so(studies, monkeypatch):
    told = []
    monkeypatch.setattr(sys.modules["compressor.sweep.sweep"], "MANY", 8)
    sweep(studies(one=NINE), "results", 1, lambda *event: told.append(event))
    assert told[0] == (0, 9, "preparing 9 jobs")
