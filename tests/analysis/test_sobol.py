"""The parts of a `saltelli` design, and indices of a plane, which are known."""

import numpy as np
import pytest
from scipy.stats import sobol_indices

from compressor.analysis.effects import SEED, saltelli_design, sampled_effects
from compressor.cases.swept import design


def test_only_a_design_is_one():
    points = np.array(design("saltelli", 8, 3, 1))
    assert saltelli_design(points[:, [2, 0, 1]]) is not None  # the order of columns is no matter
    assert saltelli_design(points[:-1]) is None
    assert saltelli_design(np.array(design("sobol", 40, 3, 1))) is None
    assert saltelli_design(points.astype(object)) is None


def test_the_first_points_of_a_design_are_one():
    points = np.array(design("saltelli", 64, 2, 1))
    part = saltelli_design(points).first(16)
    assert np.array_equal(points[part.mixed[1], 1], points[part.b, 1])
    assert part.indices(points[:, 0])["first_order"] == pytest.approx([1.0, 0.0], abs=0.05)


@pytest.mark.parametrize("keys", [2, 5])
def test_scipy_has_the_same_indices(keys):
    points = np.array(design("saltelli", 64, keys, 1))
    values = np.exp(points @ np.arange(1.0, keys + 1))
    parts = saltelli_design(points)
    found = parts.indices(values, 50)
    table = {"f_A": values[parts.a][None], "f_B": values[parts.b][None],
             "f_AB": values[parts.mixed][:, None]}  # fmt: skip
    theirs = sobol_indices(func=table, n=64)
    state = np.random.get_state()  # noqa: NPY002
    np.random.seed(SEED)  # noqa: NPY002
    spread = theirs.bootstrap(n_resamples=50)
    np.random.set_state(state)  # noqa: NPY002
    for order in ("first_order", "total_order"):
        np.testing.assert_allclose(found[order], np.ravel(getattr(theirs, order)), rtol=1e-12)
        interval = getattr(spread, order).confidence_interval
        np.testing.assert_allclose(found[f"{order}_low"], np.ravel(interval.low), rtol=1e-9)
        np.testing.assert_allclose(found[f"{order}_high"], np.ravel(interval.high), rtol=1e-9)


def test_a_block_drops_out_whole():
    """Of four blocks of three keys: an unknown point of A, of B, or of one mixed part costs one."""
    points = np.array(design("saltelli", 8, 3, 1))
    parts = saltelli_design(points)
    unknown = np.zeros(len(points), bool)
    unknown[[parts.a[1], parts.b[3], parts.mixed[2, 4], parts.mixed[0, 4]]] = True
    left = parts.without(unknown)
    kept = [0, 2, 5, 6, 7]
    assert left.a.tolist() == parts.a[kept].tolist()
    assert left.b.tolist() == parts.b[kept].tolist()
    assert left.mixed.tolist() == parts.mixed[:, kept].tolist()


def test_failed_runs_bias_the_indices_only_where_their_blocks_stay():
    """y = x1 + 2 x2, a tenth of the points unknown by chance: 0.2 and 0.8, and the other answer."""
    points = np.array(design("saltelli", 512, 2, 1))
    values = points[:, 0] + 2.0 * points[:, 1]
    lost = np.random.default_rng(4).random(values.size) < 0.1
    found = sampled_effects([*points.T], np.where(lost, np.nan, values))
    assert found.filled == lost.sum()
    parts = saltelli_design(points)
    assert found.dropped == 512 - parts.without(lost).a.size > 100
    assert found.total == pytest.approx([0.2, 0.8], abs=0.04)
    other = found.with_unknown
    assert other.filled == lost.sum()
    # a point at the median is off by what the strong key does: the weak one seems to do it
    assert other.total[0] == pytest.approx(0.29, abs=0.02)
    assert other.main[1] == pytest.approx(0.74, abs=0.02)
    whole = sampled_effects([*points.T], values)
    assert (whole.dropped, whole.with_unknown) == (0, None)


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
