"""How far variants of a case move its metrics: as a table, as text, and on the page of a report.

The numbers are those of `run_variants`. A change is what lies beyond the error bars of both runs.
"""

import math
import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import xarray as xr

from compressor.cases import Study, points
from compressor.digits import PAGE_DIGITS, align_columns, by_bar, is_known
from compressor.metrics import BARRED
from compressor.outcome import Regime
from compressor.report import Addition, Cell, Measure, PageTable, TableRow, format_measure, measures
from compressor.store import Folder, StoredStudy, StoreError, StoreWarning, read_dataset

NONE_SEEN = "none seen"  # less than both error bars
NO_VALUE = "–"
MIN_SHOWN_CHANGE = 1e-5  # relative: a smaller change is not written out
MOST_SHOWN = 8  # of what moves a metric, on the screen
KEY_DIGITS = 8  # of a job's key in a file's name
KEY_IN_NAME = re.compile(rf"(-[0-9a-f]{{{KEY_DIGITS}}})")


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

    `values`, `bars`: of the case itself, in the measures' units; `spans`: (least, greatest) change
    of each measure, 0 among them; `unknown`: titles of measures that the case has no number of.
    """

    measures: tuple[Measure, ...]
    values: tuple[float, ...]
    bars: tuple[float, ...]
    rows: tuple[ModelRow, ...]
    spans: tuple[tuple[float, float], ...]
    unknown: tuple[str, ...]

    @property
    def span_texts(self) -> tuple[str, ...]:
        """Return the spans in words, `-66 to +93 %`."""
        return tuple(span_text(m, *span) for m, span in zip(self.measures, self.spans, strict=True))

    @property
    def main(self) -> int | None:
        """Return the number of the peak that moves most, of a force or the piston.

        Of a case without known peaks, as a chaotic one, of another measure with a relative error;
        None where there is none.
        """
        places = [n for n, m in enumerate(self.measures) if m.is_relative]
        peaks = [n for n in places if self.measures[n].variable.startswith("peak")]
        return max(peaks or places, key=lambda n: self.spans[n][1] - self.spans[n][0], default=None)

    def most(self, n: int) -> list[ModelRow]:
        """Return the rows that are seen to move a measure, what moves it most first."""
        rows = [row for row in self.rows if abs(row.changes[n]) > 0.0]  # which nan is not
        return sorted(rows, key=lambda row: -abs(row.changes[n]))


def model_table(data: xr.Dataset) -> ModelTable:
    """Return the changes of a table of choices, dim `choice`, the case itself first.

    Counts, which depend on how long a run is, are left out.
    """
    first = data.isel(choice=0)
    shown = [m for m in measures(first) if BARRED[m.variable].kind != "count"]
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
    sizes = [[0.0, *(row.changes[n] for row in rows)] for n in range(len(known))]
    return ModelTable(
        tuple(known), tuple(float(v[0]) for _, v, _ in columns),
        tuple(float(b[0]) for _, _, b in columns), tuple(rows),
        tuple((float(np.nanmin(each)), float(np.nanmax(each))) for each in sizes),
        tuple(m.title for m in shown if m not in known),
    )  # fmt: skip


def has_number(measure: Measure, value: float, bar: float) -> bool:
    """Return whether a case knows a measure so well that others can be compared with it."""
    known = is_known(value, bar, measure.is_relative)
    return known and (value > 0.0 or not measure.is_relative)


def change(
    measure: Measure, values: np.ndarray, bars: np.ndarray, choice: xr.Dataset
) -> tuple[str, float]:
    """Return the change of a measure by a choice, in words and as a number, nan where unknown.

    values, bars: of the case itself, and of the choice.
    """
    status, relative = str(choice["status"].item()), measure.is_relative
    if status != "ok" or math.isnan(values[1]):
        return ("failed" if status == "failed" else NO_VALUE), math.nan
    if not is_known(values[1], bars[1], relative):
        chaotic = str(choice["regime"].item()) == Regime.CHAOTIC
        return ("chaotic" if chaotic else "unknown"), math.nan
    if relative and values[1] <= 0.0:  # a penetration
        return "no contact", math.nan
    difference = values[1] - values[0]
    if abs(difference) <= bars.sum():
        return NONE_SEEN, 0.0
    size = float(difference / values[0] if relative else difference)
    return change_text(measure, size), size


def change_text(measure: Measure, size: float) -> str:
    """Return a change in percent; of a share +3.1 points, of a count a revolution +3.1."""
    if measure.is_relative:
        return percent(size, "+")
    return f"{size:+z.2g} points" if measure.unit == "%" else f"{size:+z.2g}"


def percent(size: float, sign: str = "") -> str:
    """Return a relative size in percent, to two digits or whole."""
    if abs(size) < MIN_SHOWN_CHANGE:
        return f"below {100 * MIN_SHOWN_CHANGE:g} %"
    return f"{100 * size:{sign}z{'.0f' if abs(size) >= 0.995 else '.2g'}} %"


def span_text(measure: Measure, low: float, high: float) -> str:
    """Return the span of a measure over the choices, as `-66 to +93 %`."""
    if low == high == 0.0:
        return NONE_SEEN
    texts = [
        change_text(measure, size).partition(" ")[0] if abs(size) >= MIN_SHOWN_CHANGE else "0"
        for size in (low, high)
    ]
    unit = "%" if measure.is_relative else "points" if measure.unit == "%" else ""
    return f"{' to '.join(texts)} {unit}".rstrip()


def headline(table: ModelTable) -> str:
    """Return the peak that moves most, its numerical error, how far it moves, and by what most.

    And the number of runs, and of those without a number of it, in one line.
    """
    n = table.main
    if n is None:
        return "metrics that are known: 0"
    measure, value, bar = table.measures[n], table.values[n], table.bars[n]
    text = by_bar(value, bar, measure.is_relative, bare=True, digits=PAGE_DIGITS)
    found = {
        measure.title: f"{text} {measure.unit}".rstrip(),
        "numerical error": percent(bar / value),
        "moved by": table.span_texts[n],
        "most by": next((row.name for row in table.most(n)), NO_VALUE),
        "runs": len(table.rows),
        "without a number": sum(math.isnan(row.changes[n]) for row in table.rows),
    }
    return "; ".join(f"{name}: {text}" for name, text in found.items())


def place_text(study: Study | StoredStudy, key: str) -> str:
    """Return the place in its study of the job that the choices are of, in words."""
    at = next(islice(points(study), study.keys.index(key), None))
    point = ", ".join(f"{name} = {value}" for name, value in at.items())
    which = "the only job" if study.jobs == 1 else f"one of {study.jobs} jobs"
    return f"{study.name}{f' at {point}' if point else ''}, {which}"


def list_changes(place: str, table: ModelTable) -> Iterator[str]:
    """Yield for each metric what moves it most, what has no number, and what runs assume.

    place: which job it is of.
    """
    yield f"{place}: {headline(table)}"
    rows, still = [], []
    for n, (m, value, bar) in enumerate(zip(table.measures, table.values, table.bars, strict=True)):
        most = table.most(n)
        number = f"{by_bar(value, bar, m.is_relative, bare=True)} {m.unit}".rstrip()
        rows += [(m.title, number)] if most else []
        rows += [(f"  {row.name}", row.cells[n]) for row in most[:MOST_SHOWN]]
        still += [] if most else [m.title]
    yield from align_columns(rows, "<>")
    yield f"nothing is seen to move: {'; '.join(still) or NO_VALUE}"
    yield f"not known of the case itself: {'; '.join(table.unknown) or NO_VALUE}"
    notes = {row.varied or row.name: row.note for row in table.rows if row.note}
    yield from align_columns([("assumed, or why there is no number:", ""), *notes.items()])


# ---- on the page --------------------------------------------------------------------------------


LEGEND = """\
The table is of {}: its metrics, with error bars where four digits show them, and below how much \
each changes where one thing is otherwise: a number that the case file does not give, or that a \
plant can only guess, at an end of its plausible range, or another model. What moves the first \
line’s number most comes first. “None seen”: no more than both error bars. “Points”: percentage \
points of a share. “No contact”: the journal touches no bore. “Chaotic”: such a motion has no \
peak to compare. The last column says why a number is in doubt, and what another model assumes \
that the file does not give."""
UNKNOWN = "No change is given of what is not known, or not above 0, of the case itself: {}."


def models_file(folder: Folder, study: str, key: str) -> Path:
    """Return the path at which the choices of the model of a study's job are stored."""
    return Path(folder) / "models" / f"{study}-{key[:KEY_DIGITS]}.nc"


