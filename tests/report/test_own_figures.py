"""The paper's figures of one's own machine: from which runs, and on the page."""

import csv
import json

import numpy as np
import pytest
from conftest import store
from test_report import read

from compressor.analysis.runs import CLEARANCES, FAULTS, case_of, cases_of, label, paper_cases
from compressor.cases.case import Case
from compressor.report.figures import FIGURES, pictures
from compressor.report.figures.table import spell
from compressor.report.paper_sections import comparable, find_runs, own_figures
from compressor.report.report import write_report
from compressor.store.reader import read_store
from compressor.store.studies import read_studies

HEAVY = {"rod_mass_kg": 3, "reciprocating_mass_kg": 20}
NINE = {"joint": [*FAULTS], "clearance_mm": [*CLEARANCES]}
DRAFT = {"accuracy": "draft"}
SHORT = DRAFT | {"duration_rev": 1, "settle_rev": 0, "output_step_deg": 4, "error_bars": False}
FILES = {f"heavy-figure-{n:02d}" for n in (4, *range(8, 17))}


def add(folder, name, solve=SHORT, **values):
    """Simulate a study into a store."""
    folder.mkdir(exist_ok=True)
    path = folder / f"{name}.yaml"
    path.write_text(json.dumps({"solve": solve, **values}), encoding="utf-8")
    store(folder / "results", path)
    return folder / "results"


def own(folder):
    """The paper's figures of the study `heavy` of a folder."""
    study = next(one for one in read_studies(folder) if one.name == "heavy")
    return own_figures(read_store(folder), study, "usual")


@pytest.fixture(scope="module")
def heavy_store(once):
    """A store with the study `heavy`: an ideal machine and the nine faults, with other masses."""

    def fill(folder):
        add(folder, "heavy", DRAFT, machine=HEAVY, report={"figures": "paper"},
            blocks=[{"joint": "none"}, NINE])  # fmt: skip

    return once("heavy-own", fill) / "results"


@pytest.fixture
def undrawn(monkeypatch):
    """No pixels are made, which takes long."""
    monkeypatch.setattr(pictures, "render", lambda figure: bytes(24))


def test_the_eleven_cases_keep_the_other_assumptions_of_one():
    worn = {"joint": "small_end", "clearance_mm": 0.7}
    assert cases_of(Case.from_values(worn)) == paper_cases()
    heavy = {"machine": {"rod_mass_kg": 3, "reciprocating_mass_kg": 20}}
    assert cases_of(Case.from_values(worn | heavy)) == paper_cases(**heavy["machine"])
    found = cases_of(Case.from_values(worn | {"machine": {"crank_radius_mm": 110}}))
    assert {case.machine.crank_radius_mm for case in found.values()} == {110}


def test_runs_on_other_grids_cannot_be_drawn_together(heavy_store):
    study = read_studies(heavy_store)[0]
    found = [read_store(heavy_store).job(key) for key in study.keys]
    assert comparable(found)
    later = found[1].assign_attrs(settle=2 * found[1].attrs["settle"])
    assert not comparable([found[0], later])
    assert not comparable([found[0], found[1].isel(time=slice(None, -1))])
    turn = [run.isel(time=slice(None, 2401)) for run in found]  # the first revolution is start-up
    assert comparable(turn)
    assert not comparable([run.isel(time=slice(None, -1)) for run in turn])
    assert comparable([run.isel(time=slice(None, None, 40)) for run in turn])  # 12 degrees
    assert not comparable([run.isel(time=slice(None, None, 50)) for run in turn])


def test_figures_and_captions_are_the_machine_s(heavy_store, undrawn):
    stored, study = read_store(heavy_store), read_studies(heavy_store)[0]
    runs = find_runs(stored, [study], paper_cases(**HEAVY)).usable
    _, (section, _) = own(heavy_store)
    found = {one.name: one for one in section.content.figures}
    assert {*found} == FILES
    drawn = found["heavy-figure-15"]
    assert drawn.title.startswith("heavy: Figure 15: Contact force at the big end")
    of = [runs[label("both", c)] for c in CLEARANCES]
    assert {case_of(run).machine.reciprocating_mass_kg for run in of} == {20}
    peaks = [float(run["peak_contact_force_axis"].sel(joint="big_end", axis="x")) for run in of]
    assert (
        f"Greatest along the cylinder at 0.1, 0.2, 0.3 mm: {spell(np.array(peaks) / 1e3)} kN"
        in (drawn.caption)
    )
    _, *rows = csv.reader(drawn.files["heavy-figure-15.csv"].decode().splitlines())
    forces = np.array(rows)[:, 1:4].astype(float)  # along the cylinder, beside the crank angle
    series = [run["contact_force"].sel(joint="big_end", axis="x").values[-1201:] for run in of]
    assert forces == pytest.approx(np.array(series).T / 1e3, rel=1e-6, abs=1e-6)
    assert found["heavy-figure-08"].caption == FIGURES["paper"]["figure-08"].make(runs).caption


def test_they_have_their_sections(heavy_store, tmp_path, undrawn):
    write_report(heavy_store, tmp_path / "out")
    assert {path.stem for path in (tmp_path / "out").glob("*.png")} == FILES  # and no sweep
    found = read(tmp_path / "out")
    order = [i for i in found.ids if i in ("figures-heavy", "heavy-figure-08", "study-heavy")]
    assert order == ["study-heavy", "figures-heavy", "heavy-figure-08"]
    assert "are drawn of this machine, but not Figures 3, 6, 7, whose" in found.text
    assert "Figure 4 · Figure 8 · Figure 9" in found.text  # each link had the study's name
    assert "rod mass 3 kg" in found.text
    rows = [cells for _, cells in found.rows if cells[0].startswith("(")]
    verdicts = [cells[1].partition("margin")[0] for cells in rows]
    assert verdicts[:2] == ["not measured"] * 2
    assert {*verdicts[2:]} <= {"held", "not held"}
    assert {"claims-heavy-1", "claims-heavy-8"} <= {*found.ids}
    assert {*found.jobs} >= {*read_studies(heavy_store)[0].keys}  # its table
