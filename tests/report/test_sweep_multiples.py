"""Sweeps along three and more axes: every line is the stored jobs, and every colour has a name."""

import time

import numpy as np
import pytest
from swept_made import grid

from compressor.report.figures.sweep import draw_sweep

THREE = {"clearance_mm": [0.1, 0.2, 0.3], "speed_rpm": [300.0, 400.0],
         "fault": ["big_end", "both"]}  # fmt: skip


def peak(c, n, joint):
    return 1000 + 1000 * c + 10 * n * c + 3 * joint


def plan(data):
    return {one.name: one for one in draw_sweep(data)}


def test_a_panel_shows_its_jobs():
    drawn = plan(grid(THREE, peak))["panels"]
    panels = drawn.figure.panels
    assert [panel.title for panel in panels] == [
        "peak acceleration\njoint big end", "peak acceleration\nboth joints",
        "rms acceleration\njoint big end", "rms acceleration\nboth joints",
    ]  # fmt: skip
    slow, fast = panels[1].traces
    assert (slow.name, fast.name) == ("speed 300 rpm", "speed 400 rpm")
    assert slow.x.tolist() == THREE["clearance_mm"]
    assert fast.y == pytest.approx(peak(np.array([0.1, 0.2, 0.3]), 400, 1))
    assert fast.jobs == ("k3", "k7", "k11")
    assert fast.errors is not None
    assert len({trace.style.color for trace in panels[1].traces}) == 2
    assert (drawn.figure.x_title, panels[2].y.title) == ("clearance (mm)", "m/s²")
    assert (
        drawn.caption
    ) == "A panel for each joint, a colour for each value of speed. A point a job."


def test_the_overview_shows_means_of_what_is_known():
    status, regime = (np.full((3, 2, 2), word, dtype="U11") for word in ("ok", "predictable"))
    status[0, 0, 0], regime[1, 1, 1] = "failed", "chaotic"
    drawn = plan(grid(THREE, peak, status=status, regime=regime))["overview"]
    slow, fast = drawn.figure.panels[0].traces
    c = np.array([0.1, 0.2, 0.3])
    expected = peak(c, 300, 0.5)
    expected[0] = peak(0.1, 300, 1)
    assert slow.y == pytest.approx(expected)
    expected = peak(c, 400, 0.5)
    expected[1] = peak(0.2, 400, 0)
    assert fast.y == pytest.approx(expected)
    assert not slow.jobs
    assert "Each point is the mean over joint. Up to 2 of 12 jobs lack" in drawn.caption


def test_failed_and_chaotic_jobs_are_marked_in_their_panel():
    status, regime = (np.full((3, 2, 2), word, dtype="U11") for word in ("ok", "predictable"))
    status[0, 0, 0], regime[1, 1, 1] = "failed", "chaotic"
    drawn = plan(grid(THREE, peak, status=status, regime=regime))["panels"]
    one, other = drawn.figure.panels[:2]
    failed = next(trace for trace in one.traces if trace.name == "a job failed here")
    assert (failed.x, failed.jobs) == (0.1, ("k0",))
    assert not [trace for trace in other.traces if trace.name == "a job failed here"]
    ring = next(trace for trace in other.traces if trace.name.startswith("chaotic"))
    assert (ring.x, ring.y, ring.jobs) == (0.2, peak(0.2, 400, 1), ("k7",))


def test_two_axes_with_words_are_lines_of_jobs():
    axes = {"clearance_mm": THREE["clearance_mm"], "fault": THREE["fault"]}
    drawn = plan(grid(axes, lambda c, joint: 10 * c + joint))
    assert [*drawn] == ["ranking", "overview"]
    first, second = drawn["overview"].figure.panels[0].traces
    assert (first.name, second.name) == ("joint big end", "both joints")
    assert second.y == pytest.approx([2, 3, 4])
    assert second.jobs == ("k1", "k3", "k5")


@pytest.mark.parametrize(("sizes", "limit"), [((7, 4, 5, 3), 2.0), ((18, 18, 18, 18), 5.0)])
def test_four_axes_are_few_lines_in_few_panels(sizes, limit):
    names = ("clearance_mm", "rod_mass_kg", "speed_rpm")
    axes = {n: np.linspace(1, 2, size) for n, size in zip(names, sizes, strict=False)}
    axes["load"] = [f"word {n}" for n in range(sizes[3])]
    data = grid(axes, lambda c, m, n, load: 100 + c * n + 0.1 * m + load * c)
    start = time.process_time()
    found = plan(data)
    assert time.process_time() - start < limit
    assert [*found] == ["ranking", "overview", "panels-peak_acceleration",
                        "panels-rms_acceleration"]  # fmt: skip
    for drawn in found.values():
        panels = drawn.figure.panels
        assert len(panels) <= 12
        for panel in panels:
            names = [trace.name for trace in panel.traces]
            assert all(names)
            assert len(names) == len({*names}) <= 12
    panels = found["panels-peak_acceleration"].figure.panels
    ends = np.ravel([(p.y.low, p.y.high) for p in panels])
    assert len({*ends.tolist()}) == 2  # one scale, so that panels compare
    told = found["panels-peak_acceleration"].caption
    assert ("Of 18 values of load 12 are shown." in told) == (sizes[3] == 18)


def test_a_study_of_words_alone_is_points():
    axes = {"fault": ["big_end", "both"], "load": ["spring", "gas"], "law": ["one", "two"]}
    drawn = plan(grid(axes, lambda a, b, c: 1 + 4 * a + 2 * b + c))["panels"]
    panel = drawn.figure.panels[0]
    assert panel.x.words == {0.0: "big\nend", 1.0: "both\njoints"}
    assert all(trace.is_points for trace in panel.traces)
