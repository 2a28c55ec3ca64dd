"""Lines of equal value on a plane."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from contourpy import LineType, contour_generator

from compressor.report.figures.drawing import join_with_gaps


def contour_lines(
    x: np.ndarray, y: np.ndarray, z: np.ndarray, levels: Sequence[float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of the lines of z, shape (y, x), at some levels, nan between two."""
    generator = contour_generator(x, y, np.ma.masked_invalid(z), line_type=LineType.Separate)
    lines: list[Any] = [line for level in levels for line in generator.lines(level)]
    return join_with_gaps(lines)
