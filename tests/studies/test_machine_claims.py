"""The paper's claims over machines: margins of stored jobs, what decides them, and the command."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import store_cases

from compressor.analysis import CLEARANCES, FAULTS, cases_of, claims
from compressor.cases import Case, design, load_studies, templates
from compressor.report.figures.drawing import panels_of
from compressor.store.stored import read_store
from compressor.store.studies import find_study
from compressor.studies import claims as paper

QUICK = {"accuracy": "draft", "duration_rev": 2, "output_step_deg": 1}
BLOCKS = [
    {"load": ["gas", "spring"], "joint": "none"},
    {"joint": [*FAULTS], "clearance_mm": [*CLEARANCES]},
]
UNJUDGED = {  # study -> what it has in place, and what is said
    "failing": ({"solve": QUICK | {"max_steps": 50}},
                "big_end 0.1: budget_steps; big_end 0.2: budget_steps"),
    "short": ({"solve": QUICK | {"duration_rev": 1.5, "error_bars": False}},
              "the run has no whole settled revolution (solve.duration_rev)"),
    "bare": ({"output": {"keep": "metrics"}, "machine": {"rod_mass_kg": 5}},
             "; big_end 0.1: without time series; big_end 0.2: without"),
}  # fmt: skip


@pytest.fixture(scope="module")
def stored(once):
    base = {"solve": QUICK, "blocks": BLOCKS}
    studies = {name: base | more for name, (more, _) in UNJUDGED.items()}
    studies["some"] = base | {"machine": {"rod_mass_kg": [3, 4.7]}}
    return once("claims", lambda folder: store_cases(folder, **studies)) / "results"


def test_margins_of_stored_jobs_are_those_of_the_report(stored):
    found = paper.judge_machines(stored, find_study(stored, "some"))
    assert found["rod_mass_kg"].values.tolist() == [3.0, 4.7]
    assert found["rod_mass_kg"].attrs["units"] == "kg"
    machine = Case.from_values({"machine": {"rod_mass_kg": 3.0}, "solve": QUICK})
    jobs = read_store(stored)
    runs = {name: jobs.job(case.key) for name, case in cases_of(machine).items()}
    expected = [claim.margin for claim in claims(runs)]
    one = found.sel(machine=0)
    assert one["margin"].values == pytest.approx([m.value for m in expected], rel=1e-9)
    assert one["error"].values == pytest.approx([m.error for m in expected], rel=1e-6, abs=1e-12)
    assert found["failed"].values.tolist() == ["", ""]


@pytest.mark.parametrize(("name", "told"), [(name, one[-1]) for name, one in UNJUDGED.items()])
def test_a_machine_that_cannot_be_judged_has_no_margins(name, told, stored):
    found = paper.judge_machines(stored, find_study(stored, name))
    assert told in found["failed"].item()
    assert np.isnan(found["margin"]).all()
    assert ("without a verdict", "1") in paper.numbers(found)
    assert paper.draw(found, None) is None


def test_the_command_prints_and_writes(stored, tmp_path, monkeypatch, compsim):
    monkeypatch.chdir(tmp_path)
    out = compsim("claims", "some", "-r", str(stored), "--quiet").out
    assert "two clearances are worse" in out
    assert "machines judged           2" in out
    assert Path(stored, "claims", "some.nc").exists()
    err = compsim("claims", "failing", "-r", str(stored), "--quiet", code=3).err
    assert "without a verdict:\n  big_end 0.1: budget_steps; big_end 0.2: budget_steps" in err
    assert "compsim status" in err


@pytest.mark.parametrize("name", ["claims", "assumptions"])
def test_every_machine_of_the_examples_has_all_cases(name):
    few = "machine.rod_mass_kg=[2, 3]" if name == "claims" else "sample.n=2"
    (study,) = load_studies(templates()[name].path, overrides=[few])
    found = paper.machines(study)
    assert {len(jobs) for jobs in found.values()} == {11}
    assert len(found) * 11 == study.jobs


KEYS = ("rod_mass_kg", "static", "dynamic")


def test_the_indices_of_ishigami_s_function():
    """By Saltelli's closed forms: first order .3139, .4424, 0; total .5576, .4424, .2437."""
    points = design("saltelli", 512, 3, 1)
    margin = np.full((len(points), 8), 0.5)
    x, y, z = (2.0 * np.pi * column - np.pi for column in points.T)
    margin[:, 2] = (np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)) / 20.0  # below 1
    columns = zip(KEYS, points.T, strict=True)
    coords = {name: ("machine", column, {"case_key": name}) for name, column in columns}
    drawn = machines_of(margin, coords)
    found = paper.sensitivity(drawn)
    assert found["assumption"].values.tolist() == [*KEYS]
    one = found.sel(claim=3)
    for name, exact in (
        ("first_order", (0.3139, 0.4424, 0.0)), ("total_order", (0.5576, 0.4424, 0.2437)),
    ):  # fmt: skip
        assert one[name].values == pytest.approx(exact, abs=0.05)
        assert (one[f"{name}_low"].values <= np.array(exact) + 1e-3).all()
        assert (one[f"{name}_high"].values >= np.array(exact) - 1e-3).all()
    assert np.isnan(found["total_order"].sel(claim=1)).all()
    rows = [*paper.table(drawn, found)]
    assert [row[-1].partition(" ")[0] for row in rows[1:4]] == ["-", "-", "rod_mass_kg"]
    figure, _ = paper.draw(drawn, found)
    assert [panel.title for panel in panels_of(figure)] == ["claim 3"]


def machines_of(margin, coords):
    count = len(margin)
    return xr.Dataset(
        {
            "margin": (("machine", "claim"), margin),
            "chaotic": ("machine", np.zeros(count, int)),
            "failed": ("machine", np.full(count, "", object)),
        },
        coords | {"claim": [*paper.CLAIMS]},
    )


def test_machines_are_counted():
    """Claim 8 holds from a rod mass of 4 kg on, by 0.1 a kg; all others hold, but 7 nowhere."""
    plane = np.meshgrid(np.arange(2.0, 8.0), np.arange(10.0, 14.0))
    rods, masses = (part.ravel() for part in plane)
    margin = np.full((rods.size, 8), 0.5)
    margin[:, 7], margin[:, 6] = 0.1 * (rods - 4.0), -0.12
    margin[:, 2] = 0.3 - 0.02 * np.abs(masses - 11.0)
    coords = {
        paper.ROD: ("machine", rods, {"case_key": "machine.rod_mass_kg"}),
        paper.RECIPROCATING: ("machine", masses, {"case_key": "machine.reciprocating_mass_kg"}),
    }
    plane = machines_of(margin, coords)
    rows = {row[0]: row for row in paper.table(plane, None)}
    assert rows["8"][2:6] == ("16", "-20 %", "+5 %", "+30 %")
    assert rows["7"][2] == "0"
    assert dict(paper.numbers(plane)) == {
        "machines judged": "24", "without a verdict": "0", "with chaotic cases": "0",
        "all eight claims hold in": "0", "all but claim 7 hold in": "16",
    }  # fmt: skip
    figure, sentence = paper.draw(plane, None)
    assert panels_of(figure)[-1].title == "how many of eight hold"
    assert sentence.startswith("blue: the claim holds")
