"""Judge the numbers of a stored study by other integrators: is any wrong, and do bars say so?

A number is wrong in silence where it lies farther from a judge's than ten times its error bar, and
than what the tolerance lets one expect: a thousand times rtol, but 5 % at most, and of the time
without contact 1e-4 at least. The judge is another integrator at a hundredth of the tolerance, not
below 1e-12. One that agrees settles a job; where it does not, or does not reach the end, a second
one is run, and a third where two differ. The majority counts.

Of a motion that the job itself calls chaotic only averages are foretold. They are judged over its
own revolutions, at a tenth of the tolerance: rms values within 50 %, time without contact within a
quarter of the span, or ten bars again. Impacts and releases are not counted alike: contact that
grazes begins any number of times.

What judges run are ordinary jobs, stored in RESULTS/judge; so the same command goes on.
"""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from compressor import cases, program, reasons, solve, store, sweep
from compressor.cases import Case, Study
from compressor.digits import plural
from compressor.metrics import METRICS

FOLDER = "judge"
SILENT_FACTOR = 10.0  # times its bar: an error beyond it is silent
EXPECTED, MAX_EXPECTED = 1e3, 0.05  # times rtol: the relative error that nobody is surprised by
TIGHTER, TENTH = 1e-2, 0.1  # a judge's tolerance, and of averages
JUDGED = tuple(name for name, row in METRICS.items() if not row.counted)
ABSOLUTE = ("contact_loss_fraction",)  # is a share: errors are not relative
RESOLVED = 1e-4  # of the span: steps resolve the time without contact no better
AVERAGES = {
    "rms_acceleration": 0.5,
    "rms_acceleration_deviation": 0.5,
    "contact_loss_fraction": 0.25,
}
# judges, those that are least like the run first: compiled ones share our step loop, SciPy's only
# the equations, and take too long but for short runs
OF_STIFF = "TSIT5", "LSODA", "Radau", "RODAS"
OF_STIFF_CHAOTIC = "TSIT5", "RODAS", "LSODA", "Radau"  # averages the stiff partner may judge itself
OF_SHORT = "DOP853", "RODAS", "TSIT5", "LSODA"
OF_OTHERS = "RODAS", "DOP853", "TSIT5", "LSODA"
JUDGES = 3  # of a job, at most
STIFF = 8.0  # evaluations a step: more are the stiff partner's
SHORT = 2000  # steps
# steps, so that a verdict does not depend on how fast a machine is; and seconds beyond all of them
COMPILED_STEPS, SCIPY_STEPS, SECONDS = 2_500_000, 20_000, 300.0
TOO_LONG = (
    f"judges stop after {COMPILED_STEPS:,} steps, SciPy's after {SCIPY_STEPS:,}, and all after "
    f"{SECONDS:g} s: judge a job of fewer revolutions"
)


class Vote(NamedTuple):
    """What one judge says of a job; nan where it did not reach its end, for `reason`.

    `ratio`: of the greatest error of a metric to the greatest that is no silent one; `error` and
    `bar` of that metric, relative.
    """

    method: str
    ratio: float = math.nan
    metric: str = ""
    error: float = math.nan
    bar: float = math.nan
    reason: str = ""


@dataclass
class JudgedJob:
    """A job of a study: its place, how it ended, and what judges say of it.

    `point`: its swept values; `settle`: s, from which its metrics count; `numbers`: metrics, error
    bars, steps and revolutions.
    """

    key: str
    point: dict[str, Any]
    status: str
    reason: str
    regime: str
    case: Case | None
    rtol: float
    settle: float
    numbers: Mapping[str, np.ndarray]
    votes: list[Vote]

    @property
    def verdict(self) -> str:
        """Return ok, failed, silent_wrong, unjudged or missing."""
        if self.status != "ok":
            return self.status
        agreed, dissent = self.counts()
        if agreed == dissent:
            return "unjudged"
        return "ok" if agreed > dissent else "silent_wrong"

    @property
    def why(self) -> str:
        """Return why the job failed, or why it is unjudged and what to do about it."""
        if self.verdict != "unjudged":
            return self.reason
        if self.case is None:
            return "its case is of another version of the program: run it again"
        lost = [vote.reason for vote in self.votes if vote.reason]
        if not lost:
            return "judges disagree: try a finer solve.accuracy"
        is_too_long = lost[0] in (reasons.Reason.BUDGET_STEPS, reasons.Reason.BUDGET_SECONDS)
        return f"{lost[0]} of a judge: {TOO_LONG if is_too_long else reasons.remedy(lost[0])}"

    @property
    def is_open(self) -> bool:
        """Return whether one more judge is needed."""
        agreed, dissent = self.counts()
        settled = agreed > dissent or dissent > agreed + 1
        return self.case is not None and not settled and len(self.votes) < JUDGES

    def counts(self) -> tuple[int, int]:
        """Return how many judges agree with the job, and how many do not."""
        ratios = [vote.ratio for vote in self.votes]
        return sum(ratio <= 1.0 for ratio in ratios), sum(ratio > 1.0 for ratio in ratios)

    @property
    def deciding(self) -> Vote:
        """Return the vote that the verdict rests on: the first on the side of the majority."""
        wrong = self.verdict != "ok"
        known = [vote for vote in self.votes if not math.isnan(vote.ratio)]
        return next((vote for vote in known if (vote.ratio > 1.0) == wrong), Vote(""))

    @property
    def is_chaotic(self) -> bool:
        """Return whether the job foretells averages alone."""
        return self.regime == "chaotic"


