"""Extreme scenes: drawn alike for a seed, judged by others, and none wrong in silence."""

import re
import sys

import numpy as np
import pytest
import xarray as xr
from compsim import cli
from conftest import jobs_here

from compressor.cases.case import Case
from compressor.physics import COLUMNS, Column
from compressor.report.figures.pictures import render
from compressor.solve.error_bars import estimate_errors
from compressor.solve.solution import solve
from compressor.store.files import StoreError
from compressor.studies.stress.extremes import SPANS, Budget, is_supported, place, values
from compressor.studies.stress.figures import draw_outcomes, outcomes
from compressor.studies.stress.judge import (
    PARTS,
    StressFinding,
    agreed_verdict,
    compare,
    compare_statistics,
    excess,
    journal_distance,
    judge,
    judges,
    shorten_case,
)
from compressor.studies.stress.stress import (
    FILE,
    campaign,
    campaign_dataset,
    counts,
    slowest,
    worst,
)
from compressor.studies.stress.words import list_outcomes

SMALL = Budget(revolutions=0.125, max_steps=60_000, seconds=20.0)
COUNT, SEED = 8, 4


@pytest.fixture(scope="module")
def folder(once):
    def fill(folder):
        folder.mkdir()
        with jobs_here():
            campaign(folder, COUNT, SEED, 1, budget=SMALL)

    return once("stress", fill)


@pytest.fixture(scope="module")
def study(folder):
    """The seeded scenes, as the folder holds it: nothing is run."""
    return campaign(folder, COUNT, SEED, 1, budget=SMALL)


def test_what_is_complete_compiles_nothing(study, folder, monkeypatch):
    monkeypatch.setattr(sys.modules["compressor.sweep.sweep"], "compile_once", pytest.fail)
    assert campaign(folder, COUNT, SEED, 1, budget=SMALL).identical(study)


def test_scenes_lie_in_their_ranges():
    for number in range(200):
        case = Case.from_values(values(number, SEED))
        found = place(case)
        for name, (_, whole, narrow, _) in SPANS.items():
            low, high = narrow if narrow and is_supported(number) else whole
            bounds = low * (1 - 1e-3), high * (1 + 1e-3)
            if (name == "damping" and found[name] == 0) or np.isnan(found[name]):
                continue
            assert bounds[0] <= found[name] <= bounds[1], (number, name)
        ratio = found["rod_mass"] / found["reciprocating_mass"]
        assert 0.99e-4 <= ratio <= 1.01e4


def test_scenes_are_the_same_however_many_are_drawn():
    assert values(37, 3) == values(37, 3)
    assert values(37, 3) != values(37, 4)
    before = values(5, 3)
    values(1999, 3)
    assert values(5, 3) == before


def test_scenes_start_as_they_are_said_to():
    """None, within the clearance, or sunk into the bearing: a third each."""
    kinds = []
    for number in range(300):
        case = Case.from_values(values(number, SEED))
        if case.joint != "big_end":
            continue
        offset = case.initial_offset_mm
        size = np.hypot(offset.big_end_x, offset.big_end_y)
        kinds.append(0 if size == 0 else 1 if size < case.clearance_mm.big_end else 2)
    share = np.bincount(kinds, minlength=3) / len(kinds)
    assert (share > 0.2).all(), share


def test_stiffness_is_that_of_the_same_force_at_full_damping():
    for number in (4, 5, 6, 7):
        drawn = values(number, SEED)["contact"]
        case = Case.from_values(values(number, SEED))
        force = drawn["stiffness_N_per_mm15"] * 0.1 ** drawn["exponent"]
        assert place(case)["stiffness"] * 1e-4**1.5 == pytest.approx(force, rel=1e-9)


def test_extreme_scenes(study):
    """All end ok or with a named reason within their budget; none is wrong in silence."""
    verdicts = study["verdict"].values
    assert study.sizes["scene"] == COUNT
    assert set(verdicts) <= {"ok", "failed", "unjudged"}
    assert (verdicts == "unjudged").sum() <= 1
    failed = study.isel(scene=verdicts == "failed")
    assert all(re.fullmatch("[a-z_]+", reason) for reason in failed["reason"].values)
    assert not {"internal_error", "worker_died"} & set(failed["reason"].values)
    assert (study["steps"] <= SMALL.max_steps).all()
    assert ((failed["end"] > 0) & (failed["end"] <= 1)).all()


