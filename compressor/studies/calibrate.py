"""A sound machine's unknown keys, fitted to its record: bounded least squares on complex orders.

Each point that the fit looks at is a job of the study `CASE-calibrate`, stored and run as any
other: the same question again runs nothing. Compared are complex orders of the mean revolution,
whole numbers of cycles in a revolution of the crank; how far revolutions differ says how well each
is known.

Each order counts relative to its own size, down to its noise: a model of a machine is wrong by some
per cent everywhere (`MODEL_ERROR`), and an unweighted fit would hear the strongest order alone. So
much each order may err by itself, and all of them together (`drifts`): many orders would otherwise
seem to know a mass to a tenth of a per cent. Intervals are those of the linearised problem, with
the ranges as what is known beforehand: a direction that the record does not narrow keeps its
range's width, and its keys are named.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from compressor import cases, store, vibration
from compressor.cases import Case
from compressor.program import Progress, no_progress
from compressor.studies import frame

# ---- a record's orders

AROUND = 9  # orders over which noise is taken to be alike


@dataclass(frozen=True)
class Orders:
    """Complex amplitudes (m/s2) of the orders 1 to n of a record's mean revolution, (n,).

    amplitudes: peak values, their phase from top dead centre; errors: standard error of each, by
    the scatter of revolutions, (n,); revolutions: how many they are a mean of; speed: mean, rev/s.
    """

    amplitudes: np.ndarray
    errors: np.ndarray
    revolutions: int
    speed: float


def orders_of(record: vibration.Record) -> Orders:
    """Return the orders of a record up to what its sampling rate holds.

    Raises RecordError as `vibration.check_record`.
    """
    turned = vibration.by_revolutions(record)
    lines, speed = math.sqrt(2.0) * turned.lines(turned.highest), turned.speed
    count, highest = lines.shape
    scatter = lines.var(axis=0, ddof=1) if count > 1 else np.zeros(highest)
    # few revolutions agree by chance at some orders: noise is known better beside them, too
    around = np.convolve(scatter, np.ones(AROUND), "same") / np.convolve(
        np.ones(highest), np.ones(AROUND), "same"
    )
    errors = np.sqrt(np.maximum(scatter, around) / count)
    return Orders(lines.mean(axis=0), errors, count, speed)


# ---- the fit

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
        sizes = np.abs(amplitudes)
        variances = errors**2 / 2.0 + (MODEL_ERROR * sizes) ** 2 + (FLOOR * sizes.max()) ** 2
        self.sizes = np.sqrt(variances)  # within which real and imaginary parts are fitted
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


# ---- jobs of a case

POINTS_A_KEY = 6  # of the design that the fit begins with
SEED = 1  # of the design
FEW = 25  # jobs that are done before workers have started: most take some 20 ms
SPEED = "machine.speed_rpm"
QUIET = ("sensor.noise_m_per_s2=0", "sensor.speed_jitter=0", "output.keep=series")


class Fitted(NamedTuple):
    """A key's value, and the ends of its 95 % interval within its range, in the file's unit."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Calibration:
    """What a record says of a case's unknown keys.

    case: with the fitted values, and the record's speed; keys: in the order of `fit`; at_end: those
    at an end of their range; orders: how many were compared; revolutions, speed (rev/s): of the
    record; rpm_given: the speed that the case file has; jobs: points that were looked at, `run_now`
    of them run now, in study `study`.
    """

    case: Case
    keys: dict[str, Fitted]
    at_end: tuple[str, ...]
    fit: Fit
    orders: int
    revolutions: int
    speed: float
    rpm_given: float
    jobs: int
    run_now: int
    study: str

    @property
    def open_keys(self) -> list[list[str]]:
        """Return the keys that the record does not separate, or does not determine."""
        names = [*self.keys]
        return [[names[place] for place in group] for group in self.fit.open_directions]


class FitJobs:
    """Evaluates orders of a case at values of its unknown keys, by jobs of one study."""

    def __init__(
        self, path: str, unknowns: Sequence[frame.KeySpan], overrides: Sequence[str],
        folder: store.Folder, workers: int, progress: Progress,
    ):  # fmt: skip
        self.unknowns, self.folder, self.plain = tuple(unknowns), folder, [*overrides]
        keys = [one.key for one in unknowns]
        self.study = frame.GrowingStudy(
            path, keys, "-calibrate", folder, overrides, workers, progress, FEW
        )
        self.highest = 0  # order that is compared
        self.middle = self.case_at(np.full(len(unknowns), 0.5))
        if self.middle.body is None or self.middle.sensor is None:
            raise frame.StudyError(
                f"{path} has no sensor to compare a record with: add body and sensor to it"
            )

    def run_at(self, rpm: float) -> None:
        """Let the case run at a speed, in place of its own, and without noise."""
        self.plain = frame.replace_settings(self.plain, f"{SPEED}={rpm:.{frame.DIGITS}g}")
        self.study.overrides = tuple(frame.replace_settings(self.plain, *QUIET))

    def point(self, shares: np.ndarray) -> frame.Point:
        """Return the values of the keys at shares of their ranges."""
        pairs = zip(self.unknowns, shares.tolist(), strict=True)
        return tuple(one.value(share) for one, share in pairs)

    def case_at(self, shares: np.ndarray) -> Case:
        """Return the case at shares of the ranges. Raises CaseFileError and StudyError."""
        pairs = zip(self.unknowns, self.point(shares), strict=True)
        fitted = (f"{one.key}={value!r}" for one, value in pairs)
        texts = frame.replace_settings(self.plain, *fitted)
        (found,) = cases.load_studies(self.study.path, overrides=texts)
        if found.jobs != 1:
            axes = ", ".join(axis.key for axis in found.axes)
            raise frame.StudyError(
                f"{self.study.path} makes {found.jobs} jobs where one machine is fitted, by "
                f"{axes}: choose one case by --set"
            )
        return found.cases[0]

    def __call__(self, shares: np.ndarray) -> np.ndarray:
        """Return the orders (m/s2) at shares of the ranges; nan where a job failed.

        shares: (k,), or (n, k) for n machines side by side.
        """
        keys = self.study.run([self.point(row) for row in np.atleast_2d(shares)])
        stored = store.read_store(self.folder)
        found = []
        for key in keys:
            record = store.job_record(stored, key)
            if record is None:
                found.append(np.full(self.highest, np.nan + 0j))
            else:
                found.append(orders_of(record).amplitudes[: self.highest])
        return np.array(found).reshape(*shares.shape[:-1], self.highest)


