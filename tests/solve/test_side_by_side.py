"""Runs side by side: to the bit what each gives by itself, whoever its neighbours are."""

import math

import numpy as np
import pytest
from random_cases import strangers

from compressor.cases.case import Case
from compressor.physics import lane_steps
from compressor.physics import lane_steps as rows
from compressor.physics.lane_control import (
    may_rise,
    raise_peak,
    raise_peak_at_nodes,
    top_and_vertex,
)
from compressor.physics.lane_march import fits_lane, load_lane
from compressor.physics.march import NODES
from compressor.physics.record import RECORD
from compressor.physics.tally import peak_of
from compressor.solve import solution
from compressor.solve.si_record import record
from compressor.solve.simulate import measure, observe
from compressor.solve.solution import MAX_ATTEMPTS, side_by_side

pytestmark = pytest.mark.compiled


def cases(joint, count=20, **more):
    """As a stranger would draw them, with a load that lanes take."""
    values = [one for one in strangers(1515, 40 * count) if one["joint"] == joint]
    loads = ("spring", "none", "spring", "spring")
    solve = {"duration_rev": 2, "timeout_s": 60, **more}
    return [
        Case.from_values({**one, "load": loads[i % 4], "solve": solve})
        for i, one in enumerate(values[:count])
    ]


def told(outcome):
    """All that is stored of an outcome but the wall time of its run."""
    numbers = outcome.numbers.copy()
    numbers["seconds"] = 0.0
    return outcome.status, outcome.reason, numbers.tobytes(), outcome.attributes


def test_an_outcome_has_the_same_bits(monkeypatch):
    """Metrics, error bars, ledger and counts of random cases; the first in a lane of its own.

    Of the scene that holds the others; each takes half a minute to compile, and `make throughput`
    does the same with all three.
    """
    monkeypatch.setattr(solution, "MAX_TIME", math.inf)  # twins may have to be compiled first
    some = cases("both")
    alone = side_by_side(some[:1], (3,))  # and compiled: its clock runs meanwhile
    ahead = side_by_side(some, (3,))
    assert sum(len(made) >= 2 for made in ahead) >= 0.8 * len(some)  # the run and its companion
    assert sum(len(made) > 2 for made in ahead) >= 4  # and tighter ones
    assert sum(made.solution is not None for made in ahead) >= 0.5 * len(some)
    for case, made in zip(some, ahead, strict=True):
        assert told(measure(case, made)) == told(measure(case))
        assert all(0.0 < one.trajectory.seconds < 1.0 for one in made.values())
    tighter = next(i for i, made in enumerate(ahead) if len(made) > 2 and made.solution)
    (_, ours), (_, theirs) = observe(some[tighter], ahead[tighter]), observe(some[tighter])
    for name in {*theirs.variables} - {"seconds"}:
        one, other = (np.asarray(found.variables[name][1]) for found in (ours, theirs))
        assert one.tobytes() == other.tobytes(), name
    for rtol, made in alone[0].items():
        assert made.trajectory.tally.tobytes() == ahead[0][rtol].trajectory.tally.tobytes()


def test_time_series_have_the_same_bits():
    case = cases("both", 1)[0]
    (made,) = side_by_side([case], (3,))
    (_, ours), (_, theirs) = observe(case, made), observe(case)
    for name, (_, values, *_) in theirs.variables.items():
        if name != "seconds":
            assert np.asarray(ours.variables[name][1]).tobytes() == np.asarray(values).tobytes()


def test_a_run_that_fails_touches_no_neighbour():
    """One is too soft and stops at an implausible penetration; another takes too many steps."""
    sound = cases("both", 3)
    soft = Case.from_values(
        {"joint": "both", "clearance_mm": 0.2, "contact": {"stiffness_N_per_mm15": 10}}
    )
    long = Case.from_values({"joint": "both", "clearance_mm": 0.2, "solve": {"duration_rev": 2000}})
    ahead = side_by_side([soft, sound[0], long, *sound[1:]], (3,))
    assert (ahead[0], ahead[2]) == ({}, {})
    by_themselves = side_by_side(sound, (3,))
    for one, other in zip([ahead[1], *ahead[3:]], by_themselves, strict=True):
        assert one.keys() == other.keys() != set()
        for rtol in one:
            assert one[rtol].trajectory.tally.tobytes() == other[rtol].trajectory.tally.tobytes()
    assert measure(soft, ahead[0]).reason == "penetration_implausible"


