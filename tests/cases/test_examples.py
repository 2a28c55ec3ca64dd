"""The examples that are installed with the program."""

import fnmatch
import tomllib
from pathlib import Path

import pytest

from compressor.analysis.paper_cases import FAULT_LABELS, cases_of
from compressor.cases.case import Case
from compressor.cases.examples import FOLDER, example
from compressor.cases.load import load_studies

ROOT = Path(__file__).parent.parent.parent
NAMES = sorted(path.stem for path in FOLDER.glob("*.yaml"))


@pytest.mark.parametrize("name", NAMES)
def test_examples_can_be_run(name):
    (study,) = load_studies(example(name))
    assert study.name == name
    assert study.cases


def test_an_unknown_example_names_those_that_there_are():
    with pytest.raises(ValueError, match=r"no example 'none'.* consistent"):
        example("none")


def test_the_list_has_all_of_them():
    page = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert NAMES
    assert [name for name in NAMES if f"| `{name}.yaml` |" not in page] == []


def test_they_are_installed():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    tools = project["tool"]["setuptools"]
    assert "compressor.cases.examples" in tools["packages"]
    patterns = tools["package-data"]["compressor.cases.examples"]
    files = [path.name for path in FOLDER.iterdir() if path.suffix in (".yaml", ".md")]
    assert not [f for f in files if not any(fnmatch.fnmatch(f, p) for p in patterns)]


def test_the_consistent_machine_has_the_paper_s_faults():
    (study,) = load_studies(example("consistent"))
    cases = cases_of(study.cases[-1])
    assert {*study.keys} == {cases[name].key for name in ("design", *FAULT_LABELS)}
    assert study.cases[0].machine != Case().machine
