"""The paper's figures of one's own machine: from which runs, and on the page."""

import csv

import numpy as np
import pytest
from conftest import store_cases, without_pictures
from test_report import read

from compressor.analysis.runs import CLEARANCES, FAULTS, case_of, label, paper_cases
from compressor.report.figures import FIGURES
from compressor.report.figures.table import spell
from compressor.report.paper_sections import comparable, find_runs
from compressor.report.report import write_report
from compressor.store import read_store, read_studies

HEAVY = {"rod_mass_kg": 3, "reciprocating_mass_kg": 20}
NINE = {"joint": [*FAULTS], "clearance_mm": [*CLEARANCES]}
CASE = {"machine": HEAVY, "report": {"figures": "paper"}, "solve": {"accuracy": "draft"},
        "blocks": [{"joint": "none"}, NINE]}  # fmt: skip
FILES = {f"heavy-figure-{n:02d}" for n in (4, *range(8, 17))}


@pytest.fixture(scope="module")
def heavy_store(once):
    """A store with the study `heavy`: an ideal machine and the nine faults, with other masses."""
    return once("heavy-own", lambda folder: store_cases(folder, heavy=CASE)) / "results"


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


def test_figures_captions_and_claims_are_the_machine_s(heavy_store, tmp_path):
    with without_pictures():
        write_report(heavy_store, tmp_path / "out")
    assert {path.stem for path in (tmp_path / "out").glob("*.png")} == FILES  # and no sweep
    found, study = read(tmp_path / "out"), read_studies(heavy_store)[0]
    order = [i for i in found.ids if i in ("figures-heavy", "heavy-figure-08", "study-heavy")]
    assert order == ["study-heavy", "figures-heavy", "heavy-figure-08"]
    runs = find_runs(read_store(heavy_store), [study], paper_cases(**HEAVY)).usable
    of = [runs[label("both", c)] for c in CLEARANCES]
    assert {case_of(run).machine.reciprocating_mass_kg for run in of} == {20}
    peaks = [float(run["peak_contact_force_axis"].sel(joint="big_end", axis="x")) for run in of]
    for words in (
        "heavy: Figure 15: Contact force at the big end",
        f"Greatest along the cylinder at 0.1, 0.2, 0.3 mm: {spell(np.array(peaks) / 1e3)} kN",
        " ".join(FIGURES["paper"]["figure-08"].make(runs).caption.split()),
        "are drawn of this machine, but not Figures 3, 6, 7, whose",
        "Figure 4 · Figure 8 · Figure 9",  # each link had the study's name
        "rod mass 3 kg",
    ):
        assert words in found.text
    table = (tmp_path / "out" / "heavy-figure-15.csv").read_text(encoding="utf-8")
    _, *rows = csv.reader(table.splitlines())
    forces = np.array(rows)[:, 1:4].astype(float)  # along the cylinder, beside the crank angle
    series = [run["contact_force"].sel(joint="big_end", axis="x").values[-1201:] for run in of]
    assert forces == pytest.approx(np.array(series).T / 1e3, rel=1e-6, abs=1e-6)
    rows = [cells for _, cells in found.rows if cells[0].startswith("(")]
    verdicts = [cells[1].partition("margin")[0] for cells in rows]
    assert verdicts[:2] == ["not measured"] * 2
    assert {*verdicts[2:]} <= {"held", "not held"}
    assert {"claims-heavy-1", "claims-heavy-8"} <= {*found.ids}
    assert {*found.jobs} >= {*study.keys}  # its table
