"""`compsim wear`: lives, files that go on after a kill, and stages by Archard's law."""

import itertools
import json
import math
import multiprocessing
import os
import signal
import time

import numpy as np
import pytest
from compsim.cli import main
from conftest import assert_same_bits, jobs_here, without_pictures
from published import COEFFICIENT, rubbing

from compressor.analysis.wear import rubbing_work
from compressor.cases import Case, Wear, load_cases
from compressor.solve import simulate
from compressor.store.files import StoreError
from compressor.studies import wear
from compressor.studies.frame import make_rows, stored_rows
from compressor.studies.wear import Worn, follow_stage, hours, life, open_wear

TEXT = """
joint: both
clearance_mm: 0.2
machine: {speed_rpm: [400, 500]}
solve: {accuracy: draft, duration_rev: 1, settle_rev: 0}
wear: {limit_mm: 0.23, step_mm: 0.01}
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    file = tmp_path_factory.mktemp("worn") / "bearing.yaml"
    file.write_text(TEXT, encoding="utf-8")
    out = file.with_name("results")
    with jobs_here(), without_pictures():
        assert main(["wear", str(file), "-r", str(out), "-j", "2", "--quiet"]) == 0
    return file, load_cases(file), out


def test_a_line_for_each_machine_says_when_it_is_worn_out(told, compsim):
    file, cases, out = told
    with without_pictures():
        numbers = json.loads(compsim("wear", file, "-r", out, "--json").out)
    said = compsim("wear", file, "-r", out)
    _, *lines = said.out.splitlines()
    assert "all 2 machines are stored" in said.err
    for line, one, case in zip(lines, numbers, cases, strict=True):
        assert f"machine.speed_rpm={case.machine.speed_rpm}" in line
        assert f"{one['hours']:.4g}" in line
        assert f"{one['low']:.4g} to {one['high']:.4g}" in line
        assert one["low"] < one["hours"] < one["high"]
        found = open_wear(out, case)
        assert one["file"] == str(Worn(case).path(out))
        worst = float(found["clearance"].sel(joint=one["joint"]).values[-1])
        assert worst == found["clearance"].values.max() == one["clearance"] >= 0.23e-3
        assert f"{1e3 * worst:.3f} mm at {one['joint']}" in line
    figure = out / "wear" / "bearing.png"
    assert str(figure) in said.err
    assert figure.stat().st_size > 10_000


def test_warnings_are_those_of_a_run(tmp_path, compsim, monkeypatch):
    """But for the one that a run leaves wear out."""
    file = tmp_path / "pins.yaml"
    file.write_text(TEXT.replace("[400, 500]", "400, pin_radius_mm: 30"), encoding="utf-8")
    monkeypatch.setattr(wear, "run_wear", lambda *_: ([], 0))
    said = " ".join(compsim("wear", file, "-r", tmp_path).err.split())
    assert "wear.bore_length_mm: 20 mm is the default, for the paper's pin of 10 mm" in said
    assert "compsim wear alone reads it" not in said


@pytest.mark.slow
def test_a_killed_machine_goes_on_and_ends_in_the_same_bits(told, tmp_path):
    """SIGKILL at random, until all stages are there."""
    _, cases, out = told
    worn, rng, stops = Worn(cases[0]), np.random.default_rng(3), []
    worn.make_row([])  # loads the equations, which forked processes share
    path = worn.path(tmp_path)
    for _ in range(30):
        before = len(stored_rows(worn, tmp_path))
        stops.append(before)
        process = multiprocessing.get_context("fork").Process(
            target=make_rows, args=(worn, tmp_path)
        )
        process.start()
        seen = path.stat().st_mtime_ns if path.exists() else 0
        while process.is_alive() and (path.stat().st_mtime_ns if path.exists() else 0) == seen:
            time.sleep(0.005)
        time.sleep(rng.uniform(0.0, 0.3))
        if process.is_alive():
            os.kill(process.pid, signal.SIGKILL)
        process.join()
        if process.exitcode == 0:
            break
    assert process.exitcode == 0
    assert_same_bits(open_wear(tmp_path, cases[0]), open_wear(out, cases[0]))
    assert len({*stops}) > 1


def test_a_failed_machine_goes_on_when_asked(told, tmp_path, compsim, monkeypatch, in_process):
    file = tmp_path / "failing.yaml"
    file.write_text(TEXT.replace("[400, 500]", "400"), encoding="utf-8")
    follow, calls = wear.follow_stage, []

    def failing(*given):
        calls.append(given)
        late = {"reason": "budget_seconds", "detail": "slow"} if len(calls) == 4 else {}
        return follow(*given) | late

    monkeypatch.setattr(wear, "follow_stage", failing)
    (case,) = load_cases(file)
    worn = Worn(case)
    make_rows(worn, tmp_path)
    kept = stored_rows(worn, tmp_path)
    assert (kept[-1]["reason"], kept[-1]["detail"]) == ("budget_seconds", "slow")
    make_rows(worn, tmp_path)
    assert len(stored_rows(worn, tmp_path)) == len(kept)
    said = compsim("wear", file, "-r", tmp_path, code=3)
    assert "failing: budget_seconds: slow" in said.err
    assert "--rerun" in said.err
    assert "failed: budget_seconds" in said.out
    last = float(open_wear(tmp_path, case)["hours"][-1])  # no machine outlives what was not run
    assert f"  > {hours(last)}  " in said.out
    with without_pictures():
        assert main(["wear", str(file), "-r", str(tmp_path), "--rerun"]) == 0
    assert_same_bits(open_wear(tmp_path, case), open_wear(told[2], case))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("joint: big_end\nclearance_mm: 0.2\n", "has no wear: write wear: true"),
        (TEXT.replace("_rev: 1", "_rev: 2.5"), "2.5 after settle_rev must be whole"),
        (TEXT + "lubricant: true\n", "leave out lubricant or wear"),
        (TEXT.replace("0.23", "0.1"), "0.1 mm must be more than the clearance, 0.2 mm"),
        ("joint: [none, big_end]\nclearance_mm: 0.1\nwear: true\n", "none has no bore that wears"),
    ],
)
def test_what_cannot_wear_is_refused(text, message, tmp_path, compsim):
    file = tmp_path / "odd.yaml"
    file.write_text(text, encoding="utf-8")
    assert message in compsim("wear", file, "-r", tmp_path / "none", code=2).err
    assert not (tmp_path / "none").exists()


def test_a_file_of_something_else_is_told(told, tmp_path):
    _, cases, out = told
    place = Worn(cases[1]).path(tmp_path)
    place.parent.mkdir(parents=True)
    place.write_bytes(Worn(cases[0]).path(out).read_bytes())
    with pytest.raises(StoreError, match="does not hold what its name says"):
        stored_rows(Worn(cases[1]), tmp_path)
    with pytest.raises(StoreError, match="compsim wear the case file"):
        open_wear(tmp_path / "nowhere", cases[0])


# ---- stages


VALUES = {"joint": "big_end", "clearance_mm": 0.2, "solve": {"accuracy": "draft"}}


def followed(wear, **values):
    of = Worn(Case.from_values({**VALUES, **values, "wear": {"limit_mm": 0.26, **wear}}))
    stages = [of.make_row([])]
    while not of.over(stages[-1]):
        stages.append(of.make_row(stages))
    return of, stages


@pytest.fixture(scope="module")
def machine():
    return followed({"step_mm": 0.01})


def test_a_volume_is_the_coefficient_times_what_has_slid(machine):
    """V = k N |v| t: by the runs midway, made again."""
    of, stages = machine
    found = of.to_dataset(stages)
    k = 1e-8 * 1e-9  # m3/(N m); over 2 pi (R + c) times the bore's length, by default twice R
    assert of.bore_area[0] == pytest.approx(2.0 * math.pi * (10e-3 + 0.2e-3) * 20e-3)
    volume = 0.0
    for before, after in itertools.pairwise(stages):
        turns = (after["hours"] - before["hours"]) * 3600.0 / of.case.turn
        deeper = 0.5 * turns * k * before["rubbing_work"] / of.bore_area
        midway = follow_stage(of, 0.0, before["clearance"] + deeper)
        volume += k * midway["rubbing_work"].sum() * turns
    assert found["worn_volume"].values[-1, 0] == pytest.approx(volume, rel=1e-9)
    assert not found["worn_volume"].values[:, 1].any()
    assert not found["clearance"].values[:, 1].any()
    opened = 1e3 * found["clearance"].values[:, 0]
    assert opened[0] == 0.2
    assert np.diff(opened) == pytest.approx(0.01, rel=0.2)  # by its step until the limit
    assert opened[-2] < 0.26 <= opened[-1]
    assert (np.diff(found["hours"].values) > 0).all()


def test_stages_are_ordinary_runs_at_their_clearances(machine):
    of, (_, _, stage, *_) = machine
    values = VALUES | {"clearance_mm": 1e3 * float(stage["clearance"][0])}
    run = simulate(Case.from_values(values))
    assert of.case_at(stage["clearance"]).key == Case.from_values(values).key
    solve = VALUES["solve"] | {"output_step_deg": 3.6}
    coarse = Worn(Case.from_values({**VALUES, "solve": solve, "wear": True}))
    assert coarse.case_at(stage["clearance"]).key == Case.from_values(values).key
    assert stage["peak_contact_force"] == pytest.approx(run["peak_contact_force"].values, rel=1e-12)


def test_a_coefficient_is_a_scale_of_hours(machine):
    """The same clearances, a tenth of the hours: what the interval of a life rests on."""
    of, stages = machine
    tenfold, faster = followed({"step_mm": 0.01, "coefficient_mm3_per_N_m": 1e-7})
    one, other = life(of, of.to_dataset(stages)), life(tenfold, tenfold.to_dataset(faster))
    assert other.hours == pytest.approx(one.hours / 10, rel=1e-5)
    assert (one.low, one.high) == pytest.approx((one.hours / 2, one.hours * 2))
    assert one.joint == "big_end"


def test_the_default_step_is_short_enough():
    """Against a quarter of it; 40 random machines were off by 0.02 % in the median, once by 2 %."""
    steps = Wear().step_mm, Wear().step_mm / 4
    pairs = [followed({"step_mm": step}) for step in steps]
    coarse, fine = (life(of, of.to_dataset(stages)).hours for of, stages in pairs)
    assert coarse == pytest.approx(fine, rel=2e-3)


def test_a_life_beyond_the_hours_is_not_told(machine):
    """Where even the greatest coefficient does not wear a joint out, no hours are named."""
    of, stages = followed({"hours": 1.0})
    found = life(of, of.to_dataset(stages))
    assert [math.isnan(v) for v in (found.low, found.hours, found.high)] == [True] * 3
    assert stages[-1]["hours"] == 2.0  # of the given coefficient: as the greatest wears in one
    assert found.clearance > 0.2e-3
    whole = life(machine[0], machine[0].to_dataset(machine[1]))
    of, stages = followed({"step_mm": 0.01, "hours": 0.75 * whole.hours})
    found = life(of, of.to_dataset(stages))
    assert found.low == pytest.approx(whole.low, rel=1e-3)
    assert math.isnan(found.hours)
    assert math.isnan(found.high)


def test_a_speed_that_gives_way_takes_longer_for_a_revolution():
    soft = {"drive": {"slope_N_m_s": 10.0, "flywheel_kg_m2": 5.0}, "load": "gas"}
    of = Worn(Case.from_values({**VALUES, **soft, "wear": True}))
    found = of.make_row([])
    assert not found["reason"]
    assert found["turn"] > 1.001 * of.case.turn


@pytest.mark.parametrize(
    ("solve", "opened", "reason", "words"),
    [
        ({"max_steps": 300}, 2e-4, "budget_steps", "300 steps"),
        ({}, 0.02, "invalid_input", "exceeds the pin radius"),
    ],
)
def test_a_stage_that_fails_ends_its_machine_with_a_reason(solve, opened, reason, words):
    values = {**VALUES, "solve": VALUES["solve"] | solve, "wear": True}
    worn = Worn(Case.from_values(values))
    stage = follow_stage(worn, 0.0, np.array([opened, 0.0]))
    assert stage["reason"] == reason
    assert words in stage["detail"]
    assert worn.over(stage)


# ---- what rubs


@pytest.mark.parametrize(("joint", "more"), [
    ("big_end", {}), ("small_end", {}), ("big_end", {"drive": {"flywheel_kg_m2": 0.5}}),
    ("small_end", {"guide": {"clearance_mm": 0.1, "friction": 0}}), ("small_end", {"rod": True}),
])  # fmt: skip
def test_what_rubs_is_what_friction_takes_over_its_coefficient(joint, more):
    """By the ledger of the dense solution; also in time of its own, and with a pin that tilts."""
    run = simulate(rubbing(joint, **more))
    here = 0 if joint == "big_end" else 1
    found = rubbing_work(run)
    assert found[here] == pytest.approx(float(run["friction_loss"]) / COEFFICIENT, rel=3e-3)
    assert found[1 - here] == 0.0


def test_what_rubs_is_told_a_revolution():
    """Of settled ones alone: twice as many give the same."""
    solve = {"settle_rev": 2, "duration_rev": 3, "rtol": 1e-8, "error_bars": False}
    one, two = (
        rubbing_work(simulate(rubbing("big_end", solve=solve | {"duration_rev": n}, load="spring")))
        for n in (3, 4)
    )
    assert two[0] == pytest.approx(one[0], rel=1e-3)
