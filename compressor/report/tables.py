"""The tables of a report: rows of cells, and numbers in them as text."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from compressor.analysis import SPOKEN
from compressor.digits import by_bar
from compressor.metrics import METRICS
from compressor.outcome import Regime
from compressor.report.figures.sweep_metric import Measure


@dataclass(frozen=True)
class Cell:
    """A cell: numbers stand to the right, words to the left, code in its own letters."""

    text: str
    kind: Literal["word", "number", "code"] = "word"


@dataclass(frozen=True)
class Row:
    """A row's cells; `mark` shows that a job failed, is missing, or is chaotic."""

    cells: Sequence[Cell]
    mark: Literal["", "failed", "missing", "chaotic"] = ""


@dataclass(frozen=True)
class Table:
    """A table; `head` has a title for each column."""

    head: Sequence[str]
    rows: Sequence[Row]


def number(value: float) -> str:
    """A measured number to four significant digits; a dash for nan."""
    size = abs(value)
    if math.isnan(value):
        return "–"
    if size < 1e7 and size == int(size):
        return f"{value:.0f}"
    if not 1e-3 <= size < 1e7:
        return f"{value:.2e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(size)))}f}"


def number_cell(*values: float) -> Cell:
    """One measured number, or one for each joint."""
    return Cell(" | ".join(map(number, values)), "number")


def measured_cell(measures: Sequence[Measure], values: Iterable[tuple[float, float]]) -> Cell:
    """A metric, or one of each joint, and its error bar in one cell, to the digits that it allows.

    values: of each measure, the number and its bar, in its unit.
    """
    texts = [
        by_bar(value, bar, METRICS[measure.variable].bar.relative, bare=True)
        if not math.isnan(bar)
        else number(value)
        for measure, (value, bar) in zip(measures, values, strict=True)
    ]
    return Cell(" | ".join(texts), "number")


def value_cell(value: Any) -> Cell:
    """A setting of a job: a number as the case file may give it, or a word."""
    if isinstance(value, int | float | np.number):
        return Cell(f"{value:.10g}", "number")
    return Cell(str(value))


def job_row(cells: Sequence[Cell], status: str, regime: str = "") -> Row:
    """A job's row, marked where the job failed, is missing, or is chaotic."""
    if status == "failed":
        return Row(cells, "failed")
    if status == "missing":
        return Row(cells, "missing")
    return Row(cells, "chaotic" if regime == Regime.CHAOTIC else "")


def ending(status: object, reason: object, regime: object = "") -> str:
    """How a job ended, in words, and how its motion goes, if it is known."""
    said = reason or regime
    return f"{status}: {said}" if said else str(status)


def metric_columns(shown: Iterable[Measure]) -> dict[str, list[Measure]]:
    """Measures by what stands above their column; both joints share one."""
    found = {}
    for _, same in itertools.groupby(shown, lambda measure: measure.variable):
        group = list(same)
        other = f" | {SPOKEN[group[1].joint]}" if len(group) > 1 else ""
        unit = f" ({group[0].unit})" if group[0].unit else ""
        found[group[0].title + other + unit] = group
    return found
