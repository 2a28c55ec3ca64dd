"""The report of a store: the paper's figures and claims, every study's table, and where from.

Everything is drawn in memory before a file is written, and the page is written last, so that a
report which is interrupted leaves the one before as it was.
"""

import shlex
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import xarray as xr
from plotly.offline import get_plotlyjs

from compressor import analysis, store
from compressor.cases import CardError
from compressor.outcome import Regime
from compressor.program import CompsimWarning
from compressor.report import answer, interactive, page, paper_sections, study_section
from compressor.report.figures.pictures import draw_all
from compressor.report.figures.sweep import draw_sweep
from compressor.report.figures.sweep_data import measures
from compressor.report.figures.table import DrawnFigure
from compressor.report.limits import Limits, read_limits
from compressor.report.plots import draw_for_page
from compressor.store import Stored, StoredStudy
from compressor.units import Units

LIBRARY = "plotly.min.js"


def write_report(
    results: store.Folder,
    report: store.Folder,
    command: str = "",
    limits: Sequence[str] = (),
    units: Units = "usual",
    studies: Sequence[str] = (),
    single: bool = False,
) -> Path:
    """Write figures and `index.html` about a folder of results; returns the page's path.

    limits: of metrics, whose zones tables and curves show, such as `sensor_peak=20,50 m/s²`. units:
    of figures and tables, of `compressor.units`. studies: names of those to tell of, in this order,
    by default all, those of searches last. single: report is a file, the page with all that it
    needs in it.

    Raises LimitError where these cannot be used, StoreError where there are no results, or the
    report's folder cannot be written.
    """
    folder, zones = Path(report), read_limits(limits, units)
    figures, series, make_page = build_report(results, command, zones, units, studies)
    files = {f"job-{key}.js": text.encode() for key, text in series.items()}
    drawn = [one for one in figures if isinstance(one, DrawnFigure)]
    shown = [one for one in figures if isinstance(one, page.ShownFigure)]
    for made in [*shown, *draw_all([partial(page.show_figure, one) for one in drawn])]:
        files |= made.files
    library = {LIBRARY: get_plotlyjs().encode()}
    if single:
        text = make_page(library | files)
        store.publish(folder, text.encode(errors="backslashreplace"))
        return folder
    for name, content in (library | files).items():
        store.publish(folder / name, content, durable=False)  # the same command makes it again
    store.publish(folder / "index.html", make_page({}).encode(errors="backslashreplace"))
    return folder / "index.html"


def build_report(
    results: store.Folder,
    command: str,
    limits: Limits,
    units: Units = "usual",
    names: Sequence[str] = (),
) -> tuple[
    list[DrawnFigure | page.ShownFigure], dict[str, str], Callable[[Mapping[str, bytes]], str]
]:
    """Return the figures of a report, series by job, and what makes its page, in memory.

    Figures of the paper have their files; the page holds the files that it is given. Arguments as
    of `write_report`.
    """
    studies, stored = choose_studies(results, names), store.read_store(results, warn=True)
    # a few like runs in a sweep of one's own are no reproduction
    papers = [study for study in studies if paper_sections.is_of_paper(stored, study)]
    paper = paper_sections.find_runs(stored, papers, analysis.paper_cases())
    paper_figures = paper_sections.draw_paper(paper.usable, units)
    of_own = {
        one.name: paper_sections.own_figures(stored, one, units) for one in studies if one.figures
    }
    drawn: list[DrawnStudy] = []
    left_out: list[str] = []  # studies, and why
    for study in studies:
        if paper_sections.repeats_paper(study, paper):
            continue
        notes = [of_own[study.name][0]] if study.name in of_own else []
        try:
            drawn.append(drawn_study(stored, study, notes, limits, units))
        except CardError as error:
            left_out.append(f"study {study.name} is left out: {error}")
            warnings.warn(left_out[-1], CompsimWarning, stacklevel=3)
    shown = {name for one in drawn for name in one.shown}
    cases, judged, tables = None, list[analysis.Claim](), list[page.Section]()
    if paper.stored:
        cases, judged = paper_sections.paper_data(stored, paper), analysis.claims(paper.usable)
        shown |= {one.variable for one in measures(cases)}
        caveats = [f"{one.name}: {t}" for one in papers for t in store.study_caveats(stored, one)]
        tables = paper_sections.paper_sections(cases, judged, caveats, limits, units)
    for name in limits.by_metric.keys() - shown:
        text = f"no study of this report has {name}: its limits are shown nowhere"
        warnings.warn(text, CompsimWarning, stacklevel=3)
    of_paper = page.Section(
        "figures", "The paper's figures", page.SectionContent(figures=paper_figures)
    )
    sections = [
        summarise(drawn, cases, judged, left_out, units),
        *(one.section for one in drawn),
        *[of_paper] * bool(paper_figures),
        *chain(*(sections for _, sections in of_own.values())),
        *(one.table for one in drawn),
        *tables,
        answer.assumptions_section(bool(paper.stored), any(map(has_spring, studies))),
        answer.provenance_section(studies, results, command),
    ]
    series = {
        key: text for one in drawn for key, text in interactive.job_scripts(stored, one.keys, units)
    }
    titled = [study for study in studies if study.title]
    titles = {study.title for study in titled if not study.is_trial or titled[0].is_trial}
    title = titles.pop() if len(titles) == 1 else ""  # several machines have it in their sections
    figures = [one for section in sections for one in getattr(section.content, "figures", ())]
    make_page = partial(page.document, sections, shlex.quote(str(results)), [*series], title)
    return figures, series, make_page