def judge(
    folder: store.Folder, name: str | None, workers: int,
    progress: program.Progress = program.no_progress,
) -> list[JudgedJob]:  # fmt: skip
    """Return the jobs of a stored study with their verdicts; judges that are missing are run.

    name: of the study; None: the only one. Progress counts the runs of a judge. Raises StoreError
    and WorkersFailed.
    """
    source = store.find_study(folder, name)
    jobs = read_jobs(folder, source)
    place = Path(folder) / FOLDER
    for number in range(JUDGES):
        open_jobs = [job for job in jobs if job.is_open]
        if open_jobs:
            trials = [judge_case(job, judges_of(job)[number]) for job in open_jobs]
            study = study_of_judges(source, number + 1, open_jobs, trials)
            sweep.sweep([study], place, workers, progress, f"compsim judge {source.name}")
            hear_votes(place, open_jobs, trials)
    return jobs


def read_jobs(folder: store.Folder, source: store.StoredStudy) -> list[JudgedJob]:
    """Return the jobs of a study, each once."""
    stored = store.read_store(folder)
    own = dict(zip(source.keys, cases.points(source), strict=True))
    at = stored.find([*own])
    names = [*JUDGED, *(f"{one}_error" for one in JUDGED), *COUNTS]
    numbers = stored.numbers(at, names)
    words = {name: stored.words(name) for name in ("status", "reason", "regime")}
    found = []
    for number, (key, point) in enumerate(own.items()):
        where = int(at[number])
        said = {name: str(word[where]) if where >= 0 else "" for name, word in words.items()}
        is_ok = said["status"] == "ok"
        case = stored.case_at(where) if is_ok else None
        run = stored.attributes(where) if is_ok else {"rtol": math.nan, "settle": math.nan}
        status = said["status"] or "missing"
        job = JudgedJob(key, point, status, said["reason"], said["regime"], case,
                        float(run["rtol"]), float(run["settle"]), numbers[number], [])  # fmt: skip
        found.append(job)
    return found


COUNTS = ("steps", "rejected", "evaluations", "revolutions")


def judges_of(job: JudgedJob) -> list[str]:
    """Return the methods to judge a job by, in order."""
    assert job.case
    steps = job.numbers["steps"] + job.numbers["rejected"]
    if job.numbers["evaluations"] > STIFF * steps:
        methods = OF_STIFF_CHAOTIC if job.is_chaotic else OF_STIFF
    else:
        methods = OF_SHORT if steps <= SHORT else OF_OTHERS
    return [method for method in methods if method != job.case.solve.method]


def judge_case(job: JudgedJob, method: str) -> Case:
    """Return the case that a judge runs: the job's, by another method and more exactly."""
    case = job.case
    assert case
    if job.is_chaotic and case.solve.settle_rev == "auto":  # which waits for agreement in vain
        settle = job.settle / case.turn
        case = solve.with_settle_rev(case, settle, 1, settle + float(job.numbers["revolutions"]))
    rtol = max((TENTH if job.is_chaotic else TIGHTER) * job.rtol, cases.TIGHTEST)
    compiled = method in ("TSIT5", "RODAS")
    settings = replace(
        case.solve, method=method, rtol=float(f"{rtol:.6g}"), accuracy="standard",
        error_bars=False, horizon=False, timeout_s=SECONDS,
        max_steps=COMPILED_STEPS if compiled else SCIPY_STEPS,
    )  # fmt: skip
    output = cases.Output(keep="metrics")
    return replace(case, solve=settings, output=output, body=None, sensor=None, wear=None)


def study_of_judges(
    source: store.StoredStudy, number: int, jobs: Sequence[JudgedJob], trials: Sequence[Case]
) -> Study:
    """Return the study of the runs of one judge for each of some jobs."""
    axes = [
        cases.Axis(axis.key, tuple(job.point.get(axis.key) for job in jobs)) for axis in source.axes
    ]
    axes.append(cases.Axis("solve.method", tuple(case.solve.method for case in trials)))
    keys = tuple(case.key for case in trials)
    name = f"{source.name}-{number}"
    return Study(name, source.case_file, tuple(axes), trials, keys, False, range(len(keys)))


