"""How continuously joints hit: on series that are known, and on the paper's cases."""

from typing import NamedTuple

import numpy as np
import pytest

from compressor.analysis import impacts, margins
from compressor.analysis.shaking import whole_revolutions
from compressor.cases.case import Case
from compressor.metrics import JOINTS
from compressor.solve.simulate import simulate


class Hit(NamedTuple):
    revolution: int
    crank_angle: float
    approach_speed: float


def test_windows_that_are_hit_are_counted_once():
    hits = [Hit(1, 41.0, 0.3), Hit(1, 49.9, 0.2), Hit(1, 50.1, 0.2), Hit(2, 41.0, 0.3),
            Hit(2, 200.0, 0.009)]  # fmt: skip
    assert margins.hit_share(hits, 2) == pytest.approx(3 / 72)


@pytest.mark.parametrize("share", [0.25, 0.5])
def test_the_energy_s_angle_is_that_of_a_ringing(paper_runs, share):
    """Of cos^2 over its half turn pi, 90 % lies within x of it, where x + sin x = 0.9 pi."""
    run = paper_runs["big_end 0.2"].copy(deep=True)
    angle = np.degrees(run["crank_angle"].values) % 360
    ringing = 100 * np.cos(np.radians(60 * angle)) * (angle < 360 * share)
    run["contact_force"].loc[{"joint": "big_end", "axis": "x"}] = ringing
    found = margins.measure_shares(run, "big_end")
    assert found.energy_angle.value == pytest.approx(share * 1.8734 / np.pi, rel=0.03)
    assert (found.apart.value, found.hit.value) == (0.0, 0.0)  # by the eccentricity, as before


def test_flight_and_impacts_of_a_machine_that_rattles():
    loose = {"joint": "both", "clearance_mm": 0.3, "machine": {"speed_rpm": 1200}}
    loose |= {"contact": {"damping_N_s_per_mm": 1}}
    solve = {"accuracy": "draft", "error_bars": False}
    run = simulate(Case.from_values({**loose, "solve": solve}))
    each = [margins.evidence(run, joint) for joint in JOINTS]
    for joint, by in zip(JOINTS, each, strict=True):
        found = margins.find_shares(by)
        lost = float(run["contact_loss_fraction"].sel(joint=joint))
        assert lost < found["apart"] < 0.5
        most = float(run["impact_count"].sel(joint=joint)) / (36 * by.revolutions)
        assert 0.5 * most < found["hit"] <= most * (1 + 1e-12)
        assert {hit.joint for hit in by.hits} == {joint}
    settled, _ = whole_revolutions(run)
    assert sum(len(by.hits) for by in each) == len(impacts(settled))


def test_shares_have_errors_by_the_run_s_bars(paper_runs):
    """What is not there has no error but that of the contact's bar."""
    run = paper_runs["small_end 0.2"].copy(deep=True)
    run["contact_loss_fraction_error"].loc[{"joint": "small_end"}] = 0.01
    run["contact_force_error"].loc[{"joint": "small_end"}] = 1e-4
    short = margins.measure_shares(run, "small_end")
    assert short.apart.error == 0.01
    assert short.hit.error == 0.0
    run["contact_force_error"].loc[{"joint": "small_end"}] *= 100.0
    long = margins.measure_shares(run, "small_end")
    assert 0.0 < short.energy_angle.error < long.energy_angle.error < 1.0


def test_an_impact_at_a_window_s_edge_or_of_the_slowest_speed_is_in_doubt(paper_runs):
    """Of four impacts, one lies at an edge and one is as slow as counts."""
    found = margins.evidence(paper_runs["big_end 0.2"], "big_end")
    hits = [Hit(2, 45.0, 0.3), Hit(2, 49.9, 0.2), Hit(3, 55.0, margins.SLOWEST), Hit(3, 155.0, 0.5)]
    assert margins.hit_error(found._replace(hits=hits)) == pytest.approx(2 / 36 / 3)


def test_a_chaotic_run_s_shares_are_unknown_of_three_revolutions(paper_runs):
    run = paper_runs["big_end 0.2"].copy(deep=True)
    angle = run["crank_angle"].values
    turn = np.floor(angle / (2.0 * np.pi) + 1e-9)
    ringing = np.cos(60 * angle) * ((np.degrees(angle) % 360) < 90.0 * turn)
    run["contact_force"].loc[{"joint": "big_end", "axis": "x"}] = 100.0 * ringing
    run.attrs["regime"] = "chaotic"
    found = margins.measure_shares(run, "big_end").energy_angle
    assert 0.3 < found.value < 0.6  # shares of about 1, 2 and 3 quarters of 0.6
    assert found.error == np.inf