def choose_studies(results: store.Folder, names: Sequence[str]) -> list[StoredStudy]:
    """Return the studies of some names, or all, those of searches last. Raises WrongName."""
    if not names:
        return sorted(store.read_studies(results), key=lambda study: study.is_trial)
    known = store.read_studies(results)
    return [store.find_study(results, name, known) for name in dict.fromkeys(names)]


def has_spring(study: StoredStudy) -> bool:
    """Return whether any job of a study has the spring load."""
    swept = (axis.values for axis in study.axes if axis.key == "load")
    return "spring" in (study.fixed["load"], *chain(*swept))


class DrawnStudy(NamedTuple):
    """What the page has of a user's own study.

    keys: of the jobs that a click opens; cautions: what to know beside the findings;
    shown: the metrics that its table has.
    """

    section: page.Section
    table: page.Section
    findings: list[answer.MetricChange]
    line: SimpleNamespace
    keys: list[str]
    cautions: list[str]
    shown: set[str]
    is_trial: bool


def drawn_study(
    stored: Stored,
    study: StoredStudy,
    notes: Sequence[tuple[str, str, str]],
    limits: Limits,
    units: Units,
) -> DrawnStudy:
    """Return a study, with figures of it unless the paper's are drawn; notes: lines on it."""
    with store.label_studies(stored, [study]) as data:
        named: list[tuple[str, DrawnFigure]] = []
        if not study.figures:
            swept = draw_sweep(data, limits, units, study.is_curve)
            turns = draw_for_page(stored, study, data, units)
            named = [(study_section.file_name("sweep", study.name, one.name), one) for one in swept]
            named += [(study_section.file_name(one.name, study.name), one) for one in turns]
        figures = [one._replace(name=name, title=f"{study.name}: {one.title}")
                   for name, one in named]  # fmt: skip
        section, table = study_section.study_sections(
            stored, study, data, figures, notes, limits, units
        )
        keys = [
            *(key for one in figures for key in one.jobs),
            *study.keys[: study_section.MAX_ROWS],
        ]
        line = describe_run(f"Study {study.name}", section.anchor, data)
        return DrawnStudy(
            section, table, answer.study_findings(data, units), line, keys,
            motion_cautions(stored, study, data),
            {one.variable for one in measures(data)}, study.is_trial,
        )  # fmt: skip


def describe_run(name: str, anchor: str, data: xr.Dataset) -> SimpleNamespace:
    """Return what was run, under which name, and how it ended; anchor: of its section.

    `problem`: a job has failed; `has_result`: one is ok.
    """
    counts, found = study_section.count_jobs(data)
    return SimpleNamespace(name=name, anchor=anchor, counts=counts, problem=found["failed"] > 0,
                           has_result=found["ok"] > 0)  # fmt: skip


def motion_cautions(stored: Stored, study: StoredStudy, data: xr.Dataset) -> list[str]:
    """Return which of a study's jobs are chaotic or have not settled, a sentence each."""
    chaotic = int((data["regime"].values == Regime.CHAOTIC).sum())
    of_knock = "; knock is a mean over their revolutions" if answer.worn_joints(data) else ""
    texts = [
        f"{chaotic} of {study.jobs} jobs are chaotic, and their peaks do not count here{of_knock}"
    ]
    found = [*texts[: chaotic > 0], *store.run_caveats(stored, study)]
    return [f"Study {study.name}: {text}." for text in found]


def summarise(
    drawn: Sequence[DrawnStudy],
    cases: xr.Dataset | None,
    judged: Sequence[analysis.Claim],
    left_out: Sequence[str],
    units: Units = "usual",
) -> page.Section:
    """Return the page's first screen.

    cases: of the paper, as of `paper_data`; judged: its claims; left_out: studies, and why.
    """
    lines = [one.line for one in drawn]
    told = [one for one in drawn if not one.is_trial] or drawn
    each: list[tuple[str, Sequence[answer.MetricChange]]] = [
        (one.line.name, one.findings) for one in told
    ]
    if cases is not None:
        lines.append(describe_run("The paper's cases", "cases", cases))
        worn = cases.isel(case=slice(1, None))  # and the design model; the first is the typical one
        each.append(("The paper's cases", answer.study_findings(worn, units)))
    count = answer.MAX_FINDINGS if len(each) == 1 else 1
    shown = [
        (name, chosen) for name, found in each if (chosen := answer.choose_findings(found, count))
    ]
    cautions = [f"{text[0].upper()}{text[1:]}." for text in left_out]
    cautions += [text for one in drawn for text in one.cautions]
    return answer.answer_section(lines, shown, judged, cautions)
