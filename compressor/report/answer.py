"""The first screen of a report: what was run, what failed, what changes most, and where from.

A finding is a metric whose least and greatest value over the jobs differ by more than both error
bars. Metrics are ranked by how many times the greatest is the least; each is listed once. What an
owner needs first is always listed: whether a joint knocks, the force in a worn joint, and the
reversal of the rod load.
"""

import datetime
import math
import platform
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import xarray as xr

from compressor.analysis import SPOKEN, Claim, mean_peak
from compressor.cases import MODEL_VERSION, Case
from compressor.digits import UNKNOWN, setting
from compressor.metrics import BARRED, JOINTS
from compressor.outcome import Regime
from compressor.program import PROGRAM, library_versions
from compressor.report.figures.sweep_data import (
    Measure,
    differ_beyond_bars,
    measures,
    name_in_words,
    swept_values,
)
from compressor.report.page import (
    Cell,
    PageTable,
    Section,
    SectionContent,
    TableRow,
    format_measure,
    number,
)
from compressor.store import Folder, StoredStudy
from compressor.units import Units


def assumptions_section(has_claims: bool, has_cam: bool) -> Section:
    """Return the section of the assumptions behind all studies, and the paper's claims and cam."""
    machine = Case.from_values({}).machine
    of_claims = [
        f"The paper prints no masses. These are ours: rod {machine.rod_mass_kg:g} kg (a steel bar "
        "of 600 × 40 × 25 mm), crosshead with piston rod and piston "
        f"{machine.reciprocating_mass_kg:g} kg. They decide peaks and trends: a claim that fails "
        "here is a result for these masses.",
        "Claim (1) holds by construction: with ideal joints and a prescribed crank, no load can "
        "change the motion.",
    ]
    lines = [
        "The clearance is radial: bearing radius less journal radius.",
        *["The cam of the spring load is a reconstruction: as printed it does not close."]
        * has_cam,
        *(of_claims if has_claims else ()),
        "± is the error bar of a number: what a sharper solution of the same model may give. It "
        "tells nothing of the model's own error, and nothing of numbers that had to be guessed, "
        "such as bearing lengths, oil and a casing's mass: compsim explain --models shows how far "
        "each moves them. Metrics leave out the start-up (solve.settle_rev).",
    ]
    return Section("assumptions", "What to keep in mind", SectionContent(lines=lines))


LIBRARIES = ("numpy", "scipy", "numba", "xarray", "h5py", "matplotlib")


def provenance_section(studies: Sequence[StoredStudy], results: Folder, command: str) -> Section:
    """Return the section on program and command that made a page, and its studies."""
    lines = [
        f"program: {PROGRAM}, model {MODEL_VERSION}",
        f"libraries: {spell_versions(library_versions(*LIBRARIES))}",
        f"platform: Python {platform.python_version()}, {platform.platform()}",
        f"results: {Path(results).absolute()}",
        f"command: {command}",
        f"written: {datetime.datetime.now(datetime.UTC).isoformat(timespec='seconds')}",
    ]
    rows = [
        TableRow([
            Cell(study.name), Cell(study.case_file, "code"), Cell(study.command, "code"),
            Cell(spell_versions(study.versions)), Cell(study.written), Cell(str(study.jobs)),
        ])
        for study in studies
    ]  # fmt: skip
    table = PageTable(["study", "case file", "command", "versions", "written", "jobs"], rows)
    return Section("provenance", "Where this comes from", SectionContent(table, lines=lines))


def spell_versions(versions: Mapping[str, str]) -> str:
    """Return names and versions in words."""
    return ", ".join(f"{name} {version}" for name, version in versions.items())


MAX_FINDINGS = 3  # besides those that always stand there
FORCE = "peak_contact_force"
KNOCK = "knock"
ALWAYS = (KNOCK, FORCE, "rod_load_reversal_angle")
LEFT_OUT = (
    "rms_acceleration_deviation",  # 0 without clearance, by its meaning
    "max_penetration",  # below 0 where a gap is left, above it where metal touches: no ratio
)
MIN_RATIO = 1.05  # of a change that is told as one
FROM_ZERO = 5.0  # rank of what appears: as of a value 150 times as large


@dataclass(frozen=True)
class MetricChange:
    """What a metric does over jobs; `low` and `high` are numbers with bars and unit, or one is "".

    `at_low`, `at_high`: their jobs; `change`: the ratio in words; `always`: it stands on the first
    screen whatever its rank is; `first`: at its head.
    """

    title: str
    low: str
    at_low: str
    high: str
    at_high: str
    change: str
    rank: float
    always: bool = False
    first: bool = False


