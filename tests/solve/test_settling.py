"""Where metrics begin to count, and where a run ends, when that is left to the program."""

import math

import numpy as np
import pytest
from conftest import CHAOTIC
from test_regime import PAPER, case

from compressor.cases.case import Case
from compressor.metrics import METRICS
from compressor.solve import error_bars
from compressor.solve import run as run_module
from compressor.solve.request import revolutions
from compressor.solve.search import MEASURED_REV, agree, steady
from compressor.solve.simulate import measure

AUTO = {"settle_rev": "auto", "duration_rev": "auto"}
SLOW = {  # takes revolutions to settle: little damping and friction
    "joint": "big_end",
    "clearance_mm": 0.1,
    "load": "none",
    "contact": {"damping_N_s_per_mm": 30},
}


def turn(**more):
    """Metrics of a revolution."""
    made = {name: np.ones([2] * len(row.dims)) for name, row in METRICS.items()}
    return made | {name: np.asarray(value) for name, value in more.items()}


def test_a_case_settles_where_its_revolutions_agree():
    found = measure(case(**AUTO))
    assert (found.status, found.attributes["promise"]) == ("ok", "kept")
    settled = found.numbers["settled_rev"]
    assert settled == pytest.approx(found.attributes["settle"] / case().turn)
    assert settled in (0, 1)
    same = measure(case(settle_rev=settled, duration_rev=settled + MEASURED_REV))
    for name in METRICS:
        bars = (np.asarray(one.numbers[f"{name}_error"]) for one in (found, same))
        away = np.abs(np.asarray(found.numbers[name]) - same.numbers[name])
        assert (away <= sum(bars)).all(), name
    assert found.key != same.key


@pytest.mark.parametrize(("solve", "reason"), [
    ({"duration_s": 0.48, "output_step_s": 1e-4, "settle_rev": "auto"}, "not_settled"),
    ({"settle_rev": 0.5, "duration_rev": "auto", "output_step_s": 0.004}, ""),
])  # fmt: skip
def test_steps_in_seconds_need_not_fit_the_span_that_is_found(solve, reason):
    """The solver made a case that the rules refuse."""
    machine = {"speed_rpm": 490 if reason else 600}
    values = {**(SLOW if reason else PAPER), "machine": machine, "solve": solve}
    found = measure(Case.from_values(values))
    assert found.reason == reason, found.attributes


@pytest.mark.parametrize("keep", ["metrics", "series"])
def test_no_run_is_made_twice(keep, monkeypatch):
    """The run that shows where a case settles is its first one; beside it is that of its bars."""
    made, real = [], run_module.integrate

    def integrate(request):
        made.append(request.rtol)
        return real(request)

    monkeypatch.setattr(run_module, "integrate", integrate)
    given = Case.from_values({**PAPER, "solve": AUTO, "output": {"keep": keep}})
    assert measure(given).attributes["promise"] == "kept"
    assert made == [given.rtol, pytest.approx(given.rtol / error_bars.TIGHTER_FACTOR)]


@pytest.mark.parametrize("values", [PAPER, SLOW])
def test_metrics_of_the_settled_part_do_not_change_when_it_goes_on(values):
    found = measure(case(values, **AUTO, accuracy="fine"))
    assert found.status == "ok"
    settled = found.numbers["settled_rev"]
    later = measure(case(values, settle_rev=settled + 5, duration_rev=settled + 8, accuracy="fine"))
    for name, row in METRICS.items():
        if row.bar.relative and "axis" not in row.dims:
            np.testing.assert_allclose(found.numbers[name], later.numbers[name], rtol=1e-3)


@pytest.mark.parametrize("turns", [1, 2.5])
def test_ideal_joints_repeat_in_a_run_of_any_length(turns):
    found = measure(case({"joint": "none", "load": "gas"}, settle_rev=0, duration_rev=turns))
    assert (found.attributes["regime"], found.numbers["period_rev"]) == ("periodic", 1)
    assert found.numbers["settled_rev"] == 0


def test_a_duration_alone_follows_where_settling_is_given():
    found = measure(case(settle_rev=0.5, duration_rev="auto"))
    same = measure(case(settle_rev=0.5, duration_rev=3.5))
    assert found.numbers["rms_acceleration"] == same.numbers["rms_acceleration"]
    assert math.isfinite(found.numbers["settled_rev"])


def test_a_motion_that_does_not_settle_says_so_with_its_numbers():
    found = measure(case(SLOW, settle_rev="auto", duration_rev=3, accuracy="fine"))
    assert (found.status, found.reason) == ("failed", "not_settled")
    assert found.detail == "in 3 revolutions no 3 agree within 0.0001"
    assert np.isfinite(found.numbers["rms_acceleration_error"])


def test_a_chaotic_motion_never_settles_and_is_measured_by_its_second_half(monkeypatch):
    monkeypatch.setattr("compressor.cases.case.MAX_REV", 6.0)
    found = measure(case(CHAOTIC, **AUTO))
    assert (found.status, found.attributes["regime"]) == ("ok", "chaotic")
    assert found.numbers["revolutions"] == 3
    assert math.isnan(found.numbers["settled_rev"])


def test_forces_along_an_axis_count_by_the_joint_s():
    small = np.array([[100.0, 0.1], [100.0, 0.1]])
    other = small + np.array([0.0, 0.5])
    one, two = (turn(peak_contact_force_axis=forces) for forces in (small, other))
    assert agree(one, two, 0.01)
    assert not agree(one, two, 0.001)


def test_a_period_of_more_than_one_revolution_is_settled_too():
    def turns(*peaks):
        return [turn(peak_acceleration=peak) for peak in peaks]

    assert steady(turns(1, 1, 1), 0.01) == (0, 1)
    assert steady(turns(5, 1, 1, 1), 0.01) == (1, 1)
    assert steady(turns(1, 2, 1), 0.01) is None
    assert steady(turns(9, 1, 2, 1, 2), 0.01) == (1, 2)
    assert steady(turns(1, 2, 3, 1, 2, 3), 0.01) == (0, 3)
    assert steady(turns(1, 2, 3, 4, 5, 6, 7, 8), 0.01) is None


@pytest.mark.parametrize("method", ["auto", "DOP853"])
def test_revolutions_add_up_to_the_whole_run(method):
    # in revolutions, or in tenths of one by a method that steps in Python
    turn, rtol = (0.1, 1e-7) if method == "DOP853" else (1.0, 1e-9)
    span = {"duration_rev": 0.1 + 2.1 * turn, "settle_rev": 0.1}
    of = case(**span, method=method, error_bars=False)
    whole, parted = (
        run_module.run_at_tolerance(of, rtol, 60.0, False, cuts=cuts)
        for cuts in ((), revolutions(of.settle, of.duration, turn * of.turn))
    )
    seconds = [turn["seconds"] for turn in parted.trajectory.turns]
    assert seconds == pytest.approx([turn * of.turn] * 2, rel=1e-9)
    for name in METRICS:
        np.testing.assert_allclose(parted.metrics[name], whole.metrics[name], rtol=1e-4, atol=1e-9)
    for name in ("seconds", "crank_work", "contact_work", "energy", "peak_kinetic"):
        one, other = (run.trajectory.tally[name] for run in (parted, whole))
        assert one == pytest.approx(other, rel=1e-5), name
