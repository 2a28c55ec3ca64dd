"""Averages of chaotic motions agree, of two integrators, within the errors that they state."""

import numpy as np
import pytest
from measure_chaotic import OTHER, batch_mean, compare_rms
from page_tables import kept

MOST = 4.0  # standard errors of a mean over 16 batches: exceeded by chance once in 2,000


@pytest.mark.slow
def test_a_chaotic_case_says_so_and_knows_its_rms():
    row = compare_rms({"joint": "both", "clearance_mm": 0.2}, OTHER)
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
