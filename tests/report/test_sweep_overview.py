"""Sweeps by a second axis: lines are stored jobs, or means, and every colour has a name."""

import time

import numpy as np
import pytest
from swept_made import grid

from compressor.report.figures.drawing import panels_of
from compressor.report.figures.sweep import draw_sweep

THREE = {"clearance_mm": [0.1, 0.2, 0.3], "speed_rpm": [300.0, 400.0],
         "fault": ["big_end", "both"]}  # fmt: skip


def peak(c, n, joint):
    return 1000 + 1000 * c + 10 * n * c + 3 * joint


def plan(data):
    return {one.name: one for one in draw_sweep(data)}


def test_the_overview_shows_means_of_what_is_known():
    status, regime = (np.full((3, 2, 2), word, dtype="U11") for word in ("ok", "predictable"))
    status[0, 0, 0], regime[1, 1, 1] = "failed", "chaotic"
    drawn = plan(grid(THREE, peak, status=status, regime=regime))["overview"]
    slow, fast = panels_of(drawn.figure)[0].traces
    c = np.array([0.1, 0.2, 0.3])
    expected = peak(c, 300, 0.5)
    expected[0] = peak(0.1, 300, 1)
    assert slow.y == pytest.approx(expected)
    expected = peak(c, 400, 0.5)
    expected[1] = peak(0.2, 400, 0)
    assert fast.y == pytest.approx(expected)
    assert slow.customdata is None
    assert drawn.sentence.endswith("a point is the mean over joint.")
    assert drawn.numbers[:3] == [("jobs", "12"), ("failed", "1"), ("chaotic", "1")]


def test_two_axes_with_words_are_lines_of_jobs():
    axes = {"clearance_mm": THREE["clearance_mm"], "fault": THREE["fault"]}
    drawn = plan(grid(axes, lambda c, joint: 10 * c + joint))
    assert [*drawn] == ["ranking", "overview"]
    first, second = panels_of(drawn["overview"].figure)[0].traces
    assert (first.name, second.name) == ("joint big end", "both joints")
    assert second.y == pytest.approx([2, 3, 4])
    assert [*second.customdata] == ["k1", "k3", "k5"]


@pytest.mark.parametrize(("sizes", "limit"), [((7, 4, 5, 3), 2.0), ((18, 18, 18, 18), 5.0)])
def test_four_axes_are_few_lines_in_few_panels(sizes, limit):
    names = ("clearance_mm", "rod_mass_kg", "speed_rpm")
    axes = {n: np.linspace(1, 2, size) for n, size in zip(names, sizes, strict=False)}
    axes["load"] = [f"word {n}" for n in range(sizes[3])]
    data = grid(axes, lambda c, m, n, load: 100 + c * n + 0.1 * m + load * c)
    start = time.process_time()
    found = plan(data)
    assert time.process_time() - start < limit
    assert [*found] == ["ranking", "overview"]
    for drawn in found.values():
        panels = panels_of(drawn.figure)
        assert len(panels) <= 12
        for panel in panels:
            names = [trace.name for trace in panel.traces]
            assert all(names)
            assert len(names) == len({*names}) <= 12


def test_a_study_of_words_alone_is_points():
    axes = {"fault": ["big_end", "both"], "load": ["spring", "gas"], "law": ["one", "two"]}
    drawn = plan(grid(axes, lambda a, b, c: 1 + 4 * a + 2 * b + c))["overview"]
    panel = panels_of(drawn.figure)[0]
    assert panel.x.ticktext == ("big<br>end", "both<br>joints")
    assert all(trace.mode == "markers" for trace in panel.traces)
