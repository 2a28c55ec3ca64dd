"""The table of mistakes: what is answered to each, as a file, as values, by --set, by the schema.

mistakes.json has a row a mistake: the text of a file, the lines that answer it, and the other ways
in which the same is said without a place: "values" (`Case.from_values`) and "set" (--set beside a
file `{}`); "schema" where the JSON Schema sees that something is wrong.
`python tests/cases/test_mistaken_cases.py` writes it anew, where answers change.
"""

import json
import re
import tempfile
from pathlib import Path

import jsonschema
import pytest

from compressor.cases.case import Case, CaseError
from compressor.cases.json_schema import case_schema
from compressor.cases.load import CaseFileError, load_studies
from compressor.cases.yaml_reader import Place, read_text

TABLE = Path(__file__).with_name("mistakes.json")
ROWS = json.loads(TABLE.read_text("utf-8"))
SCHEMA = jsonschema.Draft202012Validator(case_schema())


def told(text, folder, overrides=()):
    """What is said of a file, a line each."""
    path = Path(folder) / "case.yaml"
    path.write_text(text, encoding="utf-8")
    try:
        load_studies(path, overrides=overrides)
    except CaseFileError as error:
        return str(error).replace(f"{folder}/", "").replace("case.yaml:", "").split("\n")
    return []


def without_places(lines):
    return sorted(re.sub(r"^(\d+:\d+: |--set .*?: )", "", line) for line in lines)


def values_of(text):
    """The nested values of a file, None where it is no plain mapping."""
    tree, problems = read_text(text, Place("x", 1, 1))
    return tree.values if tree and not problems and isinstance(tree.values, dict) else None


def refusal(values):
    try:
        Case.from_values(values)
    except CaseError as error:
        return str(error).split("\n")
    return []


def settings(values, before=""):
    """--set KEY=VALUE of each value."""
    for key, value in values.items():
        if isinstance(value, dict) and value:
            yield from settings(value, f"{before}{key}.")
        else:
            yield f"{before}{key}={json.dumps(value, ensure_ascii=False)}"


def row(text, folder):
    """A row of the table as the program answers now."""
    lines, ways = told(text, folder), []
    values = values_of(text)
    if values and lines:
        if without_places(refusal(values)) == without_places(lines):
            ways.append("values")
        if without_places(told("{}", folder, [*settings(values)])) == without_places(lines):
            ways.append("set")
    if values is not None and not SCHEMA.is_valid(values):  # an editor marks it
        ways.append("schema")
    return [text, lines, ways]


@pytest.mark.parametrize("expected", ROWS, ids=lambda row: row[0])
def test_a_mistake_is_answered_with_place_key_and_remedy(expected, tmp_path):
    assert row(expected[0], tmp_path) == expected
    assert all(line.isprintable() for line in expected[1])  # nothing that steers a terminal


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        rows = [json.dumps(row(text, folder), ensure_ascii=False) for text, *_ in ROWS]
    TABLE.write_text("[\n" + ",\n".join(rows) + "\n]\n", encoding="utf-8")
