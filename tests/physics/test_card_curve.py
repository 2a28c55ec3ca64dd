"""The curve of a card: Akima's, closed; its force in compiled code."""

import math

import numpy as np
import pytest
from scipy.interpolate import Akima1DInterpolator

from compressor.physics.card import card_force, card_nodes
from compressor.physics.record import CARD_NODES, new_record

AT = np.arange(CARD_NODES) * 360 / CARD_NODES


@pytest.mark.parametrize("count", [20, 97, 360, 2000])
def test_the_curve_is_akima_s(count):
    """As SciPy has it, over three revolutions; of angles that are anywhere."""
    rng = np.random.default_rng(count)
    angles, values = np.sort(rng.uniform(0, 360, count)), rng.normal(size=count)
    around = np.concatenate([angles - 360, angles, angles + 360])
    curve = Akima1DInterpolator(around, np.tile(values, 3))
    found = card_nodes(angles, values)
    assert found[:, 0] == pytest.approx(curve(AT), abs=1e-12)
    assert found[:, 1] == pytest.approx(curve(AT, 1) * 360 / CARD_NODES, abs=1e-11)


def test_a_level_card_is_level():
    found = card_nodes(np.arange(0, 360, 10.0), np.full(36, 0.3))
    assert found[:, 0] == pytest.approx(0.3)
    assert found[:, 1] == pytest.approx(0.0)


def test_the_force_between_nodes():
    """Of a smooth card, to the fourth order of the table's step; continuous over 0 and 360."""
    p = new_record(featured=True)
    theta = np.radians(AT)
    step = 2 * math.pi / CARD_NODES
    p.card[:, 0], p.card[:, 1] = np.sin(3 * theta), 3 * step * np.cos(3 * theta)
    for angle in np.linspace(-1, 13, 997):
        found = card_force(math.cos(angle), math.sin(angle), p)
        assert found == pytest.approx(math.sin(3 * angle), abs=81 * step**4 / 300)
