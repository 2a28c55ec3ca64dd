"""Which key matters: bars and sentences say what the effects are."""

import re

import numpy as np
import pytest
from swept_made import grid, listed

from compressor.cases.swept import design
from compressor.report.figures.drawing import panels_of
from compressor.report.figures.sweep import draw_sweep
from compressor.report.figures.sweep_data import measures, sweep_of
from compressor.report.figures.sweep_maps import ranking

AXES = {"clearance_mm": [1.0, 2.0, 3.0], "speed_rpm": [1.0, 2.0, 3.0, 4.0],
        "load": ["spring", "gas"]}  # fmt: skip


def plan(data):
    return {one.name: one for one in draw_sweep(data)}


def bars(drawn):
    """The shares of an axis' panel by the kind of effect."""
    return {
        panel.title: {trace.name.partition("(")[2].rstrip(")"): trace.x for trace in panel.traces}
        for panel in panels_of(drawn.figure)
    }


def test_bars_and_caption_are_the_exact_shares():
    """Of c + 2 n + 0 load: V = 2/3 + 5, without interactions. rms is half of it, thus the same."""
    drawn = plan(grid(AXES, lambda c, n, load: 10 + c + 2 * n + 0 * load))["ranking"]
    found = bars(drawn)
    share = 500 / (2 / 3 + 5)
    assert [*found] == ["speed", "clearance", "load"]  # the strongest first
    for kind in ("main effect", "total effect"):
        assert found["speed"][kind] == pytest.approx([share] * 2)
        assert found["clearance"][kind] == pytest.approx([100 - share] * 2)
        assert found["load"][kind] == pytest.approx([0, 0])
    words = f"Peak acceleration: speed {share:.0f} %, clearance {100 - share:.0f} %; rms"
    assert words in drawn.caption
    panel = panels_of(drawn.figure)[0]
    assert panel.y.ticktext == ("peak acceleration", "rms acceleration")
    assert panel.x.title.text == "share of variance (%)"


def test_interactions_are_in_total_effects_alone():
    """(c - 2)(n - 2.5), of means 0 over each axis."""
    found = bars(plan(grid(AXES, lambda c, n, load: 9 + (c - 2) * (n - 2.5) + 0 * load))["ranking"])
    for axis, total in (("speed", 100), ("clearance", 100), ("load", 0)):
        assert found[axis]["main effect"] == pytest.approx([0, 0], abs=1e-9)
        assert found[axis]["total effect"] == pytest.approx([total] * 2)


def test_jobs_without_a_value_are_told():
    status = np.full((3, 4, 2), "ok", dtype="U7")
    status[1, 1, 0] = "failed"
    drawn = plan(grid(AXES, lambda c, n, load: 10 + c + 2 * n + 0 * load, status=status))
    assert bars(drawn["ranking"])["load"]["total effect"] == pytest.approx([0, 0], abs=1e-6)
    (label,) = (label for label, value in drawn["ranking"].numbers if value == "up to 1")
    assert label.endswith("count with the sum of their axes' main effects")


def test_correlations_are_told_with_their_intervals():
    points = np.array(design("lhs", 40, 2, 1))
    columns = {"clearance_mm": points[:, 0], "speed_rpm": points[:, 1]}
    drawn = plan(listed(columns, 1 + points[:, 0] + points[:, 1]))["ranking"]
    told = re.search(
        r"Peak acceleration: \w+ (\S+) \((\S+) to (\S+)\), \w+ (\S+) \(", drawn.caption
    )
    first, low, high, second = map(float, told.groups())
    assert low < second <= first < high
    drawn = plan(listed(columns, 1 - 0.9 * points[:, 0] + 0.02 * points[:, 1]))["ranking"]
    assert "Peak acceleration: clearance −1.00 (−1.00 to −1.00), speed" in drawn.caption
    panel = panels_of(drawn.figure)[0]
    (found,) = (trace for trace in panel.traces if trace.type == "bar")
    assert panel.title == "clearance"
    assert found.x[0] == pytest.approx(-1.0, abs=0.01)
    assert found.error_x.array is not None


def test_blocks_of_a_design_with_a_failed_job_are_left_out():
    """y = 1 + x1 + 3 x2, of 64 blocks six with a failed job: the first 32 whole ones count."""
    points = np.array(design("saltelli", 64, 2, 1))
    columns = {"clearance_mm": points[:, 0], "speed_rpm": points[:, 1]}
    status = np.full(256, "ok", dtype="U7")
    status[[3, 9, 64 + 20, 128 + 30, 192 + 30, 192 + 40, 192 + 50]] = "failed"  # 30 twice
    data = listed(columns, 1 + points[:, 0] + 3 * points[:, 1], status=status)
    drawn = plan(data)["ranking"]
    numbers = drawn.numbers
    assert "Sobol's indices" in drawn.caption
    (peak, _) = ranking(sweep_of(data), measures(data)).values()
    assert (peak.unknown, peak.base) == (7, 32)
    assert peak.total_ends[0, 1] < 0.9 < peak.total_ends[1, 1]
    assert ("first whole blocks of the design", "32") in numbers
    assert [value for label, value in numbers if label.endswith("are left out")] == ["up to 7"]


def test_of_a_grid_with_large_gaps_nothing_is_ranked():
    status = np.full((3, 4, 2), "ok", dtype="U7")
    status[0] = "missing"
    status[1, :2] = "failed"
    data = grid(AXES, lambda c, n, load: 10 + c + 2 * n + 0 * load, status=status)
    assert ranking(sweep_of(data), measures(data)) == {}
    assert "ranking" not in plan(data)
    assert "overview" in plan(data)
