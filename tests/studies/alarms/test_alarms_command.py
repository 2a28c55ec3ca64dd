"""`compsim alarms` on made-up records that strike: its table, files, figure, and mistakes."""

import contextlib
import csv
import dataclasses
import html
import re

import numpy as np
import pytest
from compsim import cli
from test_lead import CASE, write_run

from compressor.cases import PerJoint
from compressor.report.page import document
from compressor.store import job_record, read_dataset, read_store, read_studies
from compressor.studies.alarms import windows
from compressor.studies.alarms.alarms import rank_alarms
from compressor.studies.alarms.figures import caption, draw_alarms
from compressor.studies.alarms.page import add
from compressor.studies.alarms.words import list_remarks, table_rows


def run(folder, capsys, *words, code=0):
    assert cli.main(["alarms", *words, "-r", str(folder), "--quiet"]) == code
    found = capsys.readouterr()
    return found.err if code else found.out


@pytest.fixture(scope="module")
def written(worn_store, tmp_path_factory):
    """The folder of files, and stdout."""
    place = tmp_path_factory.mktemp("alarms")
    write_run(place / "results", CASE)
    out = place / "out.txt"
    with open(out, "w") as file, contextlib.redirect_stdout(file):
        words = [
            "alarms", "worn", "-r", str(worn_store), "--revolutions", "2", "--quiet",
            "--band", "1000-3000", "--wear", str(place / "results"), "-o", str(place / "to"),
        ]  # fmt: skip
        assert cli.main(words) == 0
    return place / "to", out.read_text()


def test_the_table_has_the_first_alarm_of_each_joint_first(written):
    folder, out = written
    found = read_dataset(folder / "alarms.nc")
    lines = out.splitlines()
    assert (
        lines[0] == "study worn: 60 sound jobs of 60 draws, 180 worn ones; windows of 2 revolutions"
    )
    assert "for 2 % of false alarms (the sound draws allow no lower rate: 1 % needs" in lines[1]
    assert "valves and gas make no noise in this model" in lines[2]
    rows = [line for line in lines if line.startswith(("big_end ", "small_end ", "both "))]
    assert len(rows) == 3 * 9  # kinds of alarm, but the body's velocity, which no job has
    for joint in ("big_end", "small_end", "both"):
        first = next(row for row in rows if row.startswith(joint))
        best = found.isel(alarm=rank_alarms(found, joint)[0], noise=0)
        of_clearance = r"([\d.]+) mm \[([\d.]+) mm, > ([\d.]+) mm\]"
        clearance, low, last = re.search(of_clearance, first).groups()
        of_joint = best.sel(joint=joint)
        assert best["alarm"].item() in first
        assert float(clearance) == pytest.approx(float(of_joint["first_clearance"]), rel=5e-3)
        assert float(low) == pytest.approx(float(of_joint["first_clearance_low"]), rel=5e-3)
        assert np.isinf(of_joint["first_clearance_high"])  # of 10 draws a clearance
        assert float(last) == pytest.approx(
            best["clearance"].values[found["worn_joint"].values == joint].max(), rel=5e-3
        )


def test_strokes_as_high_as_the_clearance_are_heard(written):
    """A ringing of 2 m/s2 and more on a sine of 1 m/s2 and noise of 0.05: by peaks, always."""
    found = read_dataset(written[0] / "alarms.nc").isel(noise=0).set_index(alarm="alarm")
    peaks = found.sel(alarm="peak, 1000-3000 Hz")
    assert peaks["detection"].values.min() == 1.0
    assert float(peaks["false_alarms_low"]) <= float(peaks.attrs["attainable"])
    assert found.sel(alarm="velocity of the record")["detection"].values.min() < 0.5


