"""A study's machine without clearance beside its worn jobs, as numbers."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.analysis import healthy_twin
from compressor.cases import Case, CaseError
from compressor.digits import is_known
from compressor.metrics import BARRED, JOINTS
from compressor.report.answer import Points
from compressor.report.figures.sweep_data import Measure, measures
from compressor.report.page import (
    Cell,
    PageTable,
    TableRow,
    column_title,
    format_briefly,
    number,
)
from compressor.store import Stored
from compressor.units import Units

MAX_WORN = 4  # jobs that stand beside the machine without clearance
MAX_TRIED = 50  # jobs among which the loudest with clearance is looked for
FROM_IDEAL = ("rms_acceleration_deviation",)  # 0 without clearance, by its meaning


@dataclass(frozen=True)
class HealthyAndWorn:
    """The table of a machine without clearance and of its worn jobs, and what it says."""

    words: str
    table: PageTable


def compare_healthy(
    stored: Stored, data: xr.Dataset, units: Units = "usual"
) -> HealthyAndWorn | None:
    """Return the worn job of the greatest rms acceleration beside its machine without clearance.

    And jobs of the study that differ from it in clearances alone. None where no job that is ok has
    clearance, this version knows the case of none, or the machine without clearance fails. data: of
    `open_study`.
    """
    if "rms_acceleration" not in data:
        return None
    rms = data["rms_acceleration"].values.ravel()
    is_ok = (data["status"].values.ravel() == "ok") & np.isfinite(rms)
    ranked = np.argsort(np.where(is_ok, -rms, np.inf), kind="stable")[: min(is_ok.sum(), MAX_TRIED)]
    keys = data["key"].values.ravel()
    for place in ranked.tolist():
        case = case_at(stored, str(keys[place]))
        if case and case.joint != "none":
            others = [n for n in differing_in_clearance(data, place) if is_ok[n] and n != place]
            chosen = others[:: max(1, -(-len(others) // (MAX_WORN - 1)))]
            places = sorted([place, *chosen], key=lambda n: rms[n])
            return _compare(stored, data, case, places, units)
    return None


def differing_in_clearance(data: xr.Dataset, place: int) -> list[int]:
    """Return the jobs of a grid that differ from one in their clearances alone, by number."""
    status = data["status"]
    at = np.unravel_index(place, status.shape)
    numbers = np.arange(status.size).reshape(status.shape)
    free = [str(data[dim].attrs.get("case_key", "")) if dim in data.coords else ""
            for dim in status.dims]  # fmt: skip
    index = tuple(
        slice(None) if key.startswith("clearance_mm") else n
        for key, n in zip(free, at, strict=True)
    )
    return np.atleast_1d(numbers[index]).ravel().tolist()


def _compare(
    stored: Stored, data: xr.Dataset, case: Case, places: list[int], units: Units
) -> HealthyAndWorn | None:
    """Return the table: a row a metric, a column without clearance and one a job."""
    healthy = healthy_twin(xr.Dataset(attrs=case.attributes()), sensed=True)
    if healthy["status"].item() != "ok":
        return None
    names = Points(data)
    rows = []
    for measure in measures(data, units):
        if measure.variable in FROM_IDEAL or measure.variable not in healthy:
            continue
        sound = float(measure.of(healthy))
        if np.isnan(sound) or BARRED[measure.variable].contact:
            continue
        values, bars = measure.of(data).values.ravel(), measure.bar(data).values.ravel()
        cells = [Cell(column_title(measure)), Cell(number(sound), "number", sound)]
        cells += [_cell(measure, float(values[n]), float(bars[n]), sound) for n in places]
        rows.append(TableRow(cells))
    keys = data["key"].values.ravel()
    heads = [(names[n] or "this job") + describe_health(stored, str(keys[n])) for n in places]
    beside = "jobs that differ from it in clearances alone" if len(places) > 1 else "this job"
    words = (
        f"The machine without clearance, by the same model, beside {beside}; in parentheses: how "
        "many times as much. The job on the right has the greatest rms acceleration of those with "
        "clearance."
    )
    return HealthyAndWorn(words, PageTable(["metric", "without clearance", *heads], rows))


def _cell(measure: Measure, value: float, bar: float, sound: float) -> Cell:
    """Return a metric of a worn job, and how many times that of the healthy machine it is."""
    text = format_briefly(measure, value, bar)
    is_sure = np.isnan(bar) or is_known(value, bar, measure.is_relative)
    if is_sure and sound > 0.0 and value > 0.0:
        times = value / sound
        text += f" ({times:.2f}×)" if times < 9.995 else f" ({times:.3g}×)"
    return Cell(text, "number", None if np.isnan(value) else value)


def describe_health(stored: Stored, key: str) -> str:
    """Return that a job counts as healthy, by its case's `healthy_clearance_mm`; else ""."""
    case = case_at(stored, key)
    is_given = case and any(getattr(case.healthy_clearance_mm, joint) > 0.0 for joint in JOINTS)
    return " (counts as healthy)" if case and is_given and case.worn_joint == "none" else ""


def case_at(stored: Stored, key: str) -> Case | None:
    """Return the case of a stored job; None where this version does not know it."""
    position = stored.position(key)
    if position is None:
        return None
    try:
        return Case.from_attribute(stored.rows.attributes(position)["case"])
    except CaseError:
        return None
