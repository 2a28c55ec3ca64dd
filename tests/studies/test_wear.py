"""`compsim wear`: from a case file to lives, figures and files that go on after a kill."""

import json
import multiprocessing
import os
import re
import signal
import time

import numpy as np
import pytest
from compsim.cli import main
from conftest import assert_same_bits, jobs_here

from compressor.cases.load import load_cases
from compressor.store.files import StoreError
from compressor.studies import wear
from compressor.studies.frame import make_rows, stored_rows
from compressor.studies.wear import Worn, hours, open_wear

TEXT = """
joint: both
clearance_mm: 0.2
machine: {speed_rpm: [400, 500]}
solve: {accuracy: draft, duration_rev: 1, settle_rev: 0}
wear: {limit_mm: 0.23, step_mm: 0.01}
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a case file and its results."""
    folder = tmp_path_factory.mktemp("worn")
    (folder / "bearing.yaml").write_text(TEXT, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def told(place):
    """What the command gave, and its code."""
    here, out = place / "bearing.yaml", place / "results"
    with jobs_here():
        assert main(["wear", str(here), "-r", str(out), "-j", "2", "--quiet"]) == 0
    return load_cases(here), out


def test_a_line_for_each_machine_says_when_it_is_worn_out(told, place, compsim):
    cases, out = told
    said = compsim("wear", place / "bearing.yaml", "-r", out)
    head, *lines = said.out.splitlines()
    assert "worn out after, h" in head
    assert "all 2 machines are stored" in said.err
    numbers = json.loads(compsim("wear", place / "bearing.yaml", "-r", out, "--json").out)
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


def test_stored_stages_are_labelled(told):
    cases, out = told
    found = open_wear(out, cases[0])
    assert found["clearance"].dims == found["rubbing_work"].dims == ("stage", "joint")
    for name in found.data_vars:
        assert found[name].attrs["long_name"]
    assert (np.diff(found["worn_volume"].values, axis=0) > 0).all()


@pytest.mark.slow
def test_a_killed_machine_goes_on_and_ends_in_the_same_bits(told, tmp_path):
    """SIGKILL at random, until all stages are there."""
    cases, out = told
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


def test_a_failed_machine_is_told_and_goes_on_when_asked(
    place, tmp_path, compsim, monkeypatch, in_process
):
    file = place / "failing.yaml"
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
    factor = case.wear.coefficient_factor
    bounds = (f"> {hours(times * last)}" for times in (1.0, 1.0 / factor, factor))
    mid, low, high = (re.escape(bound) for bound in bounds)
    assert re.search(rf"  {mid} +{low} to {high}  ", said.out)
    assert main(["wear", str(file), "-r", str(tmp_path), "--rerun"]) == 0
    assert_same_bits(open_wear(tmp_path, case), whole(worn, tmp_path / "undisturbed"))


def whole(worn, folder):
    """The stages of an undisturbed run."""
    make_rows(worn, folder)
    return open_wear(folder, worn.case)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("joint: big_end\nclearance_mm: 0.2\n", "has no wear: write wear: true"),
        (
            TEXT.replace("duration_rev: 1", "duration_rev: 2.5"),
            "2.5 after settle_rev must be whole",
        ),
        (TEXT + "lubricant: true\n", "leave out lubricant or wear"),
        (TEXT.replace("0.23", "0.1"), "0.1 mm must be more than the clearance, 0.2 mm"),
        ("joint: [none, big_end]\nclearance_mm: 0.1\nwear: true\n", "none has no bore that wears"),
        ("joint: none\nwear: true\n", "wear: nothing reads this group: it needs clearance_mm"),
    ],
)
def test_what_cannot_wear_is_refused(text, message, tmp_path, compsim):
    file = tmp_path / "odd.yaml"
    file.write_text(text, encoding="utf-8")
    assert message in compsim("wear", file, "-r", tmp_path / "none", code=2).err
    assert not (tmp_path / "none").exists()


def test_a_file_of_something_else_is_told(told, tmp_path):
    cases, out = told
    place = Worn(cases[1]).path(tmp_path)
    place.parent.mkdir(parents=True)
    place.write_bytes(Worn(cases[0]).path(out).read_bytes())
    with pytest.raises(StoreError, match="does not hold what its name says"):
        stored_rows(Worn(cases[1]), tmp_path)
    with pytest.raises(StoreError, match="compsim wear the case file"):
        open_wear(tmp_path / "nowhere", cases[0])
