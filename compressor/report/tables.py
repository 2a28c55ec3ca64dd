"""The tables of a report: rows of cells, and numbers in them as text."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from compressor.digits import by_bar
from compressor.metrics import METRICS
from compressor.outcome import Regime
from compressor.report.figures.sweep_metric import Measure


@dataclass(frozen=True)
class Cell:
    """A cell: numbers stand to the right, words to the left, code in its own letters.

    `value`: by what a column is sorted, where that is not the text.
    """

    text: str
    kind: Literal["word", "number", "code"] = "word"
    value: float | None = None


@dataclass(frozen=True)
class Row:
    """A row's cells; `mark`: the job failed, is missing, or is chaotic; `key`: of the job."""

    cells: Sequence[Cell]
    mark: Literal["", "failed", "missing", "chaotic"] = ""
    key: str = ""


@dataclass(frozen=True)
class Table:
    """A table; `head` has a title for each column."""

    head: Sequence[str]
    rows: Sequence[Row]


def number(value: float) -> str:
    """Return a measured number to four significant digits; a dash for nan."""
    size = abs(value)
    if math.isnan(value):
        return "–"
    if size < 1e7 and size == int(size):
        return f"{value:.0f}"
    if not 1e-3 <= size < 1e7:
        return f"{value:.2e}"
    return f"{value:.{max(0, 3 - math.floor(math.log10(size)))}f}"


def number_cell(value: float) -> Cell:
    """Return one measured number."""
    return Cell(number(value), "number", None if math.isnan(value) else value)


def measured(measure: Measure, value: float, bar: float) -> str:
    """Return a metric and its error bar, both in its unit, to the digits that the bar allows."""
    if math.isnan(bar):
        return number(value)
    return by_bar(value, bar, METRICS[measure.variable].bar.relative)


def measured_cell(measure: Measure, value: float, bar: float) -> Cell:
    """Return a metric and its error bar."""
    return Cell(measured(measure, value, bar), "number", None if math.isnan(value) else value)


def value_cell(value: Any) -> Cell:
    """Return a setting of a job: a number as the case file may give it, or a word."""
    if isinstance(value, int | float | np.number):
        return Cell(f"{value:.10g}", "number")
    return Cell(str(value))


def job_row(cells: Sequence[Cell], status: str, regime: str = "", key: str = "") -> Row:
    """Return a job's row, marked where the job failed, is missing, or is chaotic."""
    if status == "failed":
        return Row(cells, "failed", key)
    if status == "missing":
        return Row(cells, "missing", key)
    return Row(cells, "chaotic" if regime == Regime.CHAOTIC else "", key)


def ending(status: object, reason: object, regime: object = "") -> str:
    """Return how a job ended, in words, and how its motion goes, if it is known."""
    said = reason or regime
    return f"{status}: {said}" if said else str(status)


def column_title(measure: Measure) -> str:
    """Return what stands above a measure's column."""
    return measure.title + (f" ({measure.unit})" if measure.unit else "")