def hear_votes(place: store.Folder, jobs: Sequence[JudgedJob], trials: Sequence[Case]) -> None:
    """Give jobs the votes of what was run for them."""
    stored = store.read_store(place)
    at = stored.find([case.key for case in trials])
    numbers = stored.numbers(at, JUDGED)
    for number, (job, case) in enumerate(zip(jobs, trials, strict=True)):
        end = stored.status(case.key)
        vote = Vote(case.solve.method, reason=end.reason if end else "")
        if end and end.status == "ok":
            vote = compare(case.solve.method, job, numbers[number])
        job.votes.append(vote)


def compare(method: str, job: JudgedJob, theirs: Mapping[str, np.ndarray]) -> Vote:
    """Return the vote of a judge: the metric that is farthest beyond what the job states of it."""
    expected = min(EXPECTED * job.rtol, MAX_EXPECTED)
    least = AVERAGES if job.is_chaotic else dict.fromkeys(JUDGED, expected)
    votes = [
        excess(method, name, job.numbers, theirs[name],
               max(bound, RESOLVED if name in ABSOLUTE else 0.0))
        for name, bound in least.items()
    ]  # fmt: skip
    known = [vote for vote in votes if not math.isnan(vote.ratio)]
    return max(known, key=lambda vote: vote.ratio, default=Vote(method))


def excess(
    method: str, name: str, ours: Mapping[str, np.ndarray], theirs: np.ndarray, least: float
) -> Vote:
    """Return how far a metric is from a judge's, in multiples of what is allowed.

    Allowed are ten bars, or the least that counts if that is more. Error and bar are relative to
    the judge's greatest value over joints and axes. nan of a metric that is not known.
    """
    size = 1.0 if name in ABSOLUTE else float(np.abs(theirs).max()) or 1.0
    error = float(np.abs(ours[name] - theirs).max()) / size
    bar = float(np.nan_to_num(ours[f"{name}_error"], nan=0.0, posinf=math.inf).max()) / size
    return Vote(method, error / max(SILENT_FACTOR * bar, least), name, error, bar)


def count_ends(jobs: Iterable[JudgedJob]) -> dict[str, int]:
    """Return the number of jobs by end: a verdict, or the reason of a failed one."""
    return dict(Counter(job.reason if job.verdict == "failed" else job.verdict for job in jobs))


def rank(jobs: Iterable[JudgedJob]) -> list[JudgedJob]:
    """Return the jobs that judges heard of, the most wrong first: by verdict, then by ratio."""
    order = {"silent_wrong": 2, "unjudged": 1, "ok": 0}

    def badness(job: JudgedJob) -> tuple[int, float]:
        ratio = job.deciding.ratio
        return order[job.verdict], -1.0 if math.isnan(ratio) else ratio

    return sorted((job for job in jobs if job.verdict in order), key=badness, reverse=True)


HEAD = ("verdict", "job", "metric", "error / allowed", "error", "bar", "judges")


def table(jobs: Sequence[JudgedJob]) -> Iterator[tuple[str, ...]]:
    """Yield the rows of a table of jobs, below a head; judges in parentheses came to no end."""
    yield HEAD
    for job in jobs:
        vote = job.deciding
        known = () if math.isnan(vote.ratio) else (vote.ratio, vote.error, vote.bar)
        numbers = [f"{value:.2g}" for value in known] or [""] * 3
        judges = (f"({one.method})" if math.isnan(one.ratio) else one.method for one in job.votes)
        yield job.verdict, job.key[:8], vote.metric, *numbers, " ".join(judges)


def summarize(jobs: Sequence[JudgedJob]) -> Iterator[str]:
    """Yield how many jobs ended how, in one line, and why some are unjudged."""
    ends = sorted(count_ends(jobs).items(), key=lambda one: -one[1])
    yield f"{plural(len(jobs))}: " + ", ".join(f"{name} {count}" for name, count in ends)
    unjudged = Counter(job.why for job in jobs if job.verdict == "unjudged")
    yield from (f"{count} unjudged: {text}" for text, count in unjudged.most_common())


def to_rows(jobs: Iterable[JudgedJob]) -> list[dict[str, Any]]:
    """Return each job as JSON says it."""
    return [
        {"job": job.key, **job.point, "verdict": job.verdict, **job.deciding._asdict()}
        | {"reason": job.why, "judges": [vote._asdict() for vote in job.votes]}
        for job in jobs
    ]  # fmt: skip
