"""Numbers and tables as people read them: with the digits that error bars allow.

Without libraries: results are read without any.
"""

import math
from collections.abc import Iterable, Sequence

UNKNOWN = "unknown"  # a number whose error bar is as long as itself
DIGITS_WITHOUT_BAR, MAX_DIGITS = 6, 12  # digits without an error bar, and with one
PAGE_DIGITS = 4  # of a number on a page
ROUNDING = 1e-10  # of the greatest number of a kind: below it a number is told as 0
MIN_DECIMAL, MAX_DECIMAL = 1e-3, 1e7  # sizes of numbers written without a power of ten


def is_known(value: float, bar: float, relative: bool = True) -> bool:
    """Return whether a number is larger than its error bar; False without a bar (nan).

    A share or a count (not relative) is known by any bar below inf, also beside 0.
    """
    if math.isnan(value) or math.isnan(bar) or math.isinf(bar):
        return False
    return not relative or bar < abs(value) or bar == 0.0


def by_bar(
    value: float, bar: float, relative: bool = True, bare: bool = False, digits: int = MAX_DIGITS
) -> str:
    """Return a number with its error bar, such as 647.1 ± 0.3, to the digits that the bar allows.

    bar: nan where none was made; the number then has six digits. bare: at most six of these digits,
    without the bar. digits: that a number has at most.
    """
    if math.isnan(value):
        return "–"
    if math.isnan(bar):
        return f"{value:.{DIGITS_WITHOUT_BAR}g}"
    if not is_known(value, bar, relative):
        return UNKNOWN
    if bar == 0.0:
        return f"{value:.{DIGITS_WITHOUT_BAR}g}"
    if not relative and bar >= abs(value):
        return f"≤ {_rounded_up(abs(value) + bar)[0]:g}"
    error, place = _rounded_up(bar)
    top = math.floor(math.log10(abs(value))) if value else place
    place = max(place, top - (min(digits, DIGITS_WITHOUT_BAR) if bare else digits) + 1)
    error = max(1, math.ceil(round(error / 10.0**place, 9))) * 10.0**place  # never shorter
    pair: tuple[float, ...] = (value,) if bare else (value, error)
    if MIN_DECIMAL <= abs(value) < MAX_DECIMAL or value == 0.0:
        return " ± ".join(f"{round(number, -place):.{max(0, -place)}f}" for number in pair)
    text = " ± ".join(f"{number / 10.0**top:.{max(0, top - place)}f}" for number in pair)
    return f"{text if bare else f'({text})'}e{top:+03d}"


def plural(count: int, thing: str = "job") -> str:
    """Return a number of things in words: 1 job, 2 jobs."""
    return f"{count} {thing}" + ("s" if count != 1 else "")


def align_columns(rows: Iterable[Sequence[str]], sides: str = "") -> list[str]:
    """Return rows of text as lines in columns; sides: `<` or `>` of each, `<` by default.

    >>> align_columns([("job", "ms"), ("3fa9", "7")], "<>")
    ['job   ms', '3fa9   7']
    """
    rows = [*rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    sides = sides.ljust(len(widths), "<")
    lines = (zip(row, sides, widths, strict=True) for row in rows)
    return [
        "  ".join(f"{text:{side}{width}}" for text, side, width in line).rstrip() for line in lines
    ]


def setting(value: float) -> str:
    """Return a number that was given, in six digits; whole ones whole.

    With fewer, points of a search would look equal.

    >>> setting(0.2), setting(740.05), setting(1234567), setting(0.123456789)
    ('0.2', '740.05', '1234567', '0.123457')
    """
    is_whole = abs(value) < 1e10 and value == int(value)
    return f"{value:.10g}" if is_whole else f"{value:.{DIGITS_WITHOUT_BAR}g}"


def _rounded_up(bar: float) -> tuple[float, int]:
    """Return a bar rounded up to one digit (two after a leading 1), and its last digit's power."""
    place = math.floor(math.log10(bar))
    if bar / 10.0**place < 2.0:
        place -= 1
    count = math.ceil(round(bar / 10.0**place, 9))
    if count in (10, 20, 100):
        place += 1
        count = 1 if count == 10 else count // 10
    return count * 10.0**place, place
