"""The metrics of a run: from its tally, from samples, and averages where it is chaotic.

How the rod load at the crosshead pin changes its side, which keeps the pin's bearing oiled. API 618
(5th edition, 6.6.4) judges the combined rod load there: for how many degrees of a revolution it
lies on its smaller side, and how great its peak on that side is beside the other one's.

What is known of a chaotic motion: averages and peaks over revolutions, with standard errors.
Revolutions follow on each other and are no independent draws. So standard errors come from batch
means (Schmeiser, Operations Research 30, 1982): of up to `MAX_BATCHES` batches of as many
revolutions each. A quantile's is that of the batches' own quantiles (sectioning: Asmussen and
Glynn, Stochastic Simulation, 2007, III.5).
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from compressor.cases import Case
from compressor.metrics import METRICS, NUMBERS, QUANTILES
from compressor.physics import (
    COLUMNS,
    Column,
    elastic_form,
    is_featured,
    observe_all,
    read_fields,
)
from compressor.solve.error_bars import Companion, Metrics, energy_residual
from compressor.solve.request import Trajectory, last_state, merge_turns

ROUNDING = 1e-12


def metrics(p: np.record, tallied: np.record) -> Metrics:
    """Return the metrics by name, from what was tallied after settling.

    In the units and shapes of `compressor.metrics.TABLE`: (), (joint,) or (joint, axis).
    """
    tally = read_fields(tallied)
    seconds = tally["seconds"] or math.nan
    axes, sizes = Column.FORCE - Column.ACCELERATION, Column.FORCE_SIZE - Column.ACCELERATION
    journals = Column.JOURNAL_ACCELERATION - Column.ACCELERATION
    moved = np.array([p["reciprocating_mass"] + p["rod_mass"], p["reciprocating_mass"]])
    force = tally["peak"][sizes:journals]
    blow = moved * tally["peak"][journals:]
    # the spans of steps add up to within rounding: whole revolutions are to stay whole
    name = "steady_seconds" if is_featured(p) else "seconds"
    steady = tally[name] or math.nan
    revolutions = round(float(steady * p["omega"]) / math.tau, 9)
    of_joints = {
        "knock": np.divide(blow, force, out=np.zeros(2), where=force > 0.0),
        "max_penetration": tally["max_penetration"],
        "contact_loss_fraction": tally["loss_seconds"] / seconds,
        "impact_count": tally["impacts"],
        "release_count": tally["releases"],
        "impacts_per_rev": tally["impacts"] / revolutions,
        "releases_per_rev": tally["releases"] / revolutions,
    }
    clear = np.where(p["clearance"] == 0, 0.0, [*of_joints.values()])
    numbers = {
        "peak_acceleration": tally["peak"][0],
        "rms_acceleration": math.sqrt(tally["square_acceleration"] / seconds),
        "rms_acceleration_deviation": math.sqrt(tally["square_deviation"] / seconds),
        "peak_contact_force": force,
        "peak_contact_force_axis": tally["peak"][axes:sizes].reshape(2, 2),
        "mean_crank_torque": tally["crank_torque"] / seconds,
        "mean_guide_moment": tally["guide_moment"] / seconds,
    } | dict(zip(of_joints, clear, strict=True))
    return {name: value for name, value in numbers.items() if has_metric(p, NUMBERS[name].when)}


def has_metric(p: np.record, flag: str) -> bool:
    """Return whether a machine has what a metric needs: a flag of the record, or nothing."""
    return not flag or (is_featured(p) and bool(p[flag]))


def held_by_springs(p: np.record, trajectory: Trajectory) -> float:
    """Return by how much more energy (J) the contacts' springs hold at a run's end than before."""
    if not p["clearance"].any() or not trajectory.states[0].size:
        return 0.0
    states = np.stack([trajectory.states[0], last_state(trajectory)])
    rows = np.empty((2, COLUMNS))
    end = trajectory.stop_time if trajectory.reason else trajectory.times[-1]
    times, phases = np.array([trajectory.times[0], end]), trajectory.phases[[0, -1]]
    observe_all(times, states, phases, p, rows)
    held = np.zeros(2)
    for joint, (stiffness, clearance) in enumerate(
        zip(p["stiffness"], p["clearance"], strict=True)
    ):
        for k, depth in enumerate(rows[:, Column.PENETRATION + joint].tolist()):
            if depth > 0.0 and clearance > 0.0:
                held[k] += elastic_form(stiffness, clearance, p).energy(depth)
    return float(held[1] - held[0])


def ledger(p: np.record, trajectory: Trajectory) -> dict[str, float]:
    """Return the energy flows and counts by name."""
    tally, state = trajectory.tally, last_state(trajectory)
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


SAMPLES_PER_REV = 1440  # for `SAMPLED` metrics
MIN_SAMPLES, MAX_SAMPLES = 64, 200_000  # of them over a settled part
SMALL_END = Column.FORCE + 2  # of the pin's force along x, positive in tension


def sampled_times(case: Case) -> np.ndarray:
    """Return the times (s) after settling at which a run is sampled for `SAMPLED` metrics.

    Empty without signals.
    """
    span = case.duration - case.settle
    samples = min(max(SAMPLES_PER_REV * span / case.turn, MIN_SAMPLES), MAX_SAMPLES)
    count = round(samples) if case.output.signals else 0
    return case.settle + span / max(count, 1) * (np.arange(count) + 0.5)


def reversal_angle(rows: np.ndarray, peak: float) -> float:
    """Return the crank angle (rad) of the rod load's smaller side, straight between samples."""
    load = rows[:, SMALL_END]
    before, after = load[:-1], load[1:]
    width = np.abs(after - before)
    above = np.maximum(before, 0.0) + np.maximum(after, 0.0)
    # of a step whose ends have the same sign all or nothing, else the part above zero
    crossing = before * after < 0.0
    part = np.divide(above, width, out=np.zeros_like(width), where=crossing)
    inside = np.where(crossing, part, before + after > 0.0).sum()
    tension = (inside + 0.5 * (load[0] > 0.0) + 0.5 * (load[-1] > 0.0)) / load.size
    return 2.0 * math.pi * min(tension, 1.0 - tension)


