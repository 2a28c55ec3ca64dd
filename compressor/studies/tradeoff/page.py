"""How far numbers in doubt and other models move a case's metrics: table, line and section.

The numbers are those of `compsim explain --models`: metrics of the case itself and of each choice,
with error bars. A change is what lies beyond both bars.
"""

import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
import xarray as xr

from compressor.cases import Study, points
from compressor.digits import PAGE_DIGITS, by_bar, is_known
from compressor.metrics import BARRED
from compressor.outcome import Regime
from compressor.report import (
    Additions,
    Cell,
    Chapter,
    Measure,
    PageTable,
    Section,
    StudyNote,
    TableRow,
    file_name,
    format_measure,
    measures,
)
from compressor.store import Folder, StoredStudy, StoreError, StoreWarning, read_dataset

NONE_SEEN = "none seen"  # less than both error bars
NO_VALUE = "–"
NO_CHANGE = ("failed", "chaotic", "unknown", "no contact", NO_VALUE)  # cells without a number
MIN_SHOWN_CHANGE = 1e-5  # relative: a smaller change or error is not written out
MIN_ERROR = 1e-4
LEVELS = ("sensor_peak", "sensor_rms")
NOT_COVERED = (
    "Not in this: several of them at once, numbers that the file gives as known, and all that the "
    "equations leave out"
)
KEY_DIGITS = 8  # of a job's key in a file's name
KEY_IN_NAME = re.compile(rf"(-[0-9a-f]{{{KEY_DIGITS}}})?")


@dataclass(frozen=True)
class ModelRow:
    """A choice: its cell for each measure, how long it runs, and what it assumes.

    `changes`: relative, or in the unit of a share; nan where none is known. `time_ratio`: wall time
    over that of the case itself. `varied`: the number that is another one, with which the name
    begins; "" of another model.
    """

    name: str
    cells: tuple[str, ...]
    changes: tuple[float, ...]
    time_ratio: float
    note: str
    varied: str = ""


