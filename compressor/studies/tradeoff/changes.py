"""How far variants of a case move its metrics: as a table, and as text.

The numbers are those of `run_variants`. A change is what lies beyond the error bars of both runs.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor import digits, report
from compressor.metrics import BARRED
from compressor.outcome import Regime

NONE_SEEN = "none seen"  # less than both error bars
NO_VALUE = "–"
MIN_SHOWN_CHANGE = 1e-5  # relative: a smaller change is not written out
MOST_SHOWN = 8  # of what moves a metric


@dataclass(frozen=True)
class ModelRow:
    """A variant: its cell for each measure, how long it runs, and what it assumes.

    `changes`: relative, or in the unit of a share; nan where none is known. `time_ratio`: wall time
    over that of the case itself. `varied`: the number that is another one; "" of another model.
    """

    name: str
    cells: tuple[str, ...]
    changes: tuple[float, ...]
    time_ratio: float
    note: str
    varied: str = ""


@dataclass(frozen=True)
class ModelTable:
    """What variants change in each measure that the case itself has a number of.

    `values`, `bars`: of the case itself, in the measures' units; `unknown`: titles of measures that
    the case has no number of.
    """

    measures: tuple[report.Measure, ...]
    values: tuple[float, ...]
    bars: tuple[float, ...]
    rows: tuple[ModelRow, ...]
    unknown: tuple[str, ...]

    def rank_rows(self, n: int) -> list[ModelRow]:
        """Return the rows that are seen to move a measure, what moves it most first."""
        rows = [row for row in self.rows if abs(row.changes[n]) > 0.0]  # which nan is not
        return sorted(rows, key=lambda row: -abs(row.changes[n]))


def model_table(data: xr.Dataset) -> ModelTable:
    """Return the changes of a table of choices, dim `choice`, the case itself first.

    Counts, which depend on how long a run is, are left out.
    """
    first = data.isel(choice=0)
    shown = [m for m in report.measures(first) if BARRED[m.variable].kind != "count"]
    known = [m for m in shown if has_number(m, float(m.of(first)), float(m.bar(first)))]
    columns = [(m, m.of(data), m.bar(data)) for m in known]
    rows = []
    for n in range(1, data.sizes["choice"]):
        one = data.isel(choice=n)
        found = [change(m, values[[0, n]], bars[[0, n]], one) for m, values, bars in columns]
        name, varied, reason, note = (
            str(one[word].item()) for word in ("choice", "varied", "reason", "note")
        )
        texts = [f"failed: {reason}" if reason else "", note]
        rows.append(
            ModelRow(
                name, tuple(text for text, _ in found), tuple(size for _, size in found),
                float(one["seconds"]) / float(first["seconds"]), "; ".join(filter(None, texts)),
                varied,
            )
        )  # fmt: skip
    return ModelTable(
        tuple(known), tuple(float(v[0]) for _, v, _ in columns),
        tuple(float(b[0]) for _, _, b in columns), tuple(rows),
        tuple(m.title for m in shown if m not in known),
    )  # fmt: skip


def has_number(measure: report.Measure, value: float, bar: float) -> bool:
    """Return whether a case knows a measure so well that others can be compared with it."""
    known = digits.is_known(value, bar, measure.is_relative)
    return known and (value > 0.0 or not measure.is_relative)


def change(
    measure: report.Measure, values: np.ndarray, bars: np.ndarray, choice: xr.Dataset
) -> tuple[str, float]:
    """Return the change of a measure by a choice, in words and as a number, nan where unknown.

    values, bars: of the case itself, and of the choice.
    """
    status, relative = str(choice["status"].item()), measure.is_relative
    if status != "ok" or math.isnan(values[1]):
        return ("failed" if status == "failed" else NO_VALUE), math.nan
    if not digits.is_known(values[1], bars[1], relative):
        chaotic = str(choice["regime"].item()) == Regime.CHAOTIC
        return ("chaotic" if chaotic else "unknown"), math.nan
    if relative and values[1] <= 0.0:  # a penetration
        return "no contact", math.nan
    difference = values[1] - values[0]
    if abs(difference) <= bars.sum():
        return NONE_SEEN, 0.0
    size = float(difference / values[0] if relative else difference)
    return change_text(measure, size), size


def change_text(measure: report.Measure, size: float) -> str:
    """Return a change in percent; of a share +3.1 points, of an angle +3.1 °."""
    if measure.is_relative:
        return percent(size, "+")
    return f"{size:+z.2g} {'points' if measure.unit == '%' else measure.unit}".rstrip()


def percent(size: float, sign: str = "") -> str:
    """Return a relative size in percent, to two digits or whole."""
    if abs(size) < MIN_SHOWN_CHANGE:
        return f"below {100 * MIN_SHOWN_CHANGE:g} %"
    return f"{100 * size:{sign}z{'.0f' if abs(size) >= 0.995 else '.2g'}} %"


def list_changes(table: ModelTable) -> Iterator[str]:
    """Yield for each metric what moves it most, what has no number, and what runs assume."""
    rows, still = [], []
    for n, (m, value, bar) in enumerate(zip(table.measures, table.values, table.bars, strict=True)):
        most = table.rank_rows(n)
        number = f"{digits.by_bar(value, bar, m.is_relative, bare=True)} {m.unit}".rstrip()
        rows += [(m.title, number)] if most else []
        rows += [(f"  {row.name}", row.cells[n]) for row in most[:MOST_SHOWN]]
        still += [] if most else [m.title]
    yield from digits.align_columns(rows, "<>")
    yield f"nothing is seen to move: {'; '.join(still) or NO_VALUE}"
    yield f"not known of the case itself: {'; '.join(table.unknown) or NO_VALUE}"
    notes = {row.varied or row.name: row.note for row in table.rows if row.note}
    yield from digits.align_columns([("assumed, or why there is no number:", ""), *notes.items()])
