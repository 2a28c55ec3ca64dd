"""A test of strangeness on Gaussian clouds and curves: its size, and what it sees."""

import numpy as np
import pytest

from compressor.studies.diagnosis.approximate import Strangeness

FEATURES = 24


def drawn(count, seed, bent=1.0):
    """Features that four hidden numbers foretell, with noise; `bent`: how they go together."""
    rng = np.random.default_rng(seed)
    hidden = rng.uniform(-1, 1, (count, 4))
    mixed = np.random.default_rng(0).normal(size=(4 + 10, FEATURES))
    pairs = [hidden[:, i] * hidden[:, k] for i in range(4) for k in range(i, 4)]
    curved = np.column_stack([hidden, bent * np.column_stack(pairs)])
    return curved @ mixed + rng.normal(0, 0.2, (count, FEATURES))


@pytest.fixture(scope="module")
def known():
    return Strangeness.fit(drawn(500, 1))


def chances(known, points):
    return np.array([known.judge(point)[0] for point in points])


def test_own_records_seldom_seem_strange(known):
    own = chances(known, drawn(600, 2))
    assert (own < 0.01).mean() < 0.025
    assert 0.02 < (own < 0.1).mean() < 0.15


def test_other_relations_are_seen_among_the_same_values(known):
    other = drawn(200, 3, bent=-1.0)
    assert (chances(known, other) < 0.01).mean() > 0.8


def test_what_lies_far_off_is_seen_by_both_distances(known):
    point = drawn(1, 4)[0] + 30.0
    chance, near, apart = known.judge(point)
    assert chance == pytest.approx(2 / 501)
    assert near.record > 3 * near.usual
    assert apart.record > apart.usual


def test_the_feature_that_is_off_is_named(known):
    points = drawn(20, 5)
    points[:, 7] += 4.0
    found = [int(np.abs(known.deviations(point)).argmax()) for point in points]
    assert found.count(7) > 15


def test_a_job_is_its_own_nearest(known):
    assert known.nearest(drawn(500, 1)[123]) == 123


def test_features_that_never_change_do_no_harm():
    points = np.column_stack([drawn(300, 6), np.zeros(300)])
    assert np.isfinite(Strangeness.fit(points).judge(points[0])[0])
