"""The paper's claims over machines: margins of stored jobs, what decides them, and the command."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from compressor.analysis.claims import claims
from compressor.analysis.runs import cases_of
from compressor.cases.case import Case
from compressor.cases.examples import templates
from compressor.cases.load import load_studies
from compressor.cases.swept import design
from compressor.report.figures.drawing import panels_of
from compressor.report.figures.pictures import render
from compressor.solve.simulate import simulate
from compressor.store.studies import find_study
from compressor.studies.claims import (
    CLAIMS,
    RECIPROCATING,
    ROD,
    draw,
    judge_machines,
    machines,
    numbers,
    sensitivity,
    table,
)
from compressor.studies.frame import StudyError
from compressor.sweep.sweep import Options, in_this_process, sweep

QUICK = "solve: {accuracy: draft, duration_rev: 2, output_step_deg: 1}\n"
BLOCKS = (
    "blocks:\n"
    "  - {load: [gas, spring], joint: none}\n"
    "  - {joint: [big_end, small_end, both], clearance_mm: [0.1, 0.2, 0.3]}\n"
)


def run(path, folder, text):
    """Run a case file, and return its stored study."""
    path.write_text(text)
    (study,) = load_studies(path)
    sweep([study], folder, 1, options=Options(backend=in_this_process))
    return find_study(folder, study.name)


@pytest.fixture(scope="module")
def stored(once):
    """A folder with two machines, of which one has a failed job."""

    def fill(folder):
        folder.mkdir()
        text = QUICK + "machine: {rod_mass_kg: [3, 4.7]}\n" + BLOCKS
        fail = text.replace("output_step_deg: 1", "output_step_deg: 1, max_steps: 50")
        run(folder / "some.yaml", folder, text)
        run(folder / "failing.yaml", folder, fail.replace("[3, 4.7]", "3"))
        run(folder / "short.yaml", folder, text.replace("duration_rev: 2", "duration_rev: 1.5"))
        coarse = "output_step_deg: [1, 15]"
        run(folder / "coarse.yaml", folder, (QUICK + BLOCKS).replace("output_step_deg: 1", coarse))

    return once("claims", fill)


@pytest.mark.compiled
def test_margins_of_stored_jobs_are_those_of_the_report(stored):
    found = judge_machines(stored, find_study(stored, "some"))
    assert found["rod_mass_kg"].values.tolist() == [3.0, 4.7]
    assert found["rod_mass_kg"].attrs["units"] == "kg"
    how = {"accuracy": "draft", "duration_rev": 2, "output_step_deg": 1}
    machine = Case.from_values({"machine": {"rod_mass_kg": 3.0}, "solve": how})
    runs = {name: simulate(case) for name, case in cases_of(machine).items()}
    expected = [claim.margin for claim in claims(runs)]
    one = found.sel(machine=0)
    assert one["margin"].values == pytest.approx([m.value for m in expected], rel=1e-9)
    assert one["error"].values == pytest.approx([m.error for m in expected], rel=1e-6, abs=1e-12)
    assert found["failed"].values.tolist() == ["", ""]


@pytest.mark.compiled
def test_a_machine_with_a_failed_case_has_no_margins(stored):
    found = judge_machines(stored, find_study(stored, "failing"))
    assert found["failed"].item().startswith("big_end 0.1: budget_steps; big_end 0.2: budget_steps")
    assert np.isnan(found["margin"]).all()
    assert ("without a verdict", "1") in numbers(found)


@pytest.mark.compiled
def test_a_machine_with_too_short_or_too_coarse_series_has_no_margins(stored):
    short = judge_machines(stored, find_study(stored, "short"))
    text = "the run has no whole settled revolution (solve.duration_rev)"
    assert short["failed"].values.tolist() == [text, text]
    found = judge_machines(stored, find_study(stored, "coarse"))
    fine, coarse = (found.isel(machine=number) for number in range(2))
    assert fine["failed"] == ""
    assert "sample more finely" in coarse["failed"].item()
    assert np.isnan(coarse["margin"]).all()
    assert not np.isnan(fine["margin"]).any()


@pytest.mark.compiled
def test_the_command_prints_and_writes(stored, tmp_path, monkeypatch, compsim):
    monkeypatch.chdir(tmp_path)
    out = compsim("claims", "some", "-r", str(stored), "--quiet").out
    assert "two clearances are worse" in out
    assert "machines judged           2" in out
    assert Path(stored, "claims", "some.nc").exists()
    err = compsim("claims", "failing", "-r", str(stored), "--quiet", code=3).err
    assert "without a verdict:\n  big_end 0.1: budget_steps; big_end 0.2: budget_steps" in err
    assert "compsim status" in err


@pytest.mark.compiled
def test_a_case_without_time_series_is_told(tmp_path):
    text = QUICK + BLOCKS + "output: {keep: metrics}\n"
    found = judge_machines(tmp_path, run(tmp_path / "bare.yaml", tmp_path, text))
    assert "; big_end 0.1: without time series; big_end 0.2: without" in found["failed"].item()


@pytest.mark.parametrize("name", ["claims", "assumptions"])
def test_every_machine_of_the_examples_has_all_cases(name):
    (study,) = load_studies(
        templates()[name].path, overrides=["sample.n=2"] if name != "claims" else []
    )
    found = machines(study)
    assert {len(jobs) for jobs in found.values()} == {11}
    assert len(found) * 11 == study.jobs


def test_a_study_without_the_papers_cases_is_refused(tmp_path):
    path = tmp_path / "one.yaml"
    path.write_text("joint: both\nclearance_mm: [0.1, 0.2]\nload: spring\n")
    (study,) = load_studies(path)
    with pytest.raises(StudyError, match=r"study one has no machine .* compsim init claims"):
        machines(study)


def ishigami(points):
    """Ishigami and Homma's function with a = 7 and b = 0.1, scaled below 1."""
    x, y, z = (2.0 * np.pi * column - np.pi for column in points.T)
    return (np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)) / 20.0


