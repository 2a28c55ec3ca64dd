"""Comparisons select jobs: what they mean, against Python's own, and what is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from compressor.cases.swept import MAX_DEPTH, MAX_LENGTH, NoComparison, comparison
from compressor.cases.table import table

JOB = {
    "clearance_mm": 0.2,
    "machine.speed_rpm": 500.0,
    "load": "spring",
    "joint": "big_end",
    "gas.exponent": None,
    "solve.error_bars": True,
}
NUMBERS = ("clearance_mm", "machine.speed_rpm")
SIGNS = ("==", "!=", "<", "<=", ">", ">=")


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("clearance_mm == 0.2", True), ("clearance_mm>0.2", False), ("clearance_mm >= 2e-1", True),
        ("load == spring", True), ("load != spring", False), ("solve.error_bars == true", True),
        ("gas.exponent < 2", False), ("gas.exponent >= 2", False), ("gas.exponent != 2", True),
        ("not gas.exponent < 2", True), ("not not load == spring", True),
        ("load == none or clearance_mm < 1 and joint == both", False),
        ("(load == none or clearance_mm < 1) and joint == big_end", True),
        ("load == spring or load == none and load == gas", True),
        ("not load == none and joint == both", False),
        ("not (load == none and joint == both)", True),
        ("  machine.speed_rpm  >  +4.0E2  ", True), ("machine.speed_rpm == 0500", True),
        ("machine.speed_rpm == 0x1F4", True), ("clearance_mm > -.5", True),
        ("\n load\t==\n design\x1f", True), ("(load) == (design)", True),
        ("clearance_mm>0.1or load==none", True), ("solve.error_bars != False", True),
    ],
)  # fmt: skip
def test_a_comparison_holds_or_not(text, holds):
    assert comparison(text)(JOB.get) is holds


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "needs a key, such as clearance_mm (at the end)"),
        ("clearance_mm", "needs one of == != < <= > >= after clearance_mm (at the end)"),
        ("clearance_mm = 1", "write == for equal (at character 14, '= 1')"),
        ("clearance_mm > > 1", "needs a value after > (at character 16, '> 1')"),
        ("clearance_mm > 0.1 load == none",
         "needs `and` or `or` before this (at character 20, 'load == none')"),
        ("clearance_mm > big", "clearance_mm needs a number (at character 16, 'big')"),
        ("0.1 < clearance_mm", "needs a key, such as clearance_mm (at character 1, "
         "'0.1 < clearance_mm')"),
        ("(load == none", "needs a closing parenthesis (at the end)"),
        ("load == none)", "has no opening parenthesis for this (at character 13, ')')"),
        ("load < none", "load is a word: compare it by == or != (at character 6, '< none')"),
        ("load == sprnig", "load needs spring | gas | none (at character 9, 'sprnig')"),
        ("speed_rpm > 1", "unknown key 'speed_rpm'; did you mean machine.speed_rpm? "
         "(at character 1, 'speed_rpm > 1')"),
        ("contact.materials == steel", "contact.materials cannot be compared (at character 1, "
         "'contact.materials...')"),
        ("__import__('os')", "cannot be read (at character 12, \"'os')\")"),
        ("__import__(os)", "needs `and` or `or` before this (at character 11, '(os)')"),
        ("__import__ == 1", "unknown key '__import__' (at character 1, '__import__ == 1')"),
        ("load == 'none'", "cannot be read (at character 9, \"'none'\")"),
        ("load == none and", "needs a key, such as clearance_mm (at the end)"),
        ("load none", "needs one of == != < <= > >= after load (at character 6, 'none')"),
        ("clearance_mm > -", "needs a value after - (at the end)"),
        ("clearance_mm > 1 + 1", "clearance_mm needs a number (at character 16, '1 + 1')"),
        ("clearance_mm > true", "clearance_mm needs a number (at character 16, 'true')"),
        ("clearance_mm > 1_0", "clearance_mm needs a number (at character 16, '1_0')"),
        ("clearance_mm + 1 > 2",
         "needs one of == != < <= > >= after clearance_mm (at character 14, '+ 1 > 2')"),
        ("clearance_mm is 1",
         "needs one of == != < <= > >= after clearance_mm (at character 14, 'is 1')"),
        ("clearance_mm > 0.1 < 0.5", "needs `and` or `or` before this (at character 20, '< 0.5')"),
        ("clearance_mm > 10mm", "cannot be read: write numbers without their unit (at character "
         "17, '0mm')"),
        ("(load == none joint == both)",
         "needs `and` or `or` before this (at character 15, 'joint == both)')"),
        ("(load == none) (joint == both)",
         "needs `and` or `or` before this (at character 16, '(joint == both)')"),
        ("load == none # both", "cannot be read (at character 14, '# both')"),
        ("ｌoad == none", "cannot be read (at character 1, 'ｌoad == none')"),
        ("load == none if load == none else load == none",
         "needs a key, such as clearance_mm (at character 1, 'load == none if l...')"),
        ("(load == none) == true",
         "needs a key, such as clearance_mm (at character 2, 'load == none) == ...')"),
        ("\n load\n = none", "write == for equal (at character 9, '= none')"),
        ("(" * 51 + "load == none", "is nested deeper than 50 levels (at character 51, "
         "'(load == none')"),
        ("not " * 240 + "load == none", "is nested deeper than 50 levels (at character 205, "
         "'not not not not n...')"),
        ("not " * (MAX_DEPTH + 1) + "load == none",
         "is nested deeper than 50 levels (at character 205, 'load == none')"),
        (" " * (MAX_LENGTH + 1), "is longer than 1000 characters"),
    ],
)  # fmt: skip
def test_what_is_no_comparison_is_told(text, message):
    with pytest.raises(NoComparison) as error:
        comparison(text)
    assert str(error.value) == message


@pytest.mark.parametrize("key", [key for key, row in table().items() if row.choices])
def test_every_word_of_the_table_can_be_compared(key):
    if table()[key].kind == "materials":
        return
    for word in table()[key].choices:
        assert comparison(f"{key} == {word}")({key: word}.get)
        assert not comparison(f"{key} != {word}")({key: word}.get)


@pytest.mark.parametrize("text", ["-" * 990 + "1", "clearance_mm > " + "-" * 980 + "1",
                                  "a." * 499 + "b", "- " * 499 + "1", "1" * 1000])  # fmt: skip
def test_a_hostile_text_is_refused(text):
    with pytest.raises(NoComparison):
        comparison(text)


compared = st.builds(
    "{} {} {}".format, st.sampled_from(NUMBERS), st.sampled_from(SIGNS),
    st.sampled_from([0.1, 0.2, 500, -3e5]),
) | st.builds(
    "{} {} {}".format, st.just("load"), st.sampled_from(["==", "!="]),
    st.sampled_from(table()["load"].choices),
)  # fmt: skip
expressions = st.recursive(
    compared,
    lambda inner: (
        st.builds("{} and {}".format, inner, inner)
        | st.builds("{} or {}".format, inner, inner)
        | st.builds("not {}".format, inner)
        | st.builds("({})".format, inner)
    ),
    max_leaves=12,
)
WORDS = [
    *NUMBERS, "load", "joint", "none", "both", "and", "or", "not", "(", ")", "1e5", "-1", "9",
    "+", "-", ".", "is", "if", "lambda", "0x", "07",
]  # fmt: skip


@given(expressions)
def test_comparisons_mean_what_they_mean_in_python(text):
    names = {"clearance_mm": 0.2, "speed": 500.0, "load": "spring"}
    names |= {word: word for word in table()["load"].choices}
    meant = eval(text.replace("machine.speed_rpm", "speed"), {"__builtins__": {}}, names)
    assert comparison(text)(JOB.get) is meant


@given(st.text() | st.lists(st.sampled_from([*WORDS, *SIGNS, "=", "'"])).map(" ".join))
def test_any_text_is_a_comparison_or_refused(text):
    try:
        test = comparison(text)
    except NoComparison as error:
        message = str(error)
    else:
        message = str(test(JOB.get))
    assert message.isprintable()
