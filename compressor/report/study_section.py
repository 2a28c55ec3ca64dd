"""The section of a report about a user's own study: its failures, its table and its figures."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.outcome import Regime
from compressor.reasons import remedy
from compressor.report.figures.sweep_metric import measures
from compressor.report.page import Plate, Section
from compressor.report.tables import (
    Cell,
    Table,
    ending,
    job_row,
    measured_cell,
    metric_columns,
    value_cell,
)
from compressor.store import Stored, StoredStudy

MOST_DETAILS = 20
MOST_ROWS = 500


@dataclass(frozen=True)
class StudyContent:
    """What a page says of a study; `chaotic` counts jobs of which statistics alone hold.

    `second_set`: the id of the section with its own Figures 8 to 16; empty where it has none.
    """

    case_file: str
    counts: str
    chaotic: int
    failures: Sequence[str]
    remedies: Sequence[str]
    jobs: int
    table: Table
    plates: Sequence[Plate]
    second_set: str = ""


def study_section(
    stored: Stored,
    study: StoredStudy,
    data: xr.Dataset,
    plates: Sequence[Plate],
    second_set: str = "",
) -> Section:
    """A study as `open_study` gives it: its table, its failures, and its figures."""
    reasons = dict.fromkeys(data["reason"].values[data["status"].values == "failed"])
    content = StudyContent(
        case_file=study.case_file,
        counts=job_counts(data),
        chaotic=int((data["regime"].values == Regime.CHAOTIC).sum()),
        failures=failed_jobs(stored, data),
        remedies=[f"{reason}: {remedy(reason)}" for reason in reasons],
        jobs=data["status"].size,
        table=jobs_table(data),
        plates=plates,
        second_set=second_set,
    )
    return Section(file_name("study", study.name), f"Study {study.name}", "study.html", content)


def file_name(*words: str) -> str:
    """Words as an id or the name of a file."""
    return re.sub(r"[^A-Za-z0-9._-]", "_", "-".join(words))


def job_counts(data: xr.Dataset) -> str:
    """How many jobs of a study are ok, failed or were not run."""
    status = data["status"].values
    failed, missing = int((status == "failed").sum()), int((status == "missing").sum())
    counts = f"{status.size} jobs: {status.size - failed - missing} ok, {failed} failed"
    return counts + (f", {missing} not run." if missing else ".")


def failed_jobs(stored: Stored, data: xr.Dataset) -> list[str]:
    """Where in the sweep jobs failed, and what is known of each; the first of many."""
    failed = np.flatnonzero(data["status"].values == "failed")
    swept = swept_values(data)
    told = []
    for place in failed[:MOST_DETAILS]:
        job = stored.status(str(data["key"].values.flat[place]))
        point = [f"{name} {value_cell(values[place]).text}" for name, values in swept.items()]
        told.append(f"{', '.join(point)}: {ending(job.reason, job.detail) if job else 'gone'}")
    if len(failed) > MOST_DETAILS:
        told.append(f"and {len(failed) - MOST_DETAILS} more")
    return told


def jobs_table(data: xr.Dataset) -> Table:
    """A row for every job of a study, as far as a page can hold them."""
    swept, columns = swept_values(data), metric_columns(measures(data))
    metrics = [(same, [(ravelled(m.of(data)), ravelled(m.bar(data))) for m in same])
               for same in columns.values()]  # fmt: skip
    words = ("status", "reason", "regime", "key")
    ends = zip(*(data[name].values.flat for name in words), strict=True)
    rows = []
    for place, (status, reason, regime, key) in zip(range(MOST_ROWS), ends, strict=False):
        cells = [value_cell(values[place]) for values in swept.values()]
        cells.append(Cell(ending(status, reason, regime)))
        cells += [measured_cell(same, ((value[place], bar[place]) for value, bar in pairs))
                  for same, pairs in metrics]  # fmt: skip
        rows.append(job_row([*cells, Cell(str(key), "code")], str(status), str(regime)))
    return Table([*swept, "status", *columns, "job"], rows)


def ravelled(values: xr.DataArray) -> np.ndarray:
    """A study's values in a row, a job after the other."""
    return values.values.ravel()


def swept_values(data: xr.Dataset) -> dict[str, np.ndarray]:
    """The swept values of a study's jobs, in the order of its `status`, by coordinate."""
    status = data["status"]
    names = [str(n) for n, c in data.coords.items() if {*c.dims} <= {*status.dims} and n != "key"]
    return {
        name: data[name].broadcast_like(status).transpose(*status.dims).values.ravel()
        for name in names
    }
