"""Keys of random cases, and axes and keys of our case files: equal until the model changes.

And the examples that are installed with the program: they say what they have, nothing is odd about
them, and they run. Of what is drawn or a map two values of an axis stand for all.
`python tests/cases/test_frozen.py` writes frozen.json anew for the same values and today's files.
"""

import hashlib
import json
import re
from pathlib import Path

import pytest

from compressor.analysis import cautions, describe_machine
from compressor.cases.case import Case
from compressor.cases.examples import STARTS, templates
from compressor.cases.load import CaseFileError, load_studies
from compressor.solve.simulate import simulate

ROOT = Path(__file__).parents[2]
KEPT = Path(__file__).with_name("frozen.json")
FILES = [*(ROOT / "configs").glob("*.yaml"), *(ROOT / "compressor/cases/examples").glob("*.yaml")]
FROZEN = json.loads(KEPT.read_text("utf-8"))


MAPS = {
    "claims": ["machine.rod_mass_kg=[1.5, 9.3]", "machine.reciprocating_mass_kg=[2.5, 29.8]"],
    "speed-sweep": ["machine.speed_rpm=[200, 925]"],
}


def few_of(path, *overrides):
    """The study of a file of ours with a small part of its jobs."""
    text = path.read_text(encoding="utf-8")
    drawn = [f"sample.n={1 if 'saltelli' in text else 2}"] * ("sample:" in text)
    (study,) = load_studies(path, overrides=[*drawn, *MAPS.get(path.stem, ()), *overrides])
    return study


def kept_of(study):
    """Jobs, axes and keys of a study of ours."""
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
def test_our_files_have_the_axes_and_keys_kept_and_nothing_odd(path):
    study = few_of(path)
    assert kept_of(study) == FROZEN["files"][path.name]
    if path.stem != "extremes":  # which is far from any machine
        assert describe_machine(study).remarks() == {}
        odd = {one.key for one in cautions(study)}
        assert odd == ({"wear"} if path.stem == "life" else set())  # of which a run reads nothing


SWEPT = [one for one in templates().values() if one.name != "regimes"]  # of one job


@pytest.mark.parametrize("one", SWEPT, ids=lambda one: one.name)
def test_examples_have_the_jobs_that_they_say(one):
    """They are counted before any is made, to be refused."""
    (said,) = re.findall(r"^([\d,]+) (?:jobs|machines?)\b", one.jobs)
    jobs = int(said.replace(",", ""))
    with pytest.raises(CaseFileError, match=f" {jobs} jobs are more than {jobs - 1}: ask"):
        load_studies(one.path, max_jobs=jobs - 1)


@pytest.mark.parametrize("name", STARTS)
def test_templates_run(name):
    """Two jobs of each, short ones: the axes' ends."""
    study = few_of(templates()[name].path, "solve.accuracy=draft")
    for case in (study.cases[0], study.cases[-1]):
        run = simulate(case)
        assert run["status"].item() == "ok"
        assert run["peak_acceleration"] > 0


if __name__ == "__main__":
    cases = [json.dumps([values, Case.resolve(values).key]) for values, _ in FROZEN["cases"]]
    files = [f'"{path.name}": {json.dumps(kept_of(few_of(path)))}' for path in sorted(FILES)]
    text = '{"cases": [\n%s\n],\n"files": {\n%s\n}}\n'
    KEPT.write_text(text % (",\n".join(cases), ",\n".join(files)), encoding="utf-8")
