"""The report of a store: the paper's figures and claims, every study's table, and where from.

Everything is drawn in memory before a file is written, and the page is written last, so that a
report which is interrupted leaves the one before as it was.
"""

import contextlib
import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN, claims, paper_cases
from compressor.case import Case
from compressor.durable import Folder, publish
from compressor.figures import FIGURES, Drawing
from compressor.figures.style import render
from compressor.figures.sweep_metric import MEASURES, Measure, draw_metrics, measures, swept
from compressor.manifest import StoredStudy, read_studies
from compressor.page import (
    Html,
    Plate,
    Section,
    axes,
    claims_table,
    columns,
    document,
    element,
    figure,
    joined,
    listing,
    numbers,
    outcome,
    plain,
    provenance,
    row,
    study_table,
    table,
)
from compressor.paper_runs import PaperRuns, case_files, find_paper_runs, run_command
from compressor.physics.cam import comparisons
from compressor.quantities import HORIZON
from compressor.reasons import remedy as remedy_of
from compressor.record import record
from compressor.store import Stored, open_study, read_store

MOST_DETAILS = 20

TITLE = "Reciprocating compressor with joint clearance"
LEAD = (
    "A report of compsim on simulated crank mechanisms: the figures of Xiao et al. 2021, Dynamic "
    "Analysis for a Reciprocating Compressor System with Clearance Fault, drawn again from stored "
    "runs; what the runs say of the paper's claims; and the table of every study. Curves show the "
    "revolutions after the first, which is start-up; crank angles count from top dead centre."
)
SWEEP = (
    "A line for each combination of the other axes or, where they are many, a light line for each "
    "and their median; a study that is no grid has a point for each job. A cross: a job failed "
    "here; a circle: a job was not run."
)
ASSUMPTIONS = (
    "The masses are ours, since the paper prints none: rod 4.7 kg (a steel bar of 600 × 40 × "
    "25 mm), crosshead with piston rod and piston 14 kg. They decide peaks and trends: a claim "
    "that fails here is a result for these masses.",
    "The clearance is radial: bearing radius less journal radius.",
    "The cam of the design load is a reconstruction: as printed it does not close (Figure 4).",
    "Claim (1) holds by construction: with ideal joints and a prescribed crank, no load can "
    "change the motion.",
)

BEYOND = (
    "Of {jobs} of the jobs the run is longer than their predictability_horizon: single peaks may "
    "differ between two correct solutions, no error bar is claimed, and statistics alone hold."
)


def write_report(results: Folder, report: Folder, command: str = "") -> Path:
    """Write figures and `index.html` about a folder of results; returns the page's path.

    Raises StoreError where there are no results, or the report's folder cannot be written.
    """
    plates, page = compose(results, command)
    folder = Path(report)
    for plate in plates:
        publish(folder / f"{plate.name}.png", plate.png)
        publish(folder / f"{plate.name}.svg", plate.svg)
    publish(folder / "index.html", page.encode())
    remove_stale(folder, {plate.name for plate in plates})
    return folder / "index.html"


def compose(results: Folder, command: str) -> tuple[list[Plate], str]:
    """All figures of a report, drawn, and its page."""
    studies, stored = read_studies(results), read_store(results).warned()
    paper = find_paper_runs(stored, studies)
    plates = draw_paper(paper)
    of_paper = [*paper_sections(paper, plates)]
    shown = {run.attrs["key"] for run in paper.stored.values()}
    told = [study_section(stored, s) for s in studies if not shown.issuperset(s.keys)]
    of_studies = [section for section, _ in told]
    sections = [
        Section("assumptions", "What to keep in mind", listing(ASSUMPTIONS)),
        *(of_paper + of_studies if plates else of_studies + of_paper),
        *missing_sections(paper, results),
        provenance(studies, results, command),
    ]
    plates += [plate for _, drawn in told for plate in drawn]
    return plates, document(TITLE, LEAD, sections)


def remove_stale(report: Path, drawn: set[str]) -> None:
    """Remove an earlier report's drawings of the paper's figures that this one could not draw."""
    for name in {f"figure-{item.number:02d}" for item in FIGURES} - drawn:
        for kind in ("png", "svg"):
            with contextlib.suppress(OSError):
                (report / f"{name}.{kind}").unlink()


# ---- the paper's cases ------------------------------------------------------------------------


def draw_paper(paper: PaperRuns) -> list[Plate]:
    """Every figure of the paper whose cases are there."""
    return [
        draw(f"figure-{item.number:02d}", f"Figure {item.number}: {item.title}", item.caption,
             item.draw(paper.usable))
        for item in FIGURES
        if paper.usable.keys() >= {*item.needs}
    ]  # fmt: skip


def draw(name: str, heading: str, caption: str, drawing: Drawing) -> Plate:
    """A drawing as it is stored and shown; tells of it on stderr."""
    with contextlib.suppress(OSError):
        print(f"drawing {heading}", file=sys.stderr, flush=True)
    return Plate(name, heading, caption, render(drawing, "png"), render(drawing, "svg"))


# ---- sections ---------------------------------------------------------------------------------


def paper_sections(paper: PaperRuns, plates: Sequence[Plate]) -> Iterator[Section]:
    """What there is of the paper: figures, cases, claims."""
    if plates:
        links = (
            element("a", plate.heading.partition(":")[0], href=f"#{plate.name}") for plate in plates
        )
        body = joined([element("p", joined(links, " · ")), *map(figure, plates)])
        yield Section("figures", "The paper's figures", body)
    if paper.stored:
        yield Section("cases", "The paper's cases", paper_table(paper))
        yield Section("claims", "The paper's claims", claims_body(paper.usable))
        yield Section("printed", "Spring and cam: what is printed, what follows", printed_table())


