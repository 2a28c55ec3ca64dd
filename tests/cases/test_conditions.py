"""Comparisons select jobs: what they mean, and what is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from compressor.cases.comparison import MAX_LENGTH, NoComparison, comparison

JOB = {
    "clearance_mm": 0.2,
    "machine.speed_rpm": 500.0,
    "load": "spring",
    "joint": "big_end",
    "gas.exponent": None,
    "solve.error_bars": True,
}
NUMBERS = ("clearance_mm", "machine.speed_rpm")
SUCH_AS = "write such as clearance_mm > 0.2 and load == gas"
UNREADABLE = f"cannot be read: {SUCH_AS}; write numbers without their unit"
NEEDS = "needs a key, a sign and a value in place of {}: " + SUCH_AS
SIGNS = ("==", "!=", "<", "<=", ">", ">=")


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("clearance_mm == 0.2", True), ("clearance_mm>0.2", False), ("clearance_mm >= 2e-1", True),
        ("load == spring", True), ("load != spring", False), ("solve.error_bars == true", True),
        ("gas.exponent < 2", False), ("gas.exponent >= 2", False), ("gas.exponent != 2", True),
        ("not gas.exponent < 2", True), ("not not load == spring", True),
        ("  machine.speed_rpm  >  +4.0E2  ", True),
        ("machine.speed_rpm == 0x1F4", True), ("clearance_mm > -.5", True),
        ("\n load\t==\n design\x1f", True), ("(load) == (design)", True),
        ("clearance_mm>0.1or load==none", True), ("solve.error_bars != False", True),
        ("machine.speed_rpm <= 500", True), ("machine.speed_rpm < 500", False),
        ("machine.speed_rpm != 500", False), ("clearance_mm > -3e5", True),
        # not binds before and, and before or
        ("load == none and load == gas or clearance_mm < 1", True),
        ("clearance_mm < 1 or load == none and load == gas", True),
        ("(clearance_mm < 1 or load == none) and load == gas", False),
        ("not load == none and load == gas", False),
        ("not (load == none and load == gas)", True),
    ],
)  # fmt: skip
def test_a_comparison_holds_or_not(text, holds):
    assert comparison(text)(JOB.get) is holds


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("clearance_mm = 1", "write == for equal"),
        ("(load == none", UNREADABLE), ("load == none and", UNREADABLE),
        ("clearance_mm > 10mm", UNREADABLE), ("load == none # both", UNREADABLE),
        ("(" * 300 + "load == none" + ")" * 300, UNREADABLE),
        ("clearance_mm > big", "clearance_mm needs a number, not big"),
        ("load < none", "load is a word: compare it by == or !="),
        ("contact.materials == steel", "contact.materials cannot be compared"),
        ("__import__ == 1", "unknown key '__import__'"),
        ("clearance_mm > 0.1 < 0.5", NEEDS.format("'clearance_mm > 0.1 < 0.5'")),
        (" " * (MAX_LENGTH + 1), "is longer than 1000 characters"),
    ],
)  # fmt: skip
def test_what_is_no_comparison_is_told(text, message):
    """Beside what mistakes.json has of exclude."""
    with pytest.raises(NoComparison) as error:
        comparison(text)
    assert str(error.value) == message


WORDS = [
    *NUMBERS, "load", "none", "and", "or", "not", "(", ")", "-1", "9", "+", ".", "is", "lambda",
    "0x", "07",
]  # fmt: skip


@given(st.text() | st.lists(st.sampled_from([*WORDS, *SIGNS, "=", "'"])).map(" ".join))
def test_any_text_is_a_comparison_or_refused(text):
    try:
        test = comparison(text)
    except NoComparison as error:
        message = str(error)
    else:
        message = str(test(JOB.get))
    assert message.isprintable()
