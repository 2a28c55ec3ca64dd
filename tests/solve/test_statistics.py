"""Statistics of a chaotic motion: standard errors that hold, on draws whose mean is known."""

import math

import numpy as np
import pytest
from scipy import stats

from compressor.metrics import QUANTILES
from compressor.physics import merge_tallies, new_record, new_tally
from compressor.solve.run_metrics import (
    MIN_REVOLUTIONS,
    chaotic_bars,
    count_bar,
    metrics,
    statistics,
    summarize_peaks,
)

TURN = 0.1  # s


def turns(rng, count, pull=0.0):
    """Tallies of revolutions whose mean square acceleration follows a walk about 100."""
    levels = [0.0]
    for change in rng.normal(size=count):
        levels.append(pull * levels[-1] + math.sqrt(1 - pull**2) * change)
    found = np.rec.array(np.repeat(new_tally(), count))
    found.seconds = found.steady_seconds = TURN
    found.square[:, 0], found.square[:, 1] = 0.1 * (100.0 + 10.0 * np.array(levels[1:])), 0.1 * 25.0
    found.peak = rng.exponential(size=found.peak.shape)
    found.max_penetration = 1e-6
    found.loss_seconds = 0.1 * (0.3 + 0.02 * rng.normal(size=(count, 1)))
    found.impacts = rng.poisson(20.0, size=(count, 1))
    return [*found]


@pytest.fixture
def record():
    p = new_record()
    p["clearance"][:] = 1e-4
    p["omega"] = 2.0 * math.pi / TURN
    p["reciprocating_mass"] = p["rod_mass"] = 1.0
    return p


@pytest.mark.parametrize(("count", "pull"), [(30, 0.0), (90, 0.3)])
def test_bars_hold_the_true_average_in_95_of_100_runs(record, count, pull):
    rng = np.random.default_rng(1)
    exact = {"rms_acceleration": 10.0, "contact_loss_fraction": 0.3, "impact_count": 20.0 * count,
             "impacts_per_rev": 20.0}  # fmt: skip
    held = dict.fromkeys(exact, 0)
    for _ in range(100):
        each = turns(rng, count, pull)
        numbers = metrics(record, merge_tallies(each))
        bars = chaotic_bars(record, each, numbers)
        for name, value in exact.items():
            held[name] += bool((np.abs(numbers[name] - value) <= bars[name]).all())
    assert all(90 <= number <= 99 for number in held.values()), held


def test_revolutions_to_one_percent_are_as_many_as_it_takes(record):
    rng = np.random.default_rng(2)
    found = [statistics(record, turns(rng, 60))["revolutions_to_one_percent"] for _ in range(20)]
    # of the root of 100 +- 10: 5 % each
    assert np.median(found) == pytest.approx(25, rel=0.2)


def test_quantiles_are_those_of_the_draw():
    """Of exponential draws: median log 2, 95 % quantile log 20."""
    rng = np.random.default_rng(3)
    rows = [summarize_peaks("x", rng.exponential(size=(600, 2))) for _ in range(100)]
    expected = -np.log(1 - np.array(QUANTILES))
    mean = np.mean([row["x_quantile"] for row in rows], axis=0)
    np.testing.assert_allclose(mean, [expected] * 2, rtol=0.02)
    np.testing.assert_allclose(np.mean([row["x_mean"] for row in rows], axis=0), 1.0, rtol=0.01)


def test_batches_that_agree_by_chance_say_nothing(record):
    """Two revolutions alike had a bar of 0; a count has a Poisson one at least."""

    def bars_of(count):
        each = turns(np.random.default_rng(6), 1) * count
        numbers = metrics(record, merge_tallies(each))
        return numbers, chaotic_bars(record, each, numbers)

    _, few = bars_of(MIN_REVOLUTIONS - 1)
    assert all(np.isposinf(bar).all() for bar in few.values())
    numbers, many = bars_of(MIN_REVOLUTIONS)
    assert many["rms_acceleration"] == pytest.approx(0.0, abs=1e-9)
    assert (many["impact_count"] >= 1.96 * np.sqrt(numbers["impact_count"])).all()
    np.testing.assert_allclose(many["impacts_per_rev"], many["impact_count"] / MIN_REVOLUTIONS)
    assert (
        many["releases_per_rev"] * MIN_REVOLUTIONS > 3.0
    ).all()  # of none, as by the rule of three


def test_the_least_bar_of_a_count_is_that_of_a_poisson_one():
    """To a tenth: the exact upper end of a 95 % interval (Garwood, Biometrika 28, 1936)."""
    for count in (0, 1, 5, 24, 1000):
        upper = stats.chi2.ppf(0.975, 2 * count + 2) / 2
        assert count_bar(np.array(count)) == pytest.approx(upper - count, rel=0.1, abs=0.2)
