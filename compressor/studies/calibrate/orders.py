"""What a record and a machine are compared by: complex orders of the mean revolution.

An order is a whole number of cycles in a revolution of the crank. The mean over revolutions leaves
what every revolution repeats; how far revolutions differ says how well it is known.
"""

import math
from dataclasses import dataclass

import numpy as np

from compressor.program import CompsimError
from compressor.vibration import Record, check_record, resample_angle, turns_at

AROUND = 9  # orders over which noise is taken to be alike
LIMIT = 2.56  # sampling rate over the highest frequency that an anti-aliasing filter passes


class CalibrationError(CompsimError):
    """A question by which no machine can be fitted."""

    exit_code = 2


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

    def up_to(self, highest: int) -> "Orders":
        """Return the orders from 1 to `highest`."""
        return Orders(
            self.amplitudes[:highest], self.errors[:highest], self.revolutions, self.speed
        )


def orders_of(record: Record) -> Orders:
    """Return the orders of a record up to what its sampling rate holds.

    Raises RecordError as `vibration.check_record`.
    """
    revolutions = check_record(record.times, record.values, record.tacho)
    rate = (len(record.times) - 1) / (record.times[-1] - record.times[0])
    speed = revolutions / (record.tacho[-1] - record.tacho[0])
    turns = turns_at(record.times, record.tacho)
    first = max(int(np.searchsorted(turns, 0.0, side="right")) - 1, 0)
    a_turn = 2 * math.ceil(rate / speed / 2.0)
    even = resample_angle(2.0 * math.pi * turns[first:], record.values[first:], a_turn)
    count = even.size // a_turn  # one less where the first sample is behind top dead centre
    lines = np.fft.rfft(even.reshape(count, a_turn), axis=1) * (2.0 / a_turn)
    order = np.arange(1, int(rate / LIMIT / speed) + 1)
    # sample 0 is at the first angle, up to a sample before top dead centre
    lines = lines[:, order] * np.exp(-2j * math.pi * order * turns[first])
    scatter = lines.var(axis=0, ddof=1) if count > 1 else np.zeros(order.size)
    # few revolutions agree by chance at some orders: noise is known better beside them, too
    around = np.convolve(scatter, np.ones(AROUND), "same") / np.convolve(
        np.ones(order.size), np.ones(AROUND), "same"
    )
    errors = np.sqrt(np.maximum(scatter, around) / count)
    return Orders(lines.mean(axis=0), errors, count, speed)
