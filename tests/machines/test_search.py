"""The least change of assumptions: on verdicts whose answer is known."""

import numpy as np
import pytest

from compressor.cases.load import load_studies
from compressor.machines import search as searching
from compressor.machines.findings import change
from compressor.machines.judged import Judged
from compressor.machines.search import Span, cost, least_change
from compressor.machines.study import ClaimsError, dataset, machine_key
from compressor.store.series_file import read_dataset

TEXT = """\
machine: {rod_mass_kg: {saltelli: [1, 9]}, reciprocating_mass_kg: {saltelli: [2, 30]}}
friction: {friction_velocity_mm_per_s: {saltelli: [20, 2000], log: true}}
sample: {n: 2, seed: 1}
"""


@pytest.fixture
def judge(monkeypatch, tmp_path):
    """`least_change` where the least margin is a function of the case."""

    def judge(least, text=TEXT, generations=8):
        (tmp_path / "some.yaml").write_text(text)
        (study,) = load_studies(tmp_path / "some.yaml")

        def judge_machines(study, folder, workers, progress):
            keys = [machine_key(case) for case in study.cases]
            rows = {
                key: Judged((1.0,) * 7 + (least(case),), (0.0,) * 8, (0.0,) * 4, (0.0,) * 4)
                for key, case in zip(keys, study.cases, strict=True)
            }
            found = dataset(study, keys, rows)
            found.encoding["source"] = str(tmp_path / f"{study.name}.nc")
            return found

        monkeypatch.setattr(searching, "judge_machines", judge_machines)
        return least_change(study, tmp_path, 2, generations)

    return judge


def best(found):
    at = found.isel(machine=int(found.attrs["best"]))
    return {name: at[name].item() for name in at.coords if "case_key" in at[name].attrs}


def test_the_least_change_is_found_and_no_other_assumption_is_changed(judge, tmp_path):
    """All claims hold from a rod mass of 6 kg on: 4.7 kg is the default."""
    found = judge(lambda case: case.machine.rod_mass_kg - 6.0)
    values = best(found)
    assert 6.0 <= values.pop("rod_mass_kg") < 6.3
    assert values == {"reciprocating_mass_kg": 14.0, "friction_velocity_mm_per_s": 100.0}
    assert found.attrs["distance"] == pytest.approx((6.0 - 4.7) / 8.0, abs=0.04)
    (said, margins) = change(found)
    assert said.startswith("The least change that makes all eight claims hold: rod mass 6.")
    assert said.endswith(" kg (not 4.7).")
    assert margins.startswith("Its margins: 1 +100 % ± 0 %, 2 +100 %")
    assert read_dataset(tmp_path / "some-search.nc").attrs["best"] == found.attrs["best"]


def test_the_defaults_need_no_change(judge):
    found = judge(lambda case: 0.1, generations=1)
    assert found.attrs["distance"] == 0.0
    said, _ = change(found)
    assert said == "The least change that makes all eight claims hold: nothing."


def test_where_none_holds_the_one_that_lacks_least_is_told(judge):
    found = judge(lambda case: -0.2 - abs(case.machine.reciprocating_mass_kg - 20.0) / 10.0)
    assert best(found)["reciprocating_mass_kg"] == pytest.approx(20.0, abs=0.5)
    (said, _) = change(found)
    assert said.startswith("No machine was found at which all eight claims hold, among ")
    assert f"among {found.sizes['machine']} that a directed search looked at" in said
    assert said.endswith("there 7 claims hold.")


def test_a_search_is_the_same_again(judge):
    one, other = (
        judge(lambda case: case.machine.rod_mass_kg - 6.0, generations=1) for _ in range(2)
    )
    assert one.identical(other)


def test_a_search_needs_ranges(judge):
    with pytest.raises(ClaimsError, match="drawn between two numbers"):
        judge(lambda case: 1.0, "machine: {rod_mass_kg: [3, 4]}\n")


def test_what_a_machine_costs():
    held = Judged((0.2,) * 8, (0.0,) * 8)
    assert cost(held, 0.3) == 0.3
    assert cost(held._replace(margin=(0.2,) * 7 + (-0.1,)), 0.3) == pytest.approx(1.1)
    assert cost(Judged(), 0.3) == 10.0


def test_the_default_s_place_in_a_range():
    assert Span("k", lambda s: 20.0 * 100.0**s, 200.0).home == pytest.approx(0.5)
    assert Span("k", lambda s: 1.0 + s, 5.0).home == 1.0
    assert np.isclose(Span("k", lambda s: 1.0 + s, 1.25).home, 0.25)
