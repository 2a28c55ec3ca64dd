"""Studies of a store, and folders: what is stored and found, and what is near where nothing is."""

import json
import os

import pytest
from made_jobs import study

from compressor.cases.study import Axis, points
from compressor.store.files import StoreError, StoreWarning, WrongName
from compressor.store.reader import open_study
from compressor.store.studies import (
    StoredStudy,
    find_job,
    find_study,
    find_value,
    read_studies,
    study_paths,
    write_study,
)


def test_a_study_is_stored_and_found(tmp_path):
    one = study("speeds", machine={"speed_rpm": [300, 500]}, load=["spring", "none"])
    write_study(tmp_path, one, "compsim run speeds.yaml", ["joint=none"])
    (found,) = read_studies(tmp_path)
    assert (found.name, found.command) == ("speeds", "compsim run speeds.yaml")
    assert found.keys == tuple(case.key for case in one.cases)
    assert (found.again.overrides, found.again.jobs) == (("joint=none",), 4)
    assert found.axes == (Axis("machine.speed_rpm", (300, 500)), Axis("load", ("spring", "none")))
    assert list(points(found))[1] == {"machine.speed_rpm": 300, "load": "none"}


def test_storing_a_study_again_leaves_its_file_alone_and_a_changed_one_takes_its_place(tmp_path):
    pairs = [["steel", "steel"], ["steel", "copper"]]
    worn = {"joint": "big_end", "clearance_mm": 0.2}
    one = study("pairs", **worn, contact={"materials": pairs})
    write_study(tmp_path, one, "first")
    before = (tmp_path / "studies/pairs.json").stat().st_mtime_ns
    write_study(tmp_path, one, "second")
    assert (tmp_path / "studies/pairs.json").stat().st_mtime_ns == before
    write_study(tmp_path, study("pairs", **worn, contact={"materials": pairs[:1]}), "third")
    (found,) = read_studies(tmp_path)
    assert (found.command, found.jobs) == ("third", 1)
    assert os.listdir(tmp_path / "studies") == ["pairs.json"]


@pytest.mark.parametrize("text", ["", "{}", "[1]", "[" * 10**5, "NaN", '{"digest": 1}', "\xff"])
def test_a_damaged_study_is_named_with_a_remedy_and_run_again(text, tmp_path):
    write_study(tmp_path, one := study("one"))
    path = tmp_path / "studies/one.json"
    good = json.loads(path.read_text())
    path.write_text(text, encoding="latin-1")
    with pytest.raises(StoreError, match=r"one\.json.*run its case file again"):
        read_studies(tmp_path)
    write_study(tmp_path, one)
    assert json.loads(path.read_text())["keys"] == good["keys"]
    path.rename(tmp_path / "studies/two.json")
    write_study(tmp_path, one)
    with pytest.warns(StoreWarning, match=r"left out: .*two\.json: is damaged"):
        (other,) = read_studies(tmp_path)
    for find in (lambda: find_study(tmp_path, "two", [other]),
                 lambda: find_job(tmp_path, ["two"], [other], set())):  # fmt: skip
        with pytest.raises(StoreError, match=r"two\.json: is damaged"):
            find()


def test_a_file_is_no_folder_of_results(tmp_path):
    """In Python: the command line looks first."""
    (tmp_path / "case.yaml").touch()
    with pytest.raises(WrongName, match="is a file, where"):
        open_study(tmp_path / "case.yaml")


def named(name, axes, keys, is_grid=True):
    made = tuple(Axis(key, tuple(values)) for key, values in axes.items())
    return StoredStudy(name, f"{name}.yaml", made, tuple(keys), {}, "", {}, "", is_grid)


WEAR = named(
    "wear",
    {"clearance_mm": (0.1, 0.2, 1e-3), "machine.rod_mass_kg": (3, 4.7)},
    ["aa11", "aa12", "ab21", "ab22", "cc31", "cc32"],
)
SAMPLED = named(
    "drawn",
    {"clearance_mm": [n / 100 for n in range(1, 21)], "machine.speed_rpm": range(300, 320)},
    [f"dd{n:02}" for n in range(20)],
    is_grid=False,
)
WORDS = {"joint": ("none", "both"), "friction": (True, False), "solve.method": ("RODAS",)}
WORDS = named("words", WORDS, "efgh")
ONE = named("one", {}, ["beef"])
KNOWN = [WEAR, SAMPLED, WORDS, ONE]


def found(*words):
    return find_job("results", words, KNOWN, {"f0f0f0f0"})


@pytest.mark.parametrize(
    ("words", "key"),
    [
        (["aa11"], "aa11"),
        (["wear", "clearance_mm=0.2", "machine.rod_mass_kg=3"], "ab21"),
        (["wear", "rod_mass_kg=4.70", "clearance_mm=.2"], "ab22"),
        (["drawn", "clearance_mm=0.07"], "dd06"),
        (["words", "fault=Both", "friction=false", "method=RODAS"], "h"),
        (["one"], "beef"),
    ],
)
def test_a_job_by_its_key_or_its_place_in_a_study(words, key):
    assert found(*words) == key


def test_what_is_said_where_no_one_job_is_meant():
    """Beside what tests/cmd/test_mistakes.py has."""
    with pytest.raises(WrongName, match="2 jobs' keys begin with 'aa': aa11, aa12; give more of"):
        found("aa")
    with pytest.raises(WrongName, match=r"there are RODAS$"):
        found("words", "method=rodos")


def test_studies_by_name():
    assert find_study("results", "wear", KNOWN) is WEAR
    assert find_study("results", None, [ONE]) is ONE
    with pytest.raises(WrongName, match="holds several studies; name one: wear, drawn, words"):
        find_study("results", None, KNOWN)
    with pytest.raises(WrongName, match=r"it holds s0, s1, s2, s3, s4, …"):
        find_study("results", "quite", [named(f"s{n}", {}, ["a"]) for n in range(7)])


@pytest.mark.parametrize(
    ("word", "expected"), [("500.002", 500.002), ("500.001", 500.001), ("712.3", 712.3000001)]
)
def test_a_value_is_the_nearest_before_a_rounded_one(word, expected):
    near = named("near", {"machine.speed_rpm": (500, 500.001, 500.0015, 500.002, 712.3000001)}, "")
    assert find_value("place", near, f"speed_rpm={word}") == ("machine.speed_rpm", expected)


def test_hidden_files_of_other_systems_are_no_studies(tmp_path):
    (tmp_path / "studies").mkdir()
    (tmp_path / "studies/._wear.json").write_bytes(b"\0\5\26\7")  # as macOS adds on foreign disks
    assert study_paths(tmp_path) == []
