"""The parts of a `saltelli` design, and indices of a plane, which are known."""

import numpy as np
import pytest

from compressor.analysis.effects import saltelli_design, sampled_effects
from compressor.cases.swept import design


def test_only_a_design_is_one():
    points = np.array(design("saltelli", 8, 3, 1))
    assert saltelli_design(points[:, [2, 0, 1]]) is not None  # the order of columns is no matter
    assert saltelli_design(points[:-1]) is None
    assert saltelli_design(np.array(design("sobol", 40, 3, 1))) is None
    assert saltelli_design(points.astype(object)) is None


def test_blocks_drop_out_whole_and_a_power_of_two_is_left():
    """An unknown point of A, of B, or of a mixed part costs its block."""
    points = np.array(design("saltelli", 8, 3, 1))
    parts = saltelli_design(points)
    unknown = np.zeros(len(points), bool)
    unknown[[parts.a[1], parts.b[3], parts.mixed[2, 4], parts.mixed[0, 4]]] = True
    left = parts.whole(unknown)
    kept = [0, 2, 5, 6]  # 7 is whole, too
    assert left.a.tolist() == parts.a[kept].tolist()
    assert left.b.tolist() == parts.b[kept].tolist()
    assert left.mixed.tolist() == parts.mixed[:, kept].tolist()
    assert parts.whole(unknown, 2).a.tolist() == parts.a[[0, 2]].tolist()
    assert parts.whole(np.ones(len(points), bool)).a.size == 0


def test_indices_of_a_plane():
    """y = x1 + 2 x2: 0.2 and 0.8; a third key changes nothing, surely."""
    points = np.array(design("saltelli", 256, 3, 1))
    found = saltelli_design(points).indices(points[:, 0] + 2 * points[:, 1], 50)
    for order in ("first_order", "total_order"):
        assert found[order] == pytest.approx([0.2, 0.8, 0.0], abs=0.03)
        assert (found[f"{order}_low"] <= found[order]).all()
        assert (found[f"{order}_high"] >= found[order]).all()
        assert found[f"{order}_high"][2] == 0.0


def test_failed_runs_do_not_bias_the_indices():
    """A tenth of the points is unknown by chance."""
    points = np.array(design("saltelli", 512, 2, 1))
    values = points[:, 0] + 2.0 * points[:, 1]
    lost = np.random.default_rng(4).random(values.size) < 0.1
    found = sampled_effects([*points.T], np.where(lost, np.nan, values))
    assert (found.kind, found.unknown, found.base) == ("saltelli", lost.sum(), 256)
    assert found.total == pytest.approx([0.2, 0.8], abs=0.04)
    assert (found.main_ends[0] <= found.main).all()
    assert (found.main_ends[1] >= found.main).all()
    whole = sampled_effects([*points.T], values)
    assert (whole.unknown, whole.base) == (0, 0)


def test_where_few_blocks_are_whole_ranks_remain():
    points = np.array(design("saltelli", 16, 6, 1))
    values = points[:, 0].copy()
    values[saltelli_design(points).mixed[0, :10]] = np.nan
    assert sampled_effects([*points.T], values).kind == "rank"


def test_a_design_of_one_key_has_indices():
    points = np.array(design("saltelli", 64, 1, 1))
    found = sampled_effects([points[:, 0]], points[:, 0])
    assert found.total == pytest.approx([1.0], abs=0.03)
    assert found.total_ends[0, 0] <= found.total[0] <= found.total_ends[1, 0]
