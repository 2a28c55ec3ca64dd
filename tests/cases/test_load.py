"""Case files to jobs: what a file means, how axes multiply, and where every mistake is shown."""

import time

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from compressor.cases.case import Case
from compressor.cases.load import CaseFileError, load_cases, load_studies
from compressor.cases.yaml_reader import MAX_BYTES, Problem, resolve_scalar

BIG_END = "joint: big_end\nclearance_mm: 0.1\n"
one_file = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=3000)


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Write a case file; its path is relative, so that messages begin with its bare name."""
    monkeypatch.chdir(tmp_path)

    def write(text: str | bytes, name: str = "case.yaml") -> str:
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
        return name

    return write


def mistakes(*paths, overrides=()) -> list[str]:
    with pytest.raises(CaseFileError) as caught:
        load_studies(*paths, overrides=overrides)
    return str(caught.value).split("\n")


# What a scalar means: the core schema of YAML 1.2


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e5", 1e5), ("3.36e5", 3.36e5), ("+5", 5), ("-.5", -0.5), ("5.", 5.0), ("1E-2", 0.01),
        ("010", 10), ("0o17", 15), ("0x10", 16), ("true", True), ("FALSE", False),
        ("no", "no"), ("yes", "yes"), ("on", "on"), ("off", "off"), ("1:30", "1:30"),
        ("1_000", "1_000"), ("0b11", "0b11"), ("2024-01-01", "2024-01-01"), ("-0x10", "-0x10"),
        ("inf", "inf"), ("nan", "nan"), (".", "."), ("e5", "e5"), ("tRUE", "tRUE"), ("٣", "٣"),
        ("-.inf", float("-inf")), ("9" * 400, float("inf")), ("0x" + "f" * 400, float("inf")),
        ("~", None), ("null", None), ("", None),
    ],
)  # fmt: skip
def test_plain_scalars_follow_yaml_1_2(text, value):
    assert resolve_scalar(text) == value
    assert type(resolve_scalar(text)) is type(value)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("\ufeffmachine:\r\n  crank_radius_mm: 1e2\r\n", {"machine": {"crank_radius_mm": 100}}),
        ("%YAML 1.2\n---\nmachine:\n  speed_rpm: 0x10 # hex\n...\n",
         {"machine": {"speed_rpm": 16}}),
        ("name: no\n", {"name": "no"}),
        ('"name": "1e5"\n', {"name": "1e5"}),
        ("name: >-\n  folded\n", {"name": "folded"}),
    ],
)  # fmt: skip
def test_a_file_without_lists_is_one_case(write, text, values):
    (case,) = load_cases(write(text))
    assert case == Case.from_values({"name": "case"} | values)


def test_a_title_and_notes_are_no_part_of_a_job(write):
    titled = "report:\n  title: Unit 3\n  notes: |\n    Rod weighed.\n    Oil: VG 100.\n"
    (plain,) = load_studies(write(BIG_END, "plain.yaml"))
    (study,) = load_studies(write(BIG_END + titled, "titled.yaml"))
    assert (study.title, study.notes) == ("Unit 3", "Rod weighed.\nOil: VG 100.")
    assert (plain.title, plain.notes, plain.keys) == ("", "", study.keys)
    (other,) = load_studies("titled.yaml", overrides=["report.title=Unit 4"])
    assert other.title == "Unit 4"


def test_mistakes_of_all_files_are_told_at_once(write):
    paths = [write("load: x\n", "b.yaml"), "\x1b[31m.yaml", write("\n- 1\n", "a.yaml")]
    assert mistakes(*paths, overrides=["joint=y"]) == [
        "\\x1b[31m.yaml: cannot be read: No such file or directory; compsim init writes "
        "a case file to start from",
        "--set joint=y: joint: needs none, big_end, small_end or both, not 'y'",
        "a.yaml:2:1: needs keys at the top, such as `joint: big_end`, with a space after the colon",
        "b.yaml:1:7: load: needs spring, gas or none, not 'x'",
    ]


def test_without_a_file_the_path_of_one_is_asked_for():
    remedy = "compsim init writes a case file to start from"
    assert mistakes() == [f"needs the path of a case file; {remedy}"]


def test_a_sweep_full_of_conflicts_is_cut_short(write):
    both = [*range(1, 31)]
    text = f"machine: {{rod_length_mm: {both}, crank_radius_mm: {both}}}\nload: none\n"
    found = mistakes(write(text))
    assert found[0] == "case.yaml: 30 problems of swept values; the first 20 are"
    assert len(found) == 21


@pytest.mark.parametrize(
    ("text", "overrides", "same_as"),
    [
        ("{}", ["machine.rod_mass_kg=5"], "machine: {rod_mass_kg: 5}"),
        ("machine: {rod_mass_kg: [3, 4], speed_rpm: 400}", ["machine.rod_mass_kg = 5"],
         "machine: {rod_mass_kg: 5, speed_rpm: 400}"),
        ("machine: {rod_mass_kg: 4}", ["machine={speed_rpm: 400}"], "machine: {speed_rpm: 400}"),
        (BIG_END, ["clearance_mm=[0.2, 0.3]"], "joint: big_end\nclearance_mm: [0.2, 0.3]"),
        ("joint: both\nclearance_mm: [1, 2]", ["clearance_mm.big_end=3"],
         "joint: both\nclearance_mm: {big_end: 3, small_end: [1, 2]}"),
        (BIG_END, ["machine.pin_radius_mm.big_end=60", "machine.pin_radius_mm.small_end=90"],
         BIG_END + "machine: {pin_radius_mm: {big_end: 60, small_end: 90}}"),
        (BIG_END, ["joint=[none, both]"], "joint: [none, both]\nclearance_mm: 0.1"),
        (BIG_END + "friction: {static: 0.3}", ["friction=false"], BIG_END + "friction: false"),
        (BIG_END + "friction: false", ["friction.static=0.3"],
         BIG_END + "friction: {static: 0.3}"),
        ("solve: {accuracy: fine}", ["solve.rtol=1e-5"], "solve: {rtol: 1e-5}"),
        ("solve: {duration_s: 0.24}", ["solve.duration_rev=6"], "solve: {duration_rev: 6}"),
        (BIG_END, ["name=other", "contact.materials=[steel, steel]"],
         BIG_END + "name: other\ncontact: {materials: [steel, steel]}"),
    ],
)  # fmt: skip
def test_an_override_stands_in_place_of_the_files_value(write, text, overrides, same_as):
    (study,) = load_studies(write(text), overrides=overrides)
    (expected,) = load_studies(write(same_as))
    assert (study.axes, [*study.cases]) == (expected.axes, [*expected.cases])


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        (["joint"], "--set joint: needs the form key=value, such as joint=both"),
        (["=both"], "--set =both: needs the form key=value, such as joint=both"),
        (["joint="], "--set joint=: is empty"),
        (["joint=[none"], "--set joint=[none: is no YAML: expected ',' or ']', "
         "but got '<stream end>'"),
        (["clearance_mm=[1, 11]"], "--set clearance_mm=[1, 11]: clearance_mm: "
         "11 mm exceeds the pin radius, 10 mm: lower it; 11 µm are 0.011 mm"),
        (["name=x"], "--set name=x: name: a.yaml and b.yaml would be stored under one name, x"),
    ],
)  # fmt: skip
def test_a_wrong_override_is_told_once(write, overrides, expected):
    paths = [write(BIG_END, "a.yaml"), write(BIG_END, "b.yaml")]
    assert mistakes(*paths, overrides=overrides) == [expected]


def test_what_an_override_breaks_is_told_where_the_file_could_mend_it(write):
    path = write("load: gas\ngas: {switching: paper}\n")
    (message,) = mistakes(path, overrides=["gas.exponent=1.3"])
    assert message.startswith("case.yaml:2:18: gas.switching: the printed corners hold for")


def hostile(unit: str, before: str = "", after: str = "") -> str:
    return before + unit * ((MAX_BYTES - len(before + after)) // len(unit)) + after


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("a: &a [x]\n" + "".join(f"{c}: &{c} [*a, *a]\n" for c in "bcdef"), "write the value out"),
        (hostile("["), "is nested too deeply"),
        (hostile("- "), "is nested too deeply"),
        (hostile("9", "machine: {speed_rpm: ", "}"), "rpm, not inf"),
        (hostile("x", "name: "), "xxx'"),
        ("#" * (MAX_BYTES + 1), "is larger than 1 MiB: no case file"),
    ],
    ids=lambda value: value[:12],
)
def test_a_hostile_file_is_refused_soon(write, text, end):
    path = write(text)
    start = time.process_time()
    assert mistakes(path)[-1].endswith(end)
    assert time.process_time() - start < 30  # about 2 s on one slow core


def test_long_keys_and_values_are_cut(write):
    found = mistakes(write(f"{'k' * 500}: 1\nload: {'v' * 500}\n"))
    assert all(len(line) < 350 for line in found)


WORDS = "joint load none both clearance_mm machine rod_mass_kg friction false contact materials"
SIGNS = "steel 0.1 -1 1e400 ~ null &a *a !t << ? : - [ ] { } , | > ' \" % # --- ... \\UFFFFFFFF"
GAPS = [": ", "- ", "\n", "\n  ", "\t", " ", "%YAML 1.3\n"]
YAMLISH = st.lists(st.sampled_from([*WORDS.split(), *SIGNS.split(), *GAPS]), max_size=40)
SWEEPS = [
    "clearance_mm: {linspace: [0.1, 0.3, 3]}", "clearance_mm: {random: [1, 2]}", "load: [none]",
    "machine: {speed_rpm: {lhs: [300, 900], log: true}}", "sample: {n: 3}", "sample: {seed: 1}",
    "zip: [[load, clearance_mm]]", "exclude: load == none", "exclude: [load == none]",
    "blocks: [{load: none}, {joint: both, sample: {n: 2}}]", "joint: big_end", "zip: {}",
    "blocks: [1]", "exclude: {load: none}", "sample: {n: [1, 2]}", "zip: [[[load]]]",
]  # fmt: skip
SWEPT = st.lists(st.sampled_from(SWEEPS), max_size=6, unique=True).map("\n".join)


def problems(path: str, *overrides: str) -> list[Problem]:
    try:
        (study,) = load_studies(path, overrides=overrides)
    except CaseFileError as error:
        return error.problems or pytest.fail("no problem is named")
    assert len([*study.cases]) == study.jobs > 0
    return []


# as YAML has them: also U+0085, U+2028 and U+2029
LINE_ENDS = (b"\n", b"\r", b"\xc2\x85", b"\xe2\x80\xa8", b"\xe2\x80\xa9")


@one_file
@example("\x85\x850")
@given(st.text() | st.binary() | YAMLISH.map("".join) | YAMLISH.map(" ".join) | SWEPT)
def test_any_file_is_read_or_refused(write, text):
    content = text.encode(errors="replace") if isinstance(text, str) else text
    for problem in problems(write(content)):
        assert str(problem).isprintable()
        assert problem.place.line <= sum(content.count(end) for end in LINE_ENDS) + 2


@one_file
@given(st.text() | YAMLISH.map("".join).map("joint=".__add__))
def test_any_override_is_read_or_refused(write, text):
    for problem in problems(write(BIG_END), text):
        assert str(problem).startswith(("--set ", "case.yaml:"))
