"""`compsim compare`: jobs beside a record of another, what the page says of it, and mistakes."""

import csv
import json
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from compsim import cli
from conftest import store

from compressor.studies.compare.comparison import CAPTION

HEARD = {"length_rev": 10, "noise_m_per_s2": 0.05}
CASE = {
    "joint": "big_end", "clearance_mm": 0.2, "sensor": HEARD,
    "body": {"frequency_x_Hz": 20, "frequency_y_Hz": 20},
    "solve": {"accuracy": "draft"},
}  # fmt: skip
OTHERS = {  # in words -> what differs
    "itself, with other noise": {"sensor": HEARD | {"seed": 2}},
    "the same with noise of 10 m/s²": {"sensor": HEARD | {"noise_m_per_s2": 10.0, "seed": 2}},
    "a clearance of 0.1 mm": {"clearance_mm": 0.1},
    "a clearance of 0.3 mm": {"clearance_mm": 0.3},
    "no friction": {"friction": False},
    "520 rpm, not 500": {"machine": {"speed_rpm": 520}},
}
LIKENESS = {  # as measured once: correlation, envelope, ratio of rms, distance of spectra (dB)
    "itself, with other noise": (1.00, 1.00, 1.00, 0.1),
    "the same with noise of 10 m/s²": (0.88, 0.93, 0.51, 23.4),
    "a clearance of 0.1 mm": (0.50, 0.66, 3.02, 5.7),
    "a clearance of 0.3 mm": (-0.15, 0.80, 1.06, 4.0),
    "no friction": (-0.70, 0.86, 0.57, 3.7),
    "520 rpm, not 500": (0.08, 0.87, 0.96, 1.7),
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
def test_numbers_say_how_far_a_record_is_off(folder, capsys):
    found = json.loads(run(folder, capsys, folder[1], "others", "--json"))
    jobs = {job["key"]: job for job in found["jobs"]}
    for name, key in folder[2].items():
        for (number, tolerance), value in zip(TOLERANCE.items(), LIKENESS[name], strict=True):
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
    values = numbers[::3]  # each with `+-` and its standard error
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
    assert job["rms_ratio"]["value"] == pytest.approx(1.0, rel=0.01)


@pytest.mark.compiled
def test_the_figure_has_the_curves_of_both(folder, capsys, tmp_path):
    picture, table = tmp_path / "x.svg", tmp_path / "x.csv"
    out = run(folder, capsys, folder[1], "others", "-o", str(picture))
    assert ET.parse(picture).getroot().tag.endswith("svg")
    assert out.splitlines()[-1].strip() == CAPTION
    found = json.loads(run(folder, capsys, folder[1], "others", "-o", str(table), "--json"))
    assert f"inside the range of the 6 jobs at {found['envelope_inside']:.0%} of crank" in out
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
