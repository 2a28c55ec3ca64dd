"""A study's machine without clearance beside its worn jobs, as numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.analysis import healthy_twin
from compressor.cases import Case, stands_for
from compressor.digits import is_known
from compressor.metrics import BARRED, JOINTS
from compressor.report.answer import FORCE, KNOCK, Points, read_numbers
from compressor.report.figures.sweep_data import MEASURES, Measure, measures, swept_values
from compressor.report.page import (
    Cell,
    PageTable,
    TableRow,
    column_title,
    format_measure,
    number,
    unbroken,
)
from compressor.store import Stored
from compressor.units import Units

MAX_WORN = 10  # jobs that stand beside the machine without clearance
CLEARANCES = {"clearance_mm", *stands_for("clearance_mm")}
MAX_TRIED = 50  # jobs among which the worst with clearance is looked for
SENSOR = "sensor_peak"
HEARD = 2.0  # times the sensor peak without clearance: what a plant would look into
FROM_IDEAL = ("rms_acceleration_deviation",)  # 0 without clearance, by its meaning


@dataclass(frozen=True)
class HealthyAndWorn:
    """The table of a machine without clearance and of its worn jobs, and what it says."""

    words: str
    table: PageTable


def compare_healthy(
    stored: Stored, data: xr.Dataset, units: Units = "usual"
) -> HealthyAndWorn | None:
    """Return the worn job of the greatest contact force beside its machine without clearance.

    And jobs of the study that differ from it in clearances alone, by clearance. None where no job
    that is ok has clearance, this version knows the case of none, or the machine without clearance
    fails. data: of `open_study`.
    """
    if "max_penetration" not in data:
        return None
    is_worn = abs(data["max_penetration"]) > 0.0  # exactly 0 in an ideal joint
    has_clearance = (is_worn.any("joint") & (data["status"] == "ok")).values.ravel()
    force = np.full(has_clearance.size, np.nan)
    for measure in measures_of(FORCE, data):
        worn = is_worn.sel(joint=measure.joint).values.ravel()
        force = np.fmax(force, np.where(worn, known_values(measure, data), np.nan))
    jobs = np.flatnonzero(has_clearance)
    ranked = jobs[np.argsort(-force[jobs], kind="stable")]  # what is not known comes last
    rows = stored.find([*map(str, data["key"].values.ravel())]).tolist()
    for place in ranked[:MAX_TRIED].tolist():
        if case := stored.case_at(rows[place]):
            alike = [n for n in differing_in_clearance(data, place) if has_clearance[n]]
            greatest = {"contact force in a worn joint": place} if force[place] > 0.0 else {}
            for measure in measures_of(SENSOR, data):
                peaks = known_values(measure, data)[alike]
                if np.isfinite(peaks).any():
                    greatest["sensor peak"] = alike[int(np.nanargmax(peaks))]
            places = choose_jobs(alike, [place, *greatest.values()])
            are_all = len(places) == len(alike)
            return _compare(stored, data, case, places, greatest, are_all, units)
    return None


def measures_of(name: str, data: xr.Dataset) -> list[Measure]:
    """Return the measures of a metric, of each joint or axis; none where the data have it not."""
    return [one for one in MEASURES if one.variable == name and name in data]


def known_values(measure: Measure, data: xr.Dataset) -> np.ndarray:
    """Return a measure of a study's jobs in a row, nan where its error bar is as long as it."""
    values, bars = measure.of(data), measure.bar(data)
    return np.where(np.isnan(bars) | (bars < values), values, np.nan).ravel()


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


