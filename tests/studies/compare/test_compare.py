"""`compsim compare`: jobs beside a record of another, what the page says of it, and mistakes."""

import csv
import json
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from compsim import cli
from conftest import store
from scipy.interpolate import CubicSpline

from compressor.store import job_record, read_store
from compressor.studies.compare.comparison import CAPTION
from compressor.studies.compare.likeness import compare_lines, curves
from compressor.studies.frame import by_revolutions
from compressor.vibration import Record

PAGE = Path(__file__).parents[3] / "compressor/docs/diagnosis.md"
HEARD = {"length_rev": 10, "noise_m_per_s2": 0.05}
CASE = {
    "joint": "big_end", "clearance_mm": 0.2, "sensor": HEARD,
    "body": {"frequency_x_Hz": 20, "frequency_y_Hz": 20},
    "solve": {"accuracy": "draft"},
}  # fmt: skip
OTHERS = {  # the page's words -> what differs
    "itself, with other noise": {"sensor": HEARD | {"seed": 2}},
    "the same with noise of 2 m/s²": {"sensor": HEARD | {"noise_m_per_s2": 2.0, "seed": 2}},
    "the same with noise of 10 m/s²": {"sensor": HEARD | {"noise_m_per_s2": 10.0, "seed": 2}},
    "a clearance of 0.1 mm": {"clearance_mm": 0.1},
    "a clearance of 0.3 mm": {"clearance_mm": 0.3},
    "Threlfall's friction law": {"friction": {"law": "threlfall"}},
    "a friction of 0.1, not 0.15 (static 0.15, not 0.23)": {
        "friction": {"static": 0.15, "dynamic": 0.1},
    },
    "Flores' contact law, restitution 0.7": {
        "contact": {"law": "flores", "restitution": 0.7},
    },
    "no friction": {"friction": False},
    "520 rpm, not 500": {"machine": {"speed_rpm": 520}},
}
TOLERANCE = {"correlation": 0.1, "envelope": 0.05, "rms_ratio": 0.05, "spectral_distance": 0.3}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A job `base`, and `others` that differ from it."""
    place = tmp_path_factory.mktemp("compare")
    (place / "base.yaml").write_text(json.dumps(CASE))
    (place / "others.yaml").write_text(json.dumps(CASE | {"blocks": [*OTHERS.values()]}))
    (place / "deaf.yaml").write_text(json.dumps({"solve": CASE["solve"]}))
    studies = store(place / "results", *(place / f"{n}.yaml" for n in ("base", "others", "deaf")))
    keys = [[case.key for case in study.cases] for study in studies]
    return place, keys[0][0], dict(zip(OTHERS, keys[1], strict=True)), keys[2][0]


def run(folder, capsys, *words, code=0):
    assert cli.main(["compare", *words, "-r", str(folder[0] / "results")]) == code
    found = capsys.readouterr()
    return found.err if code else found.out


def exported(folder, suffix=".csv"):
    path = folder[0] / f"record{suffix}"
    out = ["-r", str(folder[0] / "results"), "-o", str(path), "--force"]
    assert cli.main(["export", folder[1], *out]) == 0
    return str(path)


@pytest.mark.compiled
def test_the_page_says_what_the_numbers_are_worth(folder, capsys):
    found = json.loads(run(folder, capsys, folder[1], "others", "--json"))
    jobs = {job["key"]: job for job in found["jobs"]}
    rows = re.findall(r"^\| ([^|]+) \| (-?[\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$",
                      PAGE.read_text(encoding="utf-8"), re.MULTILINE)  # fmt: skip
    said = {name: [*map(float, numbers)] for name, *numbers in rows}
    assert {*said} == {*OTHERS}
    for name, key in folder[2].items():
        for (number, tolerance), value in zip(TOLERANCE.items(), said[name], strict=True):
            assert jobs[key][number]["value"] == pytest.approx(value, abs=tolerance), (name, number)
    apart = [job["difference"]["value"] for job in found["jobs"]]
    assert apart == sorted(apart)
    assert jobs[folder[2]["a clearance of 0.1 mm"]]["what"].startswith("big_end 0.1 mm, friction")
    assert jobs[folder[2]["520 rpm, not 500"]]["what"].endswith(", machine.speed_rpm 520.0")


@pytest.mark.compiled
def test_an_exported_record_is_its_job(folder, capsys):
    path = exported(folder)
    capsys.readouterr()
    out = run(folder, capsys, path, folder[1])
    record, head, job = out.splitlines()
    assert record.endswith("record.csv: 9 revolutions at 500 rpm, 25600 Hz, 5.153 m/s2 rms up to "
                           "order 1200")  # fmt: skip
    assert head.split()[0] == "job"
    key, end, clearance, unit, rpm, *numbers = job.split()
    assert folder[1].startswith(key)
    assert (end, clearance, unit, rpm) == ("big_end", "0.2", "mm", "500")
    values = [numbers[k] for k in (0, 3, 6, 9, 12)]
    assert values == ["0.000", "1.000", "1.000", "1.000", "0.000"]


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("unit", "told"),
    [
        ("g", "read: the rms is 9.81 times the job's: m/s2 were perhaps read as g; check --unit"),
        ("mm/s2", "read: the rms is 0.001 times the job's: m/s2 were perhaps read as mm/s2; check"),
    ],
)
def test_a_unit_that_was_perhaps_mistaken_is_named(unit, told, folder, capsys):
    path = exported(folder, ".wav")
    capsys.readouterr()
    words = ["--channel", "1", "--tacho", "2", "--tacho-deg", "20", "--unit"]
    assert told in run(folder, capsys, path, folder[1], *words, unit)
    assert "perhaps" not in run(folder, capsys, path, folder[1], *words, "in/s2")
    (job,) = json.loads(run(folder, capsys, path, folder[1], *words, "m/s2", "--json"))["jobs"]
    assert job["shift_deg"] == pytest.approx(20.0, abs=0.2)
    assert job["shifted"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.compiled
def test_other_speeds_and_rates_are_compared_by_what_both_hold(folder, capsys, tmp_path):
    """Three revolutions of the exported record at half its rate, and a job that runs faster."""
    with open(exported(folder), newline="") as file:
        rows = [row[-3:] for row in csv.reader(file) if row[-3]]
    capsys.readouterr()
    path = tmp_path / "short.csv"
    short = [rows[0], *rows[1 : 1 + round(3.2 * 0.12 * 25600) : 2]]
    path.write_text("\n".join(",".join(row) for row in short))
    out = run(folder, capsys, str(path), folder[2]["520 rpm, not 500"])
    assert "3 revolutions at 500 rpm, 12800 Hz" in out
    assert "rms up to order 600" in out  # 12800 / 2.56 / (500 / 60): what both hold
    assert out.splitlines()[-1].split()[4] == "520"


@pytest.mark.compiled
def test_the_figure_has_the_curves_of_both(folder, capsys, tmp_path):
    picture, table = tmp_path / "x.svg", tmp_path / "x.csv"
    out = run(folder, capsys, folder[1], "others", "-o", str(picture))
    assert ET.parse(picture).getroot().tag.endswith("svg")
    assert out.splitlines()[-1].strip() == CAPTION
    found = json.loads(run(folder, capsys, folder[1], "others", "-o", str(table), "--json"))
    assert f"inside the range of the 10 jobs at {found['envelope_inside']:.0%} of crank" in out
    with open(table, newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    peaks = [float(row[at]) for at in [head.index(next(
        name for name in head if name == f"(b): {folder[1]}: peak and rms of 10° segments (m/s²)"
    ))] for row in rows if row[at]]  # fmt: skip
    np.testing.assert_allclose(peaks[::2], found["peak_m_per_s2"], rtol=1e-6)


@pytest.mark.compiled
def test_mistakes_are_named(folder, capsys, tmp_path):
    for words, told in (
        (["absent.csv", "others"], "absent.csv: cannot be read"),
        ([folder[1]], "Missing argument 'JOB|STUDY...'"),
        ([folder[1], "othrs"], "did you mean others?"),
        (
            [folder[1], "deaf"],
            "none of the 1 jobs has a sensor's record of two revolutions: run them",
        ),
        ([folder[1], "others", "-o", "x.pdf"], "-o x.pdf: end the name in .png, .svg, .csv"),
        ([folder[1], "others", "--unit", "g"], "says all of its record; leave --unit out"),
    ):
        assert told in run(folder, capsys, *words, code=2)
    assert "has no sensor's record" in run(folder, capsys, folder[3], "others", code=5)
    slow = tmp_path / "slow.csv"
    times = np.arange(200) / 200.0
    wave = np.sin(2 * np.pi * (times - 0.01) / 0.12)
    np.savetxt(slow, np.column_stack([times, wave, wave]), "%.9g", ",", comments="",
               header="time_s,acceleration_m_per_s2,tacho")  # fmt: skip
    out = run(folder, capsys, str(slow), "others", code=2)
    assert "slow.csv: the sampling rate holds the orders up to 9 alone" in out


@pytest.mark.compiled
def test_a_job_is_compared_with_the_others_of_its_study(folder, capsys):
    """Not with itself, unless it is named; a job without a record is counted."""
    mine = folder[2]["a clearance of 0.1 mm"]
    found = json.loads(run(folder, capsys, mine, "others", "deaf", "--json"))
    assert {job["key"] for job in found["jobs"]} == {*folder[2].values()} - {mine}
    assert found["left_out"] == 1
    alone = json.loads(run(folder, capsys, mine, mine, "--json"))
    assert [job["key"] for job in alone["jobs"]] == [mine]
    assert alone["jobs"][0]["correlation"]["value"] == pytest.approx(1.0)


GRID, TRUE = (0.1, 0.15, 0.2, 0.25), (0.12, 0.22)  # mm


def as_measured(record, seed, noise):
    """The record with noise (m/s2), a speed that varies by 0.1 %, a tacho up to 2 deg off."""
    rng = np.random.default_rng(seed)
    turn = float(np.diff(record.tacho).mean())
    knots = np.arange(-2, len(record.tacho) + 3)
    course = CubicSpline(knots * turn, rng.normal(0.0, 1e-3, knots.size)).antiderivative()
    since = record.times + course(record.times) - course(0.0)
    values = CubicSpline(record.times, record.values)(np.clip(since, 0.0, record.times[-1]))
    tacho = np.interp(record.tacho, since, record.times) + rng.uniform(-2, 2) / 360 * turn
    tacho = tacho[(tacho > 0.0) & (tacho < record.times[-1])]
    values = values + rng.normal(0.0, noise, values.size)
    return Record(record.times, values, tacho, math.nan)


@pytest.mark.compiled
def test_the_neighbour_of_the_true_clearance_comes_first(tmp_path):
    """A sample of the page's records: by the correlation it does in one of eight."""
    case = CASE | {"sensor": HEARD, "clearance_mm": [*GRID, *TRUE]}
    (tmp_path / "machines.yaml").write_text(json.dumps(case))
    (study,) = store(tmp_path / "results", tmp_path / "machines.yaml")
    stored = read_store(tmp_path / "results")
    records = {one.clearance_mm.big_end: job_record(stored, one.key) for one in study.cases}
    jobs = {clearance: by_revolutions(records[clearance]) for clearance in GRID}
    right = {"difference": 0, "correlation": 0}
    for true in TRUE:
        near = {max(one for one in GRID if one < true), min(one for one in GRID if one > true)}
        for seed, noise in ((31, 0.05), (32, 0.05), (33, 0.5), (34, 0.5)):
            mine = by_revolutions(as_measured(records[true], seed, noise))
            found = {}
            for clearance, job in jobs.items():
                lines = [one.lines(min(mine.highest, job.highest)) for one in (mine, job)]
                found[clearance] = compare_lines(*lines, *map(curves, lines))
            right["difference"] += min(found, key=lambda c: found[c].difference.value) in near
            right["correlation"] += max(found, key=lambda c: found[c].correlation.value) in near
    assert right["difference"] >= 0.9 * 8
    assert right["correlation"] < 0.9 * 8
