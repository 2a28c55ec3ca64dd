"""The section of a report about a user's own study: its failures, its table and its figures."""

import re
from collections import Counter
from collections.abc import Sequence
from types import SimpleNamespace

import xarray as xr

from compressor.digits import plural
from compressor.outcome import Regime, regime_words
from compressor.reasons import remedy
from compressor.report import page
from compressor.report.figures.sweep_data import measures, swept_values
from compressor.report.figures.table import DrawnFigure
from compressor.report.inputs import find_inputs
from compressor.report.limits import NO_LIMITS, Limits
from compressor.report.side_by_side import compare_healthy
from compressor.store import Stored, StoredStudy, study_caveats
from compressor.units import Units

MAX_ROWS = 500
KEY_DIGITS = 10  # digits of a job's key


def study_sections(
    stored: Stored,
    study: StoredStudy,
    data: xr.Dataset,
    figures: Sequence[DrawnFigure],
    notes: Sequence[tuple[str, str, str]] = (),
    limits: Limits = NO_LIMITS,
    units: Units = "usual",
) -> tuple[page.Section, page.Section]:
    """Return the sections of a study as `open_study` gives it: figures and failures, and table.

    notes: lines that others add to the first, each with the id of a section and a link's words;
    limits: of metrics, whose zones the table shows.
    """
    anchor = file_name("jobs", study.name)
    content = SimpleNamespace(
        study=study,
        counts=count_jobs(data)[0],
        caveats=study_caveats(stored, study),
        failures=list_failures(stored, data),
        figures=figures,
        jobs=anchor,
        notes=notes,
        beside=compare_healthy(stored, data, units),
        inputs=find_inputs(stored, study),
    )
    table = jobs_table(data, limits, units)
    shown, count = len(table.rows), data["status"].size
    regimes = [regime_words(name) for name in Regime if (data["regime"].values == name).any()]
    paragraphs = [
        *[f"The first {shown} of {count} jobs; compsim export {study.name} gives all."]
        * (shown < count),
        *[f"{'; '.join(regimes)}."] * bool(regimes),
        *limits.words(measures(data, units)),
        "A click on a job's key, in the last column, opens its place in the sweep and, where time "
        "series are stored, its acceleration and its contact forces.",
    ]
    return (
        page.Section(file_name("study", study.name), f"Study {study.name}", content, "study.html"),
        page.Section(anchor, f"Jobs of study {study.name}", page.SectionContent(table, paragraphs)),
    )


def file_name(*words: str) -> str:
    """Return the words as an id or the name of a file."""
    return re.sub(r"[^A-Za-z0-9._-]", "_", "-".join(words))


def count_jobs(data: xr.Dataset) -> tuple[str, Counter[str]]:
    """Return how many jobs of a study are ok, failed or missing, in words and by status."""
    found = Counter(data["status"].values.ravel().tolist())
    words = {"ok": "ok", "failed": "failed", "missing": "not run"}
    parts = [f"{found[one]} {word}" for one, word in words.items() if found[one] or one == "ok"]
    return f"{plural(found.total())}: {', '.join(parts)}", found


def list_failures(stored: Stored, data: xr.Dataset) -> list[str]:
    """Return how many jobs failed by reason, with the remedy, and what is said of the first."""
    found: dict[str, list[str]] = {}
    words = ("status", "reason", "key")
    for status, reason, key in zip(*(data[name].values.flat for name in words), strict=True):
        if status == "failed":
            found.setdefault(str(reason), []).append(str(key))
    lines = []
    for reason, keys in found.items():
        position = stored.position(keys[0])
        detail = "gone" if position is None else stored.detail(position)
        first = f"{'' if len(keys) == 1 else 'the first, '}job {keys[0][:KEY_DIGITS]}: {detail}"
        lines.append(f"{plural(len(keys))} failed, {reason}: {remedy(reason)}; {first}")
    return lines


def jobs_table(
    data: xr.Dataset, limits: Limits = NO_LIMITS, units: Units = "usual"
) -> page.PageTable:
    """Return a row for every job of a study, as far as a page can hold them."""
    swept, shown = swept_values(data), measures(data, units)
    metrics = [(m, m.of(data).ravel(), m.bar(data).ravel()) for m in shown]
    words = ("status", "reason", "regime", "key")
    ends = zip(*(data[name].values.flat for name in words), strict=True)
    rows = []
    for place, (status, reason, regime, key) in zip(range(MAX_ROWS), ends, strict=False):
        cells = [page.value_cell(values[place]) for values in swept.values()]
        cells.append(page.Cell(f"{status}: {reason or regime}".removesuffix(": ")))
        cells += [
            page.measured_cell(m, float(of[place]), float(bar[place]), limits)
            for m, of, bar in metrics
        ]
        cells.append(page.Cell(str(key)[:KEY_DIGITS], "code"))
        mark = "" if regime != Regime.CHAOTIC else str(regime)
        rows.append(page.TableRow(cells, mark if status == "ok" else str(status), str(key)))
    head = [*swept, "status", *map(page.column_title, shown), "job"]
    return page.PageTable(head, rows)
