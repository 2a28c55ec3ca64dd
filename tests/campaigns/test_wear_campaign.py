"""The kept measurement of wear, and a sample of it made anew."""

import measure_wear
import numpy as np
import pytest
from page_tables import kept

MEASURED = kept("wear.json")


def errors(key, of):
    """An error over steps or sectors."""
    finest = measure_wear.FINEST
    other = next(name for name in finest if name != key)
    rows = MEASURED["convergence"]["rows"]
    return [row[of] for row in rows if row[other] == finest[other]]


@pytest.mark.parametrize("of", ["hours", "profile"])
def test_errors_fall_with_steps_and_sectors(of):
    """With the square of the step; by tenths and more from 24 sectors to 144."""
    steps = errors("step_mm", of)
    assert np.log2(np.divide(steps[:-1], steps[1:])) == pytest.approx(2.0, abs=0.4)
    sectors = errors("sectors", of)
    assert sectors == sorted(sectors, reverse=True)
    assert sectors[-1] < 0.02 * sectors[0]


def test_the_defaults_hold_on_machines_that_did_not_choose_them():
    machines = MEASURED["machines"]
    cases = [row["values"] for row in machines]
    assert cases == [*measure_wear.strangers(MEASURED["seed"], len(machines))]
    assert not [row for row in machines if row["reason"]]
    hours = [row["hours_error"] for row in machines]
    assert np.median(hours) < 0.01
    assert max(hours) < 0.05


@pytest.mark.slow
def test_a_stranger_comes_out_again():
    few = [row for row in MEASURED["machines"] if row["values"]["joint"] != "both"]
    row = min(few, key=lambda row: row["values"]["clearance_mm"])  # which takes the fewest steps
    again = measure_wear.judged(row["values"])
    assert again["hours"] == pytest.approx(row["hours"], rel=1e-6)
    assert again["hours_error"] == pytest.approx(row["hours_error"], abs=1e-5)
