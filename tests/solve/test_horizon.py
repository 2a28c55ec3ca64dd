"""Twins in step: what parts them is the motion, not the steps."""

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import CHAOTIC, keep

from compressor.cases.case import Case
from compressor.metrics import METRICS
from compressor.physics.march import march
from compressor.physics.motion import start
from compressor.physics.observe import COLUMNS, Column, observe_all
from compressor.physics.record import FREEDOMS
from compressor.solve.attempts import integrate
from compressor.solve.horizon import (
    PARTED_DISTANCE,
    TWIN_DISTANCE,
    TWINS_RTOL,
    follow_twins,
    predictability_horizon,
)
from compressor.solve.request import Request
from compressor.solve.si_record import offsets, record, scene
from compressor.solve.simulate import measure, simulate
from compressor.store.reader import read_store
from compressor.sweep.wanted import serving_both

REGULAR = {"joint": "both", "clearance_mm": 0.3}
QUICK = {"duration_rev": 1.2, "settle_rev": 0}


def case(values, **solve):
    return Case.from_values({**values, "solve": {**QUICK, **solve}})


def request(made, shift, rtol, method="auto", samples=1):
    p = record(made)
    y = np.zeros(2 * FREEDOMS[scene(made)])
    start(offsets(made) + shift * p["clearance"][:, None] / math.sqrt(2), y, p)
    times = made.duration * np.arange(samples + 1) / samples
    return Request(p, y, times, 0.0, rtol, method)


PURE = """
import json
import sys
from test_horizon import alike, shifted

print(json.dumps([alike(*item) for item in json.loads(sys.argv[1])]))
print(json.dumps([shifted(*item) for item in json.loads(sys.argv[1])]))
"""
SCENES = [
    (joint, method, damping)
    for joint in ("big_end", "small_end", "both")
    for method, damping in (("auto", 336), ("auto", 336e3), ("RODAS", 336))
]


def damped(joint, damping, **solve):
    contact = {"damping_N_s_per_mm": damping}
    return case({**REGULAR, "joint": joint, "load": "gas", "contact": contact}, **solve)


def alike(joint, method, damping):
    """When twins that start alike have parted at all, in s."""
    asked = request(damped(joint, damping, duration_rev=0.12), 0.0, 1e-5, method)
    return follow_twins(asked, asked.start.copy(), far=0.0).horizon


def shifted(joint, method, damping):
    made = damped(joint, damping, duration_rev=0.12)
    other = request(made, 1e-15, 1e-5).start
    return follow_twins(request(made, 0.0, 1e-5, method), other, far=0.0).horizon


def test_twins_that_start_alike_stay_alike_to_the_bit():
    """Over load corners, onsets of contact and changes of method: any distance at all is too far.

    So is it seen when they do not start alike. Not compiled: compilers fuse products and sums of
    the same formula in other ways where it stands twice.
    """
    paths = os.pathsep.join([*sys.path])
    environment = {**os.environ, "COMPSIM_JIT": "0", "PYTHONPATH": paths}
    call = [sys.executable, "-c", PURE, json.dumps([SCENES[1], SCENES[5], SCENES[6]])]
    done = subprocess.run(call, env=environment, capture_output=True, text=True, check=True)
    together, apart = map(json.loads, done.stdout.splitlines())
    assert together == [math.inf] * 3
    assert max(apart) < 1e-4


@pytest.mark.parametrize(("joint", "method", "damping"), SCENES)
def test_rounding_does_not_part_compiled_twins(joint, method, damping):
    short = {"duration_rev": 0.25} if damping > 336 else {}  # stiff, and slow
    asked = request(damped(joint, damping, **short), 0.0, TWINS_RTOL, method)
    assert follow_twins(asked, asked.start.copy(), far=1e-5).horizon == math.inf


def eccentricities(asked):
    found = integrate(asked)
    rows = np.empty((asked.times.size, COLUMNS))
    observe_all(asked.times, found.states, found.phases, asked.p, rows)
    return rows[:, Column.ECCENTRICITY : Column.ECCENTRICITY + 2]


