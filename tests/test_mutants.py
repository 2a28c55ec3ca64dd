"""The bugs that `make mutants` plants: that they can be planted, and that some are caught."""

import ast
import json
import subprocess
import sys

import mutation
import planted_bugs
import pytest
from equivalent_mutants import EQUIVALENT
from mutation import Mutant, drawn, mutants_of, planted
from page_tables import kept

SAMPLE = ("K a hundredth too large", "the cam does not close", "friction's velocity in mm/s")


def test_thirty_bugs_can_be_planted():
    """Their texts still stand in the sources; says which does not."""
    bugs = planted_bugs.bugs()
    assert len({bug.identity for bug in bugs}) == 30
    for bug in bugs:
        ast.parse(bug.source())


@pytest.mark.parametrize("text", ["no such text", "return"])
def test_a_text_that_is_not_there_once_is_refused(text):
    with pytest.raises(LookupError, match=r"a bug: compressor/physics/contact\.py has"):
        planted("a bug", "physics/contact.py", text, "pass")


def test_sixty_mutants_are_drawn_of_all_kinds():
    mutants = drawn(60)
    assert mutants == drawn(60)
    assert len({mutant.identity for mutant in mutants}) == 60
    for kind in mutation.KINDS:
        assert sum(mutant.kind == kind for mutant in mutants) == 10
    for mutant in mutants:
        assert ast.dump(ast.parse(mutant.source())) != ast.dump(ast.parse(original(mutant)))


def original(mutant: Mutant):
    return (mutation.ROOT / mutant.file).read_bytes()


def test_an_edit_elsewhere_leaves_the_draw_as_it_is(tmp_path):
    folder = tmp_path / mutation.PHYSICS
    folder.mkdir(parents=True)
    for path in (mutation.ROOT / mutation.PHYSICS).glob("*.py"):
        text = path.read_text(encoding="utf-8")
        (folder / path.name).write_text("A_NEW = 'line'\n" + text, encoding="utf-8")
    there, here = ({m.identity for m in drawn(60, root)} for root in (tmp_path, mutation.ROOT))
    assert there == here


def test_every_kind_of_change(tmp_path):
    path = tmp_path / "sums.py"
    path.write_text("def f(a, b):\n    if a < 2:\n        return g(a, -b) + 0.5\n    a -= b\n")
    found = {(m.kind, m.change) for _, m in mutants_of(path, tmp_path)}
    assert found == {
        ("comparisons", "a < 2 -> a <= 2"),
        ("comparisons", "a < 2 -> a > 2"),
        ("constants", "2 -> 3"),
        ("constants", "0.5 -> 0.505"),
        ("operators", "g(a, -b) + 0.5 -> g(a, -b) - 0.5"),
        ("operators", "a -= b -> a += b"),
        ("signs", "-b -> b"),
        ("arguments", "g(a, -b) -> g(-b, a)"),
        ("terms", "g(a, -b) + 0.5 -> g(a, -b)"),
        ("terms", "a -= b -> pass"),
    }


def test_equivalent_mutants_are_drawn_ones():
    """An entry that is not drawn any more is to be removed."""
    assert set(EQUIVALENT) <= {mutant.identity for mutant in drawn(60)}


def test_what_was_measured_reaches_the_aims():
    rows = kept("mutants.json")["mutants"]
    planted_rows = [row for row in rows if row["kind"] == "planted"]
    others = [row for row in rows if row["kind"] != "planted" and "equivalent" not in row]
    assert len(planted_rows) == 30
    assert len(rows) == 90
    assert not any(row["caught_by"] for row in rows if "equivalent" in row)
    assert sum(bool(row["caught_by"]) for row in planted_rows) >= 29
    assert sum(bool(row["caught_by"]) for row in others) >= 0.9 * len(others)


@pytest.mark.slow
def test_a_few_planted_bugs_are_caught(tmp_path):
    target = tmp_path / "mutants.json"
    call = [sys.executable, "tests/measure_mutants.py", str(target), "--jobs", "1", "--compiled"]
    call += ["--pure", "contact", "loads", "--only", *SAMPLE]
    done = subprocess.run(call, cwd=mutation.ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    caught = [row["caught_by"] for row in json.loads(target.read_text())["mutants"]]
    assert [test.partition("::")[0] for test in caught] == [
        "test_contact.py", "test_loads.py", "test_contact.py"
    ]  # fmt: skip
