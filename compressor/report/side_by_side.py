"""A study's machine without clearance beside its worn jobs, as numbers."""

import numpy as np
import xarray as xr

from compressor.analysis import healthy_twin
from compressor.cases import Case, stands_for
from compressor.digits import is_known
from compressor.metrics import BARRED
from compressor.report import page
from compressor.report.answer import FORCE, name_jobs
from compressor.report.figures.drawing import thin_places
from compressor.report.figures.sweep_data import MEASURES, Measure, measures, swept_values
from compressor.store import Stored
from compressor.units import Units

MAX_WORN = 10  # jobs, and the worst, that stand beside the machine without clearance
CLEARANCES = {"clearance_mm", *stands_for("clearance_mm")}
FROM_IDEAL = ("rms_acceleration_deviation",)  # 0 without clearance, by its meaning


def compare_healthy(
    stored: Stored, data: xr.Dataset, units: Units = "usual"
) -> page.SectionContent | None:
    """Return the worn job of the greatest contact force beside its machine without clearance.

    And jobs of the study that differ from it in clearances alone, by clearance. None where no job
    that is ok has clearance, this version does not know its case, or the machine without clearance
    fails. data: of `open_study`.
    """
    if "max_penetration" not in data:
        return None
    is_worn = abs(data["max_penetration"]) > 0.0  # exactly 0 in an ideal joint
    has_clearance = (is_worn.any("joint") & (data["status"] == "ok")).values.ravel()
    force = np.full(has_clearance.size, np.nan)
    for measure in (one for one in MEASURES if one.variable == FORCE and FORCE in data):
        worn = is_worn.sel(joint=measure.joint).values.ravel()
        known = measure.known(measure.of(data), measure.bar(data)).ravel()
        force = np.fmax(force, np.where(worn, known, np.nan))
    jobs = np.flatnonzero(has_clearance)
    if not jobs.size:
        return None
    place = int(jobs[np.argmax(np.nan_to_num(force[jobs], nan=-1.0))])  # of known ones, if any
    case = stored.case_at(stored.find([str(data["key"].values.flat[place])])[0])
    if case is None:
        return None
    alike = [n for n in differing_in_clearance(data, place) if has_clearance[n]]
    some = {place, *(alike[n] for n in thin_places(len(alike), MAX_WORN))}
    places = [n for n in alike if n in some]
    words = "this job"
    if len(alike) > 1:
        count = "all" if len(places) == len(alike) else f"{len(places)} of {len(alike)}"
        words = f"{count} jobs that differ in clearances alone, from the least on"
    if len(alike) > 1 and force[place] > 0.0:
        at = name_jobs(data)[place]
        words += f"; the greatest contact force in a worn joint is at {at}"
    return _compare(data, case, places, words, units)


def differing_in_clearance(data: xr.Dataset, place: int) -> list[int]:
    """Return the jobs of a study that differ from one in clearances alone, from the least on."""
    alike = np.ones(data["status"].size, bool)
    clearances = []
    for name, values in swept_values(data).items():
        if data[name].attrs.get("case_key", name) in CLEARANCES:
            clearances.append(np.nan_to_num(values))
        else:
            is_none = values != values  # nan
            alike &= (values == values[place]) | (is_none & is_none[place])
    jobs = np.flatnonzero(alike).tolist()
    return sorted(jobs, key=lambda n: [values[n] for values in clearances])


def _compare(
    data: xr.Dataset, case: Case, places: list[int], beside: str, units: Units
) -> page.SectionContent | None:
    """Return the table: a row a metric, a column without clearance and one a job.

    beside: which jobs these are, in words.
    """
    healthy = healthy_twin(xr.Dataset(attrs=case.attributes()))
    if healthy is None:
        return None
    names = name_jobs(data)
    rows = []
    for measure in measures(data, units):
        if measure.variable in FROM_IDEAL or measure.variable not in healthy:
            continue
        sound = float(measure.of(healthy))
        if np.isnan(sound) or BARRED[measure.variable].contact:
            continue
        values, bars = measure.of(data).ravel(), measure.bar(data).ravel()
        cells = [
            page.Cell(page.column_title(measure)),
            page.Cell(page.number(sound), "number", sound),
        ]
        cells += [_cell(measure, float(values[n]), float(bars[n]), sound) for n in places]
        rows.append(page.TableRow(cells))
    heads = [names[n] or "this job" for n in places]
    words = (
        "The machine without clearance, by the same model: its joints are ideal, also without oil "
        "film; a sound bearing has some clearance. "
        f"Beside it {beside}. In parentheses: how many times as much as without clearance."
    )
    if "sensor_peak" in data:
        words += (
            " Ideal joints pass on each kink of the load, which oil and clearance soften: a sensor "
            "may read more without clearance than with a little."
        )
    table = page.PageTable(["metric", "without clearance", *heads], rows)
    return page.SectionContent(table, [words])


def _cell(measure: Measure, value: float, bar: float, sound: float) -> page.Cell:
    """Return a metric of a worn job, and how many times that of the healthy machine it is."""
    text = page.unbroken(page.format_measure(measure, value, bar))
    is_sure = np.isnan(bar) or is_known(value, bar, measure.is_relative)
    if is_sure and sound > 0.0 and value > 0.0:
        times = value / sound
        text += f" ({times:.2f}×)" if times < 9.995 else f" ({times:.3g}×)"
    return page.Cell(text, "number", None if np.isnan(value) else value)
