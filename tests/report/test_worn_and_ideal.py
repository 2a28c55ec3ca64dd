"""A machine without clearance beside its worn jobs: which jobs stand there, and their numbers."""

import re

import numpy as np
import pytest
from conftest import store_cases

from compressor.cases.case import Case
from compressor.physics import exact_motion
from compressor.report import side_by_side
from compressor.report.figures.job import NAMES
from compressor.report.plots import draw_for_page
from compressor.report.side_by_side import compare_healthy, differing_in_clearance
from compressor.store import open_study, read_store, read_studies

CLEARANCES = (0.3, 0.05, 0.1, 0.2, 0.4, 0.15, 0.25, 0.35)  # as the case file has them


SOLVE = {"duration_rev": 1.5, "settle_rev": 0.5, "accuracy": "draft", "error_bars": False}
CASE = {"joint": "big_end", "clearance_mm": [*CLEARANCES], "body": True, "sensor": True,
        "solve": SOLVE}  # fmt: skip


@pytest.fixture(scope="module")
def swept(once):
    return once("side-by-side", lambda folder: store_cases(folder, own=CASE)) / "results"


@pytest.fixture(scope="module")
def study(swept):
    return read_store(swept), open_study(swept).load()


def shown(found):
    head = found.table.head
    assert head[:2] == ["metric", "without clearance"]
    return [float(re.match(r"clearance (\S+) mm", text)[1]) for text in head[2:]]


def test_the_column_without_clearance_is_the_closed_form(swept, study):
    found = compare_healthy(*study)
    assert shown(found) == sorted(CLEARANCES)
    assert "Beside it all jobs that differ in clearances alone" in found.paragraphs[0]
    numbers = {row.cells[0].text: row.cells for row in found.table.rows}
    case = Case.from_values({})
    lengths = (case.machine.crank_radius_mm / 1e3, case.machine.rod_length_mm / 1e3)
    _, _, a = exact_motion(np.linspace(0.0, 2.0 * np.pi, 36_001), *lengths, case.omega)
    for name, value in (("peak", np.abs(a).max()), ("rms", np.sqrt(np.mean(a[1:] ** 2)))):
        sound, *worn = numbers[f"{name} acceleration (m/s²)"][1:]
        assert sound.value == pytest.approx(value, rel=1e-4)
        for clearance, cell in zip(shown(found), worn, strict=True):
            own = float(study[1][f"{name}_acceleration"].sel(clearance_mm=clearance))
            assert cell.value == pytest.approx(own)
            assert float(re.search(r"\((\S+)×\)", cell.text)[1]) == pytest.approx(
                own / value, abs=0.006
            )


@pytest.mark.parametrize("worst", [0.05, 0.15, 0.25, 0.4])
def test_the_worst_job_stands_there_in_the_order_of_clearance(study, worst, monkeypatch):
    monkeypatch.setattr(side_by_side, "MAX_WORN", 5)
    stored, data = study[0], study[1].copy(deep=True)
    data["peak_contact_force"] *= np.where(data["clearance_mm"] == worst, 1e3, 1.0)[:, None]
    found = compare_healthy(stored, data)
    columns = shown(found)
    assert columns == sorted(columns)
    assert len(columns) in (5, 6)
    assert {min(CLEARANCES), max(CLEARANCES), worst} <= {*columns}
    told = f"the greatest contact force in a worn joint is at clearance {worst:g} mm"
    assert told in found.paragraphs[0]
    assert f"Beside it {len(columns)} of 8 jobs that" in found.paragraphs[0]


def test_a_peak_that_is_not_known_makes_no_job_the_worst(study):
    stored, data = study[0], study[1].copy()
    data["peak_contact_force_error"] = data["peak_contact_force"] * 0.0 + np.inf
    found = compare_healthy(stored, data)
    assert "contact force" not in found.paragraphs[0]
    assert len(shown(found)) == len(CLEARANCES)


def test_jobs_of_a_list_differ_in_clearances_alone(study):
    """As of two clearances that advance together; a job may lack a key that others have."""
    _, data = study
    listed = data.reset_index("clearance_mm").rename_dims(clearance_mm="job")
    assert differing_in_clearance(listed, 0) == list(np.argsort(CLEARANCES))
    mass = [3.0, 3.0, 5.0, 3.0, np.nan, np.nan, 3.0, 3.0]
    listed = listed.assign_coords(rod_mass_kg=("job", mass))
    assert differing_in_clearance(listed, 0) == [1, 3, 6, 0, 7]
    assert differing_in_clearance(listed, 4) == [5, 4]


def test_a_job_by_itself_and_one_without_clearance(study):
    stored, data = study
    one = compare_healthy(stored, data.isel(clearance_mm=[0]))
    assert one.table.head == ["metric", "without clearance", "this job"]
    assert "Beside it this job." in one.paragraphs[0]
    assert compare_healthy(stored, data.assign(max_penetration=data["max_penetration"] * 0)) is None


def test_a_twin_that_fails_stands_nowhere(swept, study, monkeypatch):
    (stored, data), (own,) = study, read_studies(swept)
    drawn = {one.name: one.figure for one in draw_for_page(stored, own, data, "usual")}
    monkeypatch.setattr(side_by_side, "healthy_twin", lambda run: None)
    monkeypatch.setattr("compressor.analysis.healthy_twin", lambda run: None)
    assert compare_healthy(stored, data) is None
    alone = {one.name: one.figure for one in draw_for_page(stored, own, data, "usual")}
    assert [*alone] == [*drawn]
    names = [{trace.name for trace in figures["analyst"].data} for figures in (drawn, alone)]
    assert names[0] - names[1] == {NAMES["twin"]}
    assert NAMES["this"] in names[1]
