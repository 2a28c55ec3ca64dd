"""Captions of regimes: words and numbers follow from made data whose regimes are known."""

import numpy as np
import pytest
from regimes_made import failed, made, plane

from compressor.studies import FOLLOWED_FIGURES
from compressor.studies.regimes.captions import (
    CAPTIONS,
    bifurcation,
    periods,
    regime_of,
)

VALUES = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
ALL_AGREE = [False] * len(VALUES)


def study(up, down=None, exponents=None):
    """A study over six clearances with these regimes: a number is a period."""
    chains = [up] if down is None else [up, down]
    data = made(VALUES, directions=("up", "down")[: len(chains)])
    for i, chain in enumerate(chains):
        for j, regime in enumerate(chain):
            number = isinstance(regime, int)
            data["regime"][i, j] = "periodic" if number else regime
            data["period"][i, j] = regime if number else np.nan
    if exponents is not None:
        data["lyapunov_exponent"][:] = np.array(exponents)
        data["lyapunov_exponent_error"][:] = 0.25
    return data


def test_the_captions_of_regimes_are_those_of_compsim_plot():
    assert (*CAPTIONS,) == FOLLOWED_FIGURES


def test_a_period_that_is_not_known_is_no_period():
    data = study([1] * 6)
    data["period"][0, 0] = np.nan
    assert regime_of(data.isel(direction=0, clearance_mm_big_end=0)) == "undecided"


@pytest.mark.parametrize(
    ("up", "words"),
    [
        ([1] * 6, "Up: period 1 at all 6 values."),
        ([1, 1, 2, 4, "chaotic", "chaotic"],
         "Up: period 1 is lost at 0.3 mm, to period 2 and not found again; of 6 values "),
        ([1, 1, "chaotic", "chaotic", 1, 3],
         "Up: period 1 is lost at 0.3 mm, to chaotic, found again at 0.5 mm; of 6 values period 1 "
         "at 3, chaotic at 2, period 3 at 1."),
        (["undecided", 2, 1, 1, 1, 1],
         "Up: period 1 first at 0.3 mm; it is kept to the end; of 6 values period 1 at 4"),
        ([2, 2, 2, 4, 4, 8], "Up: nowhere period 1; of 6 values period 2 at 3, period 4 at 2"),
    ],
)  # fmt: skip
def test_where_period_1_is_lost(up, words):
    assert words in bifurcation(study(up))


def test_the_first_exponent_above_0_by_more_than_its_error():
    exponents = [[-1.0, -0.5, 0.2, 0.3, 0.8, 1.0], [-1.0, -0.5, -0.6, -0.7, -2.0, 0.126]]
    up, down = bifurcation(study([1] * 6, [1] * 6, exponents)).split(" Down: ")
    assert "Its exponent is positive first at 0.4 mm: 0.30 ± 0.25 a revolution." in up
    assert (
        "Its exponent is nowhere above 0 by more than its error: at most 0.13 ± 0.25 a "
        "revolution, at 0.6 mm." in down
    )


def test_where_up_and_down_differ_and_what_was_confirmed():
    data = study([1] * 6, [1] * 6)
    data["differs"][:], data["confirmed"][:] = ALL_AGREE, ALL_AGREE
    assert "Up and down agree at all 6 values that both reached." in bifurcation(data)
    data["differs"][:] = [False, True, True, False, True, False]
    said = bifurcation(data)
    alone = "their numbers differ, but further simulation reached no second motion."
    assert f"At 3 of 6 values, 0.2 to 0.3, 0.5 mm, {alone}" in said
    assert "attractor" not in said
    data["confirmed"][:] = [False, True, False, False, True, False]
    both = "Up and down end in different motions at 2 of 6 values that both reached, 0.2, 0.5 mm: "
    assert both + "a second attractor, confirmed by direct simulation." in bifurcation(data)
    assert f"At 1 of 6 values, 0.3 mm, {alone}" in bifurcation(data)
    gone = failed(data, "down", [1], "non_finite")
    assert "different motions at 1 of 5 values that both reached, 0.5 mm:" in bifurcation(gone)
    assert "Up and down" not in bifurcation(data.isel(direction=[0]))


def test_directions_that_share_no_value_are_not_compared():
    data = failed(study([1] * 6, [1] * 6), "down", [*range(6)])
    assert "No value was reached by both." in bifurcation(data)
    assert "agree" not in bifurcation(data)


def test_failures_are_counted_by_their_reason():
    data = failed(failed(study([1] * 6), "up", [0, 5]), "up", [2], "non_finite")
    said = bifurcation(data)
    assert "3 runs failed: step_underflow (2), non_finite (1)." in said
    assert "period 1 at all 3 values" in said
    assert "no value has a result" in bifurcation(failed(data, "up", [*range(6)]))


def test_a_map_counts_its_regimes():
    data = plane(values=VALUES)
    data["regime"][:], data["period"][:] = "periodic", 1.0
    data["regime"][1, 0, :2] = "chaotic"
    data["period"][2, 0, 3] = 3.0
    data["regime"][0, 1, 0], data["status"][0, 1, 0] = "", "missing"
    said = periods(failed(data, "down", [5]), "speed_rpm")
    assert "radial clearance of the big end (6 values, followed) and crank speed (3)." in said
    assert "Up, of 18: period 1 at 15, chaotic at 2, period 3 at 1." in said
    assert "Down, of 18: period 1 at 14, failed at 3, not run at 1." in said
