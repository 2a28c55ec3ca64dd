"""Sampled sweeps: points are jobs, and thinning is told."""

import time

import numpy as np
import pytest
from swept_made import listed

from compressor.report.figures.drawing import panels_of
from compressor.report.figures.sweep import draw_sweep

RNG = np.random.default_rng(5)
CLEARANCE, SPEED = RNG.random((2, 60)) + 1.0
COLUMNS = {"clearance_mm": CLEARANCE, "speed_rpm": SPEED}


def plan(data):
    return {one.name: one for one in draw_sweep(data)}


def traces(panel):
    return {trace.name: trace for trace in panel.traces}


def test_points_are_jobs_over_what_matters_most():
    found = plan(listed(COLUMNS, 2 + SPEED**2))
    assert [*found] == ["ranking", "points"]
    panel = panels_of(found["points"].figure)[0]
    assert panel.x.title.text == "speed (rpm)"  # what matters most
    one = traces(panel)
    assert one["a job"].x.tolist() == SPEED.tolist()
    assert one["a job"].y == pytest.approx(2 + SPEED**2)
    assert [*one["a job"].customdata] == [f"k{n}" for n in range(60)]
    assert (
        found["points"].caption
        == "Every metric over the key that matters most for each, a point a job. Jobs: 60."
    )


def test_words_are_colours():
    load = np.array(["spring", "gas"] * 30)
    values = np.where(load == "spring", SPEED, 5 - SPEED)
    panel = panels_of(plan(listed(COLUMNS | {"load": load}, values))["points"].figure)[0]
    one = traces(panel)
    assert one["load spring"].y == pytest.approx(values[::2])
    assert one["load gas"].marker.color != one["load spring"].marker.color


def test_what_is_not_known_is_marked():
    status, regime = (np.full(60, word, dtype="U11") for word in ("ok", "predictable"))
    status[3], regime[7] = "failed", "chaotic"
    values = 2 + SPEED**2
    values[7] = 60.0
    panel = plan(listed(COLUMNS, values, status=status, regime=regime))["points"].figure
    one = traces(panels_of(panel)[0])
    assert [*one["a job failed here"].customdata] == ["k3"]
    ring = next(trace for name, trace in one.items() if name.startswith("chaotic"))
    assert (*ring.y, *ring.customdata) == (60.0, "k7")
    assert ring.marker.symbol == "circle-open"
    size = ring.marker.size + ring.marker.line.width
    assert size <= one["a job"].marker.size + 1e-2  # it covers no point


def test_many_jobs_are_thinned_with_a_word():
    rng = np.random.default_rng(6)
    columns = {name: rng.random(100_000) for name in ("clearance_mm", "speed_rpm", "rod_mass_kg")}
    data = listed(columns, 1 + columns["clearance_mm"] + 0.1 * rng.random(100_000))
    start = time.process_time()
    found = plan(data)
    assert time.process_time() - start < 5.0
    for panel in panels_of(found["points"].figure):
        assert traces(panel)["a job"].x.size == 2000
    assert ("jobs drawn", "2,000 of 100,000") in found["points"].numbers
