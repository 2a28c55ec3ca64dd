"""A question about one case over one of its keys: where a metric first passes a value, or peaks.

What a case file, a range and a metric must be to make a question, and what a finished job says to
it: a number with its error bar, or why it says nothing.
"""

import math
import operator
import re
from dataclasses import dataclass, replace

import numpy as np

from compressor.cases import Study, load_studies, row_of
from compressor.metrics import AXES, BARRED, JOINTS, NUMBERS, SEGMENTS, THRESHOLDS
from compressor.program import CompsimError, did_you_mean
from compressor.solve import average_bar
from compressor.studies.frame import DIGITS
from compressor.units import READABLE, Units, read_quantity, split_number, unit_in

SIGNS = {">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le}
COMPARISON = re.compile(r"\s*([\w.]+)\s*(>=|<=|>|<)\s*([^<>=]*[^<>=\s])\s*")
BESIDE = re.compile(r"(?:(\S+?)\s*\*\s*)?base")  # a limit beside the value at the range's lower end
OVER = re.compile(r"\s*([\w.]+)\s*=\s*([^:\s]+)\s*:\s*([^:\s]+)\s*")
WORDS = {
    "joint": JOINTS, "axis": AXES, "threshold": THRESHOLDS,
    "segment": tuple(f"{degrees:g}" for degrees in SEGMENTS),
}  # fmt: skip


class QuestionError(CompsimError, ValueError):
    """A question that cannot be answered."""

    exit_code = 2


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
    an extremum is sought. times: the limit is so many times the metric at the range's lower end,
    nan where it is a number; slack: how far that limit may be off, by that point's error bar.
    limit_unit: in which the limit was written, "" where it was without a unit.
    """

    metric: str
    place: tuple[str, ...]
    sign: str
    limit: float = math.nan
    times: float = math.nan
    slack: float = 0.0
    limit_unit: str = ""

    @property
    def name(self) -> str:
        return ".".join((self.metric, *self.place))

    @property
    def unit(self) -> str:
        """Return the SI unit, "" for a share or a count."""
        return "" if BARRED[self.metric].unit == "1" else BARRED[self.metric].unit

    def beside(self, base: JobReading) -> "Goal":
        """Return the goal with its limit, from the reading at the range's lower end.

        Raises QuestionError where that says nothing.
        """
        if base.reason:
            raise QuestionError(f"base, {self.name} at the range's lower end: {base.reason}")
        return replace(self, limit=self.times * base.value, slack=abs(self.times) * base.bar)

    def unit_shown(self, units: Units | None) -> tuple[str, float]:
        """Return the unit in which numbers are shown, and the factor to it from SI.

        units: the choice; None: that of the limit as it was written.
        """
        if units is None and self.limit_unit in READABLE:
            return self.limit_unit, 1.0 / READABLE[self.limit_unit][1]
        return unit_in(self.unit, units or "si")

    def holds(self, reading: JobReading) -> bool | None:
        """Return whether the comparison holds; None where the error bar does not decide."""
        reach = reading.bar + self.slack
        ends = {
            bool(SIGNS[self.sign](reading.value + side * reach, self.limit)) for side in (-1.0, 1.0)
        }
        return ends.pop() if not reading.reason and len(ends) == 1 else None

    def read(self, numbers: np.void, regime: str) -> JobReading:
        """Return the reading of the goal from the numbers (dtype ROW) of a job that is ok.

        A single peak of a chaotic motion (`regime`) has no meaning: the mean over revolutions of
        each one's counts, with the 95 % interval that its standard error and Student's t give. The
        bars of other metrics of a chaotic motion are such intervals already.
        """
        mean = f"{self.metric}_mean"
        averaged = regime == "chaotic" and mean in NUMBERS
        value = self._at(numbers, mean if averaged else self.metric)
        if averaged:
            error = np.array(self._at(numbers, f"{mean}_standard_error"))
            bar = float(average_bar(error, int(numbers["revolutions"])))
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
        dims = BARRED[self.metric].dims
        place = tuple(WORDS[dim].index(word) for dim, word in zip(dims, self.place, strict=True))
        return float(np.asarray(numbers[name])[place])


def comparison(text: str) -> Goal:
    """Return the goal of a comparison such as `peak_acceleration > 600`. Raises QuestionError."""
    parts = COMPARISON.fullmatch(text)
    beside = BESIDE.fullmatch(parts[3]) if parts else None
    times = _number(beside[1] or "1") if beside else math.nan
    number = split_number(parts[3])[0] if parts and not beside else None
    if parts is None or (number is None and math.isnan(times)):
        raise QuestionError(f"{text!r} is no comparison: write METRIC[.JOINT], one of "
                            f"{' '.join(SIGNS)}, and a number in SI, such as "
                            "'contact_loss_fraction.small_end > 0.001', a number and its unit, "
                            "such as 166 kN, or a factor, such as 1.5 * base")  # fmt: skip
    goal = goal_of(parts[1], parts[2])
    if beside:
        return replace(goal, times=times)
    try:
        limit = read_quantity(parts[3], goal.unit or BARRED[goal.metric].unit)
    except ValueError as error:
        raise QuestionError(f"{text!r}: {error}") from error
    unit = split_number(parts[3])[1]
    return replace(goal, limit=math.nan if limit is None else limit, limit_unit=unit)


def goal_of(text: str, sign: str) -> Goal:
    """Return the goal of a metric's name, METRIC or METRIC.JOINT. Raises QuestionError."""
    metric, *place = text.strip().split(".")
    if metric not in BARRED:
        hint = did_you_mean(metric, BARRED) or f"there are {', '.join(BARRED)}"
        raise QuestionError(f"unknown metric {metric!r}; {hint}")
    dims = BARRED[metric].dims
    good = len(place) == len(dims) and all(w in WORDS[d] for w, d in zip(place, dims, strict=True))
    if not good:
        words = "".join(f".{'|'.join(WORDS[dim])}" for dim in dims)
        raise QuestionError(f"{text!r}: write {metric}{words}")
    return Goal(metric, tuple(place), sign)


@dataclass(frozen=True)
class Question:
    """Where between low and high of a case file's key (in its unit there) a goal is met.

    logarithmic: evenly in the logarithm of the key; tolerance: of the answer, relative to the
    range, in the logarithm where that is even; scan: points that are looked at first; overrides:
    `key=value` of other keys.
    """

    path: str
    key: str
    low: float
    high: float
    goal: Goal
    logarithmic: bool = False
    tolerance: float = 1e-3
    scan: int = 9
    overrides: tuple[str, ...] = ()

    @property
    def shares(self) -> list[float]:
        """Return the shares of the range at which to look first: 0 to 1, evenly."""
        return [number / (self.scan - 1) for number in range(self.scan)]

    def argument(self, share: float) -> float:
        """Return the key's value at a share of the range."""
        if share in (0.0, 1.0):
            return self.high if share else self.low
        if self.logarithmic:
            value = self.low * (self.high / self.low) ** share
        else:
            value = self.low + share * (self.high - self.low)
        return float(f"{value:.{DIGITS}g}")

    def checked(self) -> Study:
        """Return the study of the first look, after a check that the file makes one case a value.

        Raises QuestionError, and CaseFileError with what is wrong in the file.
        """
        if not self.low < self.high:
            raise QuestionError(f"{self.key}={self.low:g}:{self.high:g} is no range: "
                                "write the lower end first")  # fmt: skip
        if self.logarithmic and self.low <= 0.0:
            raise QuestionError(f"a range even in the logarithm needs ends above 0: {self.low:g}")
        row = row_of(self.key)
        if row is not None and row.kind != "number":
            raise QuestionError(f"{self.key} cannot be searched over: it is no continuous number")
        ends = [self._load(f"{value!r}") for value in (self.low, self.high)]
        if row is None:
            raise QuestionError(f"{self.key} is no single number")
        if ends[0].jobs > 1:
            axes = ", ".join(axis.key for axis in ends[0].axes)
            raise QuestionError(f"{self.path} makes {ends[0].jobs} jobs for one {self.key}, it "
                                f"sweeps {axes}: choose one case by --set")  # fmt: skip
        if ends[0].keys == ends[1].keys:
            raise QuestionError(f"{self.key} changes nothing in the case of {self.path}")
        return self._load(f"[{', '.join(repr(self.argument(share)) for share in self.shares)}]")

    def _load(self, value: str) -> Study:
        """Return the study of the file with the key set, too."""
        (study,) = load_studies(self.path, overrides=[*self.overrides, f"{self.key}={value}"])
        return study


def read_question(
    path: str, over: str, goal: str, which: str = "first", **more: object
) -> Question:
    """Return the question that texts ask.

    over: KEY=LOW:HIGH; goal: a comparison, or with `which` greatest or least a metric; more: other
    fields. Raises QuestionError.
    """
    parts = OVER.fullmatch(over)
    ends = [_number(text) for text in parts.groups()[1:]] if parts else [math.nan]
    if parts is None or any(map(math.isnan, ends)):
        raise QuestionError(
            f"{over!r} is no range: write KEY=LOW:HIGH, such as clearance_mm=0.01:0.3"
        )
    sought = comparison(goal) if which == "first" else goal_of(goal, which)
    return Question(path, parts[1], ends[0], ends[1], sought, **more)  # type: ignore[arg-type]


def _number(text: str) -> float:
    """Return a finite number, or nan."""
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan
