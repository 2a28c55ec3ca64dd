"""A few machines of the diagnosis campaign, and what its kept numbers must say to be honest."""

import itertools
import json

import numpy as np
import pytest

pytest.importorskip("sklearn", reason="scikit-learn is not installed: pip install 'compsim[learn]'")

import measure_diagnosis
from conftest import jobs_here
from machines import JOINTS, LOADS, machines
from measure_diagnosis import BINS, NOISE, by_machine, population, told_apart
from page_tables import kept

from compressor.cases.load import load_studies

FEW = 40
FASTER = ("sensor.rate_Hz=6400", "sensor.mounting_Hz=6000", "solve.error_bars=false")


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A data set of few machines, whose sensor has a quarter of the rate."""
    with jobs_here():
        return population(tmp_path_factory.mktemp("machines"), FEW, seed=2, more=FASTER)


def test_machines_share_no_value(tmp_path):
    (tmp_path / "machines.yaml").write_text(machines(80, 3), encoding="utf-8")
    (study,) = load_studies(tmp_path / "machines.yaml")
    assert len(study.cases) == 80
    kinds = [(case.joint, case.load) for case in study.cases]
    assert {kinds.count((joint, load)) for joint in JOINTS for load in LOADS} == {10}
    for values in (
        [case.machine.speed_rpm for case in study.cases],
        [case.machine.rod_mass_kg for case in study.cases],
        [case.sensor.seed for case in study.cases],
    ):
        assert len({*values}) == 80


@pytest.fixture(autouse=True)
def few_trees(monkeypatch):
    """A sixth of the campaign's: the rest is only more certain."""
    monkeypatch.setattr(measure_diagnosis, "TREES", 50)


def test_the_campaign_runs_on_few_machines(found):
    """Four kinds of ten machines each: better than chance, which is a quarter, by far."""
    assert found.sizes["window"] == 2 * FEW
    row = told_apart(found, 0)
    assert np.sum(row["confusion"]) == 2 * 12
    assert row["most_frequent"] == 0.25
    assert row["accuracy"] >= 0.5
    assert row["accuracy"] == pytest.approx(np.trace(row["confusion"]) / 24, abs=1e-3)


def test_labels_that_mean_nothing_are_not_learned(found):
    """Machines with labels of others: what was split by machine cannot be known again."""
    machine, joint = found["machine"].values, found["joint"].values
    scores = []
    for seed in range(4):
        names = np.unique(machine)
        of = dict(zip(names, np.random.default_rng(seed).permutation(names), strict=True))
        labels = {one: joint[machine == of[one]][0] for one in names}
        shuffled = found.assign(joint=("window", np.array([labels[one] for one in machine])))
        scores.append(told_apart(shuffled, 0)["accuracy"])
    assert np.mean(scores) < 0.45


def test_errors_of_shares_know_that_windows_of_a_machine_are_alike():
    right = np.repeat([True, False] * 50, 2)
    machine = np.repeat(np.arange(100), 2)
    assert by_machine(right, machine) == pytest.approx(0.5 / np.sqrt(100), rel=0.02)
    assert by_machine(right, np.arange(200)) == pytest.approx(0.5 / np.sqrt(200), rel=0.02)


def test_what_is_kept_is_of_the_whole_population():
    row = kept("diagnosis.json")
    assert row["jobs"] == measure_diagnosis.MACHINES
    left = sum(row["left_out"].values())
    assert row["machines"]["train"] + row["machines"]["test"] == row["jobs"] - left
    assert [level["noise"] for level in row["levels"]] == [*NOISE]
    for level in row["levels"]:
        scores = level["classifier"]
        assert np.sum(scores["confusion"]) == row["windows"]["test"]
        edges = [one["clearance_mm"] for one in scores["bins"]]
        assert edges == [[*pair] for pair in itertools.pairwise(BINS)]
    assert json.dumps(row).count("NaN") == 0
