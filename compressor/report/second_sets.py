"""Figures 8 to 16 and the claims again, for a study of the paper's faults in another machine."""

import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from compressor.analysis import (
    CLEARANCES,
    FAULTS,
    ORDER,
    caption,
    case_of,
    cases_of,
    claims,
    label,
    paper_cases,
    settled,
)
from compressor.cases import Case, CaseError, points
from compressor.report.differences import differences
from compressor.report.figures import FIGURES, Drawing
from compressor.report.figures import Figure as PaperFigure
from compressor.report.page import Plate, Section
from compressor.report.paper_runs import PaperRuns, find_runs
from compressor.report.study_section import file_name
from compressor.store import Stored, StoredStudy

WORN = tuple(label(fault, c) for fault in FAULTS for c in CLEARANCES)
LOADS = ("design", "typical")
# what the motion of a worn machine depends on; the gas does not push with the spring load
MACHINE = ("machine", "spring", "contact", "friction")
WHOLE = 1e-6  # revolutions: rounding of a whole one
SET = tuple(figure for figure in FIGURES if {*WORN} & {*figure.needs})
NO_IDEAL = (
    "{} are not drawn: no run without clearance of a machine with this motion is stored on the "
    "same output grid. A block with joint: none in the case file gives it."
)


@dataclass(frozen=True)
class SecondSet:
    """The paper's faults in another machine, all of one study.

    `case` is one of its worn cases; `drawn` are the runs for figures and `judged` those for claims,
    by label: the study's own, and where it has none without clearance the default machine's, if
    those are the same.
    """

    study: str
    case: Case
    keys: frozenset[str]  # of the study's jobs that it shows
    drawn: Mapping[str, xr.Dataset]
    judged: Mapping[str, xr.Dataset]


@dataclass(frozen=True)
class Pair:
    """A figure of a second set, and its counterpart in the first where that is drawn."""

    first: Plate | None
    second: Plate


@dataclass(frozen=True)
class SecondSetContent:
    """What a page says of a second set; `table`: the id of its study's section."""

    study: str
    table: str
    differences: Sequence[str]
    notes: Sequence[str]
    pairs: Sequence[Pair]
    claims: Sequence[object]

    @property
    def beside(self) -> bool:
        """Whether any figure has a counterpart."""
        return any(pair.first for pair in self.pairs)


def second_sets(
    stored: Stored, studies: Sequence[StoredStudy], paper: PaperRuns
) -> dict[str, SecondSet]:
    """Return the second set of each study that has one, by the study's name."""
    found = {study.name: second_set(stored, study, paper) for study in studies}
    return {name: one for name, one in found.items() if one}


def second_set(stored: Stored, study: StoredStudy, paper: PaperRuns) -> SecondSet | None:
    """Return a study's second set: None unless it holds all nine worn cases of just one other
    machine.

    They must be alike in all but the fault, have ended well, and have time series that are
    `comparable`.
    """
    machines = [*itertools.islice(other_machines(stored, study), 2)]
    if len(machines) != 1:
        return None  # a sweep over machines is drawn as one
    (cases,) = machines
    runs = find_runs(stored, [study], cases)
    if not runs.usable.keys() >= {*WORN} or not comparable(runs.usable.values()):
        return None
    case = case_of(runs.usable[WORN[-1]])
    drawn, judged = (borrowed(case, paper, loads) | runs.usable for loads in (False, True))
    keys = frozenset(run.attrs["key"] for run in runs.stored.values())
    return SecondSet(study.name, case, keys, drawn, judged)


def other_machines(stored: Stored, study: StoredStudy) -> Iterator[dict[str, Case]]:
    """Yield `cases_of` each machine but the default one whose nine worn cases a study holds."""
    swept = {value for axis in study.axes for value in axis.values}
    if not swept >= {*FAULTS, *CLEARANCES}:
        return
    positions = stored.rows.find(study.keys)
    held = {*stored.rows.columns["physics_key"][positions[positions >= 0]].tolist()}
    seen = set()
    for position, point in zip(positions, points(study), strict=True):
        # the first of the nine stands for all
        if position < 0 or not {FAULTS[0], CLEARANCES[0]} <= {*point.values()}:
            continue
        try:
            case = Case.from_attribute(stored.rows.attributes(position)["case"])
        except CaseError:
            continue  # of another version of compsim
        cases = cases_of(case)
        ideal = cases["design"].physics_key
        if ideal in seen or not is_other(case):
            continue
        seen.add(ideal)
        if all(cases[name].physics_key.encode() in held for name in WORN):
            yield cases