def greatest_sides(rows: np.ndarray, peak: float) -> tuple[float, float]:
    """Return the greatest tension and compression (N) of the rod load; 0 without any.

    Samples say which is greater, and `peak` how great: the one that they found may lie between two.
    """
    load = rows[:, SMALL_END]
    pull, push = max(float(load.max()), 0.0), max(float(-load.min()), 0.0)
    return (max(pull, peak), push) if pull >= push else (pull, max(push, peak))


def greatest_pull(rows: np.ndarray, peak: float) -> float:
    """Return the greatest tension (N) of the rod load; 0 without any."""
    return greatest_sides(rows, peak)[0]


def greatest_push(rows: np.ndarray, peak: float) -> float:
    """Return the greatest compression (N) of the rod load; 0 without any."""
    return greatest_sides(rows, peak)[1]


def reversal_share(rows: np.ndarray, peak: float) -> float:
    """Return the peak of the rod load's smaller side over that of the greater one."""
    pull, push = greatest_sides(rows, peak)
    greater = max(pull, push)
    return min(pull, push) / greater if greater else 0.0


# metrics of samples: from observed rows, (m, WIDE), each in the middle of one of m equal steps, and
# the greatest rod load (N) of the whole solution
SAMPLED: dict[str, Callable[[np.ndarray, float], float]] = {
    "rod_load_reversal_angle": reversal_angle,
    "rod_load_reversal_share": reversal_share,
    "peak_rod_load_tension": greatest_pull,
    "peak_rod_load_compression": greatest_push,
}


def sampled_metrics(rows: np.ndarray, found: Mapping[str, Any]) -> Metrics:
    """Return the `SAMPLED` metrics by name; none without rows.

    found: the run's `metrics`; without them by samples alone.
    """
    peak = float(found["peak_contact_force_axis"][1][0]) if found else 0.0  # small end, along x
    return {name: measure(rows, peak) for name, measure in SAMPLED.items()} if len(rows) else {}


def sampled_bars(rows: np.ndarray, found: Mapping[str, Any], other: Companion | None) -> Metrics:
    """Return the error bar of each `SAMPLED` metric, by another run; none without one.

    Half of what a third of the samples changes, whichever third, stands for what is lost between
    them: it bounds what a peak with a kink loses, and is at least 4 times what a parabola's top
    does, wherever they lie between two samples. Where the smaller side may have lost so much that
    the greatest load is its own, both sides' bars reach what samples say. The bars are as careful
    as those of the metrics that were calibrated (`compressor.metrics.Bar`).
    """
    if other is None or not len(rows):
        return {}
    numbers, plain = sampled_metrics(rows, found), sampled_metrics(rows, {})
    thirds = [third for k in range(3) if (third := sampled_metrics(rows[k::3], found))]
    lost = {
        name: 0.5 * max(abs(value - third[name]) for third in thirds)
        for name, value in numbers.items()
    }
    sides = "peak_rod_load_tension", "peak_rod_load_compression"
    smaller, greater = sorted(sides, key=lambda side: plain[side])
    is_sure, bars = plain[smaller] + lost[smaller] < numbers[greater], {}
    for name, value in numbers.items():
        row = NUMBERS[name]
        distance = float(np.ravel(other.apart[row.series])[row.joint])
        path = row.bar.path * distance * abs(value)
        by_run = other.closeness * math.hypot(row.bar.own * (value - other.metrics[name]), path)
        bars[name] = by_run + lost[name] + (0.0 if is_sure else abs(value - plain[name]))
    return bars


