"""The sections of a report about the paper: figures, cases, claims, own machines."""

import math
import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import xarray as xr

from compressor import analysis, store
from compressor.cases import Axis, Case
from compressor.report import page, study_section
from compressor.report.figures import FIGURES, Figure
from compressor.report.figures.pictures import draw_all
from compressor.report.figures.sweep_data import measures
from compressor.report.limits import NO_LIMITS, Limits
from compressor.store import Stored, StoredStudy
from compressor.units import Units


@dataclass(frozen=True)
class PaperRuns:
    """The stored runs of the paper's cases by label; `usable` ones are whole and have series."""

    stored: dict[str, xr.Dataset]
    usable: dict[str, xr.Dataset]


def is_of_paper(stored: Stored, study: StoredStudy) -> bool:
    """Return whether all stored jobs of a study, and at least one, are cases of the paper."""
    count = sum(at >= 0 for at in stored.find([*study.keys]))
    labels = {case.physics_key for case in analysis.paper_cases().values()}
    return 0 < count == len(paper_candidates(stored, [study], labels))


def repeats_paper(study: StoredStudy, paper: PaperRuns) -> bool:
    """Return whether all of a study is told as the paper's cases: whole faults, and no notes."""
    names = {name for name, run in paper.stored.items() if run.attrs["key"] in study.keys}
    faults = [
        {analysis.label(fault, clearance) for clearance in analysis.CLEARANCES}
        for fault in analysis.FAULTS
    ]
    is_whole = all(not fault & names or fault <= names for fault in faults)
    shown = {run.attrs["key"] for run in paper.stored.values()}
    return is_whole and shown.issuperset(study.keys) and not (study.title or study.notes)


def find_runs(
    stored: Stored, studies: Sequence[StoredStudy], cases: Mapping[str, Case]
) -> PaperRuns:
    """Return the most exact run of the studies with each case's physics, by label."""
    labels = {case.physics_key: name for name, case in cases.items()}
    found: dict[str, xr.Dataset] = {}
    for key in paper_candidates(stored, studies, labels):
        name = labels[str(stored.words("physics_key")[stored.position(key)])]
        try:
            run = stored.job(key)
        except store.DamagedFile as error:
            warnings.warn(str(error), store.StoreWarning, stacklevel=2)
            continue
        if name not in found or rank(run) > rank(found[name]):
            found[name] = run
    usable = {name: run for name, run in found.items() if rank(run)[:2] == (True, True)}
    return PaperRuns({n: found[n] for n in labels.values() if n in found}, usable)


def paper_candidates(
    stored: Stored, studies: Sequence[StoredStudy], physics: Collection[str]
) -> list[str]:
    """Return the keys of the studies' stored jobs that simulate some physics.

    In the studies' order, each once. physics: the physics keys.
    """
    keys = list(dict.fromkeys(key for study in studies for key in study.keys))
    positions = stored.find(keys)
    physics_keys = np.array([*physics], "S")
    same = np.isin(stored.columns["physics_key"], physics_keys)
    return [key for key, at in zip(keys, positions, strict=True) if at >= 0 and same[at]]


def rank(run: xr.Dataset) -> tuple[bool, bool, float]:
    """Return the rank of a run: greater is better, among runs of the same physics."""
    return str(run["status"].item()) == "ok", "time" in run.dims, -run.attrs.get("rtol", math.inf)


PAPER = FIGURES["paper"]
REVOLUTION_ROUNDING = 1e-6  # revolutions: rounding of a whole one
UNEQUAL = "whose runs do not settle at one crank angle, for a whole revolution"


