"""The report's machines: maps and bars show the margins, and the words beside say the same."""

import pytest

from compressor.cases.examples import example
from compressor.cases.load import load_studies
from compressor.report.page import document
from compressor.store.files import StoreError
from compressor.store.netcdf import write_dataset
from compressor.studies.claims.page import (
    add,
    machine_drawings,
    machine_files,
)
from compressor.studies.claims.study import Judged, cases_judged, machines_dataset


def verdict(case):
    """Claims 3 and 8 by the masses, 7 by nothing, all others held."""
    rod, mass = case.machine.rod_mass_kg, case.machine.reciprocating_mass_kg
    margin = [0.3] * 8
    margin[2], margin[6], margin[7] = (mass - 10.0) / 20.0, -0.15, (rod - 4.0) / 10.0
    return Judged(tuple(margin), (1e-3,) * 8, (0.05, 0.05, -0.15, -0.3), (0.0,) * 4)


def judged(tmp_path, path, overrides=()):
    """A file of a study whose verdicts are made up."""
    (study,) = load_studies(path, overrides=overrides, variants=cases_judged)
    rows = {str(n): verdict(case) for n, case in enumerate(study.cases)}
    found = machines_dataset(study, [*rows], rows)
    write_dataset(tmp_path / f"{study.name}.nc", found)
    return found


@pytest.fixture
def folder(tmp_path):
    """A map, a design for a sensitivity, and a search that found something."""
    few = ["machine.rod_mass_kg={linspace: [2, 8, 7]}",
           "machine.reciprocating_mass_kg={linspace: [6, 26, 5]}"]  # fmt: skip
    titled = ["report.title=Unit 3", "report.notes=Rod weighed."]
    judged(tmp_path, example("claims"), [*few, *titled])
    found = judged(tmp_path, example("assumptions"), ["sample.n=4"])
    write_dataset(tmp_path / "assumptions-search.nc", found)
    found.attrs |= {"distance": 0.5, "looked": 99, "least": 0}
    write_dataset(tmp_path / "assumptions-best.nc", found.isel(machine=[3]))
    return tmp_path


@pytest.fixture
def drawn(folder):
    return {name: rest for name, *rest in machine_drawings(machine_files(folder))}


def test_the_map_comes_first_and_says_what_it_shows(drawn):
    assert next(iter(drawn)) == "claims"
    sentences, heading, caption, figure = drawn["claims"]
    assert caption.endswith("Claims 1 and 2 hold at every machine here: masses do not enter them.")
    assert heading == "The paper's claims over the mass plane"
    assert sentences[0].startswith("Of 35 machines each claim holds in so many: 1 in 35, 2 in 35, ")
    assert "3 in 28" in sentences[0]
    assert "8 in 25" in sentences[0]
    assert sentences[2] == (
        "All but claim 7 hold in 20, with rod mass from 4 to 8 kg, reciprocating mass from 11 to "
        "26 kg."
    )
    assert "claim 3 7 (0 within the error)" in sentences[-1]
    assert "claim 8 5 (5 within the error)" in sentences[-1]
    panels = {panel.title: panel for panel in figure.panels}
    cells, *_, place = panels["claim 3"].traces
    assert cells.z[0] == pytest.approx([-0.2] * 7)
    assert "most of them: 7 hold" in panels
    assert (place.x, place.y) == (4.7, 14.0)


def test_the_bars_are_those_of_the_sentences(drawn):
    sentences, _, caption, figure = drawn["assumptions"]
    assert "main effect" in caption
    said = next(text for text in sentences if text.startswith("Claim 3:"))
    assert said.startswith("Claim 3: most by reciprocating mass, ")
    value = float(said.split("mass, ")[1].split(" ")[0])
    panel = next(one for one in figure.panels if one.title == "claim 3")
    widths = [width for trace in panel.traces if trace.kind == "bars" for width in trace.x]
    assert len(widths) == 16
    assert min(abs(width - value) for width in widths) <= 0.005
    assert "Claim 7: its margin is the same at all machines." in sentences


def test_a_search_is_told_in_words_alone(drawn):
    (said, margins), heading, _, figure = drawn["assumptions-best"]
    assert said.startswith("No machine was found at which all eight claims hold, among 99 that")
    assert margins.startswith("Its margins: 1 +30 % ± 0.1 %")
    assert (heading, figure) == ("", None)


def test_the_section_of_the_page_has_words_and_figures(folder, capsys):
    (chapter,) = add("results", [], folder).chapters
    assert [part.plate is None for part in chapter.section.content] == [False, False, True]
    assert [plate.name for plate in chapter.plates] == ["machines-claims", "machines-assumptions"]
    text = document([chapter.section])
    assert "In which machines the paper&#39;s claims hold" in text
    assert "machines-claims.svg" in text
    assert text.count("<strong>Unit 3</strong>") == text.count('class="notes">Rod weighed.') == 1


@pytest.mark.parametrize("place", ["", "none"])
def test_without_judged_machines_nothing_is_added(place, folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert add("results", [], place) == ({}, [])


def test_without_a_folder_there_is_nothing_and_other_files_are_refused(tmp_path, folder):
    assert machine_files(tmp_path / "none") == {}
    found = machine_files(folder)["claims"].drop_vars("share_margin")
    write_dataset(tmp_path / "other.nc", found)
    with pytest.raises(StoreError, match="no file of judged machines"):
        machine_files(tmp_path)
