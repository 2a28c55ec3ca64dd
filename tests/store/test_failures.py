"""Where in a sweep jobs fail: against regions that are known, chance, and scikit-learn's trees."""

import json

import numpy as np
import pytest
from compsim import cli
from conftest import store
from sklearn.tree import DecisionTreeClassifier

from compressor.store.failures import (
    MIN_SIDE,
    best_split,
    describe_failures,
    find_regions,
    holds,
    round_between,
)

N = 400
RNG = np.random.default_rng(3)
COLUMNS = {
    "clearance_mm": RNG.uniform(0.05, 0.5, N),
    "machine.rod_mass_kg": RNG.uniform(2, 8, N),
    "load": np.where(RNG.random(N) < 0.5, "gas", "spring").astype(object),
}
CORNER = (COLUMNS["clearance_mm"] >= 0.3) & (COLUMNS["machine.rod_mass_kg"] < 4)


def test_a_corner_of_a_sweep_is_found():
    (region,) = find_regions(COLUMNS, CORNER)
    assert (region.jobs, region.failed) == (CORNER.sum(), CORNER.sum())
    first, second = region.splits
    at = {split.key: float(split.value) for split in (first, second)}
    for key, bound, sign in (("clearance_mm", 0.3, ">="), ("machine.rod_mass_kg", 4, "<")):
        below = COLUMNS[key][COLUMNS[key] < bound].max()
        assert any(split.key == key and split.sign == sign for split in region.splits)
        assert at[key] == pytest.approx(bound, abs=0.1 * bound)
        assert at[key] > below - 0.1
    (text,) = describe_failures(COLUMNS, CORNER)
    assert text.startswith(f"{CORNER.sum()} of the {CORNER.sum()} failed jobs lie where ")
    assert f"clearance_mm >= {at['clearance_mm']:.12g}" in text
    assert text.endswith(f"there {CORNER.sum()} of {CORNER.sum()} failed")


def test_a_word_may_part_them_too():
    failed = (COLUMNS["load"] == "gas") & (COLUMNS["clearance_mm"] < 0.4)
    (region,) = find_regions(COLUMNS, failed)
    assert {split.key for split in region.splits} == {"load", "clearance_mm"}
    assert {(split.sign, split.value) for split in region.splits if split.key == "load"} in (
        {("==", "gas")}, {("!=", "spring")},
    )  # fmt: skip


@pytest.mark.parametrize("share", [0.02, 0.1, 0.4])
def test_failures_by_chance_lie_nowhere(share):
    """Of 40 sweeps whose failures are drawn, one in twenty may seem to have a region."""
    rng = np.random.default_rng(7)
    found = [find_regions(COLUMNS, rng.random(N) < share) for _ in range(40)]
    assert sum(map(bool, found)) <= 5


def test_all_jobs_of_a_large_study_are_counted():
    """The tree is made of a part of them."""
    rng = np.random.default_rng(1)
    columns = {"machine.speed_rpm": rng.uniform(300, 900, 50_000), "x": rng.random(50_000)}
    failed = columns["machine.speed_rpm"] > 800
    (region,) = find_regions(columns, failed)
    assert (
        region.failed == (failed & (columns["machine.speed_rpm"] >= region.splits[0].value)).sum()
    )
    assert failed.sum() * 0.99 < region.failed <= region.jobs < failed.sum() * 1.01


def test_too_few_failures_are_no_region():
    few = np.zeros(N, bool)
    few[: MIN_SIDE - 1] = True
    assert find_regions(COLUMNS, few) == find_regions(COLUMNS, ~few) == []
    assert find_regions({"machine.speed_rpm": np.full(N, 500.0)}, CORNER) == []
    gap = {"clearance_mm": np.where(np.arange(N) == 5, np.nan, COLUMNS["clearance_mm"])}
    assert find_regions(gap, CORNER) == []


@pytest.mark.parametrize("seed", range(8))
def test_scikit_learn_splits_alike(seed):
    rng = np.random.default_rng(seed)
    x = rng.normal(size=(90, 3))
    failed = x @ [1.0, -0.5, 0.1] + rng.normal(0, 0.7, 90) > 1.0
    found = best_split({str(k): column for k, column in enumerate(x.T)}, failed)
    tree = DecisionTreeClassifier(max_depth=1, min_samples_leaf=MIN_SIDE).fit(x, failed).tree_
    assert int(found.key) == tree.feature[0]
    np.testing.assert_array_equal(
        holds(found, x[:, tree.feature[0]]), x[:, tree.feature[0]] <= tree.threshold[0]
    )
    weights = tree.weighted_n_node_samples
    gain = tree.impurity[0] - (weights[1:] @ tree.impurity[1:]) / weights[0]
    assert found.gain == pytest.approx(gain, rel=1e-9)


def test_a_threshold_has_few_digits_and_parts_its_neighbours():
    for low, high, value in ((0.29, 0.35, 0.32), (1.0, 2.0, 1.5), (0.1, 0.1 + 1e-12, None)):
        found = round_between(low, high)
        assert low < found <= high
        assert value is None or found == value


def test_status_says_where_jobs_fail(tmp_path, capsys):
    case = {
        "name": "budget", "clearance_mm": [0.1, 0.12, 0.14, 0.16, 0.18, 0.2], "joint": "big_end",
        "solve": {"max_steps": [5, 5000000], "duration_rev": 2, "accuracy": "draft",
                  "error_bars": False, "horizon": False},
    }  # fmt: skip
    (tmp_path / "budget.yaml").write_text(json.dumps(case))
    store(tmp_path / "results", tmp_path / "budget.yaml")
    assert cli.main(["status", "-r", str(tmp_path / "results")]) in (0, 3)
    text = "6 of the 6 failed jobs lie where solve.max_steps < 2500000: there 6 of 6 failed"
    assert text in " ".join(capsys.readouterr().out.split())