def printed_table() -> Html:
    """The paper's numbers of the design load beside those that follow from its equations."""
    rows = [
        row([f"{c.quantity} ({c.unit})", math.nan if c.printed is None else c.printed, c.follows,
             c.source])
        for c in comparisons(record(Case()))
    ]  # fmt: skip
    words = "Simulated is the closed cam with Table 1's spring. A dash: the paper gives no number."
    head = ["quantity", "printed", "follows", "from"]
    return joined([element("p", words), table(head, rows)])


def claims_body(runs: Mapping[str, xr.Dataset]) -> Html:
    """The table of claims, and how it is meant."""
    words = (
        "Each claim is measured against a threshold that was written down before the first "
        "comparison. One whose cases are not all stored is not measured."
    )
    return joined([element("p", words), claims_table(claims(runs))])


def paper_table(paper: PaperRuns) -> Html:
    """A row for each of the paper's cases, stored or not."""
    known = [measures(run) for run in paper.stored.values()]
    groups = columns(m for m in MEASURES if any(m in some for some in known))
    head = ["case", "status", *groups, "energy residual", "rtol", "job"]
    rows = []
    for name in paper_cases():
        run = paper.stored.get(name)
        if run is None:
            rows.append(row([spoken(name), "not stored", *[""] * (len(head) - 2)], "missing"))
            continue
        status = str(run["status"].item())
        metrics = [numbers([value_of(m, run) for m in group]) for group in groups.values()]
        residual = float(run.get("energy_residual", math.nan))
        tolerance = plain(run.attrs.get("rtol", ""))
        trust = [residual, tolerance, element("code", run.attrs["key"])]
        end = outcome(status, run["reason"].item())
        rows.append(row([spoken(name), end, *metrics, *trust], status))
    words = (
        "Metrics are taken over the dense solution after the first revolution. Energy residual: "
        "the worst imbalance of energy, relative to what the contacts lose. A dash: nothing to "
        "tell, such as contact in an ideal joint."
    )
    return joined([element("p", words), table(head, rows)])


def value_of(measure: Measure, run: xr.Dataset) -> float:
    """A measure of one run; nan where it has none."""
    return float(measure.of(run)) if measure.variable in run else math.nan


def spoken(name: str) -> str:
    """A label of `paper_cases` in words."""
    fault, _, clearance = name.partition(" ")
    return f"{SPOKEN[fault]}, {clearance} mm" if clearance else f"{fault} model, no clearance"


def study_section(stored: Stored, study: StoredStudy) -> tuple[Section, list[Plate]]:
    """A user's own study: its table, its failures, and each metric against each swept axis."""
    with open_study(stored.folder, study.name) as data:
        body = [
            element("p", joined(["Case file ", element("code", study.case_file), "."], "")),
            failures(stored, data),
            study_table(data),
        ]
        plates = []
        for axis in swept(data) if measures(data) else []:
            name = re.sub(r"[^A-Za-z0-9._-]", "_", f"sweep-{study.name}-{axis}")
            heading = f"{study.name}: metrics against {axis}"
            caption = SWEEP
            plates.append(draw(name, heading, caption, draw_metrics(data, axis)))
    anchor = re.sub(r"[^A-Za-z0-9._-]", "_", f"study-{study.name}")
    body += map(figure, plates)
    return Section(anchor, f"Study {study.name}", joined(body)), plates


def failures(stored: Stored, data: xr.Dataset) -> Html:
    """How many jobs of a study failed or are missing, and what is known of the failures."""
    status = data["status"].values.ravel()
    failed, missing = np.flatnonzero(status == "failed"), int((status == "missing").sum())
    counts = f"{status.size} jobs: {status.size - len(failed) - missing} ok, {len(failed)} failed"
    body = [element("p", counts + (f", {missing} not run." if missing else "."))]
    if HORIZON in data and (chaotic := int(np.isfinite(data[HORIZON].values).sum())):
        body.append(element("p", BEYOND.format(jobs=chaotic)))
    items = []
    for place in failed[:MOST_DETAILS]:
        job = stored.status(str(data["key"].values.flat[place]))
        point = [f"{name} {plain(values[place])}" for name, values in axes(data).items()]
        items.append(f"{', '.join(point)}: {outcome(job.reason, job.detail) if job else 'gone'}")
    reasons = dict.fromkeys(data["reason"].values.ravel()[failed])
    advice = listing(f"{reason}: {remedy_of(reason)}" for reason in reasons)
    if len(failed) > MOST_DETAILS:
        items.append(f"and {len(failed) - MOST_DETAILS} more")
    return joined([*body, listing(items), "What to do:", advice] if items else body)


def missing_sections(paper: PaperRuns, results: Folder) -> Iterator[Section]:
    """The figures that could not be drawn, what they lack, and how to get it."""
    lacking = {
        f"Figure {item.number}, {item.title}": [name for name in item.needs if name in paper.absent]
        for item in FIGURES
    }
    items = [
        f"{title}: " + "; ".join(f"{spoken(name)} ({paper.absent[name]})" for name in names)
        for title, names in lacking.items()
        if names
    ]
    if not items:
        return
    files = case_files(paper.absent)
    advice = (
        "These case files and this command give what is missing. A case that failed is run again "
        "only when its file is deleted or its settings change."
    )
    parts = [
        element("p", advice),
        *(element("pre", f"# {name}\n{text}") for name, text in files.items()),
    ]
    body = joined([listing(items), *parts, element("pre", run_command(files, results))])
    yield Section("missing", "Figures that could not be drawn", body)
