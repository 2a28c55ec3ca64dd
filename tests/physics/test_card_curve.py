"""The curve of a card: Akima's, closed; its force in compiled code."""

import math

import numpy as np
import pytest

from compressor.physics.loads import card_force
from compressor.physics.record import CARD_NODES, new_record
from compressor.solve.si_record import card_nodes

AT = np.arange(CARD_NODES) * 360 / CARD_NODES


@pytest.mark.parametrize("count", [20, 97, 360])
def test_the_curve_is_closed(count):
    """A card that is measured from another angle on is the same curve, turned."""
    rng = np.random.default_rng(count)
    angles, values = np.sort(rng.uniform(0, 360, count)), rng.normal(size=count)
    moved = np.argsort((angles + 90) % 360)
    other = card_nodes(((angles + 90) % 360)[moved], values[moved])
    found = card_nodes(angles, values)
    np.testing.assert_allclose(other, np.roll(found, CARD_NODES // 4, axis=0), atol=1e-11)
    assert np.abs(found[:, 0]).max() > 1.0


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
