"""How long a motion can be foretold: what parts two runs is the motion, not their steps."""

import math

import numpy as np
import pytest
from conftest import CHAOTIC

from compressor.cases.case import Case
from compressor.metrics import METRICS
from compressor.physics.observe import COLUMNS, Column
from compressor.physics.record import FREEDOMS
from compressor.physics.systems import observe_all, start
from compressor.solve.request import Request
from compressor.solve.run import integrate
from compressor.solve.search import PARTED_DISTANCE, SHIFT, predictability_horizon
from compressor.solve.si_record import offsets, record, scene
from compressor.solve.simulate import measure

REGULAR = {"joint": "both", "clearance_mm": 0.3}
QUICK = {"duration_rev": 1.2, "settle_rev": 0}


def case(values, **solve):
    return Case.from_values({**values, "solve": {**QUICK, **solve}})


def request(made, shift, rtol, samples):
    p = record(made)
    y = np.zeros(2 * FREEDOMS[scene(made)])
    start(offsets(made) + shift * p["clearance"][:, None] / math.sqrt(2), y, p)
    times = made.duration * np.arange(samples + 1) / samples
    return Request(p, y, times, 0.0, rtol)


def eccentricities(asked):
    found = integrate(asked)
    rows = np.empty((asked.times.size, COLUMNS))
    observe_all(asked.times, found.states, found.phases, asked.p, rows)
    return rows[:, Column.ECCENTRICITY : Column.ECCENTRICITY + 2]


def test_a_horizon_is_that_of_tighter_runs_on_a_finer_grid():
    """Its own runs' errors are far below the shift, and it looks often enough."""
    made = case(CHAOTIC)
    pair = [eccentricities(request(made, s, 1e-13, 20_000)) for s in (0.0, SHIFT)]
    apart = np.hypot(*(pair[1] - pair[0]).T) / 0.3e-3
    parted = made.duration * np.flatnonzero(apart > PARTED_DISTANCE)[0] / 20_000
    horizon = predictability_horizon(made)
    assert 0.9 * made.turn < horizon < made.duration
    assert horizon == pytest.approx(parted, rel=0.01)
    assert predictability_horizon(made, rtol=1e-13) == pytest.approx(horizon, rel=0.01)


def test_the_case_s_own_solver_does_not_count():
    ours = predictability_horizon(case(CHAOTIC))
    assert predictability_horizon(case(CHAOTIC, method="LSODA", rtol=1e-3)) == ours


def test_a_run_that_stops_before_they_part_tells_of_no_horizon():
    """It was the time of the stop, and the motion was called chaotic."""
    assert math.isnan(predictability_horizon(case(REGULAR, max_steps=100)))
    assert math.isnan(predictability_horizon(case(REGULAR), timeout=0.0))
    found = measure(case(REGULAR, horizon=True, max_steps=10_000))  # enough for all but those runs
    assert (found.status, found.attributes["regime"]) == ("ok", "predictable")
    assert math.isnan(found.numbers["predictability_horizon"])


# Beside a job's other numbers

BRIEF = {"duration_rev": 1.2, "settle_rev": 0.2, "output_step_deg": 0.9}


def brief(values, **solve):
    return Case.from_values({**values, "solve": BRIEF | solve, "output": {"keep": "metrics"}})


def test_a_motion_that_can_be_foretold_keeps_its_bars():
    plain, asked = (measure(brief(REGULAR, horizon=asked)).numbers for asked in (False, True))
    assert asked["predictability_horizon"] == math.inf
    for name in (*METRICS, *(f"{one}_error" for one in METRICS)):
        assert np.array_equal(asked[name], plain[name]), name