KEYS = ("rod_mass_kg", "static", "dynamic")


@pytest.fixture
def drawn():
    points = np.array(design("saltelli", 512, 3, 1))
    margin = np.full((len(points), 8), 0.5)
    margin[:, 2] = ishigami(points)
    coords = {
        name: ("machine", column, {"case_key": name})
        for name, column in zip(KEYS, points.T, strict=True)
    }
    return machines_of(margin, coords)


def machines_of(margin, coords):
    """Machines with made-up margins."""
    count = len(margin)
    return xr.Dataset(
        {
            "margin": (("machine", "claim"), margin),
            "chaotic": ("machine", np.zeros(count, int)),
            "failed": ("machine", np.full(count, "", object)),
        },
        coords | {"claim": [*CLAIMS]},
    )


def test_the_indices_of_ishigami_s_function(drawn):
    """By Saltelli's closed forms: first order .3139, .4424, 0; total .5576, .4424, .2437."""
    found = sensitivity(drawn)
    assert found["assumption"].values.tolist() == [*KEYS]
    one = found.sel(claim=3)
    for name, exact in (
        ("first_order", (0.3139, 0.4424, 0.0)), ("total_order", (0.5576, 0.4424, 0.2437)),
    ):  # fmt: skip
        assert one[name].values == pytest.approx(exact, abs=0.05)
        assert (one[f"{name}_low"].values <= np.array(exact) + 1e-3).all()
        assert (one[f"{name}_high"].values >= np.array(exact) - 1e-3).all()
    assert np.isnan(found["total_order"].sel(claim=1)).all()
    rows = [*table(drawn, found)]
    assert [row[-1].partition(" ")[0] for row in rows[1:4]] == ["-", "-", "rod_mass_kg"]
    figure, _ = draw(drawn, found)
    assert [panel.title for panel in panels_of(figure)] == ["claim 3"]
    assert render(figure, "png").startswith(b"\x89PNG")


@pytest.fixture
def plane():
    """Claim 8 holds from a rod mass of 4 kg on, by 0.1 a kg; all others hold, but 7 nowhere."""
    rods, masses = (
        part.ravel() for part in np.meshgrid(np.arange(2.0, 8.0), np.arange(10.0, 14.0))
    )
    margin = np.full((rods.size, 8), 0.5)
    margin[:, 7], margin[:, 6] = 0.1 * (rods - 4.0), -0.12
    margin[:, 2] = 0.3 - 0.02 * np.abs(masses - 11.0)
    coords = {
        ROD: ("machine", rods, {"case_key": "machine.rod_mass_kg"}),
        RECIPROCATING: ("machine", masses, {"case_key": "machine.reciprocating_mass_kg"}),
    }
    return machines_of(margin, coords)


def test_machines_are_counted(plane):
    rows = {row[0]: row for row in table(plane, None)}
    assert rows["8"][2:6] == ("16", "-20 %", "+5 %", "+30 %")
    assert rows["7"][2] == "0"
    assert dict(numbers(plane)) == {
        "machines judged": "24", "without a verdict": "0", "with chaotic cases": "0",
        "all eight claims hold in": "0", "all but claim 7 hold in": "16",
    }  # fmt: skip
    figure, sentence = draw(plane, None)
    assert panels_of(figure)[-1].title == "how many of eight hold"
    assert sentence.startswith("blue: the claim holds")


def test_a_plane_without_verdicts_has_no_figure(plane):
    plane["margin"].values[:] = np.nan
    assert draw(plane, None) is None