def test_all_rates_are_in_the_csv_too(written):
    found = read_dataset(written[0] / "alarms.nc")
    with open(written[0] / "alarms.csv", newline="", encoding="utf-8") as file:
        rows = [*csv.DictReader(file)]
    assert len(rows) == found.sizes["alarm"] * found.sizes["noise"] * found.sizes["state"]
    column = [float(row["detection_low"]) for row in rows]
    np.testing.assert_allclose(column, found["detection_low"].values.ravel(), rtol=1e-5)
    one = found.isel(alarm=3, noise=0, state=-1)
    row = rows[4 * found.sizes["state"] - 1]
    assert (row["alarm"], row["filter"]) == (one["title"].item(), one["filter"].item())
    mine = one.sel(joint=str(one["worn_joint"].item()))
    for head, name in (("first_clearance_low_mm", "first_clearance_low"), ("draws", "draws"),
                       ("clearance_mm", "clearance"), ("lead_hours", "lead_hours")):  # fmt: skip
        assert float(row[head]) == pytest.approx(float(mine[name]), rel=1e-5, nan_ok=True)


def test_the_caption_says_the_numbers_of_the_figure(written):
    folder, out = written
    found = read_dataset(folder / "alarms.nc")
    text = caption(found)
    assert text in out
    assert (folder / "alarms.png").read_bytes()[:4] == b"\x89PNG"
    drawing = draw_alarms(found)
    best = found.isel(alarm=rank_alarms(found, "small_end")[0], noise=0)
    false = [100 * float(best[f"false_alarms{end}"]) for end in ("", "_low", "_high")]
    clearance = float(best["first_clearance"].sel(joint="small_end"))
    said = re.search(r"small end: (.+?), which detects from ([\d.]+) mm \[.*?\] on, "
                     r"with ([\d.]+) % \[([\d.]+), ([\d.]+)\]", text).groups()  # fmt: skip
    assert said[0] == best["alarm"].item()
    assert [*map(float, said[1:])] == pytest.approx([clearance, *false], rel=0.06)
    above, below = drawing.panels[1], drawing.panels[4]
    assert below.title.endswith(said[0])
    mine = found["worn_joint"].values == "small_end"
    (curve,) = [trace for trace in above.traces if trace.name == best["title"].item()]
    shares = best["curve_detection"].values[mine]
    reached = [best["factor"].values[share >= 0.9].max() for share in shares]  # by 90 % of windows
    np.testing.assert_allclose(curve.y, np.array(reached) / max(best["limit_high"].item(), 0.8))
    assert all(np.isfinite(trace.y).any() for trace in above.traces)
    assert np.ptp(np.log(curve.y)) > 0.3  # a figure that says something where all is detected
    assert "above 1 (dashed) it detects" in text
    np.testing.assert_array_equal(below.traces[0].y, best["curve_detection"].values[mine][0])


def test_the_report_has_a_section_of_its_study(written, worn_store):
    studies = [
        dataclasses.replace(one, title="Unit 3", notes="A.") for one in read_studies(worn_store)
    ]
    made = add(worn_store, studies, written[0])
    (chapter,) = made.chapters
    page = document([chapter.section])
    found = read_dataset(written[0] / "alarms.nc")
    assert "Which alarm sees wear first in study worn" in page
    assert page.count("<tr") == 1 + 3 * 9
    assert "<strong>Unit 3</strong>" in page
    assert '<p class="notes">A.</p>' in page
    for row in table_rows(found)[1][::9]:
        assert all(html.escape(text) in page for text in row)
    assert html.escape(caption(found)) in page
    assert [plate.name for plate in chapter.plates] == ["alarms-worn"]
    assert made.notes["worn"].anchor == chapter.section.anchor
    assert add(worn_store, [], written[0]).chapters == []  # of a study that is not stored
    assert add(worn_store, studies, "").chapters == []


def test_lead_times_stand_beside_the_clearances(written):
    """The wear run's big end goes from 0.1 mm to its limit, 0.3 mm, in 1,000 h."""
    folder, out = written
    found = read_dataset(folder / "alarms.nc").sel(joint="big_end")
    first, lead = (found[name].values for name in ("first_clearance", "lead_hours"))
    expected = np.clip(1000.0 - (first - 0.1) / 0.2 * 1000.0, 0.0, 1000.0)
    np.testing.assert_allclose(lead, expected, rtol=1e-6, atol=1e-6)
    assert "hours before the limit" in out


