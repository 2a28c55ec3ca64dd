"""Other integrators judge a stored study: what is right, what is wrong in silence, and resuming."""

import json
from dataclasses import replace

import numpy as np
import pytest
from compsim import cli
from conftest import jobs_here

from compressor.cases.case import Case
from compressor.cases.load import load_studies
from compressor.solve.simulate import observe
from compressor.store.batch import write_batch
from compressor.store.studies import find_study, read_studies
from compressor.studies import judge as judging
from compressor.studies.judge import (
    JUDGES,
    JudgedJob,
    Vote,
    compare,
    count_ends,
    excess,
    judge,
    judge_case,
    judges_of,
    rank,
    read_jobs,
    summarize,
)
from compressor.sweep.sweep import Options, in_this_process, sweep

TEXT = """
joint: big_end
clearance_mm: 0.2
contact: {law: [impact, flores], restitution: 0.6}
solve: {duration_rev: 0.5, settle_rev: 0, output_step_deg: 1, rtol: 1.0e-6, max_steps: 100000}
output: {keep: metrics}
"""


@pytest.fixture(scope="module")
def folder(once):
    """A study of two jobs, and another one with a job that failed."""

    def fill(folder):
        folder.mkdir()
        for name, text in (("laws", TEXT), ("failing", TEXT.replace("100000", "50"))):
            path = folder / f"{name}.yaml"
            path.write_text(text)
            sweep([*load_studies(path)], folder, 1, options=Options(backend=in_this_process))

    return once("judged", fill)


@pytest.mark.compiled
def test_good_numbers_are_confirmed_and_nothing_runs_twice(folder, compsim, in_process):
    """A short run of a law that remembers a meeting is judged by SciPy's DOP853."""
    with jobs_here():
        found = judge(folder, "laws", 1)
    assert [job.verdict for job in found] == ["ok", "ok"]
    assert [[vote.method for vote in job.votes] for job in found] == [["DOP853"], ["DOP853"]]
    assert all(job.deciding.ratio < 1.0 and job.deciding.metric for job in found)
    assert {study.name for study in read_studies(folder / "judge")} == {"laws-1"}
    assert {study.name for study in read_studies(folder)} == {"laws", "failing"}
    told = []
    again = judge(folder, "laws", 1, lambda *event: told.append(event))
    assert [job.votes for job in again] == [job.votes for job in found]
    assert told == []
    assert compsim("judge", "laws", "-r", str(folder), "--quiet").out.startswith("2 jobs: ok 2\n")
    rows = json.loads(compsim("judge", "laws", "-r", str(folder), "--quiet", "--json").out)
    assert [row["contact.law"] for row in rows] == ["impact", "flores"]
    assert [row["verdict"] for row in rows] == ["ok", "ok"]


@pytest.mark.compiled
def test_a_failed_job_needs_no_judge(folder):
    jobs = judge(folder, "failing", 1)
    assert count_ends(jobs) == {"budget_steps": 2}
    assert summarize(jobs) == "2 jobs: budget_steps 2"
    assert [*rank(jobs)] == []


@pytest.mark.compiled
def test_a_wrong_number_that_no_bar_tells_of_is_silent(tmp_path, in_process):
    """Numbers of another machine, with this one's bars: two judges object."""
    path = tmp_path / "wrong.yaml"
    path.write_text(TEXT.replace("[impact, flores], restitution: 0.6", "impact"))
    (study,) = load_studies(path)
    with jobs_here():
        sweep([study], tmp_path, 1)
    (job,) = read_jobs(tmp_path, find_study(tmp_path))
    heavier = replace(study.cases[0].machine, reciprocating_mass_kg=16.0)
    outcome, _ = observe(replace(study.cases[0], machine=heavier))
    for name in (f"{one}_error" for one in judging.JUDGED):
        outcome.numbers[name] = job.numbers[name]
    outcome.attributes.update(key=job.key, case=study.cases[0].attributes()["case"])
    write_batch(tmp_path, [outcome])  # of equals the later one counts
    with jobs_here():
        (found,) = judge(tmp_path, None, 1)
    assert found.verdict == "silent_wrong"
    assert len(found.votes) == 2
    assert found.deciding.ratio > 1.0
    assert cli.main(["judge", "-r", str(tmp_path), "--quiet"]) == 3


