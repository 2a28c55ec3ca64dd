"""The least change of assumptions: on verdicts whose answer is known."""

import numpy as np
import pytest

from compressor.cases.load import load_studies
from compressor.store import StoreError
from compressor.store.netcdf import read_dataset, write_dataset
from compressor.studies.claims import search as searching
from compressor.studies.claims.findings import change
from compressor.studies.claims.search import POPULATION, AssumptionRange, cost, least_change
from compressor.studies.claims.study import (
    ClaimsError,
    Judged,
    cases_judged,
    machine_key,
    machines_dataset,
)

TEXT = """\
machine: {rod_mass_kg: {saltelli: [1, 9]}, reciprocating_mass_kg: {saltelli: [2, 30]}}
friction: {friction_velocity_mm_per_s: {saltelli: [20, 2000], log: true}}
sample: {n: 2, seed: 1}
"""


@pytest.fixture
def judge(monkeypatch, tmp_path):
    """`least_change` where the least margin is a function of the case."""

    def judge(least, text=TEXT, generations=8, error=0.0):
        (tmp_path / "some.yaml").write_text(text)
        (study,) = load_studies(tmp_path / "some.yaml", variants=cases_judged)

        def judge_machines(study, folder, workers, progress):
            keys = [machine_key(case) for case in study.cases]
            rows = {
                key: Judged(
                    (1.0,) * 7 + (least(case),), (0.0,) * 7 + (error,), (0.0,) * 4, (0.0,) * 4
                )
                for key, case in zip(keys, study.cases, strict=True)
            }
            found = machines_dataset(study, keys, rows)
            found.encoding["source"] = str(tmp_path / f"{study.name}.nc")
            write_dataset(tmp_path / f"{study.name}.nc", found)
            return found

        monkeypatch.setattr(searching, "judge_machines", judge_machines)
        return least_change(study, tmp_path, 2, generations)

    return judge


def best(found):
    at = found.isel(machine=0)
    return {name: at[name].item() for name in at.coords if "case_key" in at[name].attrs}


def test_the_least_change_is_found_and_no_other_assumption_is_changed(judge, tmp_path):
    """All claims hold from a rod mass of 6 kg on: 4.7 kg is the default."""
    found = judge(lambda case: case.machine.rod_mass_kg - 6.0)
    values = best(found)
    assert 6.0 <= values.pop("rod_mass_kg") < 6.3
    assert values == {"reciprocating_mass_kg": 14.0, "friction_velocity_mm_per_s": 100.0}
    assert found.attrs["distance"] == pytest.approx((6.0 - 4.7) / 8.0, abs=0.04)
    (said, margins) = change(found)
    assert said.startswith("All eight claims hold, each beyond its error, at a machine with the le")
    assert f"found among {found.attrs['looked']}: rod mass 6." in said
    assert said.endswith(" kg (not 4.7).")
    assert margins.startswith("Its margins: 1 +100 % ± 0 %, 2 +100 %")
    assert read_dataset(tmp_path / "some-best.nc").attrs["looked"] == found.attrs["looked"]


def test_a_lucky_machine_of_short_runs_is_looked_at_again(judge):
    """Runs of 20 revolutions say what those of 4 do not, and errors count."""

    def least(case):
        if case.solve.duration_rev < 20:
            return 0.01 - abs(case.machine.rod_mass_kg - 6.0)
        return 0.05 - abs(case.machine.rod_mass_kg - 6.3)

    found = judge(least, error=0.02)
    assert best(found)["rod_mass_kg"] == pytest.approx(6.3, abs=0.031)
    assert next(change(found)).startswith("All eight claims hold, each beyond its error")


@pytest.mark.parametrize(
    ("long", "said"),
    [(0.03, "All eight claims hold, each beyond its error, at a machine with these changes"),
     (0.01, "the best holds all eight claims, but only 7 of them beyond their errors"),
     (-0.1, "there 7 claims hold, 7 of them beyond their errors.")],
)  # fmt: skip
def test_runs_of_80_revolutions_decide_where_errors_are_wide(judge, tmp_path, long, said):
    found = judge(
        lambda case: long if case.solve.duration_rev == 80 else 0.01, generations=0, error=0.02
    )
    assert said in next(change(found))
    assert read_dataset(tmp_path / "some-search-longest.nc").sizes["machine"] == 1


def test_the_defaults_need_no_change(judge):
    found = judge(lambda case: 0.1, generations=1)
    assert found.attrs["distance"] == 0.0
    said, _ = change(found)
    assert said.endswith(": nothing.")


def test_where_none_holds_the_one_that_lacks_least_is_told(judge):
    found = judge(lambda case: -0.2 - abs(case.machine.reciprocating_mass_kg - 20.0) / 10.0)
    assert best(found)["reciprocating_mass_kg"] == pytest.approx(20.0, abs=0.5)
    (said, _) = change(found)
    assert said.startswith("No machine was found at which all eight claims hold, among")
    assert f"among {found.attrs['looked']} that a directed search looked at" in said
    assert said.endswith("there 7 claims hold, 7 of them beyond their errors.")


