"""The bugs that `make mutants` plants: that they can be planted."""

import ast

import planted_bugs
from mutation import EQUIVALENT, drawn


def test_thirty_bugs_can_be_planted():
    """Their texts still stand in the sources; says which does not."""
    bugs = planted_bugs.bugs()
    assert len({bug.identity for bug in bugs}) == 30
    for bug in bugs:
        ast.parse(bug.source())


def test_equivalent_mutants_are_drawn_ones():
    """An entry that is not drawn any more is to be removed."""
    assert set(EQUIVALENT) <= {mutant.identity for mutant in drawn(60)}