MAX_BATCHES = 30
MIN_SECTION = 5  # revolutions for a quantile
T_QUANTILE = 0.975  # quantile of Student's t: a bar holds in 95 % of cases
RMS_ERROR_AIM = 0.01  # of rms_acceleration: its standard error that revolutions are counted for


def statistics(p: np.record, turns: Sequence[np.record]) -> Metrics:
    """Return `compressor.metrics.statistics_of` all metrics by name, from the revolutions' tallies.

    A standard error is inf where there are too few revolutions.
    """
    estimates: Metrics = {"revolutions": float(len(turns))}
    whole = metrics(p, merge_turns(turns))
    per_revolution = [metrics(p, turn) for turn in turns]
    batches = [metrics(p, merge_turns(part)) for part in parts(turns, MAX_BATCHES, 1)]
    for name, row in METRICS.items():
        if row.kind == "greatest":
            estimates |= summarize_peaks(name, np.array([one[name] for one in per_revolution]))
            continue
        averages = np.array([one[name] for one in batches])
        if row.kind == "root":  # the mean square is what is averaged
            error = standard_error(averages**2) / (2.0 * whole[name] or math.nan)
        elif row.kind == "count":  # in so many batches
            error = len(batches) * standard_error(averages)
        else:
            error = standard_error(averages)
        estimates[f"{name}_standard_error"] = error
    share = estimates["rms_acceleration_standard_error"] / whole["rms_acceleration"]
    estimates["revolutions_to_one_percent"] = max(
        1.0, np.ceil(len(turns) * (share / RMS_ERROR_AIM) ** 2)
    )
    return estimates


def summarize_peaks(name: str, values: np.ndarray) -> Metrics:
    """Return mean and quantiles of the revolutions' greatest values, with standard errors.

    values: (revolutions, ...).
    """
    means = np.array([part.mean(axis=0) for part in parts(values, MAX_BATCHES, 1)])
    sections = parts(values, MAX_BATCHES, MIN_SECTION)
    section_quantiles = np.array([quantiles(part) for part in sections])
    return {
        f"{name}_mean": values.mean(axis=0),
        f"{name}_mean_standard_error": standard_error(means),
        f"{name}_quantile": quantiles(values),
        f"{name}_quantile_standard_error": standard_error(section_quantiles),
    }


def quantiles(values: np.ndarray) -> np.ndarray:
    """Return the `QUANTILES` over the first axis, as the last one."""
    return np.moveaxis(np.quantile(values, QUANTILES, axis=0), 0, -1)


def parts(items: Sequence | np.ndarray, most: int, least: int) -> list:
    """Return up to `most` batches of equally many items in a row, at least `least` in each.

    The first items are left out where the batches do not take all.
    """
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
    """Return half the length of the interval that holds in 95 % of cases, by Student's t.

    error: standard error of a mean by `parts` of so many revolutions.
    """
    batches = len(parts(range(revolutions), MAX_BATCHES, 1))
    from scipy.special import stdtrit  # takes a tenth of a second, of chaotic motions alone

    return np.asarray(error) * float(stdtrit(max(batches - 1, 1), T_QUANTILE))


def mean_bar(values: np.ndarray) -> float:
    """Return half of the 95 % interval of the mean of revolutions' values, by batch means.

    values: (n,), in a row. inf of a single one.
    """
    means = np.array([part.mean() for part in parts(values, MAX_BATCHES, 1)])
    return float(sure(standard_error(means), len(values)))


def chaotic_bars(estimates: Metrics, numbers: Metrics) -> Metrics:
    """Return the error bars of a chaotic run's metrics: of averages; greatest values have inf."""
    bars = {}
    for name, row in METRICS.items():
        if row.kind == "greatest":
            bars[name] = np.where(np.asarray(numbers[name]) == 0.0, 0.0, math.inf)
        else:
            bars[name] = sure(estimates[f"{name}_standard_error"], int(estimates["revolutions"]))
    return bars
