"""The time series of a run, the forces on its frame, and how far apart two runs are.

Two runs are compared at the same times, whatever is stored of either: their distance is a relative
L2 norm over the settled part, sqrt(sum |a - b|^2 / sum |a|^2). What the forces on the frame are
made of stands in docs/a-run.md.

Contacts last less than a crank angle of 0.3 degrees, and so do the couples of their friction:
values of a stored series are exact, means over one are not.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from compressor.cases import Case
from compressor.metrics import SERIES, SIZES
from compressor.physics import COLUMNS, WIDE, Column, Coordinate, frame_of_series, observe_all
from compressor.solve.request import Metrics, Trajectory

if TYPE_CHECKING:
    import xarray as xr

Variables = dict[str, tuple]  # as xarray has them
COLUMN = {"contact_force": Column.FORCE, "rod_load": Column.FORCE + 2}  # others have its name
COMPARED_PER_REV = 150  # times a revolution at which two runs are compared
SAMPLES_PER_BAND = 2.56  # samples of the forces in a period of the highest frequency requested
SAMPLES_PER_PERIOD = 24  # samples of the forces in one of the body's fastest motion
MIN_COMPARED, MAX_COMPARED = 64, 20_000  # of these times over a settled part


def variable(dims: tuple[str, ...], values: np.ndarray, unit: str, phrase: str) -> tuple:
    """Return a variable as xarray has them."""
    return dims, values, {"units": unit, "long_name": phrase}


def rows_at(
    p: np.record, times: np.ndarray, states: np.ndarray, phases: np.ndarray | int,
    columns: int = COLUMNS,
) -> np.ndarray:  # fmt: skip
    """Return the observed rows of states, (m, n), at times (s), (m,), by phases: (m, columns)."""
    rows, numbers = np.empty((times.size, columns)), np.full(times.size, phases)
    # in one piece: to numba another layout is another type
    observe_all(np.ascontiguousarray(times), np.ascontiguousarray(states), numbers, p, rows)
    return rows


def rows_of(
    p: np.record, run: Trajectory, columns: int = WIDE, part: slice = slice(None)
) -> np.ndarray:
    """Return the observed rows of a run, or a part: (m, columns); nan from where it stopped."""
    rows = rows_at(p, run.times[part], run.states[part], run.phases[part], columns)
    if run.reason:
        rows[np.isnan(run.states[part]).any(axis=1)] = math.nan
    return rows


def finer(case: Case) -> int:
    """Return how many times finer than the output grid the body's forces are sampled."""
    body = case.body
    if body is None:
        return 1
    natural = (body.frequency_x_Hz, body.frequency_y_Hz, body.frequency_rocking_Hz)
    rate = SAMPLES_PER_PERIOD * max(natural)
    if body.band_high_Hz is not None:
        rate = max(rate, SAMPLES_PER_BAND * body.band_high_Hz)
    if case.sensor is not None:
        from compressor.vibration import analogue_rate

        rate = max(rate, analogue_rate(body, case.sensor))
    return max(1, math.ceil(rate * case.duration / round(case.steps) * (1 - 1e-12)))


def column_of(name: str) -> int:
    """Return the first column of a time series in observed rows."""
    return COLUMN.get(name) or Column[name.upper()]


def block(name: str, rows: np.ndarray) -> np.ndarray:
    """Return a time series from observed rows, shape (m,), (m, joint) or (m, joint, axis)."""
    shape, column = tuple(SIZES[dim] for dim in (SERIES | SIGNALS)[name][0]), column_of(name)
    return rows[:, column : column + math.prod(shape)].reshape(-1, *shape)


def compared_times(case: Case) -> np.ndarray:
    """Return the times (s) at which runs of a case are compared; none without bars.

    In each whole settled revolution at the same angles, so that revolutions can be compared.
    """
    if not case.wants_bars:
        return np.empty(0)
    span = case.duration - case.settle
    per_rev = compared_per_rev(case)
    step = case.turn / per_rev if per_rev else span / MIN_COMPARED
    count = max(1, int(span / step * (1 + 1e-12)))
    return case.settle + step * (np.arange(count) + 0.5)  # off the corners of the load