def test_a_search_is_the_same_again(judge):
    one, other = (
        judge(lambda case: case.machine.rod_mass_kg - 6.0, generations=1) for _ in range(2)
    )
    assert one.identical(other)


def test_a_search_begins_at_the_study_s_best_machine(judge, tmp_path):
    """Before any generation it is as good as what was judged before."""

    def least(case):
        return -abs(case.machine.rod_mass_kg - 7.3) / 10.0 - abs(case.friction.dynamic - 0.15)

    (tmp_path / "some.yaml").write_text(TEXT.replace("n: 2", "n: 64"))
    (study,) = load_studies(tmp_path / "some.yaml", variants=cases_judged)
    keys = [machine_key(case) for case in study.cases]
    rows = {
        key: Judged((1.0,) * 7 + (least(case),), (0.0,) * 8, (0.0,) * 4, (0.0,) * 4)
        for key, case in zip(keys, study.cases, strict=True)
    }
    write_dataset(tmp_path / "some.nc", machines_dataset(study, keys, rows))
    nearest = max(row.margin[7] for row in rows.values())
    judge(least, TEXT.replace("n: 2", "n: 64"), generations=0)
    first = read_dataset(tmp_path / "some-search.nc").isel(machine=slice(POPULATION))
    assert float(first["margin"].max("machine").min()) == pytest.approx(nearest, abs=1e-5)


def test_a_search_goes_down_to_the_bottom_of_a_region(judge):
    """In three assumptions that depend on each other, where no generation is looked at."""

    def least(case):
        first = case.machine.rod_mass_kg / 9.0
        second = case.machine.reciprocating_mass_kg / 30.0
        return -0.2 - abs(first - 0.31) - 2.0 * abs(second - first - 0.3)

    values = best(judge(least, generations=0))
    assert values["rod_mass_kg"] / 9.0 == pytest.approx(0.31, abs=0.02)
    assert values["reciprocating_mass_kg"] / 30.0 == pytest.approx(0.61, abs=0.02)


def test_machines_of_earlier_searches_stay(judge, tmp_path):
    """A search that takes another way knows them, and what was best."""

    def least(case):
        return -abs(case.machine.rod_mass_kg - 7.3) / 10.0

    first = judge(least, generations=4)
    known = {*read_dataset(tmp_path / "some-search.nc")["key"].values}
    again = judge(lambda case: -0.9, TEXT.replace("1, 9", "1, 8"), generations=0)
    assert again["key"].item() == first["key"].item()
    path = tmp_path / "some-search.nc"
    assert {*read_dataset(path)["key"].values} > known
    found = read_dataset(path)
    found["key"] = found["key"].copy(data=[f"{key} of old" for key in found["key"].values])
    write_dataset(path, found)
    with pytest.raises(StoreError, match="another case file, or of another version of compsim"):
        judge(least)


def test_what_follows_from_an_assumption_follows_in_a_search(judge, tmp_path):
    """Its machines are those of a sweep at the same values: a rod's inertia is that of its mass."""
    seen = []
    judge(lambda case: seen.append(case) or -1.0, generations=0)
    inertia = [case.machine.rod_inertia_kg_m2 for case in seen]
    assert inertia == pytest.approx([0.03 * case.machine.rod_mass_kg for case in seen], rel=1e-12)
    last = next(case for case in seen if case.machine.rod_mass_kg != 4.7)
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "some.yaml").write_text(
        f"machine: {{rod_mass_kg: {last.machine.rod_mass_kg}, "
        f"reciprocating_mass_kg: {last.machine.reciprocating_mass_kg}}}\n"
        f"friction: {{friction_velocity_mm_per_s: {last.friction.friction_velocity_mm_per_s}}}\n"
    )
    (study,) = load_studies(tmp_path / "one" / "some.yaml", variants=cases_judged)
    assert [*study.cases] == [last]


def test_a_search_needs_ranges(judge):
    with pytest.raises(ClaimsError, match="drawn between two numbers"):
        judge(lambda case: 1.0, "machine: {rod_mass_kg: [3, 4]}\n")


def test_what_a_machine_costs():
    held = Judged((0.2,) * 8, (0.0,) * 8)
    assert cost(held, 0.3) == 0.3
    assert cost(held._replace(margin=(0.2,) * 7 + (-0.1,)), 0.3) == pytest.approx(1.1)
    assert cost(Judged(), 0.3) == 10.0


def test_the_default_s_place_in_a_range():
    assert AssumptionRange("k", lambda s: 20.0 * 100.0**s, 200.0).home == pytest.approx(0.5)
    assert AssumptionRange("k", lambda s: 1.0 + s, 5.0).home == 1.0
    assert np.isclose(AssumptionRange("k", lambda s: 1.0 + s, 1.25).home, 0.25)
