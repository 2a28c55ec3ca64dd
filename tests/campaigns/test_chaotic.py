"""Beyond the horizon points differ and statistics agree, of two integrators."""

import math

import numpy as np
import pytest
from measure_chaotic import (
    BATCHES,
    METHODS,
    OTHER,
    SCENES,
    batch_mean,
    by_revolution,
    case,
    compare,
    distance,
    scene_row,
    told,
)
from page_tables import kept

from compressor.solve.simulate import simulate

REVOLUTIONS = 8 + 7 * BATCHES
MOST = 4.0  # standard errors of a mean over 16 batches: exceeded by chance once in 2,000


def furthest(peaks):
    """Kolmogorov and Smirnov's distance of two samples alike that chance exceeds once in 1,000.

    Half of the peaks count, since turns beside each other are alike: with all of them, 5 of 120
    pairs of the first scene's runs, from starts a nanometre apart, lay beyond; now none (0.32).
    """
    return 1.95 * math.sqrt(2 / (peaks / 2))


@pytest.fixture(scope="module")
def scene():
    """The one that takes less time; two joints are below."""
    return SCENES["big end, light and fast"]


@pytest.mark.slow
def test_points_differ_and_statistics_agree(scene):
    row = scene_row(scene, METHODS, REVOLUTIONS)
    (other,) = row["others"]
    assert row["horizon_rev"] < 3
    assert other["within"] < 1e-3
    assert other["beyond"] > 0.5
    assert max(other["standard_errors"].values()) < MOST
    assert other["peaks_distance"] < furthest(REVOLUTIONS - 8)


@pytest.mark.slow
def test_statistics_tell_two_machines_apart(scene):
    """So that agreeing means something: a fifth less clearance is seen."""
    narrow = {**scene, "clearance_mm": 0.8 * scene["clearance_mm"]}
    one, other = (
        by_revolution(simulate(case(v, "auto", REVOLUTIONS))) for v in (scene, narrow)
    )  # fmt: skip
    seen = max(compare(one, other).values()) > MOST
    assert seen or distance(one, other) > furthest(REVOLUTIONS - 8)


def test_what_is_kept_says_the_same():
    measured = kept("chaotic.json")
    for row in measured["scenes"].values():
        assert [row["against"], *(other["method"] for other in row["others"])] == [*METHODS]
        for other in row["others"]:
            assert other["within"] < 1e-3
            assert other["beyond"] > 0.5
            assert max(other["standard_errors"].values()) < MOST
            assert other["peaks_distance"] < furthest(measured["revolutions"] - measured["settle"])


@pytest.mark.slow
def test_a_chaotic_case_says_so_and_knows_its_rms():
    (scene,) = (values for name, values in SCENES.items() if name.startswith("both"))
    row = told({**scene, "clearance_mm": 0.2}, OTHER)
    assert row["regime"] == "chaotic"
    assert row["apart"] < MOST
    assert row["known"] < 0.1


def test_a_hundred_chaotic_cases_know_their_rms():
    row = kept("chaotic.json")["random"]
    assert row["judged"] == 100
    assert row["within"]["2"] >= 89  # 95 in the mean; chance leaves fewer in one of 100 campaigns
    assert max(row["scipy"]["apart"]) < MOST


def test_errors_of_means_allow_for_revolutions_that_follow_on_each_other():
    """A random walk that is pulled back: its mean is worse known than that of as many draws."""
    noise = np.random.default_rng(1).normal(size=1600)
    walk = np.empty_like(noise)
    walk[0] = noise[0]
    for i in range(1, noise.size):
        walk[i] = 0.9 * walk[i - 1] + noise[i]
    _, plain = batch_mean(noise)
    _, pulled = batch_mean(walk)
    assert plain == pytest.approx(1 / 40, rel=0.5)
    assert pulled == pytest.approx(1 / 40 / 0.1, rel=0.5)
