"""One machine judged: as the page judges stored runs, and what fails."""

import math

import pytest

from compressor.analysis.claims import claims
from compressor.analysis.runs import cases_of
from compressor.cases.case import Case
from compressor.solve.simulate import simulate
from compressor.studies.claims.study import CLAIMS, ideal_text, judge

QUICK = {"accuracy": "draft", "duration_rev": 2, "output_step_deg": 1}


def test_a_machine_s_margins_are_those_of_its_stored_cases():
    machine = Case.from_values({"machine": {"rod_mass_kg": 3.0}, "solve": QUICK})
    found = judge(machine)
    runs = {name: simulate(case) for name, case in cases_of(machine).items()}
    expected = [claim.margin for claim in claims(runs)]
    assert len(expected) == len(CLAIMS)
    assert found.margin == pytest.approx([one.value for one in expected], rel=1e-12)
    assert found.error == pytest.approx([one.error for one in expected], rel=1e-12)
    assert (found.failed, found.chaotic) == ("", 0)


def test_a_machine_with_a_failed_case_has_no_margins():
    found = judge(Case.from_values({"solve": QUICK | {"max_steps": 50}}))
    assert found.failed.startswith("big_end 0.1: budget_steps; big_end 0.2: budget_steps")
    assert all(math.isnan(margin) for margin in found.margin)


def test_ideal_runs_are_shared_by_machines_that_differ_in_masses_and_joints_alone():
    base = ideal_text(Case.from_values({}))
    same = {"machine": {"rod_mass_kg": 2, "reciprocating_mass_kg": 9}, "friction": False}
    assert ideal_text(Case.from_values(same)) == base
    for other in ({"machine": {"speed_rpm": 400}}, {"gas": {"back_pressure_MPa": 0.1}}):
        assert ideal_text(Case.resolve(other)) != base


def test_the_papers_cases_of_a_machine_keep_all_but_load_joint_and_clearance():
    machine = Case.from_values({"friction": False, "solve": {"accuracy": "fine"}})
    for name, case in cases_of(machine).items():
        assert case.friction is None
        assert case.solve.accuracy == "fine"
        assert case.joint == (name.split()[0] if " " in name else "none")
