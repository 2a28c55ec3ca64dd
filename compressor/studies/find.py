"""Questions as searches: where a metric first passes a value, or where it is greatest or least.

A scan of evenly spaced points in parallel finds the interval, sections of it or Brent's bounded
minimisation (Brent 1973, Algorithms for Minimization without Derivatives, ch. 5) narrow it. Each
point is a job of a study that grows, stored and run as any other. Structure that is finer than the
scan may be missed.
"""

import math
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from compressor import cases, digits, metrics, program, solve, store, units
from compressor.cases import Study
from compressor.studies import frame

# ---- the question

SIGNS = {">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le}
COMPARISON = re.compile(r"\s*([\w.]+)\s*(>=|<=|>|<)\s*([^<>=]*[^<>=\s])\s*")
NO_COMPARISON = (
    f"is no comparison: write METRIC[.JOINT], one of {' '.join(SIGNS)}, and a number in SI, such "
    "as 'contact_loss_fraction.small_end > 0.001', or a number and its unit, such as 166 kN"
)
WORDS = {
    "joint": metrics.JOINTS, "axis": metrics.AXES, "threshold": metrics.THRESHOLDS,
    "segment": tuple(f"{degrees:g}" for degrees in metrics.SEGMENTS),
}  # fmt: skip


@dataclass(frozen=True)
class JobReading:
    """What a job says: value and bar in the metric's SI unit; `reason`: why it says nothing.

    averaged: value is a mean over revolutions, and bar half of its 95 % interval, since the motion
    is chaotic. barred: whether an error bar was made; bar is 0 without.
    """

    value: float = math.nan
    bar: float = math.inf
    reason: str = ""
    averaged: bool = False
    barred: bool = True


@dataclass(frozen=True)
class Goal:
    """A metric's number, by its name and its place, such as peak_contact_force.small_end.

    sign, limit: of a comparison, limit in the metric's SI unit; sign is "greatest" or "least" where
    an extremum is sought.
    """

    metric: str
    place: tuple[str, ...]
    sign: str
    limit: float = math.nan

    @property
    def name(self) -> str:
        return ".".join((self.metric, *self.place))

    @property
    def unit(self) -> str:
        """Return the SI unit, "" for a share or a count."""
        return "" if metrics.BARRED[self.metric].unit == "1" else metrics.BARRED[self.metric].unit

    def holds(self, reading: JobReading) -> bool | None:
        """Return whether the comparison holds; None where the error bar does not decide."""
        around = (reading.value - reading.bar, reading.value + reading.bar)
        ends = {bool(SIGNS[self.sign](end, self.limit)) for end in around}
        return ends.pop() if not reading.reason and len(ends) == 1 else None

    def read(self, numbers: np.void, regime: str) -> JobReading:
        """Return the reading of the goal from the numbers (dtype ROW) of a job that is ok.

        A single peak of a chaotic motion (`regime`) has no meaning: the mean over revolutions of
        each one's counts, with the 95 % interval that its standard error and Student's t give. The
        bars of other metrics of a chaotic motion are such intervals already.
        """
        mean = f"{self.metric}_mean"
        averaged = regime == "chaotic" and mean in metrics.NUMBERS
        value = self._at(numbers, mean if averaged else self.metric)
        if averaged:
            error = np.array(self._at(numbers, f"{mean}_standard_error"))
            bar = float(solve.average_bar(error, int(numbers["revolutions"])))
        else:
            bar = self._at(numbers, f"{self.metric}_error")
        if math.isnan(value):
            return JobReading(reason=f"the job has no {self.metric}")
        if math.isinf(bar):
            few = " and has too few revolutions" if regime == "chaotic" else ""
            reason = f"its error is not known, as the motion is {regime or 'of unknown kind'}{few}"
            return JobReading(value, reason=reason, averaged=averaged)
        if math.isnan(bar):
            return JobReading(value, 0.0, averaged=averaged, barred=False)
        return JobReading(value, bar, averaged=averaged)

    def _at(self, numbers: np.void, name: str) -> float:
        dims = metrics.BARRED[self.metric].dims
        place = tuple(WORDS[dim].index(word) for dim, word in zip(dims, self.place, strict=True))
        return float(np.asarray(numbers[name])[place])


def comparison(text: str) -> Goal:
    """Return the goal of a comparison such as `peak_acceleration > 600`. Raises StudyError."""
    parts = COMPARISON.fullmatch(text)
    if parts is None:
        raise frame.StudyError(f"{text!r} {NO_COMPARISON}")
    goal = goal_of(parts[1], parts[2])
    try:
        limit = units.read_quantity(parts[3], metrics.BARRED[goal.metric].unit)
    except ValueError as error:
        raise frame.StudyError(f"{text!r}: {error}") from error
    if limit is None:
        raise frame.StudyError(f"{text!r} {NO_COMPARISON}")
    is_share = goal.metric.endswith(("_fraction", "_share"))
    greatest = 2.0 * math.pi if goal.unit == "rad" else 1.0 if is_share else math.inf
    if abs(limit) > greatest:
        raise frame.StudyError(
            f"{text!r}: {limit:.4g} {goal.unit}".rstrip() + f" is more than {goal.metric} can be, "
            f"{greatest:.3g}; a unit such as {'%' if is_share else 'deg'} goes behind the number"
        )
    return replace(goal, limit=limit)


def goal_of(text: str, sign: str) -> Goal:
    """Return the goal of a metric's name, METRIC or METRIC.JOINT. Raises StudyError."""
    metric, *place = text.strip().split(".")
    if metric not in metrics.BARRED:
        known = f"there are {', '.join(metrics.BARRED)}"
        hint = program.did_you_mean(metric, metrics.BARRED) or known
        raise frame.StudyError(f"unknown metric {metric!r}; {hint}")
    dims = metrics.BARRED[metric].dims
    good = len(place) == len(dims) and all(w in WORDS[d] for w, d in zip(place, dims, strict=True))
    if not good:
        words = "".join(f".{'|'.join(WORDS[dim])}" for dim in dims)
        raise frame.StudyError(f"{text!r}: write {metric}{words}")
    return Goal(metric, tuple(place), sign)


@dataclass(frozen=True)
class Question:
    """Where in a span of a case file's key a goal is met.

    tolerance: of the answer, relative to the span, in the logarithm where that is even; scan:
    points that are looked at first; overrides: `key=value` of other keys.
    """

    path: str
    span: frame.KeySpan
    goal: Goal
    tolerance: float = 1e-3
    scan: int = 9
    overrides: tuple[str, ...] = ()

    @property
    def shares(self) -> list[float]:
        """Return the shares of the span at which to look first: 0 to 1, evenly."""
        return [number / (self.scan - 1) for number in range(self.scan)]

    def load_first(self) -> Study:
        """Return the study of the first look, after a check that the file makes one case a value.

        Raises StudyError, and CaseFileError with what is wrong in the file.
        """
        key, value = self.span.key, self.span.value
        if key in [one.partition("=")[0].strip() for one in self.overrides]:
            raise frame.StudyError(
                f"--set {key}: --over searches over it; leave one of the two out"
            )
        ends = [self._load(f"{value(share)!r}") for share in (0.0, 1.0)]
        if ends[0].jobs > 1:
            axes = ", ".join(axis.key for axis in ends[0].axes)
            text = f"{self.path} makes {ends[0].jobs} jobs for one {key}, it sweeps {axes}"
            raise frame.StudyError(f"{text}: choose one case by --set")
        if ends[0].keys == ends[1].keys:
            raise frame.StudyError(f"{key} changes nothing in the case of {self.path}")
        return self._load(f"[{', '.join(repr(value(share)) for share in self.shares)}]")

    def _load(self, value: str) -> Study:
        """Return the study of the file with the key set, too."""
        texts = [*self.overrides, f"{self.span.key}={value}"]
        (study,) = cases.load_studies(self.path, overrides=texts)
        return study


# ---- the search

MAX_POINTS = 200  # that one search may ask for beyond its scan
place = operator.attrgetter("share")  # of a point


@dataclass(frozen=True)
class Point:
    """A share of the range from 0 to 1, the key's value there, and the reading of its job."""

    share: float
    argument: float
    reading: JobReading
    key: str = ""  # of the job
    failed: bool = False


Evaluate = Callable[[Sequence[float]], list[Point]]  # shares -> their points, in any order
Holds = Callable[[JobReading], bool | None]


@dataclass(frozen=True)
class SearchResult:
    """What a search found.

    kind: `found`; `undecided`: found, but points inside the interval cannot be decided; `at_low`:
    the comparison holds at the range's lower end; `nowhere`: it holds at no point; `unclear`:
    no point surely meets the goal, and some say nothing.
    low, high: the ends of the interval. Of a comparison: where it does not hold and where it first
    does; low is None where no point below surely fails. Of an extremum: the nearest points that are
    surely worse, None where the range ends before.
    best: of an extremum, the best point; within: the points whose bars reach the best one's.
    blind: points inside the interval that do not decide.
    points: all, by argument; run_now: jobs that were not stored before; study: where they are.
    """

    kind: str
    low: Point | None
    high: Point | None
    best: Point | None = None
    within: tuple[Point, ...] = ()
    blind: tuple[Point, ...] = ()
    points: tuple[Point, ...] = ()
    run_now: int = 0
    study: str = ""


def find_first(
    evaluate: Evaluate, holds: Holds, shares: Sequence[float], tolerance: float, at_once: int = 1
) -> SearchResult:
    """Return the interval in which a comparison first becomes true, going up from share 0.

    Its ends are decided points, less than `tolerance` (a share) apart, or less than that from the
    points between them that are not decided. at_once: points of one call to evaluate.
    """
    points: list[Point] = []
    next_shares: Sequence[float] = shares
    while next_shares and len(points) < len(shares) + MAX_POINTS:
        points = sorted([*points, *evaluate(next_shares)], key=place)
        answer = interval(points, holds)
        next_shares = sections(answer, tolerance, at_once)
    return answer


def interval(points: Sequence[Point], holds: Holds) -> SearchResult:
    """Return the interval in which a comparison first becomes true, by points in their order."""
    verdicts = [(point, holds(point.reading)) for point in points]
    blind = tuple(point for point, verdict in verdicts if verdict is None)
    high = next((point for point, verdict in verdicts if verdict), None)
    if high is None:
        return SearchResult(
            "unclear" if blind else "nowhere", None, None, blind=blind, points=tuple(points)
        )
    below = [point for point, verdict in verdicts if verdict is False and point.share < high.share]
    low = below[-1] if below else None
    left = -math.inf if low is None else low.share
    blind = tuple(point for point in blind if left < point.share < high.share)
    kind = "undecided" if blind else "found" if low else "at_low"
    return SearchResult(kind, low, high, blind=blind, points=tuple(points))


def sections(answer: SearchResult, tolerance: float, at_once: int) -> list[float]:
    """Return the shares of the range at which to look next, so that the interval narrows.

    They divide the interval, or what is left and right of blind points.
    """
    if answer.high is None or answer.kind == "at_low":
        return []
    chain = [point for point in (answer.low, *answer.blind, answer.high) if point is not None]
    gaps = [*pairwise(chain)]
    if answer.blind:
        gaps = gaps[-1:] if answer.low is None else [gaps[0], gaps[-1]]
    found = []
    for left, right in gaps:
        width = right.share - left.share
        # not more than bring the gap below the tolerance, nor one more by rounding
        enough = math.ceil(width / tolerance * (1.0 - 1e-9)) - 1
        count = min(max(1, at_once // len(gaps)), enough)
        found += [left.share + width * (n + 1) / (count + 1) for n in range(count)]
    return found


def find_extremum(
    evaluate: Evaluate, greatest: bool, shares: Sequence[float], tolerance: float
) -> SearchResult:
    """Return the place at which a metric is greatest or least, near the best of some points.

    The points are at `shares`. Between the two neighbours of that,
    minimize_scalar(method="bounded") goes on until its argument is known to `tolerance`, a share.
    Then the gaps beside the best point are halved, as that may have ended at a lesser extremum.
    Points that say nothing count as the worst one that is known.
    """
    points = sorted(evaluate(shares), key=place)
    usable = [point for point in points if not point.reading.reason]
    if not usable:
        return SearchResult("unclear", None, None, blind=tuple(points), points=tuple(points))
    factor = -1.0 if greatest else 1.0
    known = {point.share: point for point in points}
    worst = max(factor * point.reading.value for point in usable)

    def cost_at(share: float) -> float:
        share = float(share)
        if share not in known:
            (known[share],) = evaluate([share])
        reading = known[share].reading
        return worst if reading.reason else factor * reading.value

    at = points.index(min(usable, key=lambda point: factor * point.reading.value))
    bounds = (points[max(at - 1, 0)].share, points[min(at + 1, len(points) - 1)].share)
    minimize_scalar(cost_at, bounds=bounds, method="bounded",
                    options={"xatol": tolerance, "maxiter": MAX_POINTS})  # fmt: skip
    while True:
        answer = bracket_best(known.values(), factor)
        middles = halves_beside_best(answer, tolerance)
        if not middles or len(known) + len(middles) > len(points) + MAX_POINTS:
            return answer
        known |= {point.share: point for point in evaluate(middles)}


def halves_beside_best(answer: SearchResult, tolerance: float) -> list[float]:
    """Return the middles of gaps beside the best point, wider than `tolerance`, to a worse one."""
    points, best = answer.points, answer.best
    return [
        0.5 * (left.share + right.share)
        for left, right in pairwise(points)
        if best in (left, right) and right.share - left.share > tolerance * (1.0 + 1e-9)
        and not {left, right} <= {*answer.within}
    ]  # fmt: skip


def bracket_best(known: Iterable[Point], factor: float) -> SearchResult:
    """Return the best of some points, those that may be as good, and the worse ones around.

    factor: 1 where the least is best, -1 where the greatest is.
    """
    points = sorted(known, key=place)
    usable = [point for point in points if not point.reading.reason]
    best = min(usable, key=lambda point: factor * point.reading.value)
    within: list[Point] = []
    worse: list[Point] = []
    for point in usable:
        behind = factor * (point.reading.value - best.reading.value)
        (within if behind <= point.reading.bar + best.reading.bar else worse).append(point)
    low = max((p for p in worse if p.share < within[0].share), key=place, default=None)
    high = min((p for p in worse if p.share > within[-1].share), key=place, default=None)
    left = -math.inf if low is None else low.share
    right = math.inf if high is None else high.share
    blind = tuple(p for p in points if p.reading.reason and left < p.share < right)
    kind = "undecided" if blind else "found"
    return SearchResult(kind, low, high, best, tuple(within), blind, tuple(points))


def find(
    question: Question,
    folder: store.Folder,
    workers: int = 2,
    progress: program.Progress = program.no_progress,
) -> SearchResult:
    """Return the answer of a question, by jobs in a folder's store.

    Jobs that it holds are not run again. The study is called after the file and the key. Raises
    StudyError, CaseFileError, StoreError and WorkersFailed.
    """
    question.load_first()
    span = question.span
    study = frame.GrowingStudy(
        question.path, [span.key], f"-find-{span.key}", folder, question.overrides,
        workers, progress,
    )  # fmt: skip

    def evaluate(shares: Sequence[float]) -> list[Point]:
        values = [span.value(share) for share in shares]
        keys = study.run([(value,) for value in values])
        stored, found = store.read_store(folder), []
        for share, value, key in zip(shares, values, keys, strict=True):
            position = stored.position(key)
            if position is None:
                if refused := study.refused.get((value,)):
                    raise refused
                raise store.StoreError(folder, f"job {key} is gone", "ask again")
            end = stored.status_at(position)
            if end.status == "ok":
                regime = stored.columns["regime"][position].decode()
                reading = question.goal.read(stored.numbers([position])[0], regime)
            else:
                text = f"the job failed, {end.reason}: {stored.detail(position)}"
                reading = JobReading(reason=text)
            found.append(Point(share, value, reading, key, end.status != "ok"))
        return found

    goal, shares, tolerance = question.goal, question.shares, question.tolerance
    if goal.sign in ("greatest", "least"):
        answer = find_extremum(evaluate, goal.sign == "greatest", shares, tolerance)
    else:
        answer = find_first(evaluate, goal.holds, shares, tolerance, workers)
    return replace(answer, run_now=study.run_now, study=study.name)


# ---- as rows ------------------------------------------------------------------------------------


def list_answer(
    question: Question, answer: SearchResult, folder: store.Folder, system: units.Units
) -> Iterator[str]:
    """Yield an answer as it is printed: where it lies, and a row for each point."""
    goal, (unit, factor) = question.goal, units.unit_in(question.goal.unit, system)
    ends = [f"{one.argument:.9g}" for one in (answer.low, answer.high) if one]
    span, steps = question.span, question.scan - 1
    if span.log:
        step = f"a factor {(span.high / span.low) ** (1 / steps):.4g} apart"
    else:
        step = f"{(span.high - span.low) / steps:.4g} apart"
    is_limit = goal.sign not in ("greatest", "least")
    limit = f" {factor * goal.limit:g} {unit}".rstrip() if is_limit else ""
    yield f"{goal.name} {goal.sign}{limit}: {answer.kind}"
    head = {"at": f"{answer.best.argument:.9g}"} if answer.best else {}
    if answer.kind == "at_low":
        head["at"] = f"{ends[0]} already, the lower end of the range"
    elif ends:
        where = "between" if ends[1:] else "at or below"
        head[where if is_limit else "worse from"] = " and ".join(ends)
    value = "lesser" if goal.sign == "least" else "greater"
    missed = "finer changes" if is_limit else f"a {value} value between points"
    head["scan"] = f"{question.scan} points {step}: {missed} may be missed"
    head["jobs"] = f"{len(answer.points)}, {answer.run_now} of them run now, in study "
    head["jobs"] += f"{answer.study} of {folder}"
    yield from digits.align_columns(head.items())
    title = f"{goal.metric} ({unit})" if unit else goal.metric
    rows = [(span.key, title, "", "job")]
    for point in answer.points:
        text = point.reading.reason or read(point.reading, factor)
        rows.append((f"{point.argument:.9g}", text, verdict(goal, answer, point), point.key[:8]))
    yield from digits.align_columns(rows, ">")


def verdict(goal: Any, answer: SearchResult, point: Point) -> str:
    """Return what a point says to the question, in a word."""
    if answer.best is not None:
        within = "as good" if point in answer.within else "worse"
        return "best" if point is answer.best else "open" if point.reading.reason else within
    holds = goal.holds(point.reading)
    return "failed" if point.failed else "open" if holds is None else "yes" if holds else "no"


def read(reading: JobReading, factor: float) -> str:
    """Return a job's number with its error bar; factor: to the unit from SI."""
    bar = factor * reading.bar if reading.barred else math.nan
    text = digits.by_bar(factor * reading.value, bar, False)
    text += " (mean over revolutions: chaotic)" if reading.averaged else ""
    return text if reading.barred else f"{text} (no error bar was made)"


def jsonable_answer(question: Question, answer: SearchResult) -> dict[str, Any]:
    """Return a question and its answer as JSON says them."""
    return asdict(question) | {"unit": question.goal.unit} | asdict(answer)
