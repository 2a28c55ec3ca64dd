"""`compsim follow` from a case file to a Dataset, and every mistake in what is asked for."""

import numpy as np
import pytest
import xarray as xr
from compsim import cli
from conftest import assert_same_bits, jobs_here, without_pictures

from compressor.cases import CaseFileError
from compressor.store import write_dataset
from compressor.studies.follow.follow import load_values, machines, read_over
from compressor.studies.follow.motion import NUMBERS, TEXTS, run_value
from compressor.studies.frame import StudyError, stored_rows

TEXT = """
joint: big_end
machine: {rod_mass_kg: [3, 4.7]}
solve: {accuracy: draft}
report: {title: Unit 3}
"""
OVER = "clearance_mm=0.1:0.3:3"
FILE = "r/follow/worn-clearance_mm.nc"
WORN = "joint: big_end\nclearance_mm: 0.1\n"


def followed(path, over, **more):
    along = read_over(over, **more)
    return machines(load_values(path, along), along)


def write(path, text=TEXT):
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    place = tmp_path_factory.mktemp("follow")
    path = write(place / "worn.yaml")
    words = ["follow", path, "--over", OVER, "--both", "--no-exponent", "--points", "8", "--quiet"]
    with jobs_here(), without_pictures():
        assert cli.main([*words, "-r", str(place / "r"), "-j", "2"]) == 0
    return place


@pytest.fixture
def follow_again(place, compsim):
    words = ["--over", OVER, "--both", "--no-exponent", "--points", "8"]
    return lambda: compsim("follow", place / "worn.yaml", "-r", place / "r", *words)


def test_the_dataset_has_machines_both_ways_and_values(place):
    found = xr.load_dataset(place / FILE)
    assert found["period"].dims == ("job", "direction", "clearance_mm")
    assert found["section"].dims[3:] == ("revolution", "joint", "coordinate")
    assert found["rod_mass_kg"].values.tolist() == [3.0, 4.7]
    assert found["clearance_mm"].values.tolist() == [0.1, 0.2, 0.3]
    assert found["clearance_mm"].attrs["units"] == "mm"
    assert found["clearance_mm"].attrs["long_name"] == "radial clearance"
    assert found["direction"].values.tolist() == ["up", "down"]
    assert found["coordinate"].values.tolist() == ["x", "y", "x_rate", "y_rate"]
    assert (found["status"] == "ok").all()
    assert (found["period"] == 1).all()
    assert found["differs"].dims == ("job", "clearance_mm")
    assert not found["differs"].any()
    assert (found.attrs["over"], found.attrs["title"]) == ("clearance_mm", "Unit 3")
    for name in found.data_vars:
        assert found[name].attrs["long_name"], name
        assert name in TEXTS or found[name].attrs["units"], name
    assert {*NUMBERS, *TEXTS} - {*found.data_vars} == {"end_state"}


def test_a_second_run_has_nothing_to_do_and_prints_the_same(place, follow_again):
    out, said = follow_again()
    assert out.startswith("rod_mass_kg 3.0\n")
    assert out.count("0.1 to 0.3             3       period 1\n") == 4
    assert [line for line in out.splitlines() if line.endswith((".png", ".nc"))] == [
        str(place / f"r/follow/worn-clearance_mm{end}") for end in ("-1.png", "-2.png", ".nc")
    ]
    assert (place / "r/follow/worn-clearance_mm-2.png").stat().st_size > 10_000
    assert "nothing to do: all 12 values are stored" in said


def test_a_chain_goes_on_alone_from_its_last_value_and_ends_in_the_same_bits(
    place, follow_again, in_process
):
    """As after a kill: a file is whole or absent (tests/studies/test_wear.py)."""
    before = xr.load_dataset(place / FILE)
    more = {"both": True, "points": 8, "exponent": False}
    _, chain = followed(place / "worn.yaml", OVER, **more)[0].chains
    assert chain.values == (0.3, 0.2, 0.1)  # in the order of running
    path = chain.path(place / "r")
    others = {*path.parent.iterdir()} - {path}
    stamps = [one.stat().st_mtime_ns for one in others]
    rows = stored_rows(chain, place / "r")
    after = run_value(chain.cases[1], rows[0]["end_state"], chain.points, chain.exponent)
    np.testing.assert_array_equal(after["end_state"], rows[1]["end_state"])
    write_dataset(path, chain.to_dataset(rows[:2]))
    with without_pictures():
        said = follow_again().err
    assert "1 value run in" in said
    assert "11 were stored before" in said
    assert len(others) == 3
    assert [one.stat().st_mtime_ns for one in others] == stamps
    assert_same_bits(xr.load_dataset(place / FILE), before)


