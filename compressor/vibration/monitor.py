"""What a monitoring system reads of a vibration: a band's rms, crank-angle segments, counts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compressor.cases import Body, Sensor
from compressor.vibration.accelerometer import Record, listen
from compressor.vibration.body import BodyMotion, Forces, body_motion
from compressor.vibration.spectra import band_signal, shape

Thresholds = Sequence[float | None]  # m/s2, None for none
Numbers = dict[str, float | np.ndarray]  # metrics by name, SI


@dataclass(frozen=True)
class Monitored:
    """How forces move a body, and what is monitored of it over whole settled revolutions.

    `motion`: at all samples of the forces; `recorded`: by the sensor, None without one. Settled:
    `velocity` in a band, m/s, (m, axis); `record`: m/s2, (n,), and `turns` of the crank there, in
    revolutions from a top dead centre, `first` of them where it settles, (n,), none without a
    sensor; `revolutions`: of each of the two.
    """

    motion: BodyMotion
    recorded: Record | None
    velocity: np.ndarray
    record: np.ndarray
    turns: np.ndarray
    first: float
    revolutions: tuple[int, int]

    def measure(self, thresholds: Thresholds) -> Numbers:
        """Return the metrics by name, of `compressor.metrics.TABLE`.

        None of a body or a record without a whole revolution; no counts without a first threshold.
        """
        numbers: Numbers = {}
        if self.revolutions[0]:
            numbers["body_velocity_rms"] = np.sqrt(np.mean(self.velocity**2, axis=0))
        if self.revolutions[1] < 1:
            return numbers
        return numbers | measure_record(self.record, self.turns, self.revolutions[1], thresholds)

    def cut(self) -> list["Monitored"]:
        """Return each revolution: of the velocity, and of the record where there is one.

        A record may repeat the settled revolutions, which adds no information: no more
        revolutions of it are taken than there are of the velocity.
        """
        whole, recorded = self.revolutions
        count = min(whole, recorded) if recorded else whole
        velocity = np.array_split(self.velocity, whole) if whole else []
        of_turn = [np.floor(self.turns - self.first + 1e-9) == n for n in range(count)]
        return [
            replace(self, velocity=one, record=self.record[mine], turns=self.turns[mine],
                    revolutions=(1, min(1, recorded)))
            for one, mine in zip(velocity, of_turn, strict=False)
        ]  # fmt: skip


def shake_body(
    body: Body, sensor: Sensor | None, forces: Forces, turn: float, guide: float, settle: float
) -> Monitored:
    """Return the body's motion under forces, the sensor's record, and what is monitored.

    forces, turn, guide: see `listen`; settle: s, from where revolutions count: the first sample of
    the forces where the body is steady, else time after it.
    """
    steady = body.start == "steady"
    first = round(settle / turn, 9) % 1.0 if steady else settle / turn
    motion, recorded = body_motion(body, forces, steady), None
    if sensor is not None:
        phase = first if steady else 0.0
        recorded = listen(body, sensor, forces, turn, guide, motion, phase)
    velocity = np.stack([motion["x"].velocity, motion["y"].velocity], axis=1)
    velocity = velocity[0 if steady else round(settle / forces.step) :]
    whole = math.floor((len(velocity) - 1) * forces.step / turn * (1 + 1e-9))
    velocity = velocity[: round(whole * turn / forces.step)]
    if whole:
        in_band = [band_signal(one, 1.0 / forces.step, *body.band_Hz) for one in velocity.T]
        velocity = np.stack(in_band, axis=1)
    if recorded is None:
        return Monitored(motion, None, velocity, np.empty(0), np.empty(0), first, (whole, 0))
    passed = recorded.turns - first
    spacing = (passed[-1] - passed[0]) / max(len(passed) - 1, 1)
    count = math.floor(passed[-1] + 2.0 * spacing)  # up to a sample may lack of the last one
    inside = (passed > -1e-9) & (passed < count - 1e-9)
    record, turns = recorded.values[inside], recorded.turns[inside]
    return Monitored(motion, recorded, velocity, record, turns, first, (whole, count))


def measure_record(
    values: np.ndarray, turns: np.ndarray, revolutions: int, thresholds: Thresholds = ()
) -> Numbers:
    """Return the metrics of a record over whole revolutions, of `compressor.metrics.TABLE`.

    values: m/s2, (n,); turns: of the crank there, (n,); thresholds: without the first, nothing is
    counted; None among them counts as nan.
    """
    (rms, crest, kurtosis, _), levels = shape(values), segment_levels(360.0 * turns, values)
    numbers: Numbers = {
        "sensor_peak": float(np.abs(values).max()), "sensor_rms": rms,
        "sensor_crest_factor": crest, "sensor_kurtosis": kurtosis,
        "sensor_segment_peak": levels[0], "sensor_segment_rms": levels[1],
    }  # fmt: skip
    if thresholds and thresholds[0] is not None:
        counts = [math.nan if one is None else count_peaks(values, one) for one in thresholds]
        numbers["sensor_counts_per_rev"] = np.array(counts) / revolutions
    return numbers


def segment_levels(
    angle_deg: np.ndarray, values: np.ndarray, count: int = 36
) -> tuple[np.ndarray, np.ndarray]:
    """Return the peak and the rms in equal segments of crank angle, (count,) each.

    As protection systems of reciprocating machines watch them. angle_deg: of the samples, at any
    revolution, (m,). Segment k goes from 360 k / count degrees, included, to the next, not
    included. The peak is the greatest magnitude; both are nan where a segment has no sample.
    """
    from scipy.stats import binned_statistic  # takes half a second

    # an angle that rounding has put just before a segment's begin lies in it
    place = (angle_deg + 3.6e-7 / count) % 360.0
    peak, square = (
        binned_statistic(place, of, by, count, (0.0, 360.0)).statistic
        for of, by in ((np.abs(values), "max"), (values**2, "mean"))
    )
    return peak, np.sqrt(square)


def count_peaks(values: np.ndarray, threshold: float) -> int:
    """Return how many peaks of |values| pass a threshold.

    One counts once it is no longer above the threshold: one that the record's end cuts off does
    not, one that its begin cuts off does. Each swing of a casing that rings counts, to either side.
    """
    above = np.abs(values) > threshold
    return int(np.count_nonzero(above[:-1] & ~above[1:]))
