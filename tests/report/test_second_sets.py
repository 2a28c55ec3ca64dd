"""Another machine's Figures 8 to 16: which studies have them, from which runs, and the page."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from conftest import part_of, store
from test_report import forget, read

from compressor.analysis.captions import caption
from compressor.analysis.runs import (
    CLEARANCES,
    FAULT_LABELS,
    FAULTS,
    cases_of,
    label,
    paper_cases,
)
from compressor.cases.case import Case
from compressor.report import paper_sections, report
from compressor.report.figures import Drawing, pictures
from compressor.report.paper_sections import (
    PaperRuns,
    comparable,
    default_machine_runs,
    find_paper_runs,
    is_other,
    second_drawings,
)
from compressor.report.report import write_report
from compressor.store.reader import read_store
from compressor.store.studies import read_studies

HEAVY = {"rod_mass_kg": 3, "reciprocating_mass_kg": 20}
NINE = {"joint": [*FAULTS], "clearance_mm": [*CLEARANCES]}
DRAFT = {"accuracy": "draft"}
SHORT = DRAFT | {"duration_rev": 1, "settle_rev": 0, "output_step_deg": 4, "error_bars": False}
FILES = {f"heavy-figure-{n:02d}" for n in range(8, 17)}


def add(folder, name, solve=SHORT, **values):
    """Simulate a study into a store."""
    folder.mkdir(exist_ok=True)
    path = folder / f"{name}.yaml"
    path.write_text(json.dumps({"solve": solve, **values}), encoding="utf-8")
    store(folder / "results", path)
    return folder / "results"


def sets(folder):
    stored, studies = read_store(folder), read_studies(folder)
    return paper_sections.second_sets(stored, studies, find_paper_runs(stored, studies))


@pytest.fixture(scope="module")
def heavy_store(once):
    """A store with the study `heavy`: an ideal machine and the nine faults, with other masses."""

    def fill(folder):
        add(folder, "heavy", DRAFT, machine=HEAVY, blocks=[{"joint": "none"}, NINE])

    return once("heavy", fill) / "results"


@pytest.fixture
def heavy(heavy_store, tmp_path):
    return shutil.copytree(heavy_store, tmp_path / "results")


@pytest.fixture
def undrawn(monkeypatch):
    """Nothing is drawn of the paper's figures, and no pixels are made, which takes long."""
    figures = {
        module: tuple(
            replace(item, draw=lambda runs: Drawing([], 1.0)) for item in getattr(module, name)
        )
        for module, name in ((report, "FIGURES"), (paper_sections, "SET"))
    }
    monkeypatch.setattr(report, "FIGURES", figures[report])
    monkeypatch.setattr(paper_sections, "SET", figures[paper_sections])
    monkeypatch.setattr(pictures, "render", lambda drawing: bytes(24))


# ---- which studies ----------------------------------------------------------------------------


def test_the_runs_are_those_of_the_study(heavy_store):
    found = sets(heavy_store)["heavy"]
    assert {*found.drawn} == {"design", *FAULT_LABELS}
    assert found.keys == read_store(heavy_store).keys()
    for name in FAULT_LABELS:
        values = json.loads(found.drawn[name].attrs["case"])
        sizes = [size for size in values["clearance_mm"].values() if size]
        assert values["machine"]["reciprocating_mass_kg"] == 20
        assert {label(values["joint"], size) for size in sizes} == {name}


LAST = {"joint": "both", "clearance_mm": 0.3}
SPOILT = {  # the ninth case of studies that have eight
    "missing": {"clearance_mm": 0.4},
    "failed": {"solve": {"max_steps": 1}},
    "metrics": {"output": {"keep": "metrics"}},
    "mixed": {"friction": {"dynamic": 0.1}},
    "uneven": {"clearance_mm": {"big_end": 0.3, "small_end": 0.1}},
    "longer": {"solve": {"duration_rev": 2}},
}


@pytest.fixture(scope="module")
def spoilt(once):
    """A store with the studies of `SPOILT`."""
    eight = [{"joint": f, "clearance_mm": [*CLEARANCES]} for f in FAULTS[:2]]
    eight.append({"joint": "both", "clearance_mm": [0.1, 0.2]})

    def fill(folder):
        for name, last in SPOILT.items():
            add(folder, name, machine=HEAVY, blocks=[*eight, LAST | last])

    return once("spoilt", fill) / "results"