def own_figures(
    stored: Stored, study: StoredStudy, units: Units
) -> tuple[tuple[str, str, str], list[page.Section]]:
    """Return the paper's figures and claims of the machine of a study's last job.

    A figure needs those of the paper's cases that it shows among the study's jobs. The note is on
    the study's section; there are no sections where nothing can be drawn.
    """
    places = [place for place in stored.find([*study.keys]).tolist() if place >= 0]
    case = stored.case_at(places[-1]) if places else None
    runs = find_runs(stored, [study], analysis.cases_of(case)).usable if case else {}
    alike = comparable(runs.values())
    figures = draw_paper(runs, units, study.name) if alike else []
    if not figures:
        reason = "since no figure has all its cases there with series" if alike else UNEQUAL
        text = f"The paper's figures are not drawn of this machine, {reason}"
        return (text, study_section.file_name("jobs", study.name), "Its jobs"), []
    text = "The paper's figures are drawn of this machine if all their cases are there with series"
    anchors = [study_section.file_name(what, study.name) for what in ("figures", "claims")]
    titles = [f"{study.name}: the paper's {what}" for what in ("figures", "claims")]
    return (text, anchors[0], "Figures and claims"), [
        page.Section(anchors[0], titles[0], page.SectionContent(figures=figures)),
        page.Section(anchors[1], titles[1], analysis.claims(runs), "claims.html"),
    ]


def comparable(runs: Collection[xr.Dataset]) -> bool:
    """Return whether runs can be drawn and judged together.

    They settle at one crank angle and have samples at the same ones, for a revolution or more.
    """
    grids = [analysis.settled_part(run)["crank_angle"].values for run in runs]
    if not grids:
        return True
    turns = (grids[0][-1] - grids[0][0]) / (2.0 * np.pi)
    is_whole = bool(turns > 1.0 - REVOLUTION_ROUNDING)
    return is_whole and all(np.array_equal(grid, grids[0]) for grid in grids)


CASES = (
    "Metrics are taken over the dense solution after the start-up. A dash: nothing to tell, such "
    "as contact in an ideal joint. A figure is drawn if all its cases are ok and keep time series: "
    "compsim init paper writes a file of all cases, and running it adds those that are not there."
)


def paper_sections(
    cases: xr.Dataset,
    judged: Sequence[analysis.Claim],
    caveats: Sequence[str],
    limits: Limits = NO_LIMITS,
    units: Units = "usual",
) -> list[page.Section]:
    """Return the paper's sections after its figures: claims and cases.

    cases: of `paper_data`; judged: the paper's claims; limits: of metrics, whose zones are shown.
    """
    words = [CASES, *limits.words(measures(cases, units))]
    table = page.SectionContent(study_section.jobs_table(cases, limits, units), words, caveats)
    return [
        page.Section("claims", "The paper's claims", judged, "claims.html"),
        page.Section("cases", "The paper's cases", table),
    ]


def paper_data(stored: Stored, paper: PaperRuns) -> xr.Dataset:
    """Return the paper's cases as one study of eleven jobs, as `open_study` does."""
    names = [*analysis.paper_cases()]
    keys = [paper.stored[name].attrs["key"] if name in paper.stored else "" for name in names]
    axis = Axis("case", tuple(map(label_in_words, names)))
    fixed = Case.from_values({}).values()
    study = StoredStudy("paper", "", (axis,), tuple(keys), fixed, "", {}, "")
    return store.label_studies(stored, [study])


def label_in_words(name: str) -> str:
    """Return a label of `paper_cases` in words."""
    fault, _, clearance = name.partition(" ")
    return (
        f"{analysis.SPOKEN[fault]}, {clearance} mm" if clearance else f"{fault} model, no clearance"
    )


def draw_paper(
    runs: Mapping[str, xr.Dataset], units: Units, study: str = ""
) -> list[page.ShownFigure]:
    """Return every figure of the paper whose cases are there; study: whose machine it is, if any.

    Copies of this process make all of them, since their numbers take as long as their pictures.
    """

    def show(one: Figure) -> page.ShownFigure:
        drawn = one.make(runs, units=units)
        if study:
            drawn = drawn._replace(
                name=study_section.file_name(study, one.name), title=f"{study}: {one.title}"
            )
        return page.show_figure(drawn)

    known = [one for one in PAPER.values() if runs.keys() >= {*one.needs}]
    return draw_all([partial(show, one) for one in known])
