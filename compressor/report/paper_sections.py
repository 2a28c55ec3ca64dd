"""The sections of a report about the paper: figures, cases, claims, other machines, diagnosis."""

import itertools
import math
import shlex
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from compressor.analysis import (
    CLEARANCES,
    FAULTS,
    LOADS,
    ORDER,
    SPOKEN,
    Claim,
    Shaking,
    caption,
    case_of,
    cases_of,
    claims,
    comparisons,
    diagnosis_caption,
    label,
    paper_cases,
    settled_part,
    shaking,
)
from compressor.cases import Case, CaseError, points, table, value_in
from compressor.report.figures import FIGURES, Drawing
from compressor.report.figures import Figure as PaperFigure
from compressor.report.figures.diagnosis import (
    Shakings,
    draw_diagnosis_angles,
    draw_diagnosis_orbits,
    draw_diagnosis_spectra,
)
from compressor.report.figures.sweep_data import MEASURES, measures
from compressor.report.inputs import spelt
from compressor.report.page import (
    Cell,
    PageTable,
    Plate,
    Section,
    TableRow,
    column_title,
    job_row,
    measured_cell,
    number_cell,
    status_text,
    value_cell,
)
from compressor.report.study_section import KEY_DIGITS, file_name
from compressor.store import DamagedFile, Folder, Stored, StoredStudy, StoreWarning
from compressor.units import Units


@dataclass(frozen=True)
class PaperRuns:
    """The stored runs of the paper's cases by label; `usable` ones are whole and have series."""

    stored: dict[str, xr.Dataset]
    usable: dict[str, xr.Dataset]
    absent: dict[str, str]  # label -> why it is not usable


def find_paper_runs(stored: Stored, studies: Sequence[StoredStudy]) -> PaperRuns:
    """Return the runs with the physics of the paper's cases."""
    return find_runs(stored, studies, paper_cases())


def is_of_paper(stored: Stored, study: StoredStudy) -> bool:
    """Return whether all stored jobs of a study, and at least one, are cases of the paper."""
    count = sum(at >= 0 for at in stored.rows.find([*study.keys]))
    labels = {case.physics_key for case in paper_cases().values()}
    return 0 < count == len(paper_candidates(stored, [study], labels))


def repeats_paper(study: StoredStudy, paper: PaperRuns) -> bool:
    """Return whether all of a study is told as the paper's cases: whole faults, and no notes."""
    names = {name for name, run in paper.stored.items() if run.attrs["key"] in study.keys}
    faults = [{label(fault, clearance) for clearance in CLEARANCES} for fault in FAULTS]
    is_whole = all(not fault & names or fault <= names for fault in faults)
    shown = {run.attrs["key"] for run in paper.stored.values()}
    return is_whole and shown.issuperset(study.keys) and not (study.title or study.notes)


def find_runs(
    stored: Stored, studies: Sequence[StoredStudy], cases: Mapping[str, Case]
) -> PaperRuns:
    """Return the studies' runs with the physics of some cases by label.

    Of several, the most exact.
    """
    labels = {case.physics_key: name for name, case in cases.items()}
    found: dict[str, xr.Dataset] = {}
    damaged = set()
    for key in paper_candidates(stored, studies, labels):
        name = labels[str(stored.rows.word("physics_key")[stored.position(key)])]
        try:
            run = stored.job(key)
        except DamagedFile as error:
            warnings.warn(str(error), StoreWarning, stacklevel=2)
            damaged.add(name)
            continue
        if name not in found or rank(run) > rank(found[name]):
            found[name] = run
    usable = {name: run for name, run in found.items() if rank(run)[:2] == (True, True)}
    absent = {n: why_absent(found.get(n), n in damaged) for n in labels.values() if n not in usable}
    return PaperRuns({n: found[n] for n in labels.values() if n in found}, usable, absent)


def paper_candidates(
    stored: Stored, studies: Sequence[StoredStudy], physics: Collection[str]
) -> list[str]:
    """Return the keys of the studies' stored jobs that simulate some physics.

    In the studies' order, each once. physics: the physics keys.
    """
    keys = list(dict.fromkeys(key for study in studies for key in study.keys))
    positions = stored.rows.find(keys)
    physics_keys = np.array([*physics], "S")
    same = np.isin(stored.rows.bytes_of["physics_key"], physics_keys)
    return [key for key, at in zip(keys, positions, strict=True) if at >= 0 and same[at]]


def rank(run: xr.Dataset) -> tuple[bool, bool, float]:
    """Return the rank of a run: greater is better, among runs of the same physics."""
    return str(run["status"].item()) == "ok", "time" in run.dims, -run.attrs.get("rtol", math.inf)


