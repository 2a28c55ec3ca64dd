"""A machine followed over its clearance: a value of it again, and what is kept."""

import numpy as np
import pytest
import xarray as xr
from measure_regimes import ALONG, distinct
from page_tables import kept

from compressor.cases.examples import example
from compressor.studies.follow.follow import load_values, machines
from compressor.studies.follow.motion import run_value


@pytest.fixture(scope="module")
def rows():
    return kept("regimes.json")["rows"]


def test_period_1_has_negative_exponents_and_chaos_positive_ones(rows):
    single = [row for row in rows if row["period"] == 1]
    chaotic = [row for row in rows if row["regime"] == "chaotic"]
    assert single[0]["value"] == 0.01
    # a chaotic motion may linger near a cycle: its exponent over 16 revolutions is then unsure
    assert all(row["exponent"] - row["error"] < 0.0 for row in single)
    surely = [row for row in single if row["exponent"] + row["error"] < 0.0]
    assert len(surely) >= 0.95 * len(single)  # errors are 95 % half-lengths
    assert chaotic
    assert all(row["exponent"] - row["error"] > 0.0 for row in chaotic)


def test_the_period_is_the_number_of_points(rows):
    for row in rows:
        if row["regime"] == "periodic":
            assert row["points"] == row["period"], row
        else:
            assert row["points"] > 16, row
            assert row["period"] is None, row


def test_up_and_down_differ_where_their_motions_do(rows):
    for value in kept("regimes.json")["differ"]:
        up, down = (row for row in rows if row["value"] == value)
        assert (up["regime"], up["period"]) != (down["regime"], down["period"])


def test_the_first_value_is_as_it_was(rows):
    (machine,) = machines(load_values(example("regimes"), ALONG), ALONG)
    found = run_value(machine.chains[0].cases[0], None, ALONG.plan)
    kept_row = rows[0]
    assert found["regime"] == kept_row["regime"] == "periodic"
    assert float(found["period"]) == kept_row["period"]
    away = abs(float(found["lyapunov_exponent"]) - kept_row["exponent"])
    assert away <= float(found["lyapunov_exponent_error"]) + kept_row["error"]


def test_points_that_are_near_count_once():
    points = np.full((4, 2, 4), np.nan)
    points[:3, 0] = [[1e-4, 0, 0, 0], [1e-4 + 5e-8, 0, 0, 0], [2e-4, 0, 0, 0]]
    one = xr.Dataset(
        {"section": (("revolution", "joint", "coordinate"), points)},
        {"joint": ["big_end", "small_end"]},
    )
    assert distinct(one, 0.1) == 2
