"""`compsim plot`: figures of one job, or of a study along one of its axes, as files."""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from compressor import analysis, cases, store
from compressor.metrics import JOINTS
from compressor.program import CompsimError
from compressor.reasons import remedy
from compressor.report.answer import name_jobs
from compressor.report.figures import FIGURES, SweptRow
from compressor.report.figures.drawing import as_csv, thin_places
from compressor.report.figures.pictures import render
from compressor.report.figures.sweep_data import name_in_words, shown_value
from compressor.report.figures.table import DrawnFigure
from compressor.report.study_section import KEY_DIGITS, file_name
from compressor.store import Stored, StoredStudy
from compressor.units import Units


class PlotError(CompsimError):
    """What cannot be drawn: why, and what to do about it."""


def choose_figures(what: Sequence[str], known: Sequence[str], thing: str) -> tuple[str, ...]:
    """Return the figures to draw: those requested, by default all.

    known: the names that `thing` has. Raises PlotError for another one.
    """
    wrong = [name for name in what if name not in known]
    if wrong:
        raise PlotError(f"{thing} has no figure {wrong[0]!r}: it has {', '.join(known)}")
    return tuple(what) or tuple(known)


def write_figure(path: Path, figure: go.Figure) -> Path:
    """Write a figure as its path ends, .png or .csv; return the path. Raises StoreError."""
    is_table = path.suffix == ".csv"
    store.publish(path, as_csv(figure).encode() if is_table else render(figure))
    return path


JOB, STUDY = FIGURES["job"], FIGURES["study"]
JOINT_WORDS = {
    "none": "no clearance", "both": "clearance at both joints",
    **{joint: f"clearance at the {analysis.SPOKEN[joint]}" for joint in JOINTS},
}  # fmt: skip
TITLE_WIDTH = 105  # letters of a line of a figure's title
MAX_ROWS = 200  # of a map
KEEP = "run it again with --set output.keep=series"


def write_plots(
    results: store.Folder,
    output: store.Folder,
    words: Sequence[str],
    what: Sequence[str] = (),
    over: str = "",
    at: Sequence[str] = (),
    units: Units = "usual",
) -> Iterator[tuple[Path, str]]:
    """Draw a study by its name, or a job by the words that `show` takes; yield files and captions.

    A study of one job has a job's figures, too. words: the beginning of a job's key, or a study,
    and `axis=value` until one job is left. what: names of figures, all by default. over: a study's
    axis by its key or the end of it; at: `key=value` of its other axes, else their first. Raises
    WrongName where they name none or several, PlotError where it cannot be drawn; StoreError where
    the store cannot be read or the files not be written.
    """
    stored, studies = store.read_store(results, warn=True), store.read_studies(results)
    named = {study.name: study for study in studies}
    of_job = bool(what) and {*what} <= {*JOB}
    if len(words) == 1 and words[0] in named and not (of_job and named[words[0]].jobs == 1):
        drawn = draw_study(stored, named[words[0]], what, over, at, units)
        stem = words[0]
    else:
        key = store.find_job(results, words, studies, stored.keys())
        if over or at:
            raise PlotError(f"{key} is one job: --over and --at are for studies")
        drawn = job_figures(stored, studies, key, what, units)
        stem = key[:KEY_DIGITS]
    for one in drawn:
        path = Path(output) / f"{file_name(stem, one.name)}.png"
        yield write_figure(path, one.figure), one.caption