def why_absent(run: xr.Dataset | None, damaged: bool) -> str:
    """Return why a case of the paper cannot be drawn."""
    if run is None:
        return "its file is damaged" if damaged else "not stored"
    if str(run["status"].item()) != "ok":
        return f"failed: {run['reason'].item()}"
    return "stored without its time series"


def case_files(labels: Collection[str]) -> dict[str, str]:
    """Return the case files that give some of the paper's cases: the text of each by its name."""
    files = {f"{name}.yaml": f"load: {load}" for name, load in LOADS.items() if name in labels}
    for fault in FAULTS:
        sizes = [f"{c:g}" for c in CLEARANCES if label(fault, c) in labels]
        if sizes:
            text = f"joint: {fault}\nclearance_mm: [{', '.join(sizes)}]"
            files[f"{fault.replace('_', '-')}.yaml"] = text
    return files


@dataclass(frozen=True)
class Difference:
    """A key of a case file whose value is not the default; both values with their unit."""

    key: str
    phrase: str  # what the key is; empty for a whole group
    value: str
    default: str

    @property
    def said(self) -> str:
        """Return the difference in words."""
        phrase = f", {self.phrase}" if self.phrase else ""
        return f"{self.key}{phrase}: {self.value} (default: {self.default})"


def differences(case: Case, besides: tuple[str, ...] = ()) -> list[Difference]:
    """Return the keys in which a case differs from the default case, in a file's order.

    Only its physics and span count. A value that follows from others, such as the inertia of a
    uniform rod, is none of its own, nor is one that means the same as the default. besides: groups
    or keys at the top to leave out.
    """
    values, defaults = case.values(), Case().values()
    found = []
    for key, value in leaves(values, defaults):
        default = value_in(defaults, key) if "." in key else defaults.get(key)
        if key.partition(".")[0] in besides or value == default or follows(case, values, key):
            continue
        row = table().get(key)
        unit, phrase = (row.unit, row.phrase) if row else ("", "")
        found.append(Difference(key, phrase, spelt(value, unit), spelt(default, unit)))
    return found


