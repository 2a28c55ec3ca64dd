"""The section Diagnosis of a report: the healthy machine beside the paper's faults."""

from collections.abc import Iterator
from dataclasses import dataclass

from compressor.analysis import (
    CLEARANCES,
    FAULTS,
    ORDER,
    SPOKEN,
    Shaking,
    diagnosis_caption,
    label,
    shaking,
)
from compressor.report.figures import Drawing
from compressor.report.figures.diagnosis import (
    Shakings,
    draw_diagnosis_angles,
    draw_diagnosis_orbits,
    draw_diagnosis_spectra,
)
from compressor.report.page import Plate, Section
from compressor.report.paper_runs import PaperRuns
from compressor.report.tables import Cell, Row, Table

NEEDS = ("design", *(label(fault, c) for fault in FAULTS for c in CLEARANCES))
TITLES = {
    "spectra": "Diagnosis 1: orders of the force on the frame",
    "orbits": "Diagnosis 2: orbits of the journals",
    "angles": "Diagnosis 3: when the frame shakes, and the contact modes",
}


@dataclass(frozen=True)
class DiagnosisContent:
    """What a page says of the faults side by side."""

    order: int
    table: Table
    plates: list[Plate]


def shakings(paper: PaperRuns) -> Shakings:
    """Return `shaking` of the healthy machine and all faults; empty unless all are stored."""
    if not paper.usable.keys() >= {*NEEDS}:
        return {}
    return {name: shaking(paper.usable[name]) for name in NEEDS}


def diagnosis_drawings(
    found: Shakings, paper: PaperRuns
) -> Iterator[tuple[str, str, str, Drawing]]:
    """Yield the names, headings, captions and drawings, where there are `shakings`."""
    if not found:
        return
    drawings = {
        "spectra": draw_diagnosis_spectra(found),
        "orbits": draw_diagnosis_orbits(paper.usable),
        "angles": draw_diagnosis_angles(found, paper.usable),
    }
    for name, drawing in drawings.items():
        caption = diagnosis_caption(name, found, paper.usable)
        yield f"diagnosis-{name}", TITLES[name], caption, drawing


def diagnosis_sections(found: Shakings, plates: list[Plate]) -> Iterator[Section]:
    """Yield the section of the figures that were drawn, and a table of the force above `ORDER`."""
    if plates:
        content = DiagnosisContent(ORDER, force_table(found), plates)
        yield Section("diagnosis", "Diagnosis", "diagnosis.html", content)


def force_table(found: Shakings) -> Table:
    """Return the rms of X above `ORDER` and its two shares, N, by fault and clearance."""
    head = ["clearance at", "mm", "rms (N)", "near changes of direction (N)", "elsewhere (N)"]
    healthy = found["design"]
    rows = [Row([Cell("none"), Cell("0", "number"), *forces(healthy)])]
    for fault in FAULTS:
        for clearance in CLEARANCES:
            one = found[label(fault, clearance)]
            rows.append(Row([Cell(SPOKEN[fault]), Cell(f"{clearance:g}", "number"), *forces(one)]))
    return Table(head, rows)


def forces(one: Shaking) -> list[Cell]:
    """Return the whole and its shares, to 0.1 N."""
    values = one.spectrum.above, one.near_turns, one.elsewhere
    return [Cell(f"{value:.1f}", "number") for value in values]