def job_figures(
    stored: Stored, studies: Sequence[StoredStudy], key: str, what: Sequence[str], units: Units
) -> Iterator[DrawnFigure]:
    """Yield the figures of a job that has time series."""
    figures = choose_figures(what, [*JOB], f"job {key}")
    run = drawable(stored, studies, key)
    worn = bool(analysis.joints_with_clearance(run))
    has = {"clearance": worn, "gas": analysis.case_of(run).load == "gas"}
    why = {
        "clearance": "has ideal joints",
        "gas": "has no gas in its cylinder: cards are of load: gas",
    }
    for name in what:
        for lack in (need for need in JOB[name].needs if not has[need]):
            raise PlotError(f"job {key} {why[lack]}, so that there is no figure {name!r} of it")
    twin = analysis.healthy_twin(run) if worn else None
    try:
        for name in figures:
            if all(has[need] for need in JOB[name].needs):
                shown = JOB[name].make(run, twin, units=units)
                shown.figure.layout.title = job_title(studies, key, shown.title)
                yield shown
    except analysis.NoSeriesError as error:
        raise PlotError(f"job {key}: {error}") from error


def drawable(stored: Stored, studies: Sequence[StoredStudy], key: str) -> xr.Dataset:
    """Return the job's Dataset with time series; PlotError says what to do where there are none."""
    position = stored.position(key)
    if position is None:
        files = " ".join(study.case_file for study in studies if key in study.keys)
        raise PlotError(f"job {key} was not run yet: compsim run {files} -r {stored.folder}")
    status = stored.status_at(position)
    if status.status != "ok":
        cure = remedy(status.reason)
        raise PlotError(f"job {key} failed: {status.reason}: {stored.detail(position)}; {cure}")
    if not status.samples:
        raise PlotError(f"job {key} kept no time series: {KEEP}")
    return stored.job(key)


def draw_study(
    stored: Stored, study: StoredStudy, what: Sequence[str], over: str, at: Sequence[str],
    units: Units,
) -> Iterator[DrawnFigure]:  # fmt: skip
    """Yield the figures of a study along one axis."""
    if what and {*what} <= {*JOB}:
        first = study.keys[0][:KEY_DIGITS]
        raise PlotError(f"{study.name} is a study: for {what[0]} name a job, such as {first}")
    figures = choose_figures(what, [*STUDY], f"study {study.name}")
    over = choose_axis(stored.folder, study, over)
    jobs, title, where = select_jobs(stored.folder, study, over, at, MAX_ROWS)
    rows = [swept_row(stored, value, key) for value, key in jobs]
    if not any(row.shaking for row in rows):
        raise PlotError(nothing_to_draw(stored, study, rows))
    for name in figures:
        kept = keep_sensed(rows) if name == "cycles" else rows
        shown = STUDY[name].make(kept, title, units=units)
        shown.figure.layout.title = study_title(study, shown.title, where)
        yield shown._replace(note=spell_where(where))


def job_title(studies: Sequence[StoredStudy], key: str, what: str) -> str:
    """Return the title of a job's figure: its study, what is drawn, its place in the sweep."""
    for study in sorted(studies, key=lambda one: one.is_trial):  # a search may share the job
        if key in study.keys:
            point = [*cases.points(study)][study.keys.index(key)]
            values = [f"{axis} {shown_value(value)}" for axis, value in point.items()]
            return title_figure(
                study.title or study.name, what, [*values, f"job {key[:KEY_DIGITS]}"]
            )
    return title_figure(f"job {key[:KEY_DIGITS]}", what)


def study_title(study: StoredStudy, what: str, where: Sequence[str]) -> str:
    """Return the title of a study's figure: what is drawn, which joints are worn, the speed."""
    swept = {axis.key for axis in study.axes}
    parts = []
    if "joint" not in swept:
        parts.append(JOINT_WORDS[study.fixed["joint"]])
    if "machine.speed_rpm" not in swept:
        parts.append(f"{study.fixed['machine']['speed_rpm']:g} rpm")
    return title_figure(study.title or study.name, what, [*parts, *where])


def title_figure(machine: str, what: str, parts: Sequence[str] = ()) -> str:
    """Return a figure's title: the machine by its title or study, what is drawn, and where."""
    texts = f"{machine}: {what}", "; ".join(parts)
    return "<br>".join(line for text in texts for line in wrap(text, TITLE_WIDTH))


