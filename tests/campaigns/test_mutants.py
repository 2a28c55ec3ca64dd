"""The bugs that `make mutants` plants: that they can be planted, and that one is caught."""

import ast

import mutation
import planted_bugs
import pytest
from mutation import EQUIVALENT, Mutant, drawn, mutants_of


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
