"""The bugs that `make mutants` plants: that they can be planted, and that one is caught."""

import ast
import contextlib
import signal

import mutation
import planted_bugs
import pytest
from measure_mutants import CannotBeLoaded, first_failure
from mutation import EQUIVALENT, Mutant, drawn, mutants_of
from page_tables import kept


def test_thirty_bugs_can_be_planted():
    """Their texts still stand in the sources; says which does not."""
    bugs = planted_bugs.bugs()
    assert len({bug.identity for bug in bugs}) == 30
    for bug in bugs:
        ast.parse(bug.source())


@pytest.fixture(scope="module")
def sixty():
    return drawn(60)


def test_sixty_mutants_are_drawn_of_all_kinds(sixty):
    assert len({mutant.identity for mutant in sixty}) == 60
    for kind in mutation.KINDS:
        assert sum(mutant.kind == kind for mutant in sixty) == 10
    for mutant in sixty:
        assert ast.dump(ast.parse(mutant.source())) != ast.dump(ast.parse(original(mutant)))


def original(mutant: Mutant):
    return (mutation.ROOT / mutant.file).read_bytes()


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


def test_equivalent_mutants_are_drawn_ones(sixty):
    """An entry that is not drawn any more is to be removed."""
    assert set(EQUIVALENT) <= {mutant.identity for mutant in sixty}


def test_what_was_measured_reaches_the_aims():
    rows = kept("mutants.json")["mutants"]
    planted_rows = [row for row in rows if row["kind"] == "planted"]
    others = [row for row in rows if row["kind"] != "planted" and "equivalent" not in row]
    assert len(planted_rows) == 30
    assert len(rows) == 90
    assert not any("cannot_be_loaded" in row for row in rows)
    assert not any(row["caught_by"] for row in rows if "equivalent" in row)
    assert all("::" in row["caught_by"] for row in rows if row["caught_by"])
    assert sum(bool(row["caught_by"]) for row in planted_rows) >= 29
    assert sum(bool(row["caught_by"]) for row in others) >= 0.9 * len(others)


TINY = {
    "passes": "def test_one(): pass",
    "fails": "def test_one(): pass\ndef test_two(): assert 1 == 2\ndef test_three(): assert 0",
    "dies": "import os\ndef test_one(): pass\ndef test_two(): os.abort()",
    "never_ends": "import resource\ndef test_one():\n"
                  "    resource.setrlimit(resource.RLIMIT_CPU, (1, 2))\n    while True: pass",
    "cannot_be_imported": "1 / 0\ndef test_one(): pass",
}  # fmt: skip


def test_a_bug_is_caught_only_where_a_test_ran_and_failed(tmp_path):
    (tmp_path / "tests").mkdir()
    (tmp_path / "pyproject.toml").write_text(
        "[tool.pytest.ini_options]\nmarkers=['slow','compiled']"
    )
    found = {}
    for name, text in TINY.items():
        (tmp_path / "tests" / f"test_{name}.py").write_text(text)
        with contextlib.suppress(CannotBeLoaded):
            found[name] = first_failure(tmp_path, [f"tests/test_{name}.py"], False, "cache")
    assert found == {
        "passes": "",
        "fails": "test_fails.py::test_two",
        "dies": "test_dies.py::test_two: ended by signal 6",
        "never_ends": f"test_never_ends.py::test_one: ended by signal {signal.SIGXCPU}",
    }