def choose_jobs(jobs: Sequence[int], needed: Sequence[int]) -> list[int]:
    """Return the first, the last and the needed jobs, and others between, MAX_WORN in all."""
    chosen = {jobs[0], jobs[-1], *needed}
    rest = [job for job in jobs if job not in chosen]
    if room := max(0, MAX_WORN - len(chosen)):
        chosen.update(rest[len(rest) // (2 * room) :: max(1, len(rest) // room)][:room])
    return [job for job in jobs if job in chosen]


def _compare(
    stored: Stored,
    data: xr.Dataset,
    case: Case,
    places: list[int],
    greatest: Mapping[str, int],
    are_all: bool,
    units: Units,
) -> HealthyAndWorn | None:
    """Return the table: a row a metric, a column without clearance and one a job.

    greatest: jobs by what is greatest in them, in words; are_all: no job like these is left out.
    """
    healthy = healthy_twin(xr.Dataset(attrs=case.attributes()))
    if healthy is None:
        return None
    names = Points(data)
    rows = []
    for measure in measures(data, units):
        if measure.variable in FROM_IDEAL or measure.variable not in healthy:
            continue
        sound = float(measure.of(healthy))
        if np.isnan(sound) or BARRED[measure.variable].contact:
            continue
        values, bars = measure.of(data).ravel(), measure.bar(data).ravel()
        cells = [Cell(column_title(measure)), Cell(number(sound), "number", sound)]
        cells += [_cell(measure, float(values[n]), float(bars[n]), sound) for n in places]
        rows.append(TableRow(cells))
    keys = data["key"].values.ravel()
    heads = [(names[n] or "this job") + describe_health(stored, str(keys[n])) for n in places]
    beside = "this job"
    if len(places) > 1:
        peaks = "".join(f"; the greatest {what} is at {names[n]}" for what, n in greatest.items())
        beside = (
            f"all jobs that differ in clearances alone, from the least on{peaks}"
            if are_all
            else f"{len(places)} jobs that differ in clearances alone, from the least on: those of "
            "the least and the greatest clearance"
            + f" and of the greatest {' and '.join(greatest)}" * bool(greatest)
            + f", and others between{peaks}; the table of all jobs has the rest"
        )
    words = (
        "The machine without clearance, by the same model: its joints are ideal, also without oil "
        "film. A sound bearing has some clearance; jobs that count as healthy are marked so. "
        f"Beside it {beside}. In parentheses: how many times as much as without clearance."
        + describe_noise(data, healthy, places)
    )
    return HealthyAndWorn(words, PageTable(["metric", "without clearance", *heads], rows, 2))


def describe_noise(data: xr.Dataset, healthy: xr.Dataset, places: Sequence[int]) -> str:
    """Return that a sensor hears worn jobs of which none knocks, else ""."""
    if not {SENSOR, KNOCK} <= {*data} or SENSOR not in healthy:
        return ""
    (peak,) = measures_of(SENSOR, data)
    knocks = [read_numbers(m, data)[0].ravel()[places] for m in measures_of(KNOCK, data)]
    times = np.fmax.reduce(known_values(peak, data)[places]) / float(peak.of(healthy))
    if not times >= HEARD or not (np.fmax.reduce(knocks) <= BARRED[KNOCK].limit).all():
        return ""
    return (
        f" No joint knocks, but the sensor's peak is up to {times:.2g} times as high: blows that "
        "are small beside the force in a joint may still be heard."
    )


def _cell(measure: Measure, value: float, bar: float, sound: float) -> Cell:
    """Return a metric of a worn job, and how many times that of the healthy machine it is."""
    text = unbroken(format_measure(measure, value, bar))
    is_sure = np.isnan(bar) or is_known(value, bar, measure.is_relative)
    if is_sure and sound > 0.0 and value > 0.0:
        times = value / sound
        text += f" ({times:.2f}×)" if times < 9.995 else f" ({times:.3g}×)"
    return Cell(text, "number", None if np.isnan(value) else value)


def describe_health(stored: Stored, key: str) -> str:
    """Return that a job counts as healthy, by its case's `healthy_clearance_mm`; else ""."""
    position = stored.position(key)
    case = None if position is None else stored.case_at(position)
    is_given = case and any(getattr(case.healthy_clearance_mm, joint) > 0.0 for joint in JOINTS)
    return " (counts as healthy)" if case and is_given and case.worn_joint == "none" else ""
