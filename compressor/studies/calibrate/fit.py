"""Bounded least squares on complex orders, with intervals, and what cannot be separated.

Each order counts relative to its own size, down to its noise: a model of a machine is wrong by some
per cent everywhere (`MODEL_ERROR`), and an unweighted fit would hear the strongest order alone. So
much each order may err by itself, and all of them together (`drifts`): many orders would otherwise
seem to know a mass to a tenth of a per cent. Intervals are those of the linearised problem, with
the ranges as what is known beforehand: a direction that the record does not narrow keeps its
range's width, and its keys are named.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

MODEL_ERROR = 0.02  # of each order's amplitude, by which any model of a machine is taken to err
FLOOR = 1e-6  # of the greatest amplitude: below it lies rounding
STEP = 1e-4  # of a range, over which a derivative is taken
STARTS = 2  # best points of the design from which the fit begins
MAX_ROUNDS = 30  # of a fit from one start
SURE = 1.96  # standard deviations of a 95 % interval
UNIFORM = math.sqrt(1.0 / 12.0)  # standard deviation of what is known of a share beforehand
OPEN = 0.5  # of that: the record does not determine a direction whose deviation is above
NAMED = 0.3  # share of a direction from which on a key is named in it

# model: (n, k) shares of the ranges -> complex orders, (n, orders); nan where a job failed
Model = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Fit:
    """What a record says of k unknowns, each a share of its range.

    shares: the best, (k,); deviations: standard deviations, (k,), at most that of the range;
    open_directions: groups of unknowns, by their place; the record determines one number less;
    misfit: root of the mean squared residual where the unknowns matter: at most about 1 where the
    model is right to `MODEL_ERROR`; explained: share of the mean square of the orders; noise: share
    of it that is the record's own scatter.
    """

    shares: np.ndarray
    deviations: np.ndarray
    open_directions: tuple[tuple[int, ...], ...]
    misfit: float
    explained: float
    noise: float

    def interval(self, place: int) -> tuple[float, float]:
        """Return the ends of an unknown's 95 % interval, as shares, within its range."""
        half = SURE * self.deviations[place]
        return max(0.0, self.shares[place] - half), min(1.0, self.shares[place] + half)


