"""`compsim claims`: what it says and stores, and what it refuses."""

from pathlib import Path

import pytest
from compsim import cli

from compressor.studies.claims import search as searching
from compressor.studies.claims import study as judging
from compressor.studies.claims.study import Judged, machines_dataset
from compressor.studies.claims.study import machines as machines_of

MAP = "machine: {rod_mass_kg: [3, 4.7], reciprocating_mass_kg: [10, 14]}\n"
DRAWN = (
    "machine: {rod_mass_kg: {saltelli: [3, 6]}, pin_radius_mm: {saltelli: [9, 11]}}\n"
    "sample: {n: 2}\n"
)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with case files; verdicts are made up, and the studies are listed."""
    monkeypatch.chdir(tmp_path)
    Path("map.yaml").write_text(MAP)
    Path("drawn.yaml").write_text(DRAWN)
    asked = []

    def made(study, folder, *rest):
        machines_of(study)
        asked.append((study.name, str(folder), study.jobs))
        rows = {str(n): Judged((0.1,) * 8, (0.0,) * 8, (0.1,) * 4, (0.0,) * 4)
                for n in range(study.jobs)}  # fmt: skip
        if study.name == "map":
            rows["0"] = Judged(failed="both 0.1: not_settled")
        found = machines_dataset(study, [*map(str, range(study.jobs))], rows)
        found.encoding["source"] = f"{folder}/{study.name}.nc"
        return found

    def search(study, folder, workers, generations, progress):
        asked.append((study.name, generations))
        found = made(study, folder)
        found.attrs |= {"looked": 60, "least": 1, "distance": 0.0}
        found.encoding["source"] = f"{folder}/{study.name}-search.nc"
        return found

    monkeypatch.setattr(judging, "judge_machines", made)
    monkeypatch.setattr(searching, "least_change", search)
    return asked


def test_what_machines_say_is_printed_with_the_file(here, capsys):
    assert cli.main(["claims", "map.yaml", "-o", "out"]) == 3
    said = capsys.readouterr()
    lines = said.out.splitlines()
    assert lines[0] == "out/map.nc"
    assert lines[1].startswith("  Of 3 machines each claim holds in so many: 1 in 3, ")
    assert lines[2] == "  1 machine has no verdict, as a case failed."
    assert "next: compsim report --claims out" in said.err
    assert Path("out").is_dir()


def test_a_search_follows_in_the_ranges_of_what_is_drawn(here, capsys):
    assert cli.main(["claims", "drawn.yaml", "--search", "3", "--quiet"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if line[0] != " "] == [
        "claims/drawn.nc",
        "claims/drawn-search.nc",
    ]
    place = lines.index("claims/drawn-search.nc")
    assert lines[place + 1].startswith("  All eight claims hold, each beyond")
    assert ("drawn", 3) in here


def test_without_files_the_examples_are_taken(here):
    assert cli.main(["claims", "--quiet"]) == 0
    assert here == [("claims", "claims", 1600), ("assumptions", "claims", 640)]
