"""How long a sweep will still take: against sweeps of which every job's time is known."""

import heapq

import pytest

from compressor.cases.case import Case
from compressor.reasons import Reason
from compressor.sweep.wanted import MIN_JOBS_FOR_ETA, SweepProgress, SweepWork
from compressor.sweep.worker import JobLost, JobResult

START_UP = 40.0  # s: the equations are compiled, workers start
SECONDS = {"none": 0.01, "big_end": 0.5, "both": 1.0}  # a revolution


def case(joint="big_end", turns=1.0, **solve):
    values = {"joint": joint, "solve": {"duration_rev": turns, "settle_rev": 0, **solve}}
    return Case.from_values(values | ({} if joint == "none" else {"clearance_mm": 0.1}))


def seconds_of(one):
    return SECONDS[one.joint] * one.duration / one.turn


def guesses(cases, workers=2):
    """(time, what is left in truth, the guess) at the end of each job of a sweep by a clock."""
    now = [0.0]
    work = SweepWork(cases, lambda: now[0])
    assert work.left() is None
    free, ends = [START_UP] * workers, []
    for one in cases:
        start = heapq.heappop(free)
        ends.append((start + seconds_of(one), len(ends), one))
        heapq.heappush(free, ends[-1][0])
    finish = max(free)
    for at, _, one in sorted(ends):
        now[0] = at
        work.add(JobResult(one, None, seconds_of(one)))
        yield at, finish - at, work.left()


def good(left, true, share):
    """Whether a guess is off by no more than a share, or by the time of two jobs."""
    return abs(left.seconds - true) <= max(2.0, share * true)


def test_alike_jobs_are_foretold_from_the_fifth_on():
    found = list(guesses([case() for _ in range(200)]))
    for number, (at, true, left) in enumerate(found, 1):
        if number < MIN_JOBS_FOR_ETA or at - START_UP < 1.0:
            assert left is None
        else:  # one of two workers may have been counted once less
            assert good(left, true, 1 / number + 0.01)
            assert not left.at_least


def test_starting_up_and_compiling_do_not_count():
    at, true, left = next(found for found in guesses([case() for _ in range(100)]) if found[2])
    assert at < START_UP + 2
    assert good(left, true, 0.25)


def test_longer_jobs_weigh_more():
    """Off by a tenth, or by the longest job, which the other worker may have almost done."""
    cases = [case(turns=turns) for turns in (1, 2, 4, 8, 16) for _ in range(20)]
    for number, (_, true, left) in enumerate(guesses(cases), 1):
        assert left is None or abs(left.seconds - true) <= max(8.0, true / number + true / 10)


def test_nothing_is_said_while_most_of_the_work_is_of_another_kind():
    found = list(guesses([case("none")] * 300 + [case("both")] * 300))
    assert all(left is None for _, _, left in found[:300])
    for number, (_, true, left) in enumerate(found[303:], 4):
        assert good(left, true, 1 / number + 0.05)


def test_a_kind_that_is_not_measured_makes_a_guess_a_lower_bound():
    found = list(guesses([case("big_end")] * 300 + [case("both")] * 100))
    bounds = [(true, left) for _, true, left in found[2:298] if left]
    assert len(bounds) > 190
    assert all(left.at_least and left.seconds < true for true, left in bounds)
    assert not any(left.at_least for _, _, left in found[302:])


@pytest.mark.parametrize(
    "solve", [{"accuracy": "reference"}, {"error_bars": False}, {"rtol": 1e-9}]
)
def test_kinds_differ_in_what_costs(solve):
    work = SweepWork(
        [case() for _ in range(9)] + [case(**solve) for _ in range(9)], iter(range(99)).__next__
    )
    for _ in range(4):
        work.add(JobResult(case(), None, 1.0))
    assert work.left() is None or work.left().at_least


def test_lost_jobs_tell_nothing_and_are_no_longer_ahead():
    now = [0.0]
    work = SweepWork([case() for _ in range(14)], lambda: now[0])
    for number in range(12):
        now[0] += 1.0
        end = (
            JobResult(case(), None, 1.0) if number % 2 else JobLost(case(), Reason.WORKER_DIED, "")
        )
        work.add(end)
    # 6 s of work in the 11 s since the first measured job began: two are left, 1 s each
    assert work.left().seconds == pytest.approx(2 * 11 / 6)
    now[0] += 1.0
    assert work.left().seconds == pytest.approx(2 * 11 / 6 - 1)
    now[0] += 100.0
    assert work.left().seconds == 0.0


def test_a_sweep_tells_how_it_stands(tmp_path, in_process):
    import json

    from compressor.cases.load import load_studies
    from compressor.sweep.sweep import Options, sweep

    values = {"joint": "both", "clearance_mm": [0.1, 0.2, 0.3], "solve": {
        "duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9,
        "max_steps": [5, 10**6]}}  # fmt: skip
    (tmp_path / "wear.yaml").write_text(json.dumps(values))
    (study,) = load_studies(tmp_path / "wear.yaml", only="clearance_mm < 0.25")
    told = []
    sweep([study], tmp_path / "out", 1, options=Options(pulse=told.append))
    assert told[0] == SweepProgress(0, 0, 4)
    assert {(now.total, now.left) for now in told} == {(4, None)}
    assert [now.done for now in told] == sorted(now.done for now in told)
    (study,) = load_studies(tmp_path / "wear.yaml")
    told.clear()
    sweep([study], tmp_path / "out", 1, options=Options(pulse=told.append))
    assert told[0] == SweepProgress(4, 2, 6)