def leaves(values: Mapping[str, Any], defaults: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the dotted keys and values.

    A group that the default case lacks, or has alone, is one value.
    """
    for name in dict.fromkeys([*defaults, *values]):
        value, default = values.get(name), defaults.get(name)
        if isinstance(value, Mapping) and isinstance(default, Mapping):
            yield from ((f"{name}.{inner}", item) for inner, item in value.items())
        else:
            yield name, value


def follows(case: Case, values: Mapping[str, Any], key: str) -> bool:
    """Return whether a case stays the same without a key.

    The key then follows from the others, or is not read.
    """
    group, _, name = key.rpartition(".")
    rest: dict[str, Any] = {n: item for n, item in values.items() if n != key}
    if group:
        rest[group] = {n: item for n, item in values[group].items() if n != name}
    try:
        return Case.resolve(rest).physics_key == case.physics_key
    except CaseError:
        return False  # what is left fits no more


WORN_LABELS = tuple(label(fault, c) for fault in FAULTS for c in CLEARANCES)
IDEAL = ("design", "typical")
# what the motion of a worn machine depends on; the gas does not push with the spring load
MACHINE = ("machine", "spring", "contact", "friction")
REVOLUTION_ROUNDING = 1e-6  # revolutions: rounding of a whole one
SET = tuple(figure for figure in FIGURES if {*WORN_LABELS} & {*figure.needs})
NO_IDEAL = (
    "Figures {} are not drawn: no run without clearance of a machine with this motion is stored on "
    "the same output grid. A block with joint: none in the case file gives it."
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
class FigurePair:
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
    pairs: Sequence[FigurePair]
    claims: Sequence[object]

    @property
    def beside(self) -> bool:
        """Return whether any figure has a counterpart."""
        return any(pair.first for pair in self.pairs)


def second_sets(
    stored: Stored, studies: Sequence[StoredStudy], paper: PaperRuns
) -> dict[str, SecondSet]:
    """Return the second set of each study that has one, by the study's name."""
    found = {study.name: second_set(stored, study, paper) for study in studies}
    return {name: one for name, one in found.items() if one}


def second_set(stored: Stored, study: StoredStudy, paper: PaperRuns) -> SecondSet | None:
    """Return a study's set of the paper's worn cases in another machine, or None.

    None unless it holds all nine worn cases of just one other machine. They must be alike in all
    but the fault, have ended well, and have time series that are `comparable`.
    """
    machines = [*itertools.islice(other_machines(stored, study), 2)]
    if len(machines) != 1:
        return None  # a sweep over machines is drawn as one
    (cases,) = machines
    runs = find_runs(stored, [study], cases)
    if not runs.usable.keys() >= {*WORN_LABELS} or not comparable(runs.usable.values()):
        return None
    case = case_of(runs.usable[WORN_LABELS[-1]])
    drawn, judged = (
        default_machine_runs(case, paper, loads) | runs.usable for loads in (False, True)
    )
    keys = frozenset(run.attrs["key"] for run in runs.stored.values())
    return SecondSet(study.name, case, keys, drawn, judged)


def other_machines(stored: Stored, study: StoredStudy) -> Iterator[dict[str, Case]]:
    """Yield `cases_of` each machine but the default one whose nine worn cases a study holds."""
    swept = {value for axis in study.axes for value in axis.values}
    if not swept >= {*FAULTS, *CLEARANCES}:
        return
    positions = stored.rows.find(study.keys)
    stored_keys = {*stored.rows.bytes_of["physics_key"][positions[positions >= 0]].tolist()}
    ideals = set()
    for position, point in zip(positions, points(study), strict=True):
        # the first of the nine stands for all
        if position < 0 or not {FAULTS[0], CLEARANCES[0]} <= {*point.values()}:
            continue
        case = stored.case_at(position)
        if case is None:
            continue
        cases = cases_of(case)
        if not cases.keys() >= {"design", *WORN_LABELS}:
            continue
        ideal = cases["design"].physics_key
        if ideal in ideals or not is_other(case):
            continue
        ideals.add(ideal)
        if all(cases[name].physics_key.encode() in stored_keys for name in WORN_LABELS):
            yield cases


def is_other(case: Case) -> bool:
    """Return whether a case is of another machine than the default one, whatever its span."""
    return any(getattr(case, group) != getattr(Case(), group) for group in MACHINE)


def comparable(runs: Collection[xr.Dataset]) -> bool:
    """Return whether runs can be drawn and judged together.

    They settle at one crank angle and have samples at the same ones, for a revolution or more, and
    so close that the lines above `ORDER`, which claim 7 reads, are resolved.
    """
    grids = [settled_part(run)["crank_angle"].values for run in runs]
    turns = (grids[0][-1] - grids[0][0]) / (2.0 * np.pi)
    fine = grids[0].size - 1 > 2 * (ORDER + 1) * turns
    return (
        turns > 1.0 - REVOLUTION_ROUNDING
        and fine
        and all(np.array_equal(g, grids[0]) for g in grids)
    )


def default_machine_runs(case: Case, paper: PaperRuns, loads: bool) -> dict[str, xr.Dataset]:
    """Return the default machine's ideal runs that hold for a case's machine as well.

    Without clearance masses, contact and friction are not read: the motion is that of equal crank,
    rod, speed and span. loads: whether the loads on the piston are to be the same, too.
    """
    default = Case()
    lengths = ("crank_radius_mm", "rod_length_mm", "speed_rpm")
    machine = replace(default.machine, **{name: getattr(case.machine, name) for name in lengths})
    unread = ["contact", "friction", "initial_offset_mm", "body", "sensor"]
    unread += [] if loads else ["gas", "spring"]
    others: dict[str, Any] = {name: getattr(default, name) for name in unread}
    try:  # its oil may not fit the default pin, nor its rod the default's mass centre
        same = replace(case, joint="none", lubricant=None, wear=None, machine=machine, **others)
    except CaseError:
        return {}
    twins, defaults = cases_of(same), paper_cases()
    return {
        load: paper.usable[load]
        for load in IDEAL
        if load in paper.usable
        and load in twins
        and twins[load].physics_key == defaults[load].physics_key
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
        FigurePair(counterparts.get(f"figure-{names[plate.name].number:02d}"), plate)
        for plate in plates
    ]
    lacking = [item for name, item in names.items() if name not in {p.name for p in plates}]
    numbers = ", ".join(str(item.number) for item in lacking)
    notes = [NO_IDEAL.format(numbers)] if lacking else []
    texts = [one.said for one in differences(found.case, ("name", "load", "joint", "clearance_mm"))]
    content = SecondSetContent(found.study, table, texts, notes, pairs, claims(found.judged))
    title = f"{found.study}: Figures 8 to 16 of another machine"
    return Section(second_anchor(found.study), title, "second_set.html", content)


@dataclass(frozen=True)
class MissingFigures:
    """What each figure lacks, and the case files and the command that give it."""

    figures: Sequence[str]
    case_files: Sequence[str]
    command: str


@dataclass(frozen=True)
class PaperCasesContent:
    """What a page says of the paper's cases: what to know beside their numbers, and a table."""

    caveats: list[str]
    table: PageTable


def paper_sections(
    paper: PaperRuns,
    plates: Sequence[Plate],
    judged: Sequence[Claim],
    caveats: list[str],
    units: Units = "usual",
) -> tuple[list[Section], list[Section]]:
    """Return the paper's sections: figures; and claims, cases, and the load's printed numbers.

    judged: the paper's claims.
    """
    figures = [Section("figures", "The paper's figures", "figures.html", plates)] if plates else []
    if not paper.stored:
        return figures, []
    title = "Spring and cam: what is printed, what follows"
    cases = PaperCasesContent(caveats, cases_table(paper, units))
    return figures, [
        Section("claims", "The paper's claims", "claims.html", judged),
        Section("cases", "The paper's cases", "cases.html", cases),
        Section("printed", title, "printed.html", printed_table()),
    ]


def cases_table(paper: PaperRuns, units: Units) -> PageTable:
    """Return a row for each of the paper's cases, stored or not."""
    known = [measures(run) for run in paper.stored.values()]
    shown = [m.read_in(units) for m in MEASURES if any(m in some for some in known)]
    head = ["case", "status", *map(column_title, shown), "energy residual", "rtol", "job"]
    rows = []
    for name in paper_cases():
        run = paper.stored.get(name)
        if run is None:
            cells = [Cell(label_in_words(name)), Cell("not stored"), *[Cell("")] * (len(head) - 2)]
            rows.append(TableRow(cells, "missing"))
            continue
        status, key = str(run["status"].item()), run.attrs["key"]
        regime = run.attrs.get("regime", "")
        start = [
            Cell(label_in_words(name)),
            Cell(status_text(status, run["reason"].item(), regime)),
        ]
        metrics = [measured_cell(m, *m.read(run)) for m in shown]
        residual = number_cell(float(run.get("energy_residual", math.nan)))
        tolerance = value_cell(run.attrs.get("rtol", ""))
        trust = [residual, tolerance, Cell(key[:KEY_DIGITS], "code")]
        rows.append(job_row([*start, *metrics, *trust], status, regime, key))
    return PageTable(head, rows)


def label_in_words(name: str) -> str:
    """Return a label of `paper_cases` in words."""
    fault, _, clearance = name.partition(" ")
    return f"{SPOKEN[fault]}, {clearance} mm" if clearance else f"{fault} model, no clearance"


def printed_table() -> PageTable:
    """Return the paper's numbers of the spring load beside those that follow from its equations."""
    rows = [
        TableRow([
            Cell(c.quantity),
            number_cell(math.nan if c.printed is None else c.printed, c.unit),
            number_cell(c.follows, c.unit),
            Cell(c.source),
        ])
        for c in comparisons()
    ]  # fmt: skip
    return PageTable(["quantity", "printed", "follows", "from"], rows)


def missing_sections(paper: PaperRuns, results: Folder) -> Iterator[Section]:
    """Yield the figures that could not be drawn, what they lack, and how to get it."""
    lacking = {
        f"Figure {item.number}, {item.title}": [name for name in item.needs if name in paper.absent]
        for item in FIGURES
    }
    figures = [
        f"{title}: " + "; ".join(f"{label_in_words(name)} ({paper.absent[name]})" for name in names)
        for title, names in lacking.items()
        if names
    ]
    if not figures:
        return
    files = case_files(paper.absent)
    texts = [f"# {name}\n{text}" for name, text in files.items()]
    command = f"compsim run {' '.join(files)} -r {shlex.quote(str(results))}"
    content = MissingFigures(figures, texts, command)
    yield Section("missing", "Figures that could not be drawn", "missing.html", content)


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
    table: PageTable
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


def force_table(found: Shakings) -> PageTable:
    """Return the rms of X above `ORDER` and its two shares, N, by fault and clearance."""
    head = ["clearance at", "clearance", "rms", "near changes of direction", "elsewhere"]
    healthy = found["design"]
    rows = [TableRow([Cell("none"), number_cell(0.0, "mm"), *forces(healthy)])]
    for fault in FAULTS:
        for clearance in CLEARANCES:
            one = found[label(fault, clearance)]
            size = Cell(f"{clearance:g} mm", "number", clearance)
            rows.append(TableRow([Cell(SPOKEN[fault]), size, *forces(one)]))
    return PageTable(head, rows)


def forces(one: Shaking) -> list[Cell]:
    """Return the whole and its shares, to 0.1 N."""
    values = one.spectrum.above, one.near_turns, one.elsewhere
    return [Cell(f"{value:.1f} N", "number", value) for value in values]
