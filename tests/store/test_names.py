"""Studies and jobs by name: which one is meant, and what is near where none is."""

import pytest

from compressor.program import did_you_mean
from compressor.store.files import WrongName
from compressor.store.studies import StoredAxis, StoredStudy, find_job, find_study, find_value


def study(name, axes, keys, is_grid=True):
    made = tuple(StoredAxis(key, tuple(values), "") for key, values in axes.items())
    return StoredStudy(name, f"{name}.yaml", made, tuple(keys), {}, "", {}, "", is_grid)


WEAR = study(
    "wear",
    {"clearance_mm": (0.1, 0.2, 1e-3), "machine.rod_mass_kg": (3, 4.7)},
    ["aa11", "aa12", "ab21", "ab22", "cc31", "cc32"],
)
SAMPLED = study(
    "drawn",
    {"clearance_mm": [n / 100 for n in range(1, 21)], "machine.speed_rpm": range(300, 320)},
    [f"dd{n:02}" for n in range(20)],
    is_grid=False,
)
WORDS = study("words", {"joint": ("none", "both"), "friction": (True, False)}, "efgh")
ONE = study("one", {}, ["beef"])
KNOWN = [WEAR, SAMPLED, WORDS, ONE]


def found(*words):
    return find_job("results", words, KNOWN, {"f0f0f0f0"})


@pytest.mark.parametrize(
    ("words", "key"),
    [
        (["aa11"], "aa11"),
        (["f0"], "f0f0f0f0"),
        (["wear", "clearance_mm=0.2", "machine.rod_mass_kg=3"], "ab21"),
        (["wear", "rod_mass_kg=4.70", "clearance_mm=.2"], "ab22"),
        (["wear", "clearance_mm=1e-3", "rod_mass_kg=3.0"], "cc31"),
        (["drawn", "clearance_mm=0.07"], "dd06"),
        (["words", "fault=both", "friction=false"], "h"),
        (["words", "joint=none", "friction=true"], "e"),
        (["one"], "beef"),
    ],
)
def test_a_job_by_its_key_or_its_place_in_a_study(words, key):
    assert found(*words) == key


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["aa"], "2 jobs' keys begin with 'aa': aa11, aa12; give more of the key"),
        (["aa13"], "no job's key begins with 'aa13', and no study is called so; the nearest is aa"),
        (["waer"], "and no study is called so; did you mean wear?"),
        (["WEAR.yaml"], "did you mean wear?"),
        (["zz"], "compsim status lists the studies"),
        (["waer", "clearance_mm=0.1"], "holds no study 'waer'; did you mean wear?"),
        (["other", "clearance_mm=0.1"], "holds no study 'other'; it holds wear, drawn, words, one"),
        (["wear"], "wear is a study of 6 jobs; choose one by clearance_mm=… of 0.1, 0.2, 0.001; "
                   "machine.rod_mass_kg=… of 3, 4.7"),
        (["wear", "clearance_mm=0.1"], "2 jobs of wear have clearance_mm=0.1; choose one by "
                                       "machine.rod_mass_kg=… of 3, 4.7"),
        (["wear", "clearence_mm=0.1"], "wear has no axis 'clearence_mm'; did you mean clearance"),
        (["wear", "load=none"], "wear has no axis 'load'; its axes are clearance_mm, machine.rod_"),
        (["wear", "clearance_mm=0.3"], "no job of wear has clearance_mm=0.3; there are 0.1, 0.2, "),
        (["wear", "clearance_mm=0.2mm"], "there are 0.1, 0.2, 0.001"),
        (["wear", "clearance_mm"], "'clearance_mm' is no AXIS=VALUE of wear; its axes are"),
        (["drawn", "clearance_mm=0.123"],
         "no job of drawn has clearance_mm=0.123; there are 0.1, 0.11, 0.12, 0.13, 0.14 next to"),
        (["drawn", "clearance_mm=0.01", "speed_rpm=301"], "no job of drawn has clearance_mm=0.01"),
        (["one", "clearance_mm=0.1"], "one has no axis 'clearance_mm'; it is one job: leave"),
        (["words", "joint=botch", "friction=true"], "no job of words has joint=botch; there are"),
    ],
)  # fmt: skip
def test_what_is_near_where_no_one_job_is_meant(words, told):
    with pytest.raises(WrongName) as error:
        found(*words)
    assert told in str(error.value)
    assert "\n" not in str(error.value)


def test_studies_by_name():
    assert find_study("results", "wear", KNOWN) is WEAR
    assert find_study("results", None, [ONE]) is ONE
    with pytest.raises(WrongName, match="holds several studies; name one: wear, drawn, words"):
        find_study("results", None, KNOWN)
    with pytest.raises(WrongName, match=r"it holds s0, s1, s2, s3, s4, …"):
        find_study("results", "quite", [study(f"s{n}", {}, ["a"]) for n in range(7)])


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("staus", "did you mean status?"),
        ("STATUS", "did you mean status?"),
        ("configs/big-end.yaml", "did you mean big-end?"),
        ("quite another", ""),
        ("x" * 10**6, ""),
    ],
)
def test_what_a_word_means(word, told):
    assert did_you_mean(word, ["status", "big-end", "show"]) == told


@pytest.mark.parametrize(
    ("word", "expected"), [("500.002", 500.002), ("500.001", 500.001), ("712.3", 712.3000001)]
)
def test_a_value_is_the_nearest_before_a_rounded_one(word, expected):
    near = study("near", {"machine.speed_rpm": (500, 500.001, 500.0015, 500.002, 712.3000001)}, "")
    assert find_value("place", near, f"speed_rpm={word}") == ("machine.speed_rpm", expected)


def test_what_rounds_to_several_values_is_none_of_them():
    near = study("near", {"machine.speed_rpm": (500.00151, 500.00152)}, "")
    with pytest.raises(WrongName, match=r"no job of near has machine.speed_rpm=500.002"):
        find_value("place", near, "speed_rpm=500.002")
