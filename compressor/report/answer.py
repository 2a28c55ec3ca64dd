"""The first screen of a report: what was run, what failed, and what changes most.

A finding is a metric whose least and greatest value over the jobs differ by more than both error
bars. Metrics are ranked by how many times the greatest is the least; each is told once.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN, Claim
from compressor.digits import is_known
from compressor.metrics import METRICS
from compressor.report.figures.sweep_metric import Measure, measures
from compressor.report.page import Section
from compressor.report.tables import measured

MOST_FINDINGS = 3
FROM_IDEAL = ("rms_acceleration_deviation",)  # 0 without clearance, by its meaning
FROM_ZERO = 5.0  # rank of what appears: as of a value 150 times as large


@dataclass(frozen=True)
class Finding:
    """What a metric does over jobs; `low` and `high` are numbers with bars and unit, or one is "".

    `at_low`, `at_high`: of which jobs; `change`: the ratio in words.
    """

    title: str
    low: str
    at_low: str
    high: str
    at_high: str
    change: str
    rank: float


@dataclass(frozen=True)
class Line:
    """What was run, under which name, and how it ended."""

    name: str
    anchor: str
    counts: str
    problem: bool


@dataclass(frozen=True)
class Answer:
    """The first screen; `pictures` are SVG of the mechanisms with their captions."""

    lines: Sequence[Line]
    findings: Sequence[tuple[str, Sequence[Finding]]]
    claims: Sequence[Claim]
    pictures: Sequence[tuple[str, str]]


def answer_section(answer: Answer) -> Section:
    """Return the section that the page begins with."""
    return Section("answer", "The answer", "answer.html", answer)


def findings(jobs: Iterable[tuple[str, xr.Dataset]]) -> list[Finding]:
    """Return what changes most over jobs, each named and with its metrics."""
    named = [(name, job) for name, job in jobs if str(job["status"].item()) == "ok"]
    known = list(dict.fromkeys(m for _, job in named for m in measures(job)))
    names = [name for name, _ in named]
    rows = [(m, *_columns(m, [job for _, job in named])) for m in known]
    return ranked(rows, names)


def study_findings(data: xr.Dataset) -> list[Finding]:
    """Return what changes most over the jobs of a study, as `open_study` gives it."""
    rows = [(m, m.of(data).values.ravel(), m.bar(data).values.ravel()) for m in measures(data)]
    return ranked(rows, Points(data))


class Points(Sequence[str]):
    """What is swept at each job of a study, in words, made when it is asked for."""

    def __init__(self, data: xr.Dataset):
        status = data["status"]
        self.names = [
            str(name)
            for name, of in data.coords.items()
            if {*of.dims} <= {*status.dims} and "case_key" in of.attrs
        ]
        self.data, self.shape, self.dims = data, status.shape, status.dims

    def __len__(self) -> int:
        return math.prod(self.shape)

    def __getitem__(self, number: Any) -> Any:
        place = dict(zip(self.dims, np.unravel_index(number, self.shape), strict=True))
        parts = []
        for name in self.names:
            of = self.data[name]
            if len({*of.values.ravel().tolist()}) > 1:
                value = of.isel({d: n for d, n in place.items() if d in of.dims}).item()
                parts.append(worded(name, value, of.attrs.get("units", "")))
        return ", ".join(part for part in parts if part)


def worded(name: str, value: object, unit: str) -> str:
    """Return a swept value in words: clearance 0.2 mm; "" where the job has none."""
    words = name.removesuffix("_" + unit.replace("/", "_per_").replace(" ", "_")).replace("_", " ")
    if isinstance(value, int | float):
        if math.isnan(value):
            return ""
        return f"{words} {value:.6g} {unit}".removesuffix(" 1").rstrip()
    return f"{words} {SPOKEN.get(str(value), value)}" if value != "" else ""


def _columns(measure: Measure, jobs: Sequence[xr.Dataset]) -> tuple[np.ndarray, np.ndarray]:
    """Return a measure and its bar of each job, nan where it has none."""
    pairs = [
        (float(measure.of(job)), float(measure.bar(job)))
        if measure.variable in job
        else (math.nan, math.nan)
        for job in jobs
    ]
    values, bars = np.array(pairs, float).reshape(-1, 2).T
    return values, bars


def ranked(
    rows: Iterable[tuple[Measure, np.ndarray, np.ndarray]], names: Sequence[str]
) -> list[Finding]:
    """Return the findings of measures over jobs, the greatest change first, one a metric."""
    best: dict[str, Finding] = {}
    for measure, values, bars in rows:
        if METRICS[measure.variable].counted or measure.variable in FROM_IDEAL:
            continue
        found = finding(measure, values, bars, names)
        if found and (measure.variable not in best or found.rank > best[measure.variable].rank):
            best[measure.variable] = found
    return sorted(best.values(), key=lambda found: -found.rank)[:MOST_FINDINGS]


def finding(
    measure: Measure, values: np.ndarray, bars: np.ndarray, names: Sequence[str]
) -> Finding | None:
    """Return what a measure does over jobs, where that is beyond its error bars.

    Jobs whose value is not known within its bar, such as a chaotic motion's peak, do not count.
    """
    relative = METRICS[measure.variable].bar.relative
    unbarred = np.isnan(bars)
    sure = [
        n
        for n, (value, bar) in enumerate(zip(values.tolist(), bars.tolist(), strict=True))
        if value >= 0.0 and (unbarred[n] or is_known(value, bar, relative))
    ]
    if not sure:
        return None
    low, high = (pick(sure, key=lambda n: values[n]) for pick in (min, max))

    def told(n: int) -> str:
        return f"{measured(measure, float(values[n]), float(bars[n]))} {measure.unit}".rstrip()

    title = measure.title[0].upper() + measure.title[1:]
    if len(values) == 1:
        return Finding(title, "", "", told(high), "", "", 0.0)
    if values[high] - values[low] <= np.nansum([bars[high], bars[low]]):
        return None
    ratio = values[high] / values[low] if values[low] > 0.0 else math.inf
    rank = min(math.log(ratio), FROM_ZERO) if values[low] > 0.0 else FROM_ZERO
    change = f"{ratio:.3g} times" if ratio < 1e3 else "from nearly nothing"
    return Finding(title, told(low), names[low], told(high), names[high], change, rank)


def round_robin(
    each: Sequence[tuple[str, Sequence[Finding]]],
) -> Iterator[tuple[str, Sequence[Finding]]]:
    """At most so many findings in all, the first of each first."""
    room = MOST_FINDINGS
    counts = [0] * len(each)
    while room and any(n < len(found) for n, (_, found) in zip(counts, each, strict=True)):
        for place, (_, found) in enumerate(each):
            if room and counts[place] < len(found):
                counts[place] += 1
                room -= 1
    for count, (name, found) in zip(counts, each, strict=True):
        if count:
            yield name, found[:count]
