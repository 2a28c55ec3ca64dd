"""The metrics of a run: from its tally, and averages where it is chaotic.

API 618 (5th edition, 6.6.4) judges how the rod load at the crosshead pin changes its side, which
keeps the pin's bearing oiled: for how many degrees it lies on its smaller side, with which peak.

Of a chaotic motion averages and peaks over revolutions are known. These follow on each other and
are no independent draws, so that standard errors come from batch means (Schmeiser, Operations
Research 30, 1982): of up to `MAX_BATCHES` batches of as many revolutions each.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from compressor.cases import TIGHTEST
from compressor.metrics import METRICS, NUMBERS, QUANTILES, of_source
from compressor.physics import (
    GREATEST,
    MEANS,
    SQUARES,
    Column,
    elastic_form,
    is_featured,
    merge_tallies,
    read_fields,
)
from compressor.solve.request import Metrics, Trajectory
from compressor.solve.series import rows_at

ROUNDING = 1e-12


class Tallied:
    """What metrics are made from: the fields of a tally, and those of its machine's record, `p`."""

    def __init__(self, p: np.record, tally: np.record):
        self.tally = read_fields(tally)
        self.p, crosshead = p, p["reciprocating_mass"]
        moved = np.array([crosshead + p["rod_mass"], crosshead])  # kg, by a blow at each joint
        self.blow = moved * self.greatest("JOURNAL_ACCELERATION", 2)  # N
        self.seconds = tally["seconds"] or math.nan
        self.steady_seconds = tally["steady_seconds"] or math.nan
        # the spans of steps add up to within rounding: whole revolutions are to stay whole
        self.revolutions = round(float(self.steady_seconds * p["omega"]) / math.tau, 9)

    def __getattr__(self, field: str) -> Any:
        """Return a field of the tally."""
        return self.tally[field]

    def mean(self, column: str) -> float:
        """Return the mean of a column over time, of those in `physics.tally.MEANS`."""
        return self.integral[MEANS.index(Column[column])] / self.seconds

    def root_mean_square(self, column: str) -> float:
        """Return that of a column over time, of those in `physics.tally.SQUARES`."""
        return math.sqrt(self.square[SQUARES.index(Column[column])] / self.seconds)

    def greatest(self, column: str, *shape: int) -> Any:
        """Return the greatest sizes of a column, or from it on, of `physics.tally.GREATEST`."""
        first = GREATEST.index(Column[column])
        return self.peak[first : first + math.prod(shape)].reshape(shape)[()]

    def ratio(self, part: Any, whole: Any) -> Any:
        """Return a part over the whole, 0 where that is not above 0."""
        known = np.greater(whole, 0.0)
        return np.divide(part, whole, out=np.zeros(np.shape(whole)), where=known)[()]

    def has(self, flag: str) -> bool:
        """Return whether a run has what a metric takes: nothing, signals, a flag of its record."""
        if flag in ("", "signals"):
            return not flag or bool(self.has_rod_load)
        return is_featured(self.p) and bool(self.p[flag])


def metrics(p: np.record, tally: np.record) -> Metrics:
    """Return the metrics of `compressor.metrics.TABLE` by name, from what was tallied.

    Those of contacts are 0 at ideal joints.
    """
    run, numbers = Tallied(p, tally), {}
    for row in of_source("tally"):
        if row.made and run.has(row.when):
            value = row.made(run)
            numbers[row.name] = (
                np.where(p["clearance"] == 0.0, 0.0, value) if row.contact else value
            )
    return numbers


def held_by_springs(p: np.record, trajectory: Trajectory) -> float:
    """Return by how much more energy (J) the contacts' springs hold at a run's end than before."""
    if not p["clearance"].any() or not trajectory.states[0].size:
        return 0.0
    end = trajectory.stop_time if trajectory.reason else trajectory.times[-1]
    times = np.array([trajectory.times[0], end])
    states = np.stack([trajectory.states[0], trajectory.last_state])
    rows = rows_at(p, times, states, trajectory.phases[[0, -1]])
    held = np.zeros(2)
    for joint, (k, c) in enumerate(zip(p["stiffness"], p["clearance"], strict=True)):
        for which, depth in enumerate(rows[:, Column.PENETRATION + joint].tolist()):
            if depth > 0.0 and c > 0.0:
                held[which] += elastic_form(k, c, p).energy(depth)
    return float(held[1] - held[0])


