"""What a record and a machine are compared by: complex orders of the mean revolution.

An order is a whole number of cycles in a revolution of the crank. The mean over revolutions leaves
what every revolution repeats; how far revolutions differ says how well it is known.
"""

import math
from dataclasses import dataclass

import numpy as np

from compressor.program import CompsimError
from compressor.studies.frame import by_revolutions
from compressor.vibration import Record

AROUND = 9  # orders over which noise is taken to be alike


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
    turned = by_revolutions(record)
    lines, speed = math.sqrt(2.0) * turned.lines(turned.highest), turned.speed
    count, highest = lines.shape
    scatter = lines.var(axis=0, ddof=1) if count > 1 else np.zeros(highest)
    # few revolutions agree by chance at some orders: noise is known better beside them, too
    around = np.convolve(scatter, np.ones(AROUND), "same") / np.convolve(
        np.ones(highest), np.ones(AROUND), "same"
    )
    errors = np.sqrt(np.maximum(scatter, around) / count)
    return Orders(lines.mean(axis=0), errors, count, speed)