def weigh(amplitudes: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Return the standard deviation that each order's real and imaginary part is fitted within."""
    sizes = np.abs(amplitudes)
    least = FLOOR * sizes.max()
    return np.sqrt(errors**2 / 2.0 + (MODEL_ERROR * sizes) ** 2 + least**2)


def drifts(count: int) -> np.ndarray:
    """Return the ways in which all orders err together, (ways, count): gain and phase, and tilts.

    A tilt goes with the logarithm of the order, from -1 at order 1 to 1 at order `count`.
    """
    tilt = 2.0 * np.log(np.arange(1, count + 1)) / max(math.log(count), 1.0) - 1.0
    one = np.ones(count)
    return MODEL_ERROR * np.array([one, tilt, 1j * one, 1j * tilt])


class Misfit:
    """Residuals of a record's orders, and their slopes; points are remembered.

    x: k shares, then how much of each of the `drifts`, in units of what a model may err by. Behind
    the residuals of orders, real and imaginary parts, stand those of what is known beforehand.
    """

    def __init__(self, model: Model, amplitudes: np.ndarray, errors: np.ndarray, unknowns: int):
        self.model, self.amplitudes, self.unknowns = model, amplitudes, unknowns
        self.sizes = weigh(amplitudes, errors)
        self.drifts = drifts(len(amplitudes))
        self.known = np.append(np.full(unknowns, 1.0 / UNIFORM), np.ones(len(self.drifts)))
        self.middle = np.append(np.full(unknowns, 0.5), np.zeros(len(self.drifts)))
        self.seen: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def at(self, shares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the model's orders, and their slopes by the shares, (k, orders).

        A point and its neighbours are evaluated together, so that their jobs run side by side.
        """
        name = shares.tobytes()
        if name not in self.seen:
            steps = np.where(shares + STEP <= 1.0, STEP, -STEP)
            found = self.model(np.vstack([shares, shares + np.diag(steps)]))
            self.seen[name] = found[0], (found[1:] - found[0]) / steps[:, None]
        return self.seen[name]

    def value(self, x: np.ndarray) -> np.ndarray:
        """Return the residuals."""
        orders = self.at(x[: self.unknowns])[0] * (1.0 + x[self.unknowns :] @ self.drifts)
        apart = (orders - self.amplitudes) / self.sizes
        # a job that failed is a place to leave
        data = np.nan_to_num(np.append(apart.real, apart.imag), nan=1e6)
        return np.append(data, (x - self.middle) * self.known)

    def slope(self, x: np.ndarray) -> np.ndarray:
        """Return the slopes of the residuals, (residuals, unknowns)."""
        orders, slopes = self.at(x[: self.unknowns])
        gain = 1.0 + x[self.unknowns :] @ self.drifts
        rows = np.vstack([slopes * gain, self.drifts * orders]) / self.sizes
        data = np.nan_to_num(np.hstack([rows.real, rows.imag]).T)
        return np.vstack([data, np.diag(self.known)])


def fit_orders(
    model: Model, amplitudes: np.ndarray, errors: np.ndarray, starts: np.ndarray
) -> Fit | None:
    """Return the `Fit` of a record's orders; None where the model fails at every start.

    amplitudes, errors: of the record, (orders,), m/s2; starts: design of shares, (n, k). The
    middle of the ranges is weakly preferred, as it was before the record: what that leaves open
    stays there, and not at an end.
    """
    unknowns = starts.shape[1]
    misfit = Misfit(model, amplitudes, errors, unknowns)
    sums = np.sum(np.abs((model(starts) - amplitudes) / misfit.sizes) ** 2, axis=1)
    sums = np.nan_to_num(sums, nan=math.inf)
    good = [place for place in np.argsort(sums)[:STARTS] if math.isfinite(sums[place])]
    if not good:
        return None
    low, high = np.full((2, len(misfit.middle)), [[-math.inf], [math.inf]])
    low[:unknowns], high[:unknowns] = 0.0, 1.0
    ends = [
        least_squares(
            misfit.value, np.append(starts[place], misfit.middle[unknowns:]), misfit.slope,
            (low, high), max_nfev=MAX_ROUNDS, xtol=1e-4, ftol=1e-4,
        )
        for place in good
    ]  # fmt: skip
    return judge(misfit, min(ends, key=lambda end: float(end.cost)).x, errors)


def judge(misfit: Misfit, x: np.ndarray, errors: np.ndarray) -> Fit:
    """Return the `Fit` of the shares and drifts at the end of a descent."""
    unknowns, half = misfit.unknowns, len(misfit.amplitudes)
    apart, slopes = misfit.value(x)[: 2 * half], misfit.slope(x)[: 2 * half]
    weight = np.sum(slopes[:, :unknowns] ** 2, axis=1)  # of a residual: how far unknowns move it
    total = float(weight.sum())
    size = math.sqrt(float(weight @ apart**2) / total) if total else math.nan
    information = slopes.T @ slopes / max(1.0, size) ** 2 + np.diag(misfit.known**2)
    covariance = np.linalg.inv(information)[:unknowns, :unknowns]
    spread, directions = np.linalg.eigh(covariance)
    groups = {
        tuple(np.flatnonzero(np.abs(direction) >= NAMED).tolist())
        for deviation, direction in zip(np.sqrt(spread), directions.T, strict=True)
        if deviation > OPEN * UNIFORM
    }
    left = np.hypot(apart[:half], apart[half:]) * misfit.sizes
    power = float(np.sum(np.abs(misfit.amplitudes) ** 2))
    return Fit(
        x[:unknowns], np.sqrt(np.diag(covariance)), tuple(sorted(groups)), size,
        1.0 - float(np.sum(left**2)) / power, float(np.sum(errors**2)) / power,
    )  # fmt: skip