@pytest.mark.parametrize(
    "values",
    [
        {"load": "gas"},
        {"load": "gas", "gas": {"action": "double", "rod_diameter_mm": 30}},
        {"contact": {"exponent": 1.4}},
        {"clearance_mm": 0.0},
        {"solve": {"method": "DOPRI5"}},
        {"solve": {"settle_rev": "auto"}},
        {"solve": {"timeout_s": 1}},
        {"solve": {"max_steps": MAX_ATTEMPTS - 1}},
        {"solve": {"output_step_deg": 0.001}},
    ],
)
def test_what_does_not_suit_is_left_to_itself(values):
    case = Case.from_values({"joint": "both", "clearance_mm": 0.2, **values})
    (made,) = side_by_side([case], (3,))
    assert all(rtol != case.rtol for rtol in made)


def test_scenes_that_are_not_named_are_left_alone():
    assert side_by_side(cases("both", 2), (1,)) == [{}, {}]


def test_lanes_know_every_field_of_the_record():
    """Rows are filled with their own numbers: each field of a lane's record is the row it names."""
    W = np.arange(rows.TOTAL * rows.LANES, dtype=float)
    made = lane_steps.lane_record.__wrapped__((0, 0), W, 3)
    places = {field: rows.FIRST_FIELD + i * rows.LANES + 3 for i, field in enumerate(rows.FIELDS)}
    choices = {"scene": 2, "load": rows.SPRING, "law": 0, "friction": 1, "freedoms": 2, "wide": 0,
               "unbalance": 0.0, "exponent": 1.5, "corners": (0.0, 0.0, 0.0), "hysteresis": 0.0,
               "least_approach": 0.0, "bristle_stiffness": 0.0, "bristle_damping": 0.0,
               "viscous": 0.0, "crank_suction_force": 0.0, "crank_discharge_force": 0.0,
               "crank_clearance": 0.0, "crank_corners": (0.0, 0.0), "laws": (0.0,)}  # fmt: skip
    assert {*choices} == {*rows.CHOICES}
    for name in RECORD.names:
        if name in choices:
            expected = choices[name]
        elif RECORD[name].shape:
            expected = tuple(W[places[name, joint]] for joint in range(2))
        else:
            expected = W[places[name, 0]]
        assert getattr(made, name) == expected, name
    assert fits_lane(record(Case.from_values({"joint": "big_end", "clearance_mm": 0.2})))


@pytest.mark.parametrize("every", [1, 2])
@pytest.mark.parametrize("size", [True, False])
def test_a_peak_in_a_lane_is_that_of_a_step_by_itself(every, size):
    """The rule stands twice: a lane has no indices (`tally.peak_of`, `top_and_vertex`)."""
    rng = np.random.default_rng(5)
    for drawn in rng.normal(0.0, 1.0, (200, NODES.size, 1)):
        values = np.abs(drawn[:, 0]) if size else drawn[:, 0]
        found = max(top_and_vertex(tuple(values), every == 1))
        assert found == peak_of(NODES, drawn, every, 0, -np.inf, size)


def test_lanes_are_loaded_by_one_function():
    """numba would compile it again for a plain 0 among its arguments."""
    side_by_side(cases("both", 1), (3,))
    index = load_lane.target._cache._cache_file._load_index()
    assert index
    assert not [types for (types, *_) in index if "Literal" in str(types)]


@pytest.mark.parametrize("fine", [True, False])
def test_no_parabola_rises_above_a_peak_where_none_may(fine):
    """The bound that spares its divisions, close to it: known peaks just above the nodes."""
    rng = np.random.default_rng(6)
    near = 0
    for drawn, above in zip(
        rng.normal(0.0, 1.0, (500, 5)), rng.uniform(0.0, 0.6, 500), strict=True
    ):
        values = tuple(drawn)
        nodes = drawn if fine else drawn[::2]
        known = nodes.max() + above * np.ptp(nodes)
        whole, by_nodes = (
            find(values, fine, known, True) for find in (raise_peak, raise_peak_at_nodes)
        )
        assert may_rise(values, fine, known, True) or whole == by_nodes
        near += whole > by_nodes
    assert near > 10  # some do rise
