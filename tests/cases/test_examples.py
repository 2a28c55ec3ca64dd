"""The examples that are installed with the program."""

import re

import pytest

from compressor.analysis.cautions import cautions
from compressor.cases.examples import FOLDER, STARTS, templates
from compressor.cases.load import load_studies
from compressor.solve.simulate import simulate

NAMES = sorted(path.stem for path in FOLDER.glob("*.yaml"))


@pytest.mark.parametrize("name", STARTS)
def test_templates_run_without_a_warning(name):
    """Two jobs of each, short ones: the axes' ends."""
    (study,) = load_studies(templates()[name].path, overrides=["solve.accuracy=draft"])
    assert cautions(study) == []
    for case in (study.cases[0], study.cases[-1]):
        run = simulate(case)
        assert run["status"].item() == "ok"
        assert run["peak_acceleration"] > 0


def test_templates_come_first_and_say_what_they_answer():
    found = templates()
    assert tuple(found)[: len(STARTS)] == STARTS
    assert sorted(found) == NAMES
    for one in found.values():
        assert one.question.count("?") == 1
        assert re.search(r"seconds|minutes|hour|\d s\b|\d min\b", one.jobs)
        verb = one.next.split()[1]
        assert verb in ("run", "wear", "follow")
        assert (verb == "wear") is ("\nwear:" in one.path.read_text())
        assert one.next.startswith(f"compsim {verb} {one.name}.yaml")