@pytest.mark.parametrize(
    ("revolutions", "change", "reason"),
    [
        (2, lambda one: {"tacho": one.tacho[:2]}, "too_short"),
        (1, lambda one: {"tacho": one.tacho[:2]}, "too_short"),  # a revolution, of two at least
        (5, lambda one: {}, "too_short"),
        (2, lambda one: {"values": 0.0 * one.values}, "silent_record"),
        (2, lambda one: {"values": one.values + np.nan}, "silent_record"),
    ],
)
def test_a_record_that_cannot_be_read_says_why(
    worn_store, monkeypatch, revolutions, change, reason
):
    stored = read_store(worn_store).warned()
    key = read_studies(worn_store)[0].keys[0]
    record = job_record(stored, key)
    monkeypatch.setattr(
        windows, "job_record", lambda *_: dataclasses.replace(record, **change(record))
    )
    options = windows.AlarmOptions(revolutions)
    assert windows.read_job(stored, key, PerJoint(0.0, 0.0), None, options) == reason


def test_no_fewer_revolutions_are_proposed_than_a_record_needs(worn_store):
    source = read_studies(worn_store)[0]
    for revolutions, told in ((1, "of 2 revolutions: 6 too_short; run what is missing, or with "
                               "sensor.length_rev: 3 or more"),
                              (5, "of 5 revolutions: 6 too_short; run what is missing, or with "
                               "sensor.length_rev: 6 or more, or give fewer --revolutions"),
                              ):  # fmt: skip
        options = windows.AlarmOptions(revolutions)
        error = windows.explain_no_windows(source, {"too_short": 6}, options)
        assert str(error).endswith(told)


def test_alarms_that_are_not_judged_are_named(written):
    found = read_dataset(written[0] / "alarms.nc")
    line = "not judged, since not all sound records have it: velocity of the body"
    assert line in [*list_remarks(found)]


def test_mistakes_are_named(worn_store, worn, capsys, tmp_path):
    for folder, words, told in (
        (worn, ["deaf"], "study deaf has no sensor's record: write `body: true` and `sensor: "
         "{length_rev: 11}` into"),
        (worn, ["worn"], "its sound jobs are 2 draws of what it varies beside joint and"),
        (worn, ["worn", "--revolutions", "30"], "has no record of 30 revolutions: 12 too_short"),
        (worn_store, ["worn", "--band", "500-5000"], "is sampled at 8000 Hz; give bands up to ha"),
        (worn_store, ["worn", "--band", "high"], "'high' is no band such as 1000-3000, in Hz"),
        (worn_store, ["worn", "--band", "9-3"], "give the lower frequency first"),
        (worn_store, ["worn", "--band", "9-30", "--band", "9-30"], "a band is given twice"),
        (worn_store, ["worn", "--factor", "2", "--false-alarms", "0.05"], "give one of them"),
        (worn_store, ["worn", "--noise", "1,1"], "a noise level is given twice"),
        (worn_store, ["worn", "--wear", str(tmp_path)], "has 0 wear runs (none): compsim wear"),
        (worn_store, [], "Missing argument 'STUDY'"),
        (worn_store, ["wrn"], "did you mean worn?"),
    ):  # fmt: skip
        assert told in run(folder, capsys, *words, code=2)


def test_no_band_is_above_what_the_sensor_passes(worn_store, capsys, monkeypatch):
    """As with sensor.low_pass_Hz: 2000; the study's own sensor has none."""
    monkeypatch.setattr(windows, "highest_passed", lambda sensor: 2000.0)
    told = run(worn_store, capsys, "worn", "--revolutions", "2", "--band", "500-2500", code=2)
    assert re.search(r"band 500-2500 Hz: the sensor of job \w+ passes up to 2000 Hz", told)