def calibrate(
    record: vibration.Record, path: str, unknowns: Sequence[frame.KeySpan], folder: store.Folder,
    overrides: Sequence[str] = (), workers: int = 2, progress: Progress = no_progress,
) -> Calibration:  # fmt: skip
    """Return what a record of a sound machine says of a case's unknown keys.

    The case runs at the record's mean speed, without noise; compared are complex orders of the mean
    revolution, up to what the record's and the case's sampling rate hold, by bounded least squares.
    Raises CaseFileError, StudyError, StoreError and WorkersFailed.
    """
    if not unknowns:
        raise frame.StudyError("nothing is to be fitted: give --fit KEY=LOW:HIGH")
    if any(one.key == SPEED for one in unknowns):
        raise frame.StudyError(f"{SPEED} is the record's own: leave it out of --fit")
    measured = orders_of(record)
    jobs = FitJobs(path, unknowns, overrides, folder, workers, progress)
    rpm_given = jobs.middle.machine.speed_rpm
    jobs.run_at(60.0 * measured.speed)
    sensor = jobs.middle.sensor
    assert sensor is not None
    corner = min(sensor.low_pass_Hz or math.inf, sensor.rate_Hz / vibration.USABLE)
    # the highest order that both hold; a job's own count may be one less by rounding
    jobs.highest = min(len(measured.amplitudes), int(corner / measured.speed * (1.0 - 1e-9)))
    if not jobs.highest:
        what = f"its sensor's band holds no order of {60 * measured.speed:.6g} rpm"
        raise frame.StudyError(f"{path}: {what}: raise sensor.low_pass_Hz")
    starts = cases.design("lhs", POINTS_A_KEY * len(unknowns), len(unknowns), SEED)
    amplitudes, errors = measured.amplitudes[: jobs.highest], measured.errors[: jobs.highest]
    fit = fit_orders(jobs, amplitudes, errors, starts)
    study = jobs.study
    if not study.jobs:
        raise next(iter(study.refused.values()))  # no point of the ranges makes a case
    if fit is None:
        raise frame.StudyError(f"each job of study {study.name} failed: compsim status shows why")
    ends = np.clip([[0.0], [-SURE], [SURE]] * fit.deviations + fit.shares, 0.0, 1.0)
    keys = {one.key: Fitted(*map(one.value, column))
            for one, column in zip(unknowns, ends.T.tolist(), strict=True)}  # fmt: skip
    is_end = np.minimum(fit.shares, 1.0 - fit.shares) < 1e-3
    at_end = tuple(one.key for one, ends in zip(unknowns, is_end, strict=True) if ends)
    return Calibration(
        jobs.case_at(fit.shares), keys, at_end, fit, jobs.highest, measured.revolutions,
        measured.speed, rpm_given, len(study.jobs), study.run_now, study.name,
    )  # fmt: skip


# ---- as text

POOR_FIT = 1.3  # misfit from which on the machine is said not to be this one


def list_fit(record: str, config: str, found: Calibration) -> Iterator[str]:
    """Yield what was fitted, how well, and what the record does not determine."""
    fit, rpm = found.fit, f"{60 * found.speed:.6g} rpm, in place of the file's {found.rpm_given:g}"
    turns = f"{found.revolutions} revolutions at {rpm}; orders 1 to {found.orders}"
    yield f"{config}, fitted to {record}: {turns}"
    for key, one in found.keys.items():
        more = "; at an end of its range: widen it" if key in found.at_end else ""
        yield f"{key}: {one.value:.4g}, 95 % interval {one.low:.4g} to {one.high:.4g}{more}"
    explained = f"{fit.explained:.2%} of the mean revolution's mean square"
    yield f"the machine explains {explained}; noise is {fit.noise:.2g} of it"
    if fit.misfit >= POOR_FIT:
        times = f"{fit.misfit:.3g} times what a model may err; intervals are widened by as much"
        yield f"THE MACHINE DOES NOT FIT: orders are off by {times}"
    for group in found.open_keys:
        how = "are not separated" if len(group) > 1 else "is not determined"
        yield f"{' and '.join(group)} {how}: the record narrows their range by less than half"


def jsonable_fit(record: str, found: Calibration) -> dict[str, Any]:
    """Return what was fitted as JSON says it."""
    fit = found.fit
    return {
        "record": record,
        "study": found.study,
        "keys": {key: one._asdict() for key, one in found.keys.items()},
        "misfit": fit.misfit,
        "explained": fit.explained,
        "noise": fit.noise,
        "orders": found.orders,
        "revolutions": found.revolutions,
        "speed_rpm": 60 * found.speed,
        "not_told_apart": found.open_keys,
        "case": found.case.values(),
    }
