"""The report as an HTML page with its figures and tables.

Python gives sections of plain data; the files in `templates` make markup of them, and escape every
text that they print.
"""

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from compressor.digits import MAX_DECIMAL, PAGE_DIGITS, by_bar, setting
from compressor.report.figures import pictures
from compressor.report.figures.drawing import as_csv
from compressor.report.figures.sweep_data import Measure
from compressor.report.figures.table import DrawnFigure
from compressor.report.interactive import script
from compressor.report.limits import NO_LIMITS, Limits


@dataclass(frozen=True)
class Cell:
    """A cell: numbers stand to the right, words to the left, code in its own letters.

    `value`: by what a column is sorted, where that is not the text; `zone`: A to D, the worse of
    two, of a metric that has limits; "" of others.
    """

    text: str
    kind: Literal["word", "number", "code"] = "word"
    value: float | None = None
    zone: str = ""


@dataclass(frozen=True)
class TableRow:
    """A row's cells; `mark`: the job failed, is missing, or is chaotic; `key`: of the job."""

    cells: Sequence[Cell]
    mark: str = ""
    key: str = ""


@dataclass(frozen=True)
class PageTable:
    """A table; `head` has a title for each column."""

    head: Sequence[str]
    rows: Sequence[TableRow]


def number(value: float) -> str:
    """Return a measured number to four significant digits, whole ones whole; a dash for nan."""
    if math.isnan(value):
        return "–"
    if not float(value).is_integer():
        value = float(f"{value:.{PAGE_DIGITS}g}")
    is_whole = abs(value) < MAX_DECIMAL and value == int(value)
    return f"{value:.0f}" if is_whole else f"{value:#.{PAGE_DIGITS}g}"


SHORT_BAR = 5e-4  # of a number: its error bar is below its fourth digit


def format_measure(measure: Measure, value: float, bar: float) -> str:
    """Return a metric in four digits, with its error bar where these show it."""
    if math.isnan(bar) or bar < SHORT_BAR * abs(value):
        return number(value)
    return by_bar(value, bar, measure.is_relative, digits=PAGE_DIGITS)


def unbroken(text: str) -> str:
    """Return a text that stays in one line: a number and its error bar."""
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def measured_cell(measure: Measure, value: float, bar: float, limits: Limits = NO_LIMITS) -> Cell:
    """Return a metric and its error bar, and the zone of its limits that it lies in."""
    text = unbroken(format_measure(measure, value, bar))
    zone = limits.zone(measure, value, bar)
    known = None if math.isnan(value) else value
    return Cell(f"{text} {zone}".rstrip(), "number", known, zone[-1:])


def value_cell(value: Any) -> Cell:
    """Return a setting of a job: a number, a word, or a dash where the job has none."""
    if isinstance(value, int | float | np.number):
        if math.isnan(value):
            return Cell("–", "number")
        return Cell(setting(float(value)), "number", float(value))
    return Cell(str(value) or "–")


def column_title(measure: Measure) -> str:
    """Return the title of a measure's column."""
    return measure.title + (f" ({measure.unit})" if measure.unit else "")


class ShownFigure(NamedTuple):
    """What the page says of a figure, and the files beside it by name; jobs: keys of its points."""

    name: str
    title: str
    caption: str
    size: tuple[int, int]
    jobs: Sequence[str]
    files: Mapping[str, bytes]


def show_figure(drawn: DrawnFigure) -> ShownFigure:
    """Return a figure as the page has it: with its picture, table and script."""
    files = {
        f"{drawn.name}.png": pictures.render(drawn.figure),
        f"{drawn.name}.csv": as_csv(drawn.figure).encode(),
        f"{drawn.name}.js": script(drawn.name, drawn.figure).encode(),
    }
    return ShownFigure(drawn.name, drawn.title, drawn.caption, drawn.size, [*drawn.jobs], files)


class SectionContent(NamedTuple):
    """What `section.html` prints."""

    table: PageTable | None = None
    paragraphs: Sequence[str] = ()
    lines: Sequence[str] = ()
    figures: Sequence[DrawnFigure | ShownFigure] = ()


@dataclass(frozen=True)
class Section:
    """A part of the page: `template` prints its `content`, `anchor` is its id."""

    anchor: str
    title: str
    content: Any
    template: str = "section.html"


SUBJECT = "Reciprocating compressor with joint clearance"


def document(
    sections: Sequence[Section],
    results: str,
    series: Sequence[str],
    title: str,
    files: Mapping[str, bytes],
) -> str:
    """Return the whole page: the first section, a list of contents, and the other sections.

    results: their folder in a shell's words; series: keys of the jobs whose last revolution lies
    beside the page; title: of the page, `SUBJECT` where there is none; files: pictures, tables and
    scripts that the page is to hold, by name, in place of those beside it.
    """

    def address(name: str) -> Markup:
        """Return where a file is: beside the page, or in it."""
        if not files:
            return escape(name)
        kind = "text/csv" if name.endswith(".csv") else "image/png"
        return Markup(f"data:{kind};base64,{base64.b64encode(files[name]).decode()}")

    made = Environment(
        loader=PackageLoader(__package__),
        autoescape=True,  # of all that templates print
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.globals |= {"address": address, "single": bool(files)}
    scripts = [Markup(text.decode()) for name, text in files.items() if name.endswith("js")]
    return made.get_template("page.html").render(
        sections=sections, results=results, series=series, title=title, subject=SUBJECT,
        scripts=scripts,
    )  # fmt: skip
