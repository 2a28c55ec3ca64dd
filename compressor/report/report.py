"""The report of a store: the paper's figures and claims, every study's table, and where from.

Everything is drawn in memory before a file is written, and the page is written last, so that a
report which is interrupted leaves the one before as it was.
"""

import contextlib
import sys
from collections.abc import Iterable
from itertools import chain
from pathlib import Path

from compressor.analysis import caption
from compressor.report.diagnosis_section import (
    TITLES,
    diagnosis_drawings,
    diagnosis_sections,
    shakings,
)
from compressor.report.figures import FIGURES, Drawing
from compressor.report.figures.style import render
from compressor.report.figures.sweep_metric import draw_metrics, measures, swept
from compressor.report.machines_section import (
    Part,
    machine_drawings,
    machine_files,
    machine_sections,
)
from compressor.report.page import Plate, Section, document
from compressor.report.paper_runs import PaperRuns, find_paper_runs
from compressor.report.paper_sections import missing_sections, paper_sections
from compressor.report.provenance import provenance_section
from compressor.report.second_sets import (
    SET,
    SecondSet,
    second_anchor,
    second_drawings,
    second_name,
    second_section,
    second_sets,
)
from compressor.report.study_section import file_name, study_section
from compressor.store import (
    Folder,
    Stored,
    StoredStudy,
    open_study,
    publish,
    read_store,
    read_studies,
)

SWEEP = (
    "A line for each combination of the other axes or, where they are many, a light line for each "
    "and their median; a study that is no grid has a point for each job. A cross: a job failed "
    "here; a circle: a job was not run."
)


def write_report(results: Folder, report: Folder, command: str = "", claims: Folder = "") -> Path:
    """Write figures and `index.html` about a folder of results; returns the page's path.

    claims: the folder of judged machines (`compsim claims`), if there is one.

    Raises StoreError where there are no results, or the report's folder cannot be written.
    """
    plates, studies, page = compose(results, command, claims)
    folder = Path(report)
    for plate in plates:
        publish(folder / f"{plate.name}.png", plate.png)
        publish(folder / f"{plate.name}.svg", plate.svg)
    publish(folder / "index.html", page.encode())
    remove_stale(folder, studies, {plate.name for plate in plates})
    return folder / "index.html"


def compose(results: Folder, command: str, claims: Folder) -> tuple[list[Plate], list[str], str]:
    """All figures of a report, drawn, the names of its studies, and its page."""
    judged = machine_files(claims) if claims else {}
    studies, stored = read_studies(results), read_store(results).warned()
    paper = find_paper_runs(stored, studies)
    of_paper = draw_paper(paper)
    others = second_sets(stored, studies, paper)
    of_others = {n: [draw(*parts) for parts in second_drawings(one)] for n, one in others.items()}
    found = shakings(paper)
    of_faults = [draw(*parts) for parts in diagnosis_drawings(found, paper)]
    shown = {run.attrs["key"] for run in paper.stored.values()}
    drawn = {
        study.name: drawn_study(stored, study, others.get(study.name))
        for study in studies
        if not shown.issuperset(study.keys)
    }
    about_others = [
        second_section(one, of_others[name], of_paper, drawn[name][0].anchor)
        for name, one in others.items()
    ]
    about_paper = [*paper_sections(paper, of_paper)]
    about_studies = [section for section, _ in drawn.values()]
    if of_paper:
        about_paper[1:1] = [*about_others, *diagnosis_sections(found, of_faults)]
        told = about_paper + about_studies
    else:
        told = about_others + about_studies + about_paper
    about_machines = [drawn_part(*parts) for parts in machine_drawings(judged)]
    sections = [
        Section("assumptions", "What to keep in mind", "assumptions.html"),
        *told,
        *machine_sections(about_machines),
        *missing_sections(paper, results),
        provenance_section(studies, results, command),
    ]
    sets = (of_paper, *of_others.values(), of_faults, *(more for _, more in drawn.values()))
    plates = [*chain(*sets), *(part.plate for part in about_machines if part.plate)]
    return plates, [study.name for study in studies], document(sections)


def drawn_part(
    name: str, sentences: list[str], heading: str, caption: str, drawing: Drawing | None
) -> Part:
    """What is said of a file of judged machines, with its figure where it has one."""
    if drawing is None:
        return Part(name, sentences, None)
    plate = draw(file_name("machines", name), heading, caption, drawing)
    return Part(name, sentences, plate)


def drawn_study(
    stored: Stored, study: StoredStudy, other: SecondSet | None
) -> tuple[Section, list[Plate]]:
    """A user's own study: its section, and each metric against each swept axis, drawn.

    The sweep is not drawn where all of the study is shown as another set of the paper's figures.
    """
    anchor = second_anchor(study.name) if other else ""
    whole = other is not None and other.keys.issuperset(study.keys)
    with open_study(stored.folder, study.name) as data:
        plates = [
            draw(file_name("sweep", study.name, axis), f"{study.name}: metrics against {axis}",
                 SWEEP, draw_metrics(data, axis))
            for axis in (swept(data) if measures(data) and not whole else [])
        ]  # fmt: skip
        return study_section(stored, study, data, plates, anchor), plates


def remove_stale(report: Path, studies: Iterable[str], drawn: set[str]) -> None:
    """Remove an earlier report's drawings of the paper's figures that this one could not draw.

    studies: the names of those that may have had a set of their own.
    """
    names = {f"figure-{item.number:02d}" for item in FIGURES}
    names |= {second_name(study, item) for study in studies for item in SET}
    for name in (names | {f"diagnosis-{name}" for name in TITLES}) - drawn:
        for kind in ("png", "svg"):
            with contextlib.suppress(OSError):
                (report / f"{name}.{kind}").unlink()


def draw_paper(paper: PaperRuns) -> list[Plate]:
    """Every figure of the paper whose cases are there."""
    return [
        draw(f"figure-{item.number:02d}", f"Figure {item.number}: {item.title}",
             caption(item.number, paper.usable), item.draw(paper.usable))
        for item in FIGURES
        if paper.usable.keys() >= {*item.needs}
    ]  # fmt: skip


def draw(name: str, heading: str, caption: str, drawing: Drawing) -> Plate:
    """A drawing as it is stored and shown; tells of it on stderr."""
    with contextlib.suppress(OSError):
        print(f"drawing {heading}", file=sys.stderr, flush=True)
    return Plate(name, heading, caption, render(drawing, "png"), render(drawing, "svg"))
