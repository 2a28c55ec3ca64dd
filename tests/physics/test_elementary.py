"""Functions that compiled loops use in place of the library's: held against mpmath."""

import math

import mpmath
import numpy as np
import pytest

from compressor.physics.elementary import direction, exponential, logarithm

draw = np.random.default_rng(20)
ANGLES = [0.0, math.pi / 4, math.pi / 2, math.pi, 2 * math.pi, *draw.uniform(0, 7, 200),
          *draw.uniform(0, 6e5, 300), *10.0 ** draw.uniform(-9, 0, 50)]  # fmt: skip


def exactly(function, value):
    with mpmath.workdps(40):
        return function(mpmath.mpf(float(value)))


def test_a_direction_is_right_to_its_last_digits():
    """Two units in the last place of the larger of the two; 100,000 turns from the start, too."""
    for angle in [*ANGLES, *(-angle for angle in ANGLES)]:
        for found, function in zip(direction(angle), (mpmath.cos, mpmath.sin), strict=True):
            exact = exactly(function, angle)
            assert abs(float(found - exact)) <= 2 * np.spacing(max(abs(float(exact)), 1e-3))


def test_a_direction_is_one():
    """Its length does not drift: that of a rotation by many steps would."""
    lengths = [math.hypot(*direction(angle)) for angle in ANGLES]
    assert np.abs(np.array(lengths) - 1.0).max() < 4e-16


@pytest.mark.parametrize(
    ("function", "library", "values"),
    [
        (logarithm, math.log, 10.0 ** draw.uniform(-300, 300, 500)),
        (logarithm, math.log, [1.0, 2.0, 0.5, math.sqrt(2.0), np.nextafter(1.0, 0.0)]),
        (exponential, math.exp, draw.uniform(-690, 690, 500)),
        (exponential, math.exp, [0.0, 1.0, -1.0, math.log(2.0) / 2]),
    ],
)
def test_steps_are_chosen_by_eight_digits(function, library, values):
    for value in values:
        exact = library(value)
        assert function(value) == pytest.approx(exact, rel=2e-8, abs=2e-9)


@pytest.mark.parametrize("function", [logarithm, exponential])
def test_there_is_no_step_between_the_pieces(function):
    """Where the exponent changes, neighbours stay neighbours: a step's length must not jump."""
    edges = [math.sqrt(2.0) * 2.0**k for k in range(-4, 5)]
    if function is exponential:
        edges = [(k + 0.5) * math.log(2.0) for k in range(-4, 5)]
    for edge in edges:
        below, above = function(edge * (1 - 1e-12)), function(edge * (1 + 1e-12))
        assert below == pytest.approx(above, rel=3e-8, abs=3e-9)
