"""The sections of a report about the paper: figures, cases, claims, and what is missing."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import xarray as xr

from compressor.analysis import SPOKEN, claims, comparisons, paper_cases
from compressor.report.figures import FIGURES
from compressor.report.figures.sweep_metric import MEASURES, Measure, measures
from compressor.report.page import Plate, Section
from compressor.report.paper_runs import PaperRuns, case_files, run_command
from compressor.report.study_section import SHORT
from compressor.report.tables import (
    Cell,
    Row,
    Table,
    column_title,
    ending,
    job_row,
    measured_cell,
    number_cell,
    value_cell,
)
from compressor.store import Folder


@dataclass(frozen=True)
class MissingFigures:
    """What each figure lacks, and the case files and the command that give it."""

    figures: Sequence[str]
    case_files: Sequence[str]
    command: str


def paper_sections(
    paper: PaperRuns, plates: Sequence[Plate]
) -> tuple[list[Section], list[Section]]:
    """Return what there is of the paper: figures; claims, cases, and the load's printed numbers."""
    figures = [Section("figures", "The paper's figures", "figures.html", plates)] if plates else []
    if not paper.stored:
        return figures, []
    title = "Spring and cam: what is printed, what follows"
    return figures, [
        Section("claims", "The paper's claims", "claims.html", claims(paper.usable)),
        Section("cases", "The paper's cases", "cases.html", cases_table(paper)),
        Section("printed", title, "printed.html", printed_table()),
    ]


def cases_table(paper: PaperRuns) -> Table:
    """Return a row for each of the paper's cases, stored or not."""
    known = [measures(run) for run in paper.stored.values()]
    shown = [m for m in MEASURES if any(m in some for some in known)]
    head = ["case", "status", *map(column_title, shown), "energy residual", "rtol", "job"]
    rows = []
    for name in paper_cases():
        run = paper.stored.get(name)
        if run is None:
            cells = [Cell(spoken(name)), Cell("not stored"), *[Cell("")] * (len(head) - 2)]
            rows.append(Row(cells, "missing"))
            continue
        status, key = str(run["status"].item()), run.attrs["key"]
        regime = run.attrs.get("regime", "")
        start = [Cell(spoken(name)), Cell(ending(status, run["reason"].item(), regime))]
        metrics = [measured_cell(m, *value_of(m, run)) for m in shown]
        residual = number_cell(float(run.get("energy_residual", math.nan)))
        tolerance = value_cell(run.attrs.get("rtol", ""))
        trust = [residual, tolerance, Cell(key[:SHORT], "code")]
        rows.append(job_row([*start, *metrics, *trust], status, regime, key))
    return Table(head, rows)


def value_of(measure: Measure, run: xr.Dataset) -> tuple[float, float]:
    """Return a measure of one run and its error bar; nan where it has none."""
    if measure.variable not in run:
        return math.nan, math.nan
    return float(measure.of(run)), float(measure.bar(run))


def spoken(name: str) -> str:
    """Return a label of `paper_cases` in words."""
    fault, _, clearance = name.partition(" ")
    return f"{SPOKEN[fault]}, {clearance} mm" if clearance else f"{fault} model, no clearance"


def printed_table() -> Table:
    """Return the paper's numbers of the spring load beside those that follow from its equations."""
    rows = [
        Row([
            Cell(f"{c.quantity} ({c.unit})"),
            number_cell(math.nan if c.printed is None else c.printed),
            number_cell(c.follows),
            Cell(c.source),
        ])
        for c in comparisons()
    ]  # fmt: skip
    return Table(["quantity", "printed", "follows", "from"], rows)


def missing_sections(paper: PaperRuns, results: Folder) -> Iterator[Section]:
    """Yield the figures that could not be drawn, what they lack, and how to get it."""
    lacking = {
        f"Figure {item.number}, {item.title}": [name for name in item.needs if name in paper.absent]
        for item in FIGURES
    }
    figures = [
        f"{title}: " + "; ".join(f"{spoken(name)} ({paper.absent[name]})" for name in names)
        for title, names in lacking.items()
        if names
    ]
    if not figures:
        return
    files = case_files(paper.absent)
    texts = [f"# {name}\n{text}" for name, text in files.items()]
    content = MissingFigures(figures, texts, run_command(files, results))
    yield Section("missing", "Figures that could not be drawn", "missing.html", content)