def read_models(folder: Folder, study: StoredStudy) -> list[xr.Dataset]:
    """Read what `compsim explain --models` stored of jobs of a study.

    Numbers of a job that the study has not, or that are damaged, are left out with a warning.
    """
    again = f"compsim explain --models {study.case_file} -r {folder} makes it again"
    found = []
    for path in sorted(Path(folder, "models").glob(f"{study.name}-*.nc")):
        if not KEY_IN_NAME.fullmatch(path.stem.removeprefix(study.name)):
            continue
        try:
            data = read_dataset(path, again)
            if data.attrs.get("key") in study.keys:
                found.append(data)
                continue
            problem = f"{path}: is not shown, as {study.name} has no such job: run the case file "
            problem += "with the same --set, or delete it"
        except StoreError as error:
            problem = str(error)
        warnings.warn(problem, StoreWarning, stacklevel=2)
    return found


def add(results: Folder, studies: Sequence[StoredStudy]) -> Iterator[Addition]:
    """Yield a section on each job of which something was varied, with one line on its study."""
    for study in studies:
        for number, data in enumerate(read_models(results, study)):
            table, place = model_table(data), place_text(study, data.attrs["key"])
            texts = [f"{headline(table)}.", LEGEND.format(place)]
            texts += [UNKNOWN.format(", ".join(table.unknown))] if table.unknown else []
            line = "" if number else f"What moves its numbers: {headline(table)}"
            anchor = f"models-{study.name}" + (f"-{number + 1}" if number else "")
            title = f"What moves the numbers of study {place.rpartition(', ')[0]}"
            link, shown = "Table of what was varied", page_table(table)
            yield Addition(study.name, line, link, anchor, title, shown, texts)


def page_table(table: ModelTable) -> PageTable:
    """Return the cells of a table: the case itself, each choice, and the span.

    What moves the main measure most comes first.
    """
    numbers = zip(table.measures, table.values, table.bars, strict=True)
    values = [f"{format_measure(m, value, bar)} {m.unit}".rstrip() for m, value, bar in numbers]
    first = [] if table.main is None else table.most(table.main)
    rows = [
        [Cell("the case itself"), *map(number_cell, values), Cell("")],
        *([Cell(row.name), *map(number_cell, row.cells, row.changes), Cell(row.note)]
          for row in (*first, *(row for row in table.rows if row not in first))),
        [Cell("all of them"), *map(number_cell, table.span_texts), Cell("")],
    ]  # fmt: skip
    head = ["what is otherwise", *(m.title for m in table.measures), "assumed"]
    return PageTable(head, [*map(TableRow, rows)])


def number_cell(text: str, value: float = math.nan) -> Cell:
    """Return a cell that is sorted by its number."""
    return Cell(text, "number", None if math.isnan(value) else value)
