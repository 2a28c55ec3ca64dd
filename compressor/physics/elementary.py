"""Elementary functions without a call.

They give the same bits on every machine, which libraries do not promise. Polynomials are summed in
pairs, each with one rounding: a step waits for them.
"""

import math

import numpy as np

from compressor.physics._jit import fma, inline_llvm

LOG_2 = math.log(2.0)
PER_LOG_2 = 1.0 / LOG_2
ROOT_2 = math.sqrt(2.0)
BIAS, FRACTION_BITS = 1023, 52
FRACTION, ONE = (1 << FRACTION_BITS) - 1, BIAS << FRACTION_BITS
THIRD, FIFTH, SEVENTH, NINTH = 1 / 3, 1 / 5, 1 / 7, 1 / 9
SIXTH, PER_24, PER_120, PER_720, PER_5040 = 1 / 6, 1 / 24, 1 / 120, 1 / 720, 1 / 5040
# fdlibm's split of pi / 2, and its polynomials of sine and cosine up to pi / 4
PER_QUARTER = 2.0 / math.pi
QUARTER_HIGH, QUARTER_LOW = 1.57079632673412561417, 6.07710050650619224932e-11
S1, S2, S3 = -1.66666666666666324348e-1, 8.33333333332248946124e-3, -1.98412698298579493134e-4
S4, S5, S6 = 2.75573137070700676789e-6, -2.50507602534068634195e-8, 1.58969099521155010221e-10
C1, C2, C3 = 4.16666666666666019037e-2, -1.38888888888741095749e-3, 2.48015872894767294178e-5
C4, C5, C6 = -2.75573143513906633035e-7, 2.08757232129817482790e-9, -1.13596475577881948265e-11


@inline_llvm
def logarithm(x):
    """Return the natural logarithm of a normal positive number, to 1e-8: enough to choose a step.

    x = m 2^e with m about 1, and log m = 2 artanh((m - 1) / (m + 1)) as a series.
    """
    bits = np.float64(x).view(np.int64)
    exponent = (bits >> FRACTION_BITS) - BIAS
    m = np.int64((bits & FRACTION) | ONE).view(np.float64)
    high = m > ROOT_2
    m = 0.5 * m if high else m
    exponent = exponent + 1 if high else exponent
    f = (m - 1.0) / (m + 1.0)
    s = f * f
    q = s * s
    series = fma(q, fma(q, NINTH, fma(s, SEVENTH, FIFTH)), fma(s, THIRD, 1.0))
    return fma(np.float64(exponent), LOG_2, 2.0 * f * series)


@inline_llvm
def exponential(y):
    """Return e^y for |y| < 700, to 1e-8: 2^k times a Taylor series of the rest."""
    k = math.floor(y * PER_LOG_2 + 0.5)
    r = fma(-k, LOG_2, y)
    s = r * r
    low = fma(s, fma(r, SIXTH, 0.5), 1.0 + r)
    high = fma(s, fma(r, PER_5040, PER_720), fma(r, PER_120, PER_24))
    scale = np.int64((np.int64(k) + BIAS) << FRACTION_BITS).view(np.float64)
    return fma(s * s, high, low) * scale


@inline_llvm
def direction(angle):
    """Return the cosine and sine of an angle (rad), to their last digit up to some 1e5 turns."""
    quarters = math.floor(angle * PER_QUARTER + 0.5)
    r = (angle - quarters * QUARTER_HIGH) - quarters * QUARTER_LOW
    z = r * r
    q = z * z
    tail = fma(q, fma(z, S6, S5), fma(z, S4, S3))
    sine = fma(z * r, fma(q, tail, fma(z, S2, S1)), r)
    half = 0.5 * z
    rest = 1.0 - half
    tail = q * fma(q, fma(q, fma(z, C6, C5), fma(z, C4, C3)), fma(z, C2, C1))
    cosine = rest + (((1.0 - rest) - half) + tail)
    turned = np.int64(quarters) & 3
    odd = (turned & 1) == 1
    across = sine if odd else cosine
    up = cosine if odd else sine
    return (-across if (turned == 1) | (turned == 2) else across), (-up if turned >= 2 else up)