def is_other(case: Case) -> bool:
    """Return whether a case is of another machine than the default one, whatever its span."""
    return any(getattr(case, group) != getattr(Case(), group) for group in MACHINE)


def comparable(runs: Collection[xr.Dataset]) -> bool:
    """Return whether runs can be drawn and judged together.

    They settle at one crank angle and have samples at the same ones, for a revolution or more, and
    so close that the lines above `ORDER`, which claim 7 reads, can be told.
    """
    grids = [settled(run)["crank_angle"].values for run in runs]
    turns = (grids[0][-1] - grids[0][0]) / (2.0 * np.pi)
    fine = grids[0].size - 1 > 2 * (ORDER + 1) * turns
    return turns > 1.0 - WHOLE and fine and all(np.array_equal(g, grids[0]) for g in grids)


def borrowed(case: Case, paper: PaperRuns, loads: bool) -> dict[str, xr.Dataset]:
    """Return the default machine's runs without clearance, where those of a case's machine are the
    same.

    Without clearance masses, contact and friction are not read: the motion is that of equal crank,
    rod, speed and span. loads: whether the loads on the piston are to be the same, too.
    """
    default = Case()
    lengths = ("crank_radius_mm", "rod_length_mm", "speed_rpm")
    machine = replace(
        default.machine, **{name: getattr(case.machine, name) for name in lengths}
    )  # fmt: skip
    unread = ["contact", "friction", "initial_offset_mm", "body", "sensor"]
    unread += [] if loads else ["gas", "spring"]
    same = replace(case, machine=machine, **{name: getattr(default, name) for name in unread})
    twins, defaults = cases_of(same), paper_cases()
    return {
        load: paper.usable[load]
        for load in LOADS
        if load in paper.usable and twins[load].physics_key == defaults[load].physics_key
    }


def second_drawings(found: SecondSet) -> Iterator[tuple[str, str, str, Drawing]]:
    """Yield the names, headings, captions and drawings of the figures whose runs there are."""
    for item in SET:
        if found.drawn.keys() >= {*item.needs}:
            heading = f"Figure {item.number} of {found.study}: {item.title}"
            text = caption(item.number, found.drawn)
            yield second_name(found.study, item), heading, text, item.draw(found.drawn)


def second_name(study: str, figure: PaperFigure) -> str:
    """Return the name of a figure's files in a study's second set."""
    return file_name(study, f"figure-{figure.number:02d}")


def second_anchor(study: str) -> str:
    """Return the id of the section of a second set."""
    return file_name("figures", study)


def second_section(
    found: SecondSet, plates: Sequence[Plate], first: Sequence[Plate], table: str
) -> Section:
    """Return a second set on the page: how its machine differs, figures, and claims.

    plates: of `second_drawings`; first: of the first set; table: the id of the study's section.
    """
    counterparts = {plate.name: plate for plate in first}
    names = {second_name(found.study, item): item for item in SET}
    pairs = [
        Pair(counterparts.get(f"figure-{names[plate.name].number:02d}"), plate) for plate in plates
    ]
    lacking = [item for name, item in names.items() if name not in {p.name for p in plates}]
    notes = [NO_IDEAL.format(numbered(lacking))] if lacking else []
    said = [one.said for one in differences(found.case, ("name", "load", "joint", "clearance_mm"))]
    content = SecondSetContent(found.study, table, said, notes, pairs, claims(found.judged))
    title = f"{found.study}: Figures 8 to 16 of another machine"
    return Section(second_anchor(found.study), title, "second_set.html", content)


def numbered(figures: Sequence[PaperFigure]) -> str:
    """Return the figures by their numbers, such as `Figures 8, 11, 14`."""
    return f"Figures {', '.join(str(figure.number) for figure in figures)}"