def test_most_supported_scenes_are_ok(study):
    ends = counts(study)["supported"]
    assert sum(ends.values()) == COUNT // 2
    assert ends["ok"] >= 0.8 * COUNT // 2, ends  # 0.95 of thousands: make stress


def test_a_campaign_goes_on_and_scenes_repeat_their_verdicts(study, tmp_path, in_process):
    told = []
    campaign(tmp_path, 2, SEED, 1, budget=SMALL)
    again = campaign(tmp_path, 4, SEED, 1, lambda *event: told.append(event), SMALL)
    first = study.isel(scene=slice(4))
    for name in study.data_vars:
        if name not in ("seconds", "judging_seconds", "peak_memory"):
            np.testing.assert_array_equal(again[name].values, first[name].values, name)
    assert told[0][:2] == (2, 4)
    assert told[-1][:2] == (4, 4)
    with pytest.raises(StoreError, match=f"holds scenes of seed {SEED}"):
        campaign(tmp_path, 2, SEED + 1, 1, budget=SMALL)
    kept = xr.load_dataset(tmp_path / FILE, engine="h5netcdf")
    assert kept["scene"].values.tolist() == [*range(4)]
    assert kept["seconds"].attrs["units"] == "s"


CASE = {"joint": "big_end", "clearance_mm": 0.2,
        "solve": {"duration_rev": 0.5, "settle_rev": 0, "output_step_deg": 0.25}}  # fmt: skip


@pytest.fixture(scope="module")
def run():
    return solve(Case.from_values(CASE))


def finding(found):
    return StressFinding(found, 0.0, 0.0)


def test_a_good_run_is_confirmed(run):
    result = judge(Case.from_values(CASE))
    assert result.verdict == "ok"
    assert result.judged == result.horizon == PARTS
    assert result.by[0] in ("RODAS", "DOP853")
    assert result.worst.ratio < 1
    assert result.apart < 1e-3


def test_a_wrong_number_that_no_bar_tells_of_is_silent(run):
    """A run of another machine, with this one's bars: two judges object."""
    heavier = {**CASE, "machine": {"reciprocating_mass_kg": 16}}
    other = solve(Case.from_values(heavier))
    other.bars = run.bars
    result = finding(other)
    verdict, excess, _ = agreed_verdict(Case.from_values(CASE), other, compare, result)
    assert verdict == "silent_wrong"
    assert excess.ratio > 1
    assert len(result.by) == 2
    estimate_errors(other)  # by no other run, inf: it tells that it knows nothing
    verdict, _, _ = agreed_verdict(Case.from_values(CASE), other, compare, finding(other))
    assert verdict == "ok"


@pytest.mark.parametrize("factor", [0.01, 100.0])
def test_a_bar_is_as_long_as_it_says_whatever_the_number(run, factor):
    """Both a number far too large and one far too small lie ten bars off, or they do not."""
    case = Case.from_values(CASE)
    other = solve(case)
    name = "rms_acceleration"
    other.metrics = {**run.metrics, name: factor * run.metrics[name]}
    off = abs(factor - 1) * run.metrics[name]
    for length, ratio in ((off / 9, 0.9), (off / 11, 1.1)):
        other.bars = {**run.bars, name: length}
        assert excess(name, other, run, 0.05).ratio == pytest.approx(ratio)


def test_statistics_bound_what_lies_beyond_the_horizon(run):
    faster = {**CASE, "machine": {"speed_rpm": 1000}}
    other = solve(Case.from_values(faster))
    assert compare_statistics(run, run).ratio == 0
    assert compare_statistics(run, other).ratio > 1