def axis_words(key: str) -> str:
    """Return the title of an axis of a study: its name and unit, such as clearance (mm)."""
    row = cases.row_of(key)
    unit = (row.unit if row else "") or ""
    name = name_in_words(store.coordinate_names([key])[key], unit)
    return f"{name} ({unit})" if unit else name


MAX_PAGE_ROWS = 12  # of a study's jobs whose series a page reads


def draw_for_page(
    stored: Stored, study: StoredStudy, data: xr.Dataset, units: Units
) -> Iterator[DrawnFigure]:
    """Yield what a page draws of a study over the crank angle; data: as `open_study` gives it.

    The vibration along an axis, and the revolution of the job where it is greatest, of all in the
    study. Nothing of a study that kept no series.
    """
    over = choose_axis(stored.folder, study, "")
    jobs, axis, where = select_jobs(stored.folder, study, over, (), MAX_PAGE_ROWS)
    rows = keep_sensed([swept_row(stored, value, key, ["cycle"]) for value, key in jobs])
    known = sum(row.cycle is not None for row in rows)
    if not known:
        return
    if known > 1:
        title = f"vibration over crank angle and {axis}"
        shown = STUDY["cycles"].make(rows, axis, units=units)
        yield shown._replace(title=title, note=spell_where(where))
    run, value = find_loudest(stored, data)
    case = analysis.case_of(run)
    value += f" ({JOINT_WORDS[case.joint]})"
    twin = analysis.healthy_twin(run) if case.joint != "none" else None
    shown = JOB["analyst"].make(run, twin, units=units)
    note = " Of the study's jobs with series it has the greatest vibration." * (study.jobs > 1)
    yield shown._replace(title=f"{shown.title}, {value}", note=note)
    if case.load == "gas":
        shown = JOB["cards"].make(run, twin, units=units)
        yield shown._replace(title=f"{shown.title}, {value}")


def find_loudest(stored: Stored, data: xr.Dataset) -> tuple[xr.Dataset, str]:
    """Return the job of a study whose vibration is greatest, and its swept values in words.

    Of those whose revolution can be read, at least one; by the sensor where any job has one.
    """
    sensed = "sensor_peak" in data and bool(data["sensor_peak"].notnull().any())
    peaks = data["sensor_peak" if sensed else "peak_acceleration"].values.ravel()
    for n in np.argsort(-peaks, kind="stable"):  # nan last
        key = str(data["key"].values.flat[n])
        if swept_row(stored, "", key, ["cycle"]).cycle:
            break
    return stored.job(key), name_jobs(data)[n] or key[:KEY_DIGITS]


def keep_sensed(rows: Sequence[SweptRow]) -> list[SweptRow]:
    """Return rows without the revolutions of jobs that have no sensor, where others have one.

    A sensor's record and the crosshead's acceleration are not to be compared.
    """
    if len({row.cycle.is_sensed for row in rows if row.cycle}) < 2:
        return [*rows]
    return [
        row if row.cycle is None or row.cycle.is_sensed
        else replace(row, cycle=None, problem="no sensor")
        for row in rows
    ]  # fmt: skip


def nothing_to_draw(stored: Stored, study: StoredStudy, rows: Sequence[SweptRow]) -> str:
    """Return why no job of a study can be drawn, and what to do about it."""
    problems = {row.problem for row in rows}
    cures = {
        "failed": f"compsim status -r {stored.folder} shows why",
        "not run": f"compsim run {study.case_file} -r {stored.folder}",
        "no series": KEEP,
        "damaged": f"compsim verify -r {stored.folder} names the file",
        "too short": "run it with a longer solve.duration_rev",
    }
    text = "; ".join(f"{problem}: {cures[problem]}" for problem in sorted(problems))
    return f"no job of {study.name} can be drawn: {text}"


