"""Numbers to the digits that their error bars allow."""

import math

import pytest

from compressor.digits import align_columns, by_bar

INF, NAN = math.inf, math.nan


@pytest.mark.parametrize(
    ("value", "bar", "text"),
    [
        (647.0912, 0.2831, "647.1 ± 0.3"),
        (647.0912, 0.12, "647.09 ± 0.12"),
        (-3.2, 0.04, "-3.20 ± 0.04"),
        (99.97, 0.95, "100 ± 1"),
        (1234.5, 19.3, "1230 ± 20"),
        (5102.3, 206.6, "5100 ± 300"),
        (1.23456e-5, 3e-8, "(1.235 ± 0.003)e-05"),
        (82345678.9, 12340.0, "(8.2346 ± 0.0013)e+07"),
        (12.0, 0.0, "12"),
        (0.0, 0.0, "0"),
        (647.09123, NAN, "647.091"),
        (NAN, 1.0, "–"),
        (0.5, 0.6, "unknown"),
        (-0.5, 0.5, "unknown"),
        (0.0, 1e-9, "unknown"),
        (647.1, INF, "unknown"),
    ],
)
def test_a_number_has_the_digits_that_its_bar_allows(value, bar, text):
    assert by_bar(value, bar) == text
    bare = by_bar(value, bar, bare=True)
    assert bare == text.partition(" ±")[0].replace("(", "") + text.partition(")")[2]


@pytest.mark.parametrize(
    ("value", "bar", "text"),
    [
        (0.0, 0.0, "0"),
        (0.0, 1e-5, "≤ 1e-05"),
        (0.0001, 0.0002, "≤ 0.0003"),
        (0.32, 0.01, "0.32 ± 0.01"),
        (14.0, 2.0, "14 ± 2"),
        (0.32, INF, "unknown"),
    ],
)
def test_a_share_or_a_count_is_bounded_where_it_may_be_nothing(value, bar, text):
    assert by_bar(value, bar, relative=False) == text


@pytest.mark.parametrize("first", [0.0123, 0.0199, 0.02, 0.0999, 0.3, 0.949, 0.951])
def test_the_bar_that_is_shown_is_never_shorter(first):
    for exponent in range(-12, 12):
        value, bar = 3.14159265358979 * 10.0**exponent, first * 10.0**exponent
        text = by_bar(value, bar)
        scale = float("1e" + text.partition(")e")[2]) if ")e" in text else 1.0
        numbers = text.strip("(").partition(")")[0].split(" ± ")
        shown, error = (float(part) * scale for part in numbers)
        assert bar * (1 - 1e-9) <= error <= 1.5 * bar * (1 + 1e-9), text
        assert abs(shown - value) <= 0.51 * error, text


def test_no_more_digits_are_shown_than_double_precision_vouches_for():
    assert by_bar(math.pi, 1e-30) == "3.14159265359 ± 0.00000000001"
    assert by_bar(math.pi, 1e-9, bare=True) == "3.14159"
    assert by_bar(1234.5678, 1.3, digits=4) == "1235 ± 2"  # 1.3 is not shown as 1
    assert by_bar(82345678.9, 12340.0, digits=4) == "(8.235 ± 0.002)e+07"


def test_columns_are_as_wide_as_what_stands_in_them():
    rows = [("job", "ms", "end"), ("3fa9", "12.5", ""), ("b", "7", "late")]
    assert align_columns(rows, "<>") == ["job     ms  end", "3fa9  12.5", "b        7  late"]
    assert align_columns([]) == []