def compared_per_rev(case: Case) -> int:
    """Return how many of `compared_times` a revolution has; 0 where no whole one is settled."""
    revolutions = (case.duration - case.settle) / case.turn
    if revolutions < 1.0:
        return 0
    return round(min(COMPARED_PER_REV, max(1.0, MAX_COMPARED / revolutions)))


def distances(ours: np.ndarray, theirs: np.ndarray) -> Metrics:
    """Return the relative L2 distance of each time series of two runs, by joint where it has one.

    A vector's squares are one sum; 0 where both are 0.
    """
    error, size = (np.einsum("ij,ij->j", rows, rows).tolist() for rows in (ours - theirs, ours))
    found = {}
    for name, (dims, _, _) in SERIES.items():
        first, count = column_of(name), math.prod(SIZES[dim] for dim in dims)
        each = count // SIZES["joint"] if "joint" in dims else count
        parts = [slice(k, k + each) for k in range(first, first + count, each)]
        sums = [(sum(error[part]), sum(size[part])) for part in parts]
        shares = [math.sqrt(apart / whole) if whole > 0.0 else 0.0 for apart, whole in sums]
        found[name] = np.array(shares) if "joint" in dims else np.float64(shares[0])
    return found


# over time and these dimensions: (dimensions, unit, long name)
SIGNALS = {
    "shaking_force": (("axis",), "N", "force of the machine on its foundation"),
    "bearing_force": (("axis",), "N", "force on the main bearing"),
    "guide_force": ((), "N", "force of the crosshead on its guide, upwards"),
    "guide_moment": (
        (), "N m", "moment of the crosshead on its guide about the crank centre, counter-clockwise"
    ),
    "crank_torque": ((), "N m", "torque that drives the crank against the rod, along its rotation"),
    "rod_load": ((), "N", "force of the crosshead pin on the rod along x, positive in tension"),
}  # fmt: skip

# of a mechanism that has the coordinate: the same, and how they come of it
FEATURES: dict[str, tuple[Coordinate, str, str]] = {
    "guide_height": (Coordinate.GUIDE, "m", "height of the crosshead's pin in its guide"),
    "guide_tilt": (Coordinate.TILT, "rad", "tilt of the crosshead, counter-clockwise"),
    "rod_bend": (Coordinate.BEND_1, "m", "deflection of the rod across it, of its first mode"),
    "rod_stretch": (Coordinate.STRETCH, "m", "by which the rod is longer"),
}


def features(
    p: np.record, states: np.ndarray, rows: np.ndarray
) -> dict[str, tuple[np.ndarray, str, str]]:
    """Return the series that a mechanism's features add, by name: values (m,), unit, long name."""
    series = {}
    for name, (coordinate, unit, phrase) in FEATURES.items():
        if p["at"][coordinate] >= 0:
            series[name] = states[:, p["at"][coordinate]].copy(), unit, phrase
    if p["tilting"]:
        gap = rows[:, Column.GUIDE_GAP].copy()
        series["guide_gap"] = gap, "m", "least gap of the crosshead's corners, negative in contact"
    if p["driven"]:
        series["crank_speed"] = rows[:, Column.CRANK_SPEED].copy(), "rad/s", "speed of the crank"
        series["motor_torque"] = rows[:, Column.MOTOR_TORQUE].copy(), "N m", "torque of the motor"
    return series


def signals(rows: np.ndarray) -> dict[str, np.ndarray]:
    """Return the `SIGNALS` by name from observed rows, (m, WIDE)."""
    return {name: block(name, rows).copy() for name in SIGNALS}


def signals_of_scene(p: np.record, run: "xr.Dataset") -> dict[str, np.ndarray]:
    """Return the `SIGNALS` by name from the time series of a run without features; SI."""
    rows = np.empty((run.sizes["time"], WIDE))
    for name, (dims, _, _) in SERIES.items():
        block(name, rows)[...] = run[name].transpose("time", *dims).values
    force, place = block("contact_force", rows), block("eccentricity", rows)
    size = np.linalg.norm(place, axis=2)
    across = place[..., 0] * force[..., 1] - place[..., 1] * force[..., 0]
    friction = -np.divide(across, size, out=np.zeros_like(size), where=size > 0)
    angle = run["crank_angle"].values
    frame_of_series(np.stack((np.cos(angle), np.sin(angle))), friction, p, rows)
    return signals(rows)
