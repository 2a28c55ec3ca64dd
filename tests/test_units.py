"""Units that people read: factors by definition, and texts with units."""

import math

import pytest

from compressor.units import read_quantity, unit_in


@pytest.mark.parametrize(
    ("unit", "units", "read", "factor"),
    [
        ("kN", "usual", "kN", 1.0), ("kN", "plant", "kN", 1.0), ("kN", "si", "N", 1e3),
        ("N", "plant", "kN", 1e-3), ("m/s²", "plant", "g", 1 / 9.80665), ("m/s²", "si", "m/s²", 1),
        ("m/s2", "si", "m/s2", 1.0), ("µm", "plant", "mm", 1e-3), ("µm", "si", "m", 1e-6),
        ("m/s", "plant", "mm/s", 1e3), ("MPa", "plant", "bar", 10.0), ("MPa", "si", "Pa", 1e6),
        ("rad/s", "plant", "rpm", 60 / math.tau), ("rad", "plant", "°", 180 / math.pi),
        ("°", "si", "°", 1.0), ("%", "si", "%", 1.0), ("per rev", "plant", "per rev", 1.0),
    ],
)  # fmt: skip
def test_a_number_is_read_in_the_unit_that_is_chosen(unit, units, read, factor):
    found, times = unit_in(unit, units)
    assert found == read
    assert times == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "si", "value"),
    [
        ("166 kN", "N", 166e3), ("166kN", "N", 166e3), ("166000", "N", 166e3),
        ("2 g", "m/s2", 19.6133), ("0.1 mm", "m", 1e-4), ("3 mm/s", "m/s", 3e-3),
        ("5 %", "1", 0.05), ("-1.5e-3", "1", -1.5e-3),
        ("90 deg", "rad", math.pi / 2), ("740 rpm", "rad/s", 740 * math.tau / 60), ("x", "N", None),
    ],
)  # fmt: skip
def test_a_text_may_have_a_unit(text, si, value):
    assert read_quantity(text, si) == (value if value is None else pytest.approx(value, rel=1e-12))


def test_a_unit_of_another_quantity_is_refused():
    with pytest.raises(ValueError, match="'kN' is no unit of it; there are m, mm, µm, um"):
        read_quantity("1 kN", "m")
