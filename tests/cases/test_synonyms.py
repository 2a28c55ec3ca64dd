"""Words of the trade: doubles of our keys are read, other units are answered with the number."""

import pytest

from compressor.cases.case import Case
from compressor.cases.checks import DOUBLES
from compressor.cases.load import CaseFileError
from compressor.cases.study import Axis


@pytest.mark.parametrize("word", DOUBLES)
def test_a_word_of_the_trade_is_twice_a_key(word):
    group, _, name = word.partition(".")
    own = DOUBLES[word].partition(".")[2]
    more = {"load": "gas"} if group == "gas" else {}
    one = Case.from_values(more | {group: {name: 250}})
    assert one == Case.from_values(more | {group: {own: 125}})
    assert getattr(getattr(one, group), own) == 125.0
    assert own in one.values()[group]
    assert name not in one.values()[group]


@pytest.mark.parametrize(
    ("swept", "radii"),
    [
        ("180", None),
        ("[160, 200]", (80.0, 100.0)),
        ("{linspace: [160, 200, 3]}", (80.0, 90.0, 100.0)),
        ("{range: [160, 200, 20]}", (80.0, 90.0, 100.0)),
        ("{logspace: [100, 200, 2]}", (50.0, 100.0)),
    ],
)
def test_a_stroke_is_swept_as_a_radius(read, swept, radii):
    study = read(f"machine: {{stroke_mm: {swept}}}\nload: none")
    assert study.axes == ((Axis("machine.crank_radius_mm", radii),) if radii else ())
    overridden = read("load: none\nmachine: {crank_radius_mm: 3}", f"machine.stroke_mm={swept}")
    assert overridden.keys == study.keys


def test_draws_lie_between_halves(read):
    study = read("load: none\nmachine: {stroke_mm: {lhs: [160, 200]}}\nsample: {n: 4}")
    assert all(80 <= case.machine.crank_radius_mm <= 100 for case in study.cases)


def test_a_block_and_the_command_line_replace_either_word(read):
    study = read(
        "load: none\nmachine: {crank_radius_mm: 90}\nblocks: [{machine: {stroke_mm: 200}}]"
    )
    assert study.cases[0].machine.crank_radius_mm == 100
    study = read("load: none\nmachine: {stroke_mm: 200}", "machine.crank_radius_mm=80")
    assert study.cases[0].machine.crank_radius_mm == 80


def test_two_sweeps_of_one_quantity_are_refused(read):
    """The first of them vanished."""
    with pytest.raises(CaseFileError, match="stroke_mm is given, too: give one of the two"):
        read("load: none\nmachine: {stroke_mm: [200, 240, 300], crank_radius_mm: [100, 110]}")
