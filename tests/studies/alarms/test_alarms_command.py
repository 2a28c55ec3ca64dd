"""`compsim alarms` on made-up records that strike: its table, files, figure, and mistakes."""

import contextlib
import re

import numpy as np
import pytest
from compsim import cli
from test_lead import CASE, write_run

from compressor.report.figures.drawing import panels_of
from compressor.store import read_dataset
from compressor.studies.alarms.alarms import CAPTION, draw_alarms, rank_alarms
from compressor.studies.alarms.readings import ALARMS

KINDS = len(ALARMS) - 1  # without the body's velocity, which no job here has


@pytest.fixture(scope="module")
def written(worn_store, tmp_path_factory):
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
    for line in (
        "study: worn", "sound machines: 60 jobs of 60 draws", "worn machines: 180 jobs",
        "windows: 2 revolutions", "limits: for 1.6 % of false alarms", CAPTION,
    ):  # fmt: skip
        assert f"{line}\n" in out
    rows = [line for line in out.splitlines() if line.startswith(("big_end ", "small_", "both "))]
    assert len(rows) == 3 * KINDS
    for joint in ("big_end", "small_end", "both"):
        first = next(row for row in rows if row.startswith(joint))
        best = found.isel(alarm=rank_alarms(found, joint)[0], noise=0).sel(joint=joint)
        clearance, low, _ = re.findall(r"([\d.]+) \[([\d.]+), > ([\d.]+)\]", first)[-1]
        assert best["alarm"].item() in first
        told = [float(clearance), float(low), np.inf]  # of 10 draws a clearance
        assert told == pytest.approx(best["first_clearance"].values, rel=5e-3)


def test_strokes_as_high_as_the_clearance_are_heard(written):
    """A ringing of 2 m/s2 and more on a sine of 1 m/s2 and noise of 0.05: by peaks, always."""
    found = read_dataset(written[0] / "alarms.nc").isel(noise=0).set_index(alarm="alarm")
    peaks = found.sel(alarm="peak, 1000-3000 Hz")
    assert peaks["detection"].values[:, 0].min() == 1.0
    assert peaks["false_alarms"].values[1] <= peaks.attrs["rate"]
    assert found.sel(alarm="velocity of the record")["detection"].values[:, 0].min() < 0.5


def test_the_figure_has_the_shares_of_each_joint(written):
    folder, _ = written
    found = read_dataset(folder / "alarms.nc")
    assert (folder / "alarms.png").read_bytes()[:4] == b"\x89PNG"
    panels = panels_of(draw_alarms(found))
    for panel, joint in zip(panels, found["joint"].values, strict=True):
        mine = found["worn_joint"].values == joint
        for trace in panel.traces:
            best = next(
                n for n in rank_alarms(found, joint) if found["kind"].values[n] == trace.name
            )
            np.testing.assert_array_equal(trace.y, found["detection"].values[best, 0, mine, 0])
        assert [rule.y0 for rule in panel.rules] == [0.9]


def test_hours_stand_beside_the_clearances(written):
    """The wear run's big end goes from 0.1 mm to its limit, 0.3 mm, in 1,000 h."""
    folder, out = written
    found = read_dataset(folder / "alarms.nc").sel(joint="big_end")
    first, lead = (found[name].values[..., 0] for name in ("first_clearance", "hours"))
    expected = np.clip(1000.0 - (first - 0.1) / 0.2 * 1000.0, 0.0, 1000.0)
    np.testing.assert_allclose(lead, expected, rtol=1e-6, atol=1e-6)
    assert "hours before the limit" in out


def test_mistakes_are_named(worn_store, worn, compsim, tmp_path):
    for folder, words, told in (
        (worn, ["deaf"], "study deaf has no sensor's record: write `body: true` and `sensor: "
         "{length_rev: 11}` into"),
        (worn, ["worn"], "study worn has 2 draws of a sound machine"),
        (worn, ["worn", "--revolutions", "30"], "has no record of 30 revolutions: 12 too_short"),
        (worn_store, ["worn", "--band", "500-5000"], "is sampled at 8000 Hz, and its sensor"),
        (worn_store, ["worn", "--band", "9-3"], "'9-3' is no band such as 1000-3000, in Hz"),
        (worn_store, ["worn", "--false-alarms", "7"], "7.0 is not in the range 0.0<x<1.0"),
        (worn_store, ["worn", "--revolutions", "1"], "1 is not in the range x>=2"),
        (worn_store, ["worn", "--noise", "1,1"], "a noise level is given twice"),
        (worn_store, ["worn", "--wear", str(tmp_path)], "has 0 wear runs: compsim wear"),
    ):  # fmt: skip
        assert told in compsim("alarms", *words, "-r", folder, "--quiet", code=2).err