def test_eight_of_nine_are_no_set(spoilt):
    assert {study.name for study in read_studies(spoilt)} == {*SPOILT}
    assert [*sets(spoilt)] == []


def test_the_eleven_cases_keep_the_other_assumptions_of_one():
    worn = {"joint": "small_end", "clearance_mm": 0.7}
    assert cases_of(Case.from_values(worn)) == paper_cases()
    heavy = {"machine": {"rod_mass_kg": 3, "reciprocating_mass_kg": 20}}
    assert cases_of(Case.from_values(worn | heavy)) == paper_cases(**heavy["machine"])
    found = cases_of(Case.from_values(worn | {"machine": {"crank_radius_mm": 110}}))
    assert {case.machine.crank_radius_mm for case in found.values()} == {110}


@pytest.mark.parametrize(
    ("values", "other"),
    [({"machine": {"speed_rpm": 450}}, True), ({"spring": {"preload_N": 700}}, True),
     ({"contact": {"damping_N_s_per_mm": 300}}, True), ({"friction": False}, True),
     ({"friction": {"dynamic": 0.1}}, True), ({"solve": {"duration_rev": 8}}, False),
     ({"body": True, "gas": {"exponent": 1.3}}, False),
     ({"machine": {"rod_mass_kg": 4.7, "rod_inertia_kg_m2": 4.7 * 0.6**2 / 12}}, False)],
)  # fmt: skip
def test_what_makes_another_machine(values, other):
    case = Case.resolve({**values, "joint": "both", "clearance_mm": 0.1})
    assert is_other(case) is other


def test_a_sweep_over_machines_is_none_but_may_hold_the_default_one(tmp_path):
    add(tmp_path, "one", machine={"rod_mass_kg": [4.7, 3]}, **NINE)
    add(tmp_path, "two", machine={"rod_mass_kg": [5, 3]}, **NINE)
    found = sets(add(tmp_path, "default", **NINE))
    assert [*found] == ["one"]
    assert found["one"].case.machine.rod_mass_kg == 3


def test_runs_on_other_grids_cannot_be_drawn_together(heavy_store):
    found = [*sets(heavy_store)["heavy"].drawn.values()]
    assert comparable(found)
    later = found[1].assign_attrs(settle=2 * found[1].attrs["settle"])
    assert not comparable([found[0], later])
    assert not comparable([found[0], found[1].isel(time=slice(None, -1))])
    turn = [run.isel(time=slice(None, 2401)) for run in found]  # the first revolution is start-up
    assert comparable(turn)
    assert not comparable([run.isel(time=slice(None, -1)) for run in turn])
    assert comparable([run.isel(time=slice(None, None, 40)) for run in turn])  # 12 degrees
    assert not comparable([run.isel(time=slice(None, None, 50)) for run in turn])


# ---- runs without clearance -------------------------------------------------------------------


LENT = PaperRuns({}, {load: xr.Dataset() for load in ("design", "typical")}, {})


@pytest.mark.parametrize(
    ("values", "drawn", "judged"),
    [({"machine": HEAVY}, 2, 2),
     ({"friction": False, "contact": {"exponent": 1.6}, "body": True}, 2, 2),
     ({"spring": {"preload_N": 700}}, 2, 0),
     ({"gas": {"exponent": 1.3, "switching": "exact"}}, 2, 0),
     ({"machine": {"speed_rpm": 400}}, 0, 0),
     ({"machine": {"crank_radius_mm": 110}}, 0, 0),
     ({"machine": {"rod_length_mm": 500}}, 0, 0),
     ({"machine": HEAVY, "solve": {"output_step_deg": 0.6}}, 0, 0),
     ({"machine": HEAVY, "solve": {"settle_rev": 2}}, 0, 0)],
)  # fmt: skip
def test_the_default_machine_lends_the_same_motion_and_no_other(values, drawn, judged):
    case = Case.resolve({**values, "joint": "both", "clearance_mm": 0.1})
    assert len(default_machine_runs(case, LENT, loads=False)) == drawn
    assert len(default_machine_runs(case, LENT, loads=True)) == judged


def test_the_study_s_own_ideal_run_goes_first(paper_store, heavy):
    part_of(paper_store, heavy, "design", "typical")
    found = sets(heavy)["heavy"]
    assert mass(found.drawn["design"]) == 3
    assert "typical" in found.judged
    forget(heavy, next(s for s in read_studies(heavy) if s.name == "heavy").keys[0])
    found = sets(heavy)["heavy"]
    assert mass(found.drawn["design"]) == 4.7
    assert comparable([found.drawn["design"], found.drawn["both 0.1"]])