RESIDUAL_PER_REV = 10.0  # of rtol: the residual that a revolution may leave
MIN_RESIDUAL = 1e-9  # one below it says nothing of a run
MAX_RESIDUAL = 0.05  # a residual above it is too large at any tolerance
MAX_AUDIT_REPEATS = 2  # by tens of the tolerance, for a run that fails its audit to be repeated at


def energy_residual(tally: np.record) -> float:
    """Return the worst imbalance of energy over what contacts take: losses, and what springs hold.

    At least over 1e-3 of the greatest kinetic energy; where nothing is lost over the crank's work.
    """
    lost = tally["contact_work"] + tally["friction_loss"]
    least = 1e-3 * tally["peak_kinetic"] if lost else abs(tally["crank_work"])
    return float(tally["worst_imbalance"] / max(lost, least, 1e-3 * tally["peak_kinetic"]))


def allowed_residual(rtol: float, revolutions: float) -> float:
    """Return the greatest energy residual of a run that can be trusted at a tolerance.

    Random cases leave a quarter of it at most (tests/results/accuracy.json). Runs beyond it mostly
    keep it at a tenth of the tolerance; those that never do are far off.
    """
    return min(max(RESIDUAL_PER_REV * rtol * max(revolutions, 1.0), MIN_RESIDUAL), MAX_RESIDUAL)


def next_audit_rtol(rtol: float, failures: int) -> float | None:
    """Return the next tolerance after so many runs whose energy does not balance, or None."""
    return None if failures > MAX_AUDIT_REPEATS or rtol < 9.9 * TIGHTEST else rtol / 10.0


def ledger(p: np.record, trajectory: Trajectory) -> dict[str, float]:
    """Return the energy flows and counts by name."""
    tally, state = trajectory.tally, trajectory.last_state
    elastic = is_featured(p) and p["elastic"]
    lost = float(state[p["rod_loss"]]) if elastic else 0.0
    # both are integrated by the same stages: without a contact they are equal but for rounding
    contact = tally["contact_work"] - lost - held_by_springs(p, trajectory)
    return {
        "crank_work": tally["crank_work"],
        "load_work": tally["load_work"],
        "contact_damping_loss": 0.0 if abs(contact) <= ROUNDING * lost else contact,
        "rod_damping_loss": lost,
        "friction_loss": tally["friction_loss"],
        "energy_residual": energy_residual(tally) if tally["started"] else math.nan,
        "steps": trajectory.steps,
        "rejected": trajectory.rejected,
        "evaluations": trajectory.evaluations,
        "seconds": trajectory.seconds,
    }


MAX_BATCHES = 30
T_QUANTILE = 0.975  # quantile of Student's t: a bar holds in 95 % of cases
NORMAL = 1.96  # the same of a normal distribution
MIN_REVOLUTIONS = 10  # settled ones, below which an average's bar is not known
RMS_ERROR_AIM = 0.01  # of rms_acceleration: its standard error that revolutions are counted for


def batch_errors(p: np.record, turns: Sequence[np.record]) -> Metrics:
    """Return the standard error of each average over revolutions, by name, from their tallies.

    inf where there are too few revolutions.
    """
    whole, errors = metrics(p, merge_tallies(turns)), {}
    batches = [metrics(p, merge_tallies(part)) for part in parts(turns)]
    for name, value in whole.items():
        kind, averages = NUMBERS[name].kind, np.array([one[name] for one in batches])
        if kind == "root":  # the mean square is what is averaged
            errors[name] = standard_error(averages**2) / (2.0 * value or math.nan)
        elif kind == "count":  # in so many batches
            errors[name] = len(batches) * standard_error(averages)
        elif kind != "greatest":
            errors[name] = standard_error(averages)
    return errors