@dataclass(frozen=True)
class ModelTable:
    """What choices of the model change in each measure that the case itself has a number of.

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
        """Return the rows that are seen to move a measure, what moves it most first.

        Both ends of a number stand beside each other.
        """
        size: dict[str, float] = {}
        for row in self.rows:
            if abs(row.changes[n]) > 0.0:  # which nan is not
                about = row.varied or row.name
                size[about] = max(size.get(about, 0.0), abs(row.changes[n]))
        rows = [row for row in self.rows if (row.varied or row.name) in size]
        return sorted(rows, key=lambda row: (-size[row.varied or row.name], row.varied))


def model_table(data: xr.Dataset) -> ModelTable:
    """Return the changes of a table of choices, dim `choice`, the case itself first.

    Counts, which depend on how long a run is, are left out, and choices without run and note.
    """
    first = data.isel(choice=0)
    shown = [m for m in measures(first) if BARRED[m.variable].kind != "count"]
    known = [m for m in shown if has_number(m, float(m.of(first)), float(m.bar(first)))]
    listed = data.isel(choice=(data["status"] != "missing") | (data["note"] != ""))
    columns = [(m, m.of(listed).values, m.bar(listed).values) for m in known]
    rows = []
    for n in range(1, listed.sizes["choice"]):
        one = listed.isel(choice=n)
        found = [change(m, values[[0, n]], bars[[0, n]], one) for m, values, bars in columns]
        ratio = float(one["seconds"]) / float(first["seconds"])
        rows.append(
            ModelRow(
                str(one["choice"].item()), tuple(text for text, _ in found),
                tuple(size for _, size in found), ratio, note_of(one), str(one["varied"].item()),
            )
        )  # fmt: skip
    spans = []
    for n in range(len(known)):
        sizes = [0.0, *(row.changes[n] for row in rows if not math.isnan(row.changes[n]))]
        spans.append((min(sizes), max(sizes)))
    return ModelTable(
        tuple(known), tuple(float(v[0]) for _, v, _ in columns),
        tuple(float(b[0]) for _, _, b in columns), tuple(rows),
        tuple(spans), tuple(m.title for m in shown if m not in known),
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
    status = str(choice["status"].item())
    if status != "ok":
        return ("failed" if status == "failed" else NO_VALUE), math.nan
    relative = measure.is_relative
    if math.isnan(values[1]):
        return NO_VALUE, math.nan
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
        return percent(size)
    return f"{size:+z.2g} points" if measure.unit == "%" else f"{size:+z.2g}"


def percent(size: float) -> str:
    """Return a relative change in percent, to two digits or whole."""
    if abs(size) < MIN_SHOWN_CHANGE:
        return f"below {100 * MIN_SHOWN_CHANGE:g} %"
    return f"{100 * size:+.0f} %" if abs(size) >= 0.995 else f"{100 * size:+.2g} %"


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


def note_of(choice: xr.Dataset) -> str:
    """Return the assumption of a choice, and why its run failed, if it did."""
    reason, note = str(choice["reason"].item()), str(choice["note"].item())
    failed = f"failed: {reason}" if reason else ""
    return "; ".join(text for text in (failed, note) if text)


def headline(table: ModelTable) -> str:
    """Return what numbers in doubt and other models make of the peak that they move most.

    Beside its numerical error; the same of the sensor's number that they move most. It says what
    was varied, and what was not.
    """
    n = table.main
    if n is None:
        return "No metric of the case is known well enough to see a change of it"
    measure, value, bar = table.measures[n], table.values[n], table.bars[n]
    number = f"{by_bar(value, bar, measure.is_relative, True, PAGE_DIGITS)} {measure.unit}"
    share = bar / value
    error = f"below {100 * MIN_ERROR:g}" if share < MIN_ERROR else f"{100 * share:.1g}"
    start = "" if measure.variable.startswith("peak") else "no peak of the case is known; "
    title = f"{start}{measure.title}"
    text = f"{title[0].upper()}{title[1:]}: {number.rstrip()}; numerical error {error} %. "
    if not table.rows:
        return f"{text}Nothing else was run"
    text += f"{scope_text(table)} {moved_text(table, n)}"
    sensed = [k for k, m in enumerate(table.measures) if m.variable in LEVELS]
    if sensed:
        loudest = max(sensed, key=lambda k: table.spans[k][1] - table.spans[k][0])
        text += f"; they {moved_text(table, loudest, f'the {table.measures[loudest].title}')}"
    blank = [row.cells[n] for row in table.rows if math.isnan(row.changes[n])]
    if blank:
        words = ", ".join(dict.fromkeys("impossible" if b == NO_VALUE else b for b in blank))
        verb = "gives" if len(blank) == 1 else "give"
        text += f"; {len(blank)} of {len(table.rows)} runs {verb} no number ({words})"
    return f"{text}. {NOT_COVERED}"


def scope_text(table: ModelTable) -> str:
    """Return what was varied, as the subject of a sentence."""
    run = [row for row in table.rows if not math.isnan(row.time_ratio)]
    numbers = len({row.varied for row in run if row.varied})
    models = sum(not row.varied for row in table.rows)
    parts = []
    if numbers:
        parts.append(f"{numbers} number{'s' * (numbers > 1)} in doubt")
    if models:
        parts.append(f"{models} other model{'s' * (models > 1)}")
    return f"{' and '.join(parts)}, each alone,"


def moved_text(table: ModelTable, n: int, what: str = "") -> str:
    """Return how far a measure is moved, and by what most."""
    what = what or ("this peak" if table.measures[n].variable.startswith("peak") else "this number")
    span = table.span_texts[n]
    if span == NONE_SEEN:
        return f"are not seen to move {what}"
    known = [row for row in table.rows if not math.isnan(row.changes[n])]
    most = max(known, key=lambda row: abs(row.changes[n]))
    return f"move {what} by {span}, most by {most.name}"


def place_text(study: Study | StoredStudy, key: str) -> str:
    """Return the place in its study of the job that the choices are of, in words."""
    at = next(islice(points(study), study.keys.index(key), None))
    point = ", ".join(f"{name} = {value}" for name, value in at.items())
    which = "the only job" if study.jobs == 1 else f"one of {study.jobs} jobs"
    return f"{study.name}{f' at {point}' if point else ''}, {which}"


# ---- on the page --------------------------------------------------------------------------------


@dataclass(frozen=True)
class ModelsContent:
    """What a page says of what was varied of a job: the job, a line, and a table."""

    place: str
    headline: str
    unknown: str
    table: PageTable


def models_file(folder: Folder, study: str, key: str) -> Path:
    """Return the path at which the choices of the model of a study's job are stored."""
    return Path(folder) / "models" / f"{study}-{key[:KEY_DIGITS]}.nc"


