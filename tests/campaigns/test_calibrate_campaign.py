"""The kept measurement of fitted machines, and one machine of it anew."""

import measure_calibrate
import numpy as np
import page_tables
import pytest

KEPT = page_tables.kept("calibrate.json")


def test_the_model_s_own_machines_lie_in_their_intervals():
    """As often as 95 % intervals allow; beside it, machines with friction, which hardly matters."""
    for other in ("nothing", "pins that rub"):
        row = KEPT["others"][other]
        inside = sum(one["inside"] for one in row["keys"].values())
        assert inside >= 0.9 * row["machines"] * len(row["keys"])
        assert row["said_not_to_fit"] <= 0.1 * row["machines"]


@pytest.mark.compiled
def test_a_machine_is_fitted_again():
    truth, known = measure_calibrate.machine(np.random.default_rng(KEPT["seed"]))
    rows, misfit, jobs = measure_calibrate.fit(truth, known, {})
    assert {key: row["truth"] for key, row in rows.items()} == truth
    for row in rows.values():
        assert row["low"] <= row["best"] <= row["high"]
    inside = sum(row["low"] <= row["truth"] <= row["high"] for row in rows.values())
    assert inside >= len(rows) - 1
    assert misfit < 1.3
    assert jobs < 200
