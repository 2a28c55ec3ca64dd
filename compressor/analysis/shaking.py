"""How joints with clearance shake the frame: orders of the force along the cylinder, and when.

A worn joint puts its force on the frame in high orders of the crank speed, where the ideal machine
has next to none. The part above `ORDER` is split by crank angle. One share lies about the changes
of direction of a joint's force, where the journal crosses its bore and swings on the other side;
the other lies elsewhere.
"""

import itertools
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from compressor.analysis.contacts import joints_with_clearance
from compressor.analysis.runs import case_of, ideal_motion, record_of, settled_part
from compressor.cases import Case, with_ideal_joints
from compressor.solve import SIGNALS, signals_of_scene, simulate

if TYPE_CHECKING:
    import xarray as xr


class NoSeriesError(ValueError):
    """A run without stored series, or with too few to be read."""


def frame_forces(run: "xr.Dataset") -> dict[str, np.ndarray]:
    """Return the signals of `compressor.solve.series` by name, at all samples of a run; SI.

    They are those that the run has stored, or follow from its time series. A machine with features
    is simulated again where they are not stored: its guide, oil and drive show in no other series.
    Raises NoSeriesError for a run without time series.
    """
    if "time" not in run.dims or "contact_force" not in run:
        raise NoSeriesError("the run has no time series (output.keep: series)")
    if all(name in run for name in SIGNALS):
        return {
            name: run[name].transpose("time", *dims).values
            for name, (dims, _, _) in SIGNALS.items()
        }
    case = case_of(run)
    if not (case.needs_mechanism or case.lubricant):
        return signals_of_scene(record_of(run), run)
    values, degrees = case.values(), np.degrees(run["crank_angle"].values)
    each = round((degrees[-1] - degrees[0]) / (degrees.size - 1), 9)
    samples = np.rint(degrees / each).astype(int)
    values["solve"] = {  # of the case as it was run, without what was yet to be found
        "method": case.solve.method, "rtol": float(run.attrs["rtol"]), "error_bars": False,
        "max_steps": case.solve.max_steps, "timeout_s": case.solve.timeout_s,
        "settle_rev": round(float(run.attrs["settle"]) / case.turn, 9),
        "duration_rev": int(samples[-1]) * each / 360.0, "output_step_deg": each,
    }  # fmt: skip
    values["output"] = {"keep": "series", "signals": True}
    return frame_forces(simulate(Case.resolve(values)).isel(time=samples))


def whole_revolutions(run: "xr.Dataset") -> "tuple[xr.Dataset, int]":
    """Return the settled samples up to the last whole revolution's end, and how many they are.

    Raises NoSeriesError for a run without time series, or that settles within less than one.
    """
    if "time" not in run.dims or "crank_angle" not in run:
        raise NoSeriesError("the run has no time series (output.keep: series)")
    settled = settled_part(run)
    turns = (settled["crank_angle"].values - settled["crank_angle"].values[0]) / (2.0 * np.pi)
    count = int(np.floor(turns[-1] + 1e-6))
    if count < 1:
        raise NoSeriesError("the run has no whole settled revolution (solve.duration_rev)")
    beyond = int(np.searchsorted(turns, count + 1e-6, "right"))
    return settled.isel(time=slice(beyond)), count  # views, no copies


def last_revolution(run: "xr.Dataset") -> "tuple[np.ndarray, xr.Dataset]":
    """Return the last whole settled revolution, both ends included, and its crank angles (degrees).

    The first angle lies from 0 to 360. Raises NoSeriesError as `whole_revolutions`.
    """
    settled, count = whole_revolutions(run)
    angle = np.degrees(settled["crank_angle"].values)
    first = int(np.searchsorted(angle, angle[0] + 360.0 * (count - 1) - 1e-6))
    angle = angle[first:]
    return angle - 360.0 * np.floor(angle[0] / 360.0 + 1e-9), settled.isel(time=slice(first, None))


def healthy_twin(run: "xr.Dataset", sensed: bool = False) -> "xr.Dataset":
    """Return the run of the same machine with ideal joints, on the output grid of its own case.

    From closed forms, or simulated where a feature leaves none: it may then fail. Without error
    bars; with body and sensor where it is to be `sensed`. Only the run's case is read.
    """
    ideal = with_ideal_joints(case_of(run))
    values = (ideal if sensed else replace(ideal, body=None, sensor=None)).values()
    values["solve"]["error_bars"] = False
    values["output"] = {"keep": "series", "signals": ideal.output.signals}
    return simulate(Case.resolve(values))