def test_values_that_a_machine_does_not_have_are_missing(in_process, tmp_path):
    text = WORN + "machine: {rod_mass_kg: [3, 4, 5]}\nsolve: {accuracy: draft}\n"
    path = write(
        tmp_path / "two.yaml", text + "exclude: machine.rod_mass_kg > 3 and clearance_mm > 0.25\n"
    )
    words = ["--over", OVER, "--no-exponent", "--points", "6", "--quiet", "-j", "1",
             "--only", "machine.rod_mass_kg < 5"]  # fmt: skip
    with without_pictures():
        assert cli.main(["follow", path, "-r", str(tmp_path), *words]) == 0
    found = xr.load_dataset(tmp_path / "follow/two-clearance_mm.nc")
    assert found["status"].values.tolist() == [[["ok"] * 3], [["ok", "ok", "missing"]]]
    assert np.isnan(found["period"].values[1, 0, 2])
    assert "differs" not in found


def test_failed_values_end_with_3_and_say_why(in_process, compsim, tmp_path):
    path = write(tmp_path / "short.yaml", WORN + "solve: {accuracy: draft, max_steps: 60}\n")
    words = ["follow", path, "--over", OVER, "--both", "-r", tmp_path, "-j", "1"]
    out, said = compsim(*words, code=3)
    assert "up         0.1 to 0.3             3       failed budget_steps" in out
    assert "job 1 down at 0.3: budget_steps: more than 60 steps" in said
    assert "budget_steps (6): raise solve.max_steps" in said
    found = xr.load_dataset(tmp_path / "follow/short-clearance_mm.nc")
    assert (found["reason"] == "budget_steps").all()
    assert [path.suffix for path in (tmp_path / "follow").iterdir() if path.is_file()] == [".nc"]


def test_the_file_may_sweep_or_leave_out_what_is_followed(tmp_path):
    texts = ("joint: big_end\n", WORN, "joint: big_end\nclearance_mm: [0.3, 0.4]\n")
    paths = [write(tmp_path / f"{n}.yaml", text) for n, text in enumerate(texts)]
    assert len({followed(path, OVER)[0].chains[0].key for path in paths}) == 1


def test_a_chain_reads_at_its_last_value_what_it_does_not_at_its_first(tmp_path):
    text = "joint: both\nclearance_mm: 0.1\nguide: {crosshead_length_mm: 90}\n"
    (one,) = followed(write(tmp_path / "case.yaml", text), "guide.clearance_mm=0:0.1:3")
    assert [case.guide.clearance_mm for case in one.chains[0].cases] == [0.0, 0.05, 0.1]


@pytest.mark.parametrize(
    ("text", "over", "message"),
    [
        (WORN, "clearance_mm=0.1:1", "AT: write KEY=LOW:HIGH:N, such as clearance_mm=0.01:1:60"),
        (WORN, "clearance_mm=0.1:1:2.5", "AT: write KEY=LOW:HIGH:N"),
        (WORN, "clearance_mm=0.1:1:1", "AT: 1 value: give 2 at least"),
        (WORN, "solve.rtol=1e-6:1e-3:3", "AT: solve.rtol is nothing of the machine: give a key"),
        (WORN, "clearance_mm=0.1:2000:3", "AT: clearance_mm: 2000 is outside [0, 1000] mm"),
        (WORN, "gas.exponent=1:6:2", "AT: gas.exponent: 6 is outside [1, 5]"),
        (WORN, "clearance_mm=0:1:3", "case.yaml: --over begins at clearance_mm = 0, where a joint"),
        ("joint: [none, big_end]\nclearance_mm: 0.1\n", "machine.speed_rpm=300:700:3",
         "no joint has clearance, so that nothing is to follow: set joint and clearance_mm (joint "
         "none)"),
        (WORN + "exclude: clearance_mm > 0.1\n", OVER, "case.yaml: --over clearance_mm has "
         "one value of this machine: give more, or mend --only, exclude or zip"),
        (WORN + "load: none\nspring: {stiffness_N_per_mm: 1}\n", OVER,
         "case.yaml:4:1: spring: "),
        (WORN, "clearance_mm=0.1:11:3", "AT: clearance_mm: 11 mm exceeds the pin radius"),
        (WORN, "gas.back_pressure_MPa=0:0.1:3", "AT: gas: nothing reads this group: it needs"),
        (WORN, "clearance_mm=0.1:0.2:20000", "AT: clearance_mm: 20000 jobs are more than 10000"),
    ],
)  # fmt: skip
def test_mistakes_are_told(tmp_path, text, over, message):
    path = write(tmp_path / "case.yaml", text)
    with pytest.raises((StudyError, CaseFileError)) as caught:
        followed(path, over)
    assert message.replace("AT", f"--over {over}") in str(caught.value)