def mass(run):
    return json.loads(run.attrs["case"])["machine"]["rod_mass_kg"]


# ---- figures and page -------------------------------------------------------------------------


def test_figures_and_captions_are_the_second_machine_s(heavy_store):
    runs = sets(heavy_store)["heavy"].drawn
    found = {name: parts for name, *parts in second_drawings(sets(heavy_store)["heavy"])}
    assert {*found} == FILES
    heading, text, drawing = found["heavy-figure-15"]
    assert heading.startswith("Figure 15 of heavy: ")
    of = [runs[label("both", c)] for c in CLEARANCES]
    peaks = [float(run["peak_contact_force_axis"].sel(joint="big_end", axis="x")) for run in of]
    assert ", ".join(f"{peak / 1e3:.2f}" for peak in peaks) + " kN along the cylinder" in text
    rows = [panel for panel in drawing.panels if panel.column[0] == 0][:3]
    drawn = [np.abs(one.y).max() for panel in rows for one in panel.traces if one.name]
    series = [run["contact_force"].sel(joint="big_end", axis="x").values[-1201:] for run in of]
    assert drawn == pytest.approx([np.abs(one).max() / 1e3 for one in series])
    assert found["heavy-figure-08"][1] == caption(8, runs)


def test_a_second_set_has_its_section(heavy, tmp_path, undrawn):
    write_report(heavy, tmp_path / "out")
    assert {path.stem for path in (tmp_path / "out").glob("*.png")} == FILES
    found = read(tmp_path / "out")
    assert {*found.ids} >= FILES
    order = [i for i in found.ids if i in ("figures-heavy", "heavy-figure-08", "study-heavy")]
    assert order == ["study-heavy", "figures-heavy", "heavy-figure-08"]
    assert "heavy: Figures 8 to 16 of another machine" in found.text
    assert "machine.rod_mass_kg, rod mass: 3 kg (default: 4.7 kg)" in found.text
    assert "piston: 20 kg (default: 14 kg)" in found.text
    assert "rod_inertia" not in found.text  # it follows from the mass
    rows = [cells for _, cells in found.rows if cells[0].startswith("(")]
    verdicts = [cells[1].partition("margin")[0] for cells in rows]
    assert verdicts[:2] == ["not measured"] * 2
    assert {*verdicts[2:]} <= {"held", "not held"}
    assert all("margin" in cells[1] for cells in rows[2:])
    assert "Figures 8 to 16 of the default machine are not stored here" in found.text
    assert {"#figures-heavy", "#study-heavy"} <= {*found.links}
    assert {*found.jobs} >= {*read_studies(heavy)[0].keys}  # its table


def test_each_figure_has_a_link_to_its_counterpart(paper_store, heavy, tmp_path, undrawn):
    part_of(paper_store, heavy, "design", "big-end")
    write_report(heavy, tmp_path / "out")
    found = read(tmp_path / "out")
    assert found.links.count("#figure-09") == 2  # from the head of the first set, too
    assert not [link for link in found.links if link == "#figure-12"]
    assert "Figure 9 of the default machine" in found.text
    assert len(found.ids) == len({*found.ids})
    assert found.ids.index("figure-09") < found.ids.index("heavy-figure-09")
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    assert page.count('class="counterpart"') == 3


def test_what_could_not_be_drawn_is_told_and_removed(tmp_path, undrawn):
    """A machine of another speed without an ideal run; a tenth job makes it a sweep, too."""
    blocks = [NINE, {"joint": "both", "clearance_mm": 0.4}]
    folder = add(tmp_path, "other", machine={"speed_rpm": 400}, blocks=blocks)
    (tmp_path / "out").mkdir()
    for name in ("other-figure-08.png", "other-figure-09.svg", "foreign-figure-08.png"):
        (tmp_path / "out" / name).write_text("an earlier report's")
    write_report(folder, tmp_path / "out")
    names = {path.stem for path in (tmp_path / "out").glob("*.png")}
    left = {f"other-figure-{n:02d}" for n in (9, 10, 12, 13, 15, 16)}
    swept = {
        "sweep-other-ranking",
        "sweep-other-points",
        "cycles-other",
        "analyst-other",
    }
    assert names == left | swept | {"foreign-figure-08"}
    assert "Figures 8, 11, 14 are not drawn" in read(tmp_path / "out").text
