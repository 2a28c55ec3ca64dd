"""Amplitude spectra, and the windows that they are taken with.

Amplitudes are single-sided. A line of a sine A sin(...) has the peak amplitude A, or the rms
amplitude A/sqrt(2), in the unit of the signal. The line at zero is the magnitude of the mean in
both. Evaluation standards use other measures of one signal: the rms of a whole band for the
vibration of housings (ISO 20816-1; ISO 20816-8 for reciprocating compressors), the peak-to-peak
displacement for shafts (ISO 7919). Peak-to-peak is 2 A for a single line only.
"""

import numpy as np
from scipy.signal import get_window, welch

from compressor.vibration.checks import SignalError

WINDOWS = {"rectangular": "boxcar", "hann": "hann", "flattop": "flattop"}  # ours -> SciPy's
LONG = 4096  # samples, by which a noise bandwidth no longer depends on their number


def scipy_window(window: str) -> str:
    """Return SciPy's name of one of the `WINDOWS`; raises SignalError."""
    if window not in WINDOWS:
        raise SignalError(f"no window is called {window!r}: choose one of {', '.join(WINDOWS)}")
    return WINDOWS[window]


def noise_bandwidth(window: str) -> float:
    """Return equivalent noise bandwidth of a window, in lines of the spectrum; raises SignalError.

    n sum(w^2) / sum(w)^2: 1 for rectangular, 1.5 for hann, 3.77 for flattop (Harris, Proceedings
    of the IEEE 66, 1978, Eq. 11). White noise raises each line of a mean square by as much.
    """
    taper = get_window(scipy_window(window), LONG)
    return float(taper.size * np.sum(taper**2) / np.sum(taper) ** 2)


def line_amplitudes(values: np.ndarray, block: int, window: str, rms: bool) -> np.ndarray:
    """Single-sided amplitudes of the lines 0, 1, ... block // 2 cycles a block; raises SignalError.

    values: (m,), m >= block. Welch's method (IEEE Transactions on Audio and Electroacoustics 15,
    1967): the mean squares of blocks of `block` samples are averaged, so that a line is the rms
    over blocks. Blocks overlap by half but for the rectangular window; samples after the last whole
    block are left. No mean is taken off. Amplitudes are divided by the window's coherent gain, so
    that a sine of a whole number of cycles a block has its own amplitude with any window. Each is a
    peak value, or with `rms` a root mean square.
    """
    kind = scipy_window(window)
    overlap = 0 if kind == "boxcar" else block // 2
    _, squares = welch(
        values, window=kind, nperseg=block, noverlap=overlap, detrend=False, scaling="spectrum"
    )
    found = np.sqrt(squares)
    if not rms:  # zero and, of an even block, the highest line have no partner that is folded in
        found[1 : (block + 1) // 2] *= np.sqrt(2.0)
    return found
