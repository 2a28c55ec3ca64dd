"""Keys of random cases, and jobs, axes and keys of our case files: equal until the model changes.

And the examples that are installed with the program: they say what they have, and run.
`python tests/cases/test_frozen.py` writes frozen.json anew for the same values and today's files.
"""

import hashlib
import json
import re
from pathlib import Path

import pytest

from compressor.analysis.cautions import cautions
from compressor.cases.case import Case
from compressor.cases.examples import STARTS, templates
from compressor.cases.load import load_studies
from compressor.solve.simulate import simulate

ROOT = Path(__file__).parents[2]
KEPT = Path(__file__).with_name("frozen.json")
FILES = [*(ROOT / "configs").glob("*.yaml"), *(ROOT / "compressor/cases/examples").glob("*.yaml")]
FROZEN = json.loads(KEPT.read_text("utf-8"))


def kept_of(path):
    """Jobs, axes and keys of a file of ours."""
    (study,) = load_studies(path, max_jobs=10**6)
    keys = hashlib.sha256("".join(study.keys).encode()).hexdigest()[:20]
    return {"axes": {axis.key: len(axis.values) for axis in study.axes},
            "jobs": study.jobs, "keys": keys, "name": study.name}  # fmt: skip


def test_keys_of_random_cases_are_those_kept_and_they_read_back():
    for values, key in FROZEN["cases"]:
        case = Case.resolve(values)
        assert case.key == key, values
        assert Case.resolve(case.values()) == case, values
        assert Case.from_attribute(case.attributes()["case"]) == case, values


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_our_files_have_the_jobs_axes_and_keys_kept(path):
    assert kept_of(path) == FROZEN["files"][path.name]


def test_examples_have_the_jobs_that_they_say():
    for name, one in templates().items():
        (said,) = re.findall(r"^([\d,]+) (?:jobs|machines?)\b", one.jobs)
        kept = FROZEN["files"][f"{name}.yaml"]
        assert (kept["name"], kept["jobs"]) == (name, int(said.replace(",", "")))


@pytest.mark.parametrize("name", STARTS)
def test_templates_run_without_a_warning(name):
    """Two jobs of each, short ones: the axes' ends."""
    (study,) = load_studies(templates()[name].path, overrides=["solve.accuracy=draft"])
    assert cautions(study) == []
    for case in (study.cases[0], study.cases[-1]):
        run = simulate(case)
        assert run["status"].item() == "ok"
        assert run["peak_acceleration"] > 0


def write_kept():
    cases = [json.dumps([values, Case.resolve(values).key]) for values, _ in FROZEN["cases"]]
    files = [f'"{path.name}": {json.dumps(kept_of(path))}' for path in sorted(FILES)]
    text = '{"cases": [\n%s\n],\n"files": {\n%s\n}}\n'
    KEPT.write_text(text % (",\n".join(cases), ",\n".join(files)), encoding="utf-8")


if __name__ == "__main__":
    write_kept()