def answer_section(
    lines: Sequence[SimpleNamespace], findings: Sequence[tuple[str, Sequence[MetricChange]]],
    claims: Sequence[Claim], cautions: Sequence[str],
) -> Section:  # fmt: skip
    """Return the section that the page begins with; cautions: a sentence each."""
    no_finding = "No job has a result."
    if any(line.has_result for line in lines):
        least = 100 * (MIN_RATIO - 1)
        no_finding = f"No metric changes by more than {least:.0f} % and its error bars."
    content = SimpleNamespace(lines=lines, findings=findings, claims=claims, cautions=cautions,
                              no_finding=no_finding)  # fmt: skip
    return Section("answer", "The answer", content, "answer.html")


def study_findings(data: xr.Dataset, units: Units = "usual") -> list[MetricChange]:
    """Return the metrics that change most over a study's jobs, as `open_study` gives it."""
    numbers = ((m, read_numbers(m, data)) for m in measures(data, units))
    rows = [(m, values.ravel(), bars.ravel()) for m, (values, bars) in numbers]
    return rank_findings(rows, name_jobs(data), worn_joints(data), ascending_jobs(data))


def read_numbers(measure: Measure, data: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return a measure of a study's jobs and its error bars, in their shape.

    A single blow of a chaotic motion has no meaning: of its knock the mean over revolutions of the
    hardest one in each counts, with its 95 % interval, as in `compsim find`.
    """
    values, bars = measure.of(data), measure.bar(data)
    if measure.variable == KNOCK and f"{KNOCK}_mean" in data:
        regime = data["regime"]
        for place in np.argwhere((regime.values == Regime.CHAOTIC) & ~np.isnan(values)):
            job = data.isel(dict(zip(regime.dims, place, strict=True)))
            values[tuple(place)], bars[tuple(place)] = mean_peak(job, KNOCK, joint=measure.joint)
    return values, bars


def worn_joints(data: xr.Dataset) -> set[str]:
    """Return the joints that have clearance in any of the jobs."""
    if "max_penetration" not in data:
        return set()
    depth = data["max_penetration"]  # exactly 0 in an ideal joint, nan of a job that failed
    return {joint for joint in JOINTS if (abs(depth.sel(joint=joint)) > 0.0).any()}


def several_values(data: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the swept keys of a study's jobs, as `swept_values`, that have several values."""
    return {name: values for name, values in swept_values(data).items()
            if "case_key" in data[name].attrs and len({*values.tolist()}) > 1}  # fmt: skip


def name_jobs(data: xr.Dataset) -> list[str]:
    """Return what is swept at each job of a study, in words."""
    words = []
    for name, values in several_values(data).items():
        unit = data[name].attrs.get("units", "")  # once: xarray takes 0.1 ms to find it
        words.append([word_value(name, value, unit) for value in values.tolist()])
    jobs = zip(*words, strict=True) if words else [()] * data["status"].size
    return [", ".join(filter(None, parts)) for parts in jobs]


def ascending_jobs(data: xr.Dataset) -> list[int]:
    """Return the numbers of a study's jobs by the one number that is swept, none without one."""
    swept = [*several_values(data).values()]
    if len(swept) != 1 or swept[0].dtype.kind not in "fiu" or np.isnan(swept[0]).any():
        return []
    return np.argsort(swept[0], kind="stable").tolist()


def word_value(name: str, value: object, unit: str) -> str:
    """Return a swept value in words: clearance 0.2 mm; "" where the job has none."""
    words = name_in_words(name, unit)
    if isinstance(value, int | float):
        if math.isnan(value):
            return ""
        return f"{words} {setting(value)} {unit}".removesuffix(" 1").rstrip()
    return f"{words} {SPOKEN.get(str(value), value)}" if value != "" else ""


def rank_findings(
    rows: Iterable[tuple[Measure, np.ndarray, np.ndarray]],
    names: Sequence[str],
    worn: Collection[str] = (),
    ascending: Sequence[int] = (),
) -> list[MetricChange]:
    """Return the findings of measures over jobs, the greatest change first, one a metric.

    worn: joints whose contact force is meant; where there is none, that of any. ascending: of
    `ascending_jobs`. Knock comes first, and has a word on the other joint, too.
    """
    best: dict[str, MetricChange] = {}
    knocks: dict[str, MetricChange] = {}
    for measure, values, bars in rows:
        if BARRED[measure.variable].counted or measure.variable in LEFT_OUT:
            continue
        if measure.variable == FORCE and worn and measure.joint not in worn:
            continue
        found = finding(measure, values, bars, names)
        if found and measure.variable == KNOCK:
            knocks[measure.joint] = found = judge_knock(found, values, bars, names, ascending)
        if found and (measure.variable not in best or found.rank > best[measure.variable].rank):
            best[measure.variable] = found
    hardest = best.get(KNOCK)
    for joint, other in knocks.items():
        if hardest and other is not hardest:
            words = f"{hardest.change}; {joint.replace('_', ' ')}: {other.change}"
            best[KNOCK] = replace(hardest, change=words)
    return choose_findings(sorted(best.values(), key=lambda found: -found.rank), MAX_FINDINGS)


def judge_knock(
    found: MetricChange,
    values: np.ndarray,
    bars: np.ndarray,
    names: Sequence[str],
    ascending: Sequence[int] = (),
) -> MetricChange:
    """Return the finding of a joint's knock with which jobs knock, ranked by what is sure of it.

    A job whose error bar holds the limit may knock.
    """
    limit, bars = BARRED[KNOCK].limit, np.nan_to_num(bars, nan=0.0, posinf=math.inf)
    knocks, quiet = values - bars > limit, values + bars <= limit
    count, known = int(knocks.sum()), ~np.isnan(values)
    unsure = int((known & ~knocks & ~quiet).sum())
    if known.sum() == 1:
        words = "it may knock" if unsure else "it knocks" if count else "it does not knock"
    else:
        words = f"{count or 'none'} of {known.sum()} jobs knock" + "s" * (count < 2)
        along = [n for n in ascending if known[n]]
        hits = knocks[along]
        if 0 < count < len(along) and not np.diff(hits).sum() > 1:
            end = along[int(np.argmax(hits))] if hits[-1] else along[count - 1]
            words += f", from {names[end]} on" if hits[-1] else f", up to {names[end]}"
        words += f", {unsure} may" if unsure else ""
    return replace(found, change=words, rank=float((values - bars)[known].max()), first=True)


def choose_findings(ranked: Sequence[MetricChange], count: int) -> list[MetricChange]:
    """Return the first findings, and beside this number those that always stand there, by rank."""
    first = [found for found in ranked if not found.always][:count]
    always = [found for found in ranked if found.always]
    return sorted([*first, *always], key=lambda found: (not found.first, -found.rank))


def finding(
    measure: Measure, values: np.ndarray, bars: np.ndarray, names: Sequence[str]
) -> MetricChange | None:
    """Return the change of a measure over jobs, where it is beyond its error bars.

    Jobs whose value is not known within its bar, such as a chaotic motion's peak, do not count.
    What always stands on the first screen is returned also where it does not change. No ratio is
    formed of a number that is below 0 in any job.
    """
    always = measure.variable in ALWAYS
    title = measure.title[0].upper() + measure.title[1:]
    sure = np.flatnonzero(~np.isnan(measure.known(values, bars))).tolist()

    def text(n: int) -> str:
        number = format_measure(measure, float(values[n]), float(bars[n]))
        return f"{number} {measure.unit}".rstrip()

    def tell_unchanged(value: str, words: str = "") -> MetricChange | None:
        return MetricChange(title, "", "", value, "", words, 0.0, always) if always else None

    if not sure:
        return None if np.isnan(values).all() else tell_unchanged(UNKNOWN, "within its error bar")
    low, high = (pick(sure, key=lambda n: values[n]) for pick in (min, max))
    if len(values) == 1:
        return MetricChange(title, "", "", text(high), "", "", 0.0, always)
    least, most = float(values[low]), float(values[high])
    if not differ_beyond_bars(values[sure], bars[sure]):
        some = f"known of {len(sure)} of {len(values)} jobs" * (len(sure) < len(values))
        same = f"the same{' in all jobs' * (not some)} within its error bars" * (len(sure) > 1)
        return tell_unchanged(text(high), ", ".join(filter(None, (some, same))))
    ratio = most / least if least * most > 0.0 else math.inf
    if max(ratio, 1.0 / ratio) < MIN_RATIO:
        span = f"{number(least)} to {number(most)} {measure.unit}".rstrip()
        return tell_unchanged(span, "nearly the same in all jobs")
    rank = min(abs(math.log(ratio)), FROM_ZERO)
    change = f"{ratio:.3g} times" if ratio < 1e3 else "from nearly nothing"
    change = change if least >= 0.0 else ""
    return MetricChange(title, text(low), names[low], text(high), names[high], change, rank, always)