def read_models(folder: Folder, study: StoredStudy) -> list[xr.Dataset]:
    """Read what `compsim explain --models` stored of jobs of a study.

    Numbers of a job that the study has not, or that are damaged, are left out with a warning. Older
    files have no key in their names.
    """
    again = f"compsim explain --models {study.case_file} -r {folder} makes it again"
    found: dict[str, xr.Dataset] = {}  # by key: files with it in their names come first
    for path in sorted(Path(folder, "models").glob(f"{study.name}*.nc")):
        if not KEY_IN_NAME.fullmatch(path.stem.removeprefix(study.name)):
            continue
        try:
            data = read_dataset(path, again)
            if data.attrs["study"] != study.name:
                continue
            if data.attrs["key"] in study.keys:
                found.setdefault(data.attrs["key"], data)
                continue
            problem = f"{path}: is not shown, as {study.name} has no such job: run the case file "
            problem += "with the same --set, or delete it"
        except StoreError as error:
            problem = str(error)
        except KeyError:
            problem = f"{path}: holds no choices of the model: {again}"
        warnings.warn(problem, StoreWarning, stacklevel=2)
    return [*found.values()]


def add(results: Folder, studies: Sequence[StoredStudy], place: Folder) -> Additions:
    """Return a line on each study of which something was varied, and a section on each job."""
    notes: dict[str, StudyNote] = {}
    chapters = []
    for study in studies:
        for number, data in enumerate(read_models(results, study)):
            anchor = file_name("models", study.name) + (f"-{number + 1}" if number else "")
            note = StudyNote(headline(model_table(data)), anchor, "Table of what was varied")
            notes.setdefault(study.name, note)
            chapters.append(Chapter(models_section(anchor, study, data)))
    return Additions(notes, chapters)


def models_section(anchor: str, study: StoredStudy, data: xr.Dataset) -> Section:
    """Return the section on what was varied of a study's job."""
    table = model_table(data)
    place = place_text(study, data.attrs["key"])
    content = ModelsContent(place, headline(table), ", ".join(table.unknown), page_table(table))
    title = f"What moves the numbers of study {place.rpartition(', ')[0]}"
    return Section(anchor, title, "compressor.studies.tradeoff:models.html", content)


def page_table(table: ModelTable) -> PageTable:
    """Return the cells of a table: the case itself, each choice, and the span.

    What moves the main measure most comes first.
    """
    numbers = zip(table.measures, table.values, table.bars, strict=True)
    values = [
        number_cell(f"{format_measure(m, value, bar)} {m.unit}".rstrip())
        for m, value, bar in numbers
    ]
    itself = [Cell("the case itself"), *values, Cell("")]
    span = [Cell("all of them"), *map(number_cell, table.span_texts), Cell("")]
    choices = (
        [Cell(row.name), *map(number_cell, row.cells, row.changes), Cell(row.note)]
        for row in ranked_rows(table)
    )
    rows = [*map(TableRow, [itself, *choices, span])]
    return PageTable(["what is otherwise", *(m.title for m in table.measures), "assumed"], rows)


def ranked_rows(table: ModelTable) -> list[ModelRow]:
    """Return the rows of a table, what moves the main measure most first."""
    first = [] if table.main is None else table.most(table.main)
    return [*first, *(row for row in table.rows if row not in first)]


def number_cell(text: str, value: float = math.nan) -> Cell:
    """Return a cell that is sorted by its number."""
    return Cell(text, "number", None if math.isnan(value) else value)
