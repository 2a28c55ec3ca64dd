"""What a case models, and which of its features have no effect."""

import pytest
from conftest import write_cases

from compressor.cases.case import Case
from compressor.cases.load import load_studies
from compressor.program import no_progress
from compressor.solve.simulate import simulate
from compressor.studies.tradeoff.explain import advice_row, explain
from compressor.studies.tradeoff.variants import choose_job

SOLVE = {"duration_rev": 0.25, "settle_rev": 0}


@pytest.fixture
def explained(tmp_path):
    """Explain the job of a case file with these values that matters most."""

    def made(**values):
        values["solve"] = SOLVE | values.get("solve", {})
        values = {"joint": "big_end", "clearance_mm": 0.2} | values
        (study,) = load_studies(*write_cases(tmp_path, made=values))
        return explain(study, choose_job(study, tmp_path)[0], 2, no_progress)

    return made


def advice(told, name):
    return next(one for one in told["advice"] if one["name"] == name)


def test_gravity_that_is_off_is_not_paid_for(explained):
    told = explained()
    assert [one["name"] for one in told["advice"]] == [
        "no friction",
        "no spring damping",
        "no load",
    ]


def test_friction_that_matters_is_kept(explained):
    """Its change is that of two runs by hand, far tighter."""
    one = advice(explained(), "no friction")
    assert "acceleration" in one["needed_for"]
    values = {"joint": "big_end", "clearance_mm": 0.2, "solve": SOLVE | {"accuracy": "fine"}}
    runs = [simulate(Case.from_values(values | more)) for more in ({}, {"friction": False})]
    peaks = [float(run["peak_acceleration"]) for run in runs]
    assert one["changes"]["acceleration"] == pytest.approx(peaks[1] / peaks[0] - 1, abs=1e-3)
    forces = [float(run["peak_contact_force"].sel(joint="big_end")) for run in runs]
    assert one["changes"]["force"] == pytest.approx(forces[1] / forces[0] - 1, abs=1e-3)


def test_what_changes_less_than_the_promise_can_go(explained):
    told = explained(machine={"gravity_m_per_s2": 1e-2}, friction={"static": 1e-7, "dynamic": 1e-7})
    for name in ("no gravity", "no friction"):
        one = advice(told, name)
        assert one["needed_for"] == []
        assert all(abs(size) < told["promise"] for size in one["changes"].values())
    assert advice(told, "no friction")["left_out"] == "friction: false"


@pytest.mark.parametrize(("size", "told"), [(-0.3, "needed"), (1e-5, "joint: small_end"),
                                            (float("nan"), "failed: budget_steps")])  # fmt: skip
def test_a_note_hides_no_known_verdict(size, told):
    """Two worn joints of unlike clearance had `clearance_mm 0.3` in place of `needed`."""
    needed = ["force"] if abs(size) >= 5e-3 else []
    note = "failed: budget_steps" if size != size else "clearance_mm 0.3"
    row = {"name": "ideal big end", "changes": {"force": size}, "time_ratio": 0.5, "note": note,
           "needed_for": needed, "left_out": "joint: small_end"}  # fmt: skip
    assert advice_row(row)[-1] == told


def test_a_tighter_promise_keeps_what_a_looser_one_drops(explained):
    weak = {"spring": {"damping_N_s_per_mm": 1e-3}}
    name = "no spring damping"
    assert not advice(explained(**weak, solve={"accuracy": "draft"}), name)["needed_for"]
    assert advice(explained(**weak, solve={"accuracy": "reference"}), name)["needed_for"]


def test_a_sweep_is_explained_by_the_job_that_matters_most(explained):
    told = explained(clearance_mm=[0.1, 0.3, 0.2], load=["gas", "spring"])
    assert told["jobs"] == 6
    assert told["point"] == {"clearance_mm": 0.3, "load": "gas"}
    assert told["sweep_seconds"] == pytest.approx(3 * told["seconds"])
    assert told["steps"] > 0


def test_the_ideal_machine_integrates_nothing(explained):
    told = explained(clearance_mm=0)
    assert (told["steps"], [*told["advice"]]) == (0, [])
    assert told["reason"] == ""


def test_a_job_that_fails_is_told_and_no_advice_given(explained):
    told = explained(solve={"max_steps": 20})
    assert told["reason"] == "budget_steps"
    assert told["detail"] == "more than 20 steps"
    assert [*told["advice"]] == []
