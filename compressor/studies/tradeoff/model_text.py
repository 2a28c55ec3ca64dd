"""How far choices of the model move a case's metrics, as a table of text."""

import textwrap
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from compressor.digits import by_bar

if TYPE_CHECKING:
    from compressor.studies.tradeoff.page import ModelTable

WIDEST = 12  # columns of a word of a head
FIRST = "choice of the model"


def model_lines(place: str, table: "ModelTable", times: bool = False) -> Iterator[str]:
    """Yield a table of choices: a head, the case itself, each choice, the span, and a summary.

    place: which job it is of; times: with a column of wall times over the case's own, and no
    summary, since not only choices of the model are there.
    """
    from compressor.studies.tradeoff.page import headline

    yield f"{place}:"
    titles = [f"{m.title}" + (f" ({m.unit})" if m.unit else "") for m in table.measures]
    heads = [textwrap.wrap(title, WIDEST) for title in titles] + [["time"]] * times
    numbers = zip(table.measures, table.values, table.bars, strict=True)
    values = [by_bar(value, bar, m.is_relative, bare=True) for m, value, bar in numbers]
    rows = [["the case itself", *values, *["× 1"] * times]]
    for row in table.rows:
        time = [f"× {row.time_ratio:.2g}" if row.time_ratio == row.time_ratio else "–"] * times
        rows.append([row.name, *row.cells, *time])
    rows.append(["all of them", *table.span_texts, *[""] * times])
    depth = max(map(len, heads), default=1)
    stacked = [[""] * (depth - len(head)) + head for head in heads]
    above = [[FIRST * (n == depth - 1), *(head[n] for head in stacked)] for n in range(depth)]
    notes = [""] * (depth - 1) + ["assumed", "", *(row.note for row in table.rows), ""]
    yield from aligned([*above, *rows], notes)
    if table.unknown:
        yield f"  not known of the case itself: {', '.join(table.unknown)}"
    if not times:
        yield headline(table)


def aligned(rows: Sequence[Sequence[str]], notes: Sequence[str]) -> Iterator[str]:
    """Yield rows with their first cell to the left, the others to the right, a note behind."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for (first, *cells), note in zip(rows, notes, strict=True):
        told = (f"{cell:>{width}}" for cell, width in zip(cells, widths[1:], strict=True))
        yield "  ".join([f"  {first:<{widths[0]}}", *told, note]).rstrip()
