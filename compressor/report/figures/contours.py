"""Lines of equal value on a plane, and the areas between them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from contourpy import FillType, LineType, contour_generator

from compressor.report.figures.drawing import join_with_gaps

Outlines = tuple[np.ndarray, np.ndarray]


def contour_lines(x: np.ndarray, y: np.ndarray, z: np.ndarray, levels: Sequence[float]) -> Outlines:
    """Return x and y of the lines of z, shape (y, x), at some levels, nan between two."""
    generator = contour_generator(x, y, np.ma.masked_invalid(z), line_type=LineType.Separate)
    lines: list[Any] = [line for level in levels for line in generator.lines(level)]
    return join_with_gaps(lines)


def contour_area(x: np.ndarray, y: np.ndarray, z: np.ndarray, low: float, high: float) -> Outlines:
    """Return x and y of the outlines of where z, shape (y, x), lies between two values."""
    generator = contour_generator(x, y, np.ma.masked_invalid(z), fill_type=FillType.OuterOffset)
    found: Any = generator.filled(low, high)
    rings = [ring for polygon, ends in zip(*found, strict=True)
             for ring in np.split(polygon, ends[1:-1])]  # fmt: skip
    return join_with_gaps(rings)