def statistics(p: np.record, turns: Sequence[np.record]) -> Metrics:
    """Return `compressor.metrics.statistics_of` all metrics by name, from the revolutions' tallies.

    A standard error is inf where there are too few revolutions.
    """
    estimates: Metrics = {"revolutions": float(len(turns))}
    errors, per_revolution = batch_errors(p, turns), [metrics(p, turn) for turn in turns]
    for name in METRICS:
        if name in errors:
            estimates[f"{name}_standard_error"] = errors[name]
        else:
            estimates |= summarize_peaks(name, np.array([one[name] for one in per_revolution]))
    whole = metrics(p, merge_tallies(turns))["rms_acceleration"]
    share = errors["rms_acceleration"] / whole
    estimates["revolutions_to_one_percent"] = max(
        1.0, np.ceil(len(turns) * (share / RMS_ERROR_AIM) ** 2)
    )
    return estimates


def summarize_peaks(name: str, values: np.ndarray) -> Metrics:
    """Return mean, its standard error and quantiles of the revolutions' greatest values."""
    means = np.array([part.mean(axis=0) for part in parts(values)])
    return {
        f"{name}_mean": values.mean(axis=0),
        f"{name}_mean_standard_error": standard_error(means),
        f"{name}_quantile": np.moveaxis(np.quantile(values, QUANTILES, axis=0), 0, -1),
    }


def parts(items: Sequence | np.ndarray, most: int = MAX_BATCHES, least: int = 1) -> list:
    """Return the last items as up to `most` batches of equal size, at least `least` in each."""
    size = max(least, math.ceil(len(items) / most))
    count = max(1, len(items) // size)
    skipped = max(0, len(items) - count * size)
    return [items[skipped + i * size : skipped + (i + 1) * size] for i in range(count)]


def standard_error(means: np.ndarray) -> np.ndarray:
    """Return the standard error of the mean of batches, (batches, ...); inf of a single one."""
    if len(means) < 2:
        return np.full(means.shape[1:], math.inf)
    return means.std(axis=0, ddof=1) / math.sqrt(len(means))


def sure(error: np.ndarray, revolutions: int) -> np.ndarray:
    """Return half the length of the 95 % interval of a mean by `parts`, by its standard error."""
    batches = len(parts(range(revolutions)))
    from scipy.special import stdtrit  # takes a tenth of a second, of chaotic motions alone

    return np.asarray(error) * float(stdtrit(max(batches - 1, 1), T_QUANTILE))


def average_bar(error: np.ndarray, revolutions: int) -> np.ndarray:
    """Return the error bar of an average over a chaotic motion's revolutions: `sure`, or inf.

    So below `MIN_REVOLUTIONS`: batches alike by chance would tell of no error.
    """
    if revolutions < MIN_REVOLUTIONS:
        return np.full(np.shape(error), math.inf)
    return sure(error, revolutions)


def count_bar(count: np.ndarray) -> np.ndarray:
    """Return how far the mean of a Poisson count may lie above it in 95 % of cases, also of 0."""
    return 0.5 * NORMAL**2 + NORMAL * np.sqrt(count + 0.25 * NORMAL**2)


def mean_bar(values: np.ndarray) -> float:
    """Return half of the 95 % interval of the mean of a chaotic motion's values; inf of few."""
    means = np.array([part.mean() for part in parts(values)])
    return float(average_bar(standard_error(means), len(values)))


def chaotic_bars(p: np.record, turns: Sequence[np.record], numbers: Metrics) -> Metrics:
    """Return the error bars of a chaotic run's metrics: of averages; greatest values have inf."""
    bars, count, errors = {}, len(turns), batch_errors(p, turns)
    for name, value in numbers.items():
        row = NUMBERS[name]
        bar = average_bar(errors.get(name, np.full(np.shape(value), math.inf)), count)
        if row.counted:
            in_all = 1 if row.kind == "count" else count
            bar = np.maximum(bar, count_bar(np.asarray(value) * in_all) / in_all)
        bars[name] = np.where(p["clearance"] == 0.0, 0.0, bar) if row.contact else bar
    return bars
