"""What is known of a chaotic motion: averages and peaks over revolutions, with standard errors.

Revolutions follow on each other and are no independent draws. So standard errors come from batch
means (Schmeiser, Operations Research 30, 1982): of up to `MOST_BATCHES` batches of as many
revolutions each. A quantile's is that of the batches' own quantiles (sectioning: Asmussen and
Glynn, Stochastic Simulation, 2007, III.5).
"""

import math
from collections.abc import Sequence

import numpy as np

from compressor.metrics import METRICS, QUANTILES
from compressor.solve.error_bars import Metrics
from compressor.solve.tallied import metrics
from compressor.solve.turns import merged

MOST_BATCHES = 30
LEAST_SECTION = 5  # revolutions of which a quantile is taken
SURE = 0.975  # quantile of Student's t: a bar holds in 95 % of cases
AIM = 0.01  # of rms_acceleration: its standard error that revolutions are counted for


def statistics(p: np.record, turns: Sequence[np.record]) -> Metrics:
    """Return statistics by name (`compressor.metrics.STATISTICS`) from the tallies of revolutions.

    A standard error is inf where there are too few revolutions to tell.
    """
    found: Metrics = {"revolutions": float(len(turns))}
    whole = metrics(p, merged(turns))
    each = [metrics(p, turn) for turn in turns]
    batches = [metrics(p, merged(part)) for part in parts(turns, MOST_BATCHES, 1)]
    for name, row in METRICS.items():
        if row.kind == "greatest":
            found |= of_peaks(name, np.array([one[name] for one in each]))
            continue
        averages = np.array([one[name] for one in batches])
        if row.kind == "root":  # the mean square is what is averaged
            error = standard_error(averages**2) / (2.0 * whole[name] or math.nan)
        elif row.kind == "count":  # in so many batches
            error = len(batches) * standard_error(averages)
        else:
            error = standard_error(averages)
        found[f"{name}_standard_error"] = error
    share = found["rms_acceleration_standard_error"] / whole["rms_acceleration"]
    found["revolutions_to_one_percent"] = max(1.0, np.ceil(len(turns) * (share / AIM) ** 2))
    return found


def of_peaks(name: str, values: np.ndarray) -> Metrics:
    """Return the mean and quantiles of the revolutions' greatest values, (n, ...), with standard
    errors.
    """
    means = np.array([part.mean(axis=0) for part in parts(values, MOST_BATCHES, 1)])
    sections = parts(values, MOST_BATCHES, LEAST_SECTION)
    own = np.array([quantiles(part) for part in sections])
    return {
        f"{name}_mean": values.mean(axis=0),
        f"{name}_mean_standard_error": standard_error(means),
        f"{name}_quantile": quantiles(values),
        f"{name}_quantile_standard_error": standard_error(own),
    }


def quantiles(values: np.ndarray) -> np.ndarray:
    """Return the `QUANTILES` over the first axis, as the last one."""
    return np.moveaxis(np.quantile(values, QUANTILES, axis=0), 0, -1)


def parts(items: Sequence | np.ndarray, most: int, least: int) -> list:
    """Up to `most` batches of equally many items in a row, at least `least`; the first are left."""
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
    """Return half the length of the interval that holds in 95 % of cases, by Student's t."""
    batches = len(parts(range(revolutions), MOST_BATCHES, 1))
    from scipy.special import stdtrit  # takes a tenth of a second, of chaotic motions alone

    return np.asarray(error) * float(stdtrit(max(batches - 1, 1), SURE))


def mean_bar(values: np.ndarray) -> float:
    """Return half of the 95 % interval of the mean of revolutions' values in a row, (n,), by batch
    means.

    inf of a single one.
    """
    means = np.array([part.mean() for part in parts(values, MOST_BATCHES, 1)])
    return float(sure(standard_error(means), len(values)))


def chaotic_bars(found: Metrics, numbers: Metrics) -> Metrics:
    """Return the error bars of a chaotic run's metrics: of averages; a greatest value is not
    known.
    """
    bars = {}
    for name, row in METRICS.items():
        if row.kind == "greatest":
            bars[name] = np.where(np.asarray(numbers[name]) == 0.0, 0.0, math.inf)
        else:
            bars[name] = sure(found[f"{name}_standard_error"], int(found["revolutions"]))
    return bars