def choose_axis(folder: store.Folder, study: StoredStudy, name: str) -> str:
    """Return the key of the axis that is meant: by default a clearance, the speed, or the first."""
    if name:
        return store.find_axis(folder, study, name).key
    keys = [axis.key for axis in study.axes]
    ranked = [key for word in ("clearance", "speed") for key in keys if word in key]
    return (ranked or keys or ["job"])[0]


def select_jobs(
    folder: store.Folder, study: StoredStudy, over: str, at: Sequence[str], most: int
) -> tuple[list[tuple[str, str]], str, list[str]]:
    """Return (value, key) of jobs along an axis in its order, its title, the other axes in words.

    At most `most`. Where both clearances vary, or words such as a law, a value is all of them: one
    alone would seem to be the cause of what another does. Raises PlotError where `at` names no job,
    the axis itself, or an axis twice.
    """
    fixed = {}
    for text in at:
        key, value = store.find_value(folder, study, text)
        if key == over:
            raise PlotError(f"--at {text}: needs key=value of an axis other than {over}")
        if key in fixed:
            raise PlotError(f"--at {text}: {key} is given twice; a figure has one value of it")
        fixed[key] = value
    if study.is_grid:
        first = {axis.key: axis.values[0] for axis in study.axes if axis.key != over}
        fixed = first | fixed
    varied = [axis.key for axis in study.axes if axis.key not in (over, *fixed)]
    jobs = [
        (point, key)
        for point, key in zip(cases.points(study), study.keys, strict=True)
        if all(point.get(name) == value for name, value in fixed.items())
    ]
    if not jobs:
        raise PlotError(f"no job of {study.name} has {', '.join(at)}")
    group = over.partition(".")[0]
    beside = [
        key
        for key in varied
        if key.partition(".")[0] == group == "clearance_mm" != over
        or any(isinstance(point.get(key), str) for point, _ in jobs)
    ]
    numbers = [isinstance(point.get(over), int | float) for point, _ in jobs]
    # a job without a clearance comes first
    jobs.sort(key=lambda job: n if isinstance(n := job[0].get(over), int | float) else -math.inf)
    values = ", ".join(f"{name} {shown_value(value)}" for name, value in fixed.items())
    where = [values] * bool(values)
    order = f"in the order of {over}; " * any(numbers)
    vary = "vary" if varied[1:] else "varies"
    where += [f"{order}{', '.join(varied)} {vary} with it"] * bool(varied)
    if len(jobs) > most:
        where.append(f"{most} of {len(jobs)} jobs, evenly chosen")
    names = [" / ".join(shown_value(point.get(name, "")) for name in (over, *beside))
             for point, _ in jobs]  # fmt: skip
    title = " / ".join(map(axis_words, (over, *beside)))
    return [(names[n], jobs[n][1]) for n in thin_places(len(jobs), most)], title, where


def spell_where(where: Sequence[str]) -> str:
    """Return the sentence on which jobs of a study are drawn, if not all."""
    return f" Here {'; '.join(where)}." if where else ""


READ = {"cycle": analysis.read_cycle, "shaking": analysis.shaking}  # parts of a `SweptRow`


def swept_row(stored: Stored, value: str, key: str, parts: Collection[str] = (*READ,)) -> SweptRow:
    """Return one job as a row of a figure over an axis, with some parts, or why it has none."""
    name = value or key[:KEY_DIGITS]
    status = stored.status(key)
    if status is None or status.status != "ok" or not status.samples:
        problem = "not run" if status is None else "failed" if status.reason else "no series"
        return SweptRow(name, problem=problem)
    try:
        run = stored.job(key)
        found: dict[str, Any] = {part: READ[part](run) for part in parts}
    except store.DamagedFile:
        return SweptRow(name, problem="damaged")
    except analysis.NoSeriesError:
        return SweptRow(name, problem="too short")
    return SweptRow(name, **found, chaotic=run.attrs.get("regime") == "chaotic")