def job(**more):
    """A made-up job that is ok."""
    values = {
        "key": "ab" * 10, "point": {}, "status": "ok", "reason": "", "regime": "predictable",
        "case": Case.from_values({}), "rtol": 1e-6, "numbers": {}, "votes": [],
    }  # fmt: skip
    return JudgedJob(**(values | more))


YES, NO, LOST = Vote("a", 0.1, "x"), Vote("b", 3.0, "y"), Vote("c")


@pytest.mark.parametrize(
    ("votes", "is_open", "verdict"),
    [
        ([], True, "unjudged"),
        ([YES], False, "ok"),
        ([NO], True, "silent_wrong"),
        ([LOST], True, "unjudged"),
        ([NO, NO], False, "silent_wrong"),
        ([NO, YES], True, "unjudged"),
        ([LOST, YES], False, "ok"),
        ([NO, YES, YES], False, "ok"),
        ([NO, YES, NO], False, "silent_wrong"),
        ([NO, LOST, LOST], False, "silent_wrong"),
        ([NO, YES, LOST], False, "unjudged"),
        ([LOST, LOST, LOST], False, "unjudged"),
    ],
)
def test_the_majority_counts(votes, is_open, verdict):
    one = job(votes=votes)
    assert (one.is_open, one.verdict) == (is_open, verdict)


@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_a_bar_is_as_long_as_it_says_whatever_the_number(factor):
    """Both a number far too large and one far too small lie ten bars off, or they do not."""
    name, size = "rms_acceleration", 50.0
    off = abs(factor - 1.0) * size
    for length, ratio in ((off / 9, 0.9), (off / 11, 1.1)):
        ours = {name: np.array(factor * size), f"{name}_error": np.array(length)}
        assert excess("a", name, ours, np.array(size), 0.05).ratio == pytest.approx(ratio)
    unknown = {name: np.array(factor * size), f"{name}_error": np.array(np.inf)}
    assert excess("a", name, unknown, np.array(size), 0.05).ratio == 0.0


def test_averages_alone_are_judged_of_a_chaotic_job():
    names = {name: np.array(1.0) for name in judging.JUDGED}
    ours = names | {f"{name}_error": np.array(0.0) for name in judging.JUDGED}
    theirs = names | {"peak_acceleration": np.array(2.0), "rms_acceleration": np.array(1.2)}
    assert compare("a", job(numbers=ours), theirs).metric == "peak_acceleration"
    chaotic = compare("a", job(numbers=ours, regime="chaotic"), theirs)
    assert chaotic.metric == "rms_acceleration"
    assert chaotic.ratio == pytest.approx(0.2 / 1.2 / 0.5)


def test_judges_are_unlike_the_run_and_more_exact():
    counts = {"steps": np.array(5000.0), "rejected": np.array(0.0)}
    smooth = job(numbers=counts | {"evaluations": np.array(30_000.0)})
    stiff = job(numbers=counts | {"evaluations": np.array(60_000.0)})
    short = job(numbers={name: value / 5 for name, value in smooth.numbers.items()})
    assert judges_of(smooth)[:JUDGES] == ["RODAS", "DOP853", "TSIT5"]
    assert judges_of(stiff)[:JUDGES] == ["TSIT5", "LSODA", "Radau"]
    assert judges_of(replace(stiff, regime="chaotic"))[:JUDGES] == ["TSIT5", "RODAS", "LSODA"]
    assert judges_of(short)[:JUDGES] == ["DOP853", "RODAS", "TSIT5"]
    solve = replace(Case.from_values({}).solve, method="RODAS")
    own = replace(smooth, case=replace(smooth.case, solve=solve))
    assert judges_of(own)[:JUDGES] == ["DOP853", "TSIT5", "LSODA"]
    case = judge_case(smooth, "RODAS")
    assert (case.solve.method, case.solve.rtol) == ("RODAS", 1e-8)
    assert judge_case(replace(smooth, regime="chaotic"), "RODAS").solve.rtol == 1e-7
    assert judge_case(replace(smooth, rtol=1e-11), "RODAS").solve.rtol == 1e-12