def test_a_stiff_run_is_not_judged_by_the_stiff_partner(run):
    assert "RODAS" in [*judges(run)]
    run_ = solve(Case.from_values({**CASE, "solve": {**CASE["solve"], "method": "RODAS"}}))
    assert [*judges(run_)] == ["TSIT5", "LSODA", "Radau"]


def test_a_claim_is_cut_to_parts_of_its_span():
    case = Case.from_values(CASE)
    assert shorten_case(case, PARTS) == case
    assert shorten_case(case, 1).duration == pytest.approx(case.duration / 16)
    assert round(shorten_case(case, 1).steps) == 45


def row(number, verdict, **more):
    return {"scene": number, "verdict": verdict, "excess": 0.1, "seconds": 1.0, **more}


def test_the_worst_come_first():
    rows = [row(0, "ok"), row(1, "failed", reason="non_finite"), row(2, "ok", excess=0.5),
            row(3, "silent_wrong", excess=3.0), row(4, "unjudged", seconds=9.0)]  # fmt: skip
    study = campaign_dataset(rows, SEED)
    assert worst(study)["scene"].values.tolist() == [3, 4, 2, 0]
    assert slowest(study)["scene"].item() in (0, 2)
    assert counts(study)["whole"] == {"non_finite": 1, "silent_wrong": 1}
    text = "\n".join(list_outcomes(study))
    assert f"compsim stress --scene 3 --seed {SEED}" in text
    assert "whole range: 2 scenes, 0.0% ok: non_finite 1, silent_wrong 1" in text


def test_a_map_marks_every_outcome():
    reasons = ("budget_steps", "budget_seconds", "penetration_implausible", "worker_died")
    rows = [row(i, "failed", reason=reason) for i, reason in enumerate(reasons)]
    rows += [row(4, "ok"), row(5, "silent_wrong"), row(6, "unjudged")]
    for one in rows:
        one |= place(Case.from_values(values(one["scene"], SEED)))
    study = campaign_dataset(rows, SEED)
    assert [*outcomes(study)] == [
        "budget", "budget", "penetration_implausible", "other failure", "ok", "silent_wrong",
        "unjudged",
    ]  # fmt: skip
    drawing = draw_outcomes(study)
    assert len(drawing.panels) == 6
    assert [one.name for one in drawing.legend] == [
        "ok (1)", "budget (2)", "penetration implausible (1)", "other failure (1)", "unjudged (1)",
        "silent wrong (1)",
    ]  # fmt: skip
    assert render(drawing, "png").startswith(b"\x89PNG")


def test_a_scene_is_repeated_as_a_case_file(capsys, tmp_path):
    number = 2
    assert cli.main(["stress", "--scene", str(number), "--seed", str(SEED)]) == 0
    text = capsys.readouterr().out
    assert "# verdict: " in text
    from compressor.cases.load import load_studies

    path = tmp_path / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    (study,) = load_studies(path)
    assert study.cases[0] == Case.from_values(values(number, SEED))


def test_the_command_writes_data_and_map(capsys, tmp_path, in_process):
    assert cli.main(["stress", "-n", "1", "--seed", "4", "-j", "1", "-o", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert out.startswith("supported range: 1 scene,")
    assert "peak memory of a worker: " in out
    assert {path.name for path in tmp_path.iterdir()} == {FILE, "stress.png", "stress.svg"}


def test_journals_part_by_their_distance_over_their_room():
    p = np.array((np.array([1e-4, 0.0]),), dtype=[("clearance", "f8", 2)])[()]
    ours, theirs = np.zeros((3, COLUMNS)), np.zeros((3, COLUMNS))
    big, small = Column.ECCENTRICITY, Column.ECCENTRICITY + 2
    assert journal_distance(p, ours, theirs) == 0.0
    theirs[1, big : big + 2] = 3e-5, 4e-5
    theirs[1, small : small + 2] = 1.0  # of a joint without clearance
    assert journal_distance(p, ours, theirs) == pytest.approx(0.5)
    ours[2, big : big + 2] = theirs[2, big : big + 2] = 0.0, 2e-4  # as far as it came
    assert journal_distance(p, ours, theirs) == pytest.approx(0.25)
