"""Other integrators judge a stored study: what is right, what is wrong in silence, and resuming."""

import json
from dataclasses import replace

import numpy as np
import pytest
from conftest import store_cases, write_batch

from compressor.cases.case import Case
from compressor.solve.simulate import observe
from compressor.store import find_study
from compressor.studies import judge as judging

SOLVE = {"duration_rev": 0.5, "settle_rev": 0, "output_step_deg": 1, "rtol": 1e-6}
CASE = {"joint": "big_end", "clearance_mm": 0.2, "solve": SOLVE, "output": {"keep": "metrics"}}
LAWS = CASE | {"contact": {"law": ["impact", "flores"], "restitution": 0.6}}
FAILING = LAWS | {"solve": SOLVE | {"max_steps": 50}}


@pytest.fixture(scope="module")
def folder(once):
    return once("judged", lambda it: store_cases(it, laws=LAWS, failing=FAILING)) / "results"


def test_good_numbers_are_confirmed_and_nothing_runs_twice(folder, compsim, in_process):
    """A short run of a law that remembers a meeting is judged by SciPy's DOP853."""
    found = judging.judge(folder, "laws", 1)
    assert [job.verdict for job in found] == ["ok", "ok"]
    assert [[vote.method for vote in job.votes] for job in found] == [["DOP853"], ["DOP853"]]
    assert all(job.deciding.ratio < 1.0 and job.deciding.metric for job in found)
    told = []
    again = judging.judge(folder, "laws", 1, lambda *event: told.append(event))
    assert [job.votes for job in again] == [job.votes for job in found]
    assert told == []
    assert compsim("judge", "laws", "-r", str(folder), "--quiet").out.startswith("2 jobs: ok 2\n")
    failed = compsim("judge", "failing", "-r", str(folder), "--quiet")  # which needs no judge
    assert failed.out.startswith("2 jobs: budget_steps 2\n")
    rows = json.loads(compsim("judge", "laws", "-r", str(folder), "--quiet", "--json").out)
    told = [(row["contact.law"], row["verdict"], row["reason"]) for row in rows]
    assert told == [("impact", "ok", ""), ("flores", "ok", "")]


def test_a_wrong_number_that_no_bar_tells_of_is_silent(tmp_path, compsim, in_process):
    """Numbers of another machine, with this one's bars: two judges object."""
    (study,), place = store_cases(tmp_path, wrong=CASE), tmp_path / "results"
    (job,) = judging.read_jobs(place, find_study(place))
    heavier = replace(study.cases[0].machine, reciprocating_mass_kg=16.0)
    outcome, _ = observe(replace(study.cases[0], machine=heavier))
    for name in (f"{one}_error" for one in judging.JUDGED):
        outcome.numbers[name] = job.numbers[name]
    outcome.attributes.update(key=job.key, case=study.cases[0].attributes()["case"])
    write_batch(place, [outcome])  # of equals the later one counts
    (found,) = judging.judge(place, None, 1)
    assert found.verdict == "silent_wrong"
    assert found.deciding.ratio > 1.0
    compsim("judge", "-r", place, "--quiet", code=3)


def job(**more):
    values = {
        "key": "ab" * 10, "point": {}, "status": "ok", "reason": "", "regime": "predictable",
        "case": Case.from_values({}), "rtol": 1e-6, "settle": 3.0, "numbers": {}, "votes": [],
    }  # fmt: skip
    return judging.JudgedJob(**(values | more))


YES, NO = judging.Vote("a", 0.1, "x"), judging.Vote("b", 3.0, "y")
LOST = judging.Vote("c", reason="budget_steps")


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
    told = "judge a job of fewer revolutions" if LOST in votes else "judges disagree"
    assert (told in judging.to_rows([one])[0]["reason"]) == (verdict == "unjudged")


@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_a_bar_is_as_long_as_it_says_whatever_the_number(factor):
    """Both a number far too large and one far too small lie ten bars off, or they do not."""
    name, size = "rms_acceleration", 50.0
    off = abs(factor - 1.0) * size
    for length, ratio in ((off / 9, 0.9), (off / 11, 1.1)):
        ours = {name: np.array(factor * size), f"{name}_error": np.array(length)}
        assert judging.excess("a", name, ours, np.array(size), 0.05).ratio == pytest.approx(ratio)
    unknown = {name: np.array(factor * size), f"{name}_error": np.array(np.inf)}
    assert judging.excess("a", name, unknown, np.array(size), 0.05).ratio == 0.0


def test_averages_alone_are_judged_of_a_chaotic_job():
    names = {name: np.array(1.0) for name in judging.JUDGED}
    ours = names | {f"{name}_error": np.array(0.0) for name in judging.JUDGED}
    theirs = names | {"peak_acceleration": np.array(2.0), "rms_acceleration": np.array(1.2)}
    assert judging.compare("a", job(numbers=ours), theirs).metric == "peak_acceleration"
    chaotic = judging.compare("a", job(numbers=ours, regime="chaotic"), theirs)
    assert chaotic.metric == "rms_acceleration"
    assert chaotic.ratio == pytest.approx(0.2 / 1.2 / 0.5)


def test_judges_are_unlike_the_run_and_more_exact():
    counts = {"steps": np.array(5000.0), "rejected": np.array(0.0)}
    smooth = job(numbers=counts | {"evaluations": np.array(30_000.0)})
    stiff = job(numbers=counts | {"evaluations": np.array(60_000.0)})
    short = job(numbers={name: value / 5 for name, value in smooth.numbers.items()})
    assert judging.judges_of(smooth)[: judging.JUDGES] == ["RODAS", "DOP853", "TSIT5"]
    assert judging.judges_of(stiff)[: judging.JUDGES] == ["TSIT5", "LSODA", "Radau"]
    assert judging.judges_of(short)[: judging.JUDGES] == ["DOP853", "RODAS", "TSIT5"]
    own = replace(smooth, case=Case.from_values({"solve": {"method": "RODAS"}}))
    assert "RODAS" not in judging.judges_of(own)[: judging.JUDGES]
    case = judging.judge_case(smooth, "RODAS")
    assert (case.solve.method, case.solve.rtol) == ("RODAS", 1e-8)
    auto = Case.from_values({"solve": {"settle_rev": "auto", "duration_rev": "auto"}})
    seen = {"regime": "chaotic", "case": auto, "numbers": {"revolutions": np.array(25.0)}}
    run = judging.judge_case(replace(smooth, **seen), "RODAS").solve  # 3 s are 25 revolutions
    assert (run.settle_rev, run.duration_rev, run.rtol) == (25.0, 50.0, 1e-7)
    assert judging.judge_case(replace(smooth, rtol=1e-11), "RODAS").solve.rtol == 1e-12
