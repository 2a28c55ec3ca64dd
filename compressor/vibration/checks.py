"""What a signal must be before it is read."""

import math
import operator

import numpy as np

from compressor.program import CompsimError


class SignalError(CompsimError):
    """A signal, or a choice, that cannot be analysed: what is wrong and what to do about it."""

    exit_code = 2


def checked_signal(values: np.ndarray, what: str = "the signal") -> np.ndarray:
    """Return the values as floats, (m,); raises SignalError unless they are finite, real and in
    a row.
    """
    found = np.asarray(values)
    if found.ndim != 1 or found.size == 0:
        shape = f"{what} has shape {found.shape}"
        raise SignalError(f"{shape}: pass one component, with at least one sample")
    if np.iscomplexobj(found):
        raise SignalError(f"{what} is complex: pass its real part or its magnitude")
    found = found.astype(float)
    bad = np.flatnonzero(~np.isfinite(found))
    if bad.size:
        rest = f"not finite at {bad.size} of {found.size} samples, first at index {bad[0]}"
        raise SignalError(f"{what} is {rest}: cut these samples off, or fill them")
    return found


def checked_angle(angle: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the angles (rad) and values as floats, (m,) each; raises SignalError.

    The angles must increase from sample to sample.
    """
    at, found = checked_signal(angle, "the crank angle"), checked_signal(values)
    if at.size != found.size:
        raise SignalError(f"{at.size} angles and {found.size} values: pass one angle per sample")
    if at.size < 4:
        raise SignalError(f"{at.size} samples are too few for a cubic spline: pass at least 4")
    back = np.flatnonzero(np.diff(at) <= 0.0)
    if back.size:
        where = f"the crank angle does not increase after index {back[0]}"
        raise SignalError(f"{where}: unwrap it, and drop samples that repeat")
    return at, found


def checked_count(value: int, least: int, what: str) -> int:
    """Return a whole number of at least `least`; raises SignalError."""
    try:
        found = operator.index(value)
    except TypeError:
        raise SignalError(f"{what} is {value!r}: pass a whole number") from None
    if found < least:
        raise SignalError(f"{what} is {found}: pass at least {least}")
    return found


def checked_positive(value: float, what: str) -> float:
    """Return a finite number above zero; raises SignalError."""
    if not (math.isfinite(value) and value > 0.0):
        raise SignalError(f"{what} is {value}: pass a finite number above 0")
    return float(value)


def whole_revolutions(count: int, a_turn: int) -> int:
    """Return how many revolutions of a_turn samples count samples are; raises SignalError."""
    a_turn = checked_count(a_turn, 2, "the number of samples a revolution")
    if count % a_turn:
        rest = f"{count} samples are no whole number of revolutions of {a_turn} samples"
        raise SignalError(f"{rest}: resample the signal at equal angles by `resampled`")
    return count // a_turn