def test_a_horizon_is_that_of_two_separate_runs():
    """Each with its own steps, so tight that their errors are far below the shift."""
    made = case(CHAOTIC)
    pair = [eccentricities(request(made, s, 1e-13, samples=20000)) for s in (0.0, TWIN_DISTANCE)]
    apart = np.hypot(*(pair[1] - pair[0]).T) / 0.3e-3
    parted = made.duration * np.flatnonzero(apart > PARTED_DISTANCE)[0] / 20000
    horizon = predictability_horizon(made)
    assert 0.9 * made.turn < horizon < made.duration
    assert horizon == pytest.approx(parted, rel=0.01)
    assert predictability_horizon(made, rtol=1e-13) == pytest.approx(horizon, rel=0.01)


def test_a_farther_twin_parts_earlier():
    made = case(CHAOTIC)
    times = [predictability_horizon(made, close=close) for close in (1e-5, 1e-7, 1e-9)]
    assert times == sorted(times)
    assert times[0] < 0.9 * times[2]


@pytest.mark.parametrize("joint", ["big_end", "small_end", "both"])
def test_the_paper_s_motions_are_regular(joint):
    assert predictability_horizon(case({**REGULAR, "joint": joint})) == math.inf


def test_the_case_s_own_solver_does_not_count():
    ours = predictability_horizon(case(CHAOTIC))
    assert predictability_horizon(case(CHAOTIC, method="LSODA", rtol=1e-3)) == ours


def test_ideal_joints_never_part():
    assert predictability_horizon(case({"joint": "none"})) == math.inf


def test_a_run_that_stops_tells_how_far_it_came():
    stopped, later = (predictability_horizon(case(REGULAR, max_steps=n)) for n in (100, 1000))
    assert 0 < stopped < later < case(REGULAR).duration
    assert 0 < predictability_horizon(case(REGULAR), timeout=0.0) < case(REGULAR).duration


# Beside a job's other numbers

BRIEF = {"duration_rev": 1.2, "settle_rev": 0.2, "output_step_deg": 0.9}


def brief(values, **solve):
    return Case.from_values({**values, "solve": BRIEF | solve, "output": {"keep": "metrics"}})


def test_a_horizon_is_looked_for_as_asked():
    always, seldom = (measure(brief(CHAOTIC, horizon=asked)) for asked in (True, False))
    assert always.numbers["predictability_horizon"] == predictability_horizon(brief(CHAOTIC))
    assert always.attributes["regime"] == "chaotic"
    assert math.isnan(seldom.numbers["predictability_horizon"])
    assert seldom.attributes["regime"] != "chaotic"


def test_a_motion_that_can_be_foretold_keeps_its_bars():
    plain, asked = (measure(brief(REGULAR, horizon=asked)).numbers for asked in (False, True))
    assert asked["predictability_horizon"] == math.inf
    for name in (*METRICS, *(f"{one}_error" for one in METRICS)):
        assert np.array_equal(asked[name], plain[name]), name


def test_a_failed_job_has_no_horizon():
    found = measure(brief(REGULAR, horizon=True, max_steps=5))
    assert found.reason == "budget_steps"
    assert math.isnan(found.numbers["predictability_horizon"])


def test_a_horizon_is_kept_and_asked_for_beside_a_job_s_identity(tmp_path):
    plain, asked = (brief(CHAOTIC, horizon=asked) for asked in (False, True))
    assert plain.key == asked.key
    assert serving_both(plain, asked).solve.horizon is True
    keep(tmp_path, simulate(plain))
    assert not read_store(tmp_path).status(plain.key).satisfies(asked)
    keep(tmp_path, simulate(asked))
    stored = read_store(tmp_path).status(plain.key)
    assert stored.satisfies(asked)
    assert stored.satisfies(plain)
    assert 0 < stored.numbers["predictability_horizon"] < asked.duration


def test_twins_go_by_the_march_that_is_compiled_already():
    """numba made a second one for a plain 1 among its arguments, in half a minute."""
    assert predictability_horizon(case(REGULAR, duration_rev=0.02, settle_rev=0)) == math.inf
    index = march.target._cache._cache_file._load_index()
    assert index
    assert not [types for (types, *_) in index if "Literal" in str(types)]