def healthy_body_velocity_rms(case: Case) -> np.ndarray:
    """Return the metric `body_velocity_rms` of a case's machine with ideal joints, m/s, (2,)."""
    values = replace(with_ideal_joints(case), sensor=None).values()
    values["solve"]["error_bars"] = False
    return simulate(Case.resolve(values))["body_velocity_rms"].values


ORDER = 12  # of the crank speed: above it the ideal machine's force has next to nothing
SAME_TURN_DEGREES = 20.0  # changes of sign nearer to each other are one turn
BEFORE, AFTER = 10.0, 50.0  # degrees about a change of direction that count as belonging to it
LEVELS = 5  # of the kurtogram that chooses a sensor's band, at most
MIN_SHARE = 0.01  # of the record's energy that this band has
MIN_LINES = 128  # samples that a level of it needs, twice over for each further one


@dataclass(frozen=True)
class Spectrum:
    """Lines over orders of the crank speed, (k,) each: peak amplitudes in the signal's unit.

    Blocks are revolutions, whose mean squares are averaged. `above`: rms of what lies above
    `ORDER` over all of them, in the signal's unit.
    """

    orders: np.ndarray
    amplitudes: np.ndarray
    above: float

    @property
    def lines(self) -> tuple[np.ndarray, np.ndarray]:
        """Return orders and amplitudes."""
        return self.orders, self.amplitudes


@dataclass(frozen=True)
class Shaking:
    """The force X on the frame along the cylinder, over `revolutions` settled ones.

    `turns`: crank angles (degrees) at which a force along the cylinder at a joint with clearance
    changes its sign. `angle` (degrees) and `mean_square` (N^2), (a_turn,): of the part of X above
    `ORDER`, a mean over revolutions. The rms of this part has two shares, N, whose squares add up
    to its own: `near_turns`, from `BEFORE` to `AFTER` a turn, and `elsewhere`.
    """

    revolutions: int
    spectrum: Spectrum
    turns: tuple[float, ...]
    angle: np.ndarray
    mean_square: np.ndarray
    near_turns: float
    elsewhere: float


def shaking(run: "xr.Dataset") -> Shaking:
    """Return the `Shaking` of a run with time series; of ideal joints there are no turns.

    Raises NoSeriesError where the series hold no whole settled revolution, RecordError where they
    are too coarse for `ORDER`.
    """
    from compressor.vibration import high_pass_orders

    settled, revolutions = whole_revolutions(run)
    crank = settled["crank_angle"].values
    force = frame_forces(settled)["shaking_force"][:, 0]
    even, a_turn = evenly(settled, revolutions, force)
    high = high_pass_orders(even, a_turn, ORDER)
    angle = (np.degrees(crank[0]) + 360.0 * np.arange(a_turn) / a_turn) % 360.0
    mean_square = (high.reshape(-1, a_turn) ** 2).mean(axis=0)
    turns = directions_change(settled)
    is_near = near_a_turn(angle, turns)
    return Shaking(
        revolutions,
        order_lines(even, a_turn),
        turns,
        angle,
        mean_square,
        math.sqrt(float(mean_square[is_near].sum()) / a_turn),
        math.sqrt(float(mean_square[~is_near].sum()) / a_turn),
    )


def evenly(settled: "xr.Dataset", revolutions: int, values: np.ndarray) -> tuple[np.ndarray, int]:
    """Return a signal resampled at equal crank angles, and their even number a turn.

    values: a signal of `whole_revolutions`.
    """
    from compressor.vibration import resample_angle

    crank = settled["crank_angle"].values
    a_turn = (crank.size - 1) // revolutions // 2 * 2
    if not a_turn:
        raise NoSeriesError("the run has no two samples a revolution (solve.output_step_deg)")
    return resample_angle(crank, values, a_turn)[: revolutions * a_turn], a_turn


def order_lines(even: np.ndarray, a_turn: int) -> Spectrum:
    """Return the order spectrum of a signal at equal crank angles.

    even: whole revolutions of `a_turn` samples each.
    """
    from compressor.vibration import line_amplitudes

    amplitudes = line_amplitudes(even, a_turn, False)
    fine = line_amplitudes(even, even.size, True)[ORDER * even.size // a_turn + 1 :]
    above = math.sqrt(float(np.sum(fine**2)))  # Parseval
    return Spectrum(np.arange(amplitudes.size), amplitudes, above)


def deviation_spectrum(run: "xr.Dataset") -> Spectrum:
    """Return the order spectrum of the acceleration less the ideal machine's, m/s2.

    Of the crosshead, over whole settled revolutions. Raises NoSeriesError where there is none.
    """
    settled, revolutions = whole_revolutions(run)
    deviation = settled["acceleration"].values - ideal_motion(settled)[2]
    return order_lines(*evenly(settled, revolutions, deviation))


def directions_change(settled: "xr.Dataset") -> tuple[float, ...]:
    """Return the crank angles (degrees) at which forces along the cylinder change sign.

    Of all joints with clearance, in rising order.
    """
    try:
        joints = joints_with_clearance(settled)
    except ValueError:
        return ()
    crank = np.degrees(settled["crank_angle"].values)
    forces = (settled["contact_force"].sel(joint=joint, axis="x").values for joint in joints)
    return tuple(sorted(turn for force in forces for turn in turning_points(crank, force)))


def turning_points(angle: np.ndarray, force: np.ndarray) -> tuple[float, ...]:
    """Return the crank angles (degrees, 0 to 360) at which a force changes its sign.

    angle: of the samples, (m,) degrees; changes of several revolutions, and of a force that
    trembles about zero, are put together where they are nearer than `SAME_TURN_DEGREES`.
    """
    angle, force = angle[force != 0.0], force[force != 0.0]  # to be free is no change of sign
    at = np.sort(angle[1:][np.diff(np.sign(force)) != 0] % 360.0)
    if not at.size:
        return ()
    groups: list[list[float]] = [[at[0]]]
    for one, other in itertools.pairwise(at):
        if other - one > SAME_TURN_DEGREES:
            groups.append([])
        groups[-1].append(float(other))
    if len(groups) > 1 and groups[0][0] + 360.0 - groups[-1][-1] <= SAME_TURN_DEGREES:
        groups[0] = [one - 360.0 for one in groups.pop()] + groups[0]
    return tuple(sorted(float(np.mean(group)) % 360.0 for group in groups))


def near_a_turn(angle: np.ndarray, turns: tuple[float, ...]) -> np.ndarray:
    """Return whether crank angles (degrees, (m,)) lie from `BEFORE` to `AFTER` a turn.

    turns: the crank angles of all changes of direction, degrees.
    """
    is_near = np.zeros(angle.size, bool)
    for turn in turns:
        is_near |= (angle - turn + BEFORE) % 360.0 < BEFORE + AFTER
    return is_near


@dataclass(frozen=True)
class SensorEnvelope:
    """The envelope spectrum of a sensor's record: orders and amplitudes (m/s2), (k,) each.

    `band`: in Hz, the one with the greatest `kurtosis` of those bands of the kurtogram that hold
    `MIN_SHARE`; beyond the sensor's filter there is rounding alone.
    """

    orders: np.ndarray
    amplitudes: np.ndarray
    band: tuple[float, float]
    kurtosis: float


def sensor_envelope(run: "xr.Dataset") -> SensorEnvelope | None:
    """Return the envelope spectrum of a run's sensor; None without, or of too short a record."""
    from compressor.vibration import envelope_spectrum, kurtogram, line_amplitudes

    if "sensor_acceleration" not in run:
        return None
    values, time = run["sensor_acceleration"].values, run["sensor_time"].values
    if values.size < 4 * MIN_LINES or not np.isfinite(values).all() or not np.ptp(values):
        return None
    rate = (time.size - 1) / (time[-1] - time[0])
    levels = min(LEVELS, int(math.log2(values.size // MIN_LINES)))
    centre, width, kurtosis = kurtogram(values, rate, levels)
    power = line_amplitudes(values, values.size, True) ** 2
    lines = np.arange(power.size) * rate / values.size
    edges = centre - width / 2, centre + width / 2
    cumulative = np.append(0.0, np.cumsum(power))
    low, high = (np.searchsorted(lines, edge) for edge in edges)
    strong = cumulative[high] - cumulative[low] >= MIN_SHARE * power.sum()
    best = int(np.nanargmax(np.where(strong, kurtosis, np.nan)))
    band = float(edges[0][best]), float(edges[1][best])
    speed = 1.0 / case_of(run).turn
    orders, amplitudes = envelope_spectrum(values, rate, band, speed=speed)
    return SensorEnvelope(orders, amplitudes, band, float(kurtosis[best]))
