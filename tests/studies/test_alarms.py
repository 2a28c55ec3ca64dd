"""Alarms: limits, rates and hours by definition, and `compsim alarms` on records that strike."""

import contextlib
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from compsim import cli

from compressor.cases import Case
from compressor.report.figures.drawing import panels_of
from compressor.store import StoreError, read_dataset, write_dataset
from compressor.studies.alarms import alarms
from compressor.studies.alarms.readings import ALARMS, LADDER, RECORD, Windows, read_windows
from compressor.studies.frame import StudyError
from compressor.studies.wear import Worn
from compressor.vibration import Record


def names(count, windows=1):
    return np.repeat([f"draw {n}" for n in range(count)], windows)


def test_a_limit_counts_draws_and_not_windows():
    """Against the definition, with ties, and draws of other lengths."""
    rng = np.random.default_rng(2)
    for _ in range(30):
        sizes = rng.integers(1, 5, 24)
        draws = np.repeat([f"{n}" for n in range(24)], sizes)
        scores = rng.integers(0, 12, draws.size).astype(float)
        rate = rng.uniform(0.02, 0.4)

        def bound(limit, draws=draws, scores=scores):
            shares = [np.mean(scores[draws == name] > limit) for name in {*draws.tolist()}]
            return (sum(shares) + 1) / 25

        allowed = [level for level in np.unique(scores) if bound(level) <= rate + 1e-12]
        assert alarms.find_limit(scores, draws, rate) == (min(allowed) if allowed else scores.max())


def test_wilsons_interval_in_closed_form():
    """Of none and of all: z^2 / (n + z^2) from the end; symmetric about a half."""
    square = 1.959963984540054**2
    none, whole = (alarms.compute_rate(trips, names(10)) for trips in (np.zeros(10), np.ones(10)))
    assert none == pytest.approx((0, 0, square / (10 + square)))
    assert whole == pytest.approx((1, 10 / (10 + square), 1))
    assert (none[1], whole[2]) == (0.0, 1.0)  # not 2.8e-15
    _, low, high = alarms.compute_rate(np.arange(40) % 2, names(40))
    assert low + high == pytest.approx(1.0)
    assert (high - 0.5) ** 2 * (1 + square / 40) == pytest.approx(0.25 * square / 40)


def test_intervals_hold_by_draws_and_would_not_by_windows():
    rng = np.random.default_rng(4)
    held = np.zeros(2)
    for _ in range(400):
        trips = np.repeat(rng.random(30) < 0.8, 5).astype(float)  # windows of a draw are alike
        for way, draws in enumerate((names(30, 5), names(150))):
            one = alarms.compute_rate(trips, draws)
            held[way] += one[1] <= 0.8 <= one[2]
    assert held[0] / 400 > 0.92
    assert held[1] / 400 < 0.75


def test_the_clearance_from_which_on_is_in_its_interval():
    """Rates of 40 draws about known ones, which pass 90 % at the third clearance."""
    rng = np.random.default_rng(5)
    clearances, truth = [0.1, 0.2, 0.3, 0.4, 0.5], [0.1, 0.75, 0.93, 0.97, 1.0]
    held = 0
    for _ in range(300):
        drawn = [(rng.random(40) < one).astype(float) for one in truth]
        rates = [alarms.compute_rate(trips, names(40)) for trips in drawn]
        found = alarms.find_onset(np.array(clearances), np.array(rates))
        assert found[1] <= found[0] <= found[2]
        held += found[1] <= 0.3 <= found[2]
    assert held / 300 > 0.94


def test_a_clearance_counts_from_which_on_it_holds():
    """What is detected between two that are not, is not: as between two resonances."""

    def onset(*shares):
        rates = np.array([(share, share - 0.1, min(share + 0.1, 1.0)) for share in shares])
        return alarms.find_onset(np.arange(1.0, len(shares) + 1.0), rates)

    assert onset(0.95, 0.7, 0.92, 1.0) == [3, 3, 4]
    assert onset(0.1, 0.2, 0.85) == [math.inf, 3, math.inf]
    assert onset(0.1, 0.2) == [math.inf] * 3


# ---- windows whose detection is known


LEVELS = {0.2: 1.0, 0.3: 2.5, 0.4: 6.0}  # clearance, mm -> rms over the sound one


def made_windows(sound=20, draws=10):
    """Windows of an rms that follows from the clearance; at 0.3 mm, of every second draw alone."""
    rows = [("none", 0.1, f"draw {n}", 1.0 + 0.001 * n) for n in range(sound)]
    for clearance, level in LEVELS.items():
        for n in range(draws):
            is_quiet = clearance == 0.3 and n % 2
            rows.append(("small_end", clearance, f"draw {n}", 1.0 if is_quiet else level))
    joints, clearances, drawn, values = (np.repeat(one, 2) for one in zip(*rows, strict=True))
    rms = values[:, None]
    readings = {
        "sensor_rms": rms, "sensor_peak": np.ones_like(rms),
        "sensor_counts_per_rev": np.zeros((rms.size, LADDER.size)),
    }  # fmt: skip
    return Windows(joints, clearances, drawn, drawn, {(0, RECORD): readings}, 0)


def test_rates_of_made_up_windows_are_known():
    judged = alarms.judge_windows(made_windows(), (0.0,), 0.05)
    one = judged.isel(noise=0).sel(alarm="rms, record")
    assert one["clearance"].values.tolist() == [*LEVELS]
    assert one["detection"].sel(end="value").values.tolist() == [0.0, 0.5, 1.0]
    assert one["draws"].values.tolist() == [10, 10, 10]
    # the loudest sound draw is above the limit that the others set
    assert float(one["false_alarms"].sel(end="value")) == pytest.approx(1 / 20)
    assert one["first_clearance"].sel(joint="small_end").values.tolist() == [0.4, 0.4, math.inf]
    assert judged["alarm"].values[alarms.rank_alarms(judged, "small_end")[0]] == "rms, record"
    (row,) = (row for row in alarms.list_rows(judged) if row[2] == "peak, record")  # reads nothing
    assert row[-1] == "> 0.4 [> 0.4, > 0.4]"
    assert "velocity of the record" not in judged["alarm"].values  # no window has it


def test_a_study_needs_sound_and_worn_jobs():
    """Too few sound ones are a mistake of the command, below."""
    source = SimpleNamespace(name="plant")
    alarms.check_draws(source, made_windows(sound=10))
    with pytest.raises(StudyError, match="has 9 draws"):
        alarms.check_draws(source, made_windows(sound=9))
    with pytest.raises(StudyError, match="none of its jobs with a record is worn: add cle"):
        alarms.check_draws(source, made_windows(draws=0))


def test_windows_of_a_sine_are_read_in_closed_form():
    """A cos at order 3 of 10 Hz with 7 m/s2, and a click in one segment of the second window."""
    rate, turn = 8000.0, 0.1
    times = np.arange(round(4.2 * turn * rate)) / rate
    wave = 7.0 * np.cos(2 * np.pi * 30.0 * (times - 0.01))
    click = np.where(np.abs(times - 0.01 - 2.5 * turn) < 1e-9, 50.0, 0.0)
    record = Record(times, wave + click, 0.01 + turn * np.arange(5), math.nan)
    found = read_windows(record, 2, ((20.0, 40.0), (1000.0, 3000.0)), (2.0, 1000.0), 0.0, [1])
    assert [*found] == [RECORD, "20-40 Hz", "1000-3000 Hz"]
    plain = found[RECORD]
    assert {len(one) for one in plain.values()} == {2}
    assert plain["sensor_rms"][0, 0] == pytest.approx(7 / math.sqrt(2), rel=1e-3)
    assert plain["velocity"][0, 0] == pytest.approx(7 / (2 * np.pi * 30 * math.sqrt(2)), rel=0.02)
    assert plain["sensor_segment_peak"][1].argmax() == 18
    level = np.flatnonzero(LADDER > 3.5)[0]
    assert plain["sensor_counts_per_rev"][0, level] == pytest.approx(6.0, abs=0.5)
    assert plain["sensor_counts_per_rev"][0, LADDER > 7.0].max() == 0.0
    assert found["20-40 Hz"]["sensor_peak"][1, 0] < 7.5
    assert found["1000-3000 Hz"]["sensor_rms"][0, 0] < 0.2
    again = read_windows(record, 2, (), (2.0, 1000.0), 3.0, [1])[RECORD]["sensor_rms"][0, 0]
    assert again == pytest.approx(math.hypot(7 / math.sqrt(2), 3.0), rel=0.05)
    assert read_windows(record, 5, (), (2.0, 1000.0), 0.0, [1]) == {}


# ---- hours between an alarm and the end of a wear run, by runs that are straight lines


CASE = {
    "joint": "both", "clearance_mm": 0.1,
    "wear": {"limit_mm": 0.3, "coefficient_factor": 2},
}  # fmt: skip


def write_run(folder, case=CASE, hours=(0.0, 400.0, 1000.0)):
    """A file of `compsim wear`, in which the small end wears half as fast as the big end."""
    worn = Worn(Case.from_values(case))
    stages = []
    for one in hours:
        opened = worn.clearances + 2e-4 * one / 1000.0 * np.array([1.0, 0.5])
        stages.append({
            "hours": one, "clearance": opened, "rubbing_work": np.ones(2),
            "turn": 0.1, "reason": "", "detail": "",
            "rms_acceleration": 1.0, "peak_acceleration": 1.0, "peak_contact_force": np.ones(2),
            "max_penetration": np.ones(2), "contact_loss_fraction": np.ones(2),
            "impact_count": np.ones(2),
        })  # fmt: skip
    path = worn.path(folder)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_dataset(path, worn.to_dataset(stages))
    return path


def hours(place, clearances):
    found = xr.Dataset(
        {"first_clearance": (("alarm", "noise", "joint", "end"), [[[*clearances.values()]]])},
        {"joint": [*clearances]},
    )
    lead = alarms.add_hours(found, alarms.read_wear(place))["hours"].values[0, 0]
    return dict(zip(clearances, lead.tolist(), strict=True))


def test_hours_are_those_to_the_first_joint_that_is_worn_out(tmp_path):
    """Big end: 0.1 mm and 0.2 mm more in 1,000 h, which ends the run; small end: 0.1 mm more."""
    found = hours(write_run(tmp_path), {
        "big_end": (0.15, 0.12, 0.2), "small_end": (0.15, 0.05, math.inf), "both": (0.1,) * 3
    })  # fmt: skip
    assert found["big_end"] == pytest.approx([750.0, 500.0 / 2, 900.0 * 2])
    # an alarm that sees nothing of the small end until the big end is worn out leads by 0
    assert found["small_end"] == pytest.approx([500.0, 0.0, 1000.0 * 2])
    assert np.isnan(found["both"]).all()  # no run wears both as one


@pytest.mark.parametrize(
    ("ends", "judged", "is_known"),
    [(400.0, 5e4, False), (1000.0, 999.0, False), (1000.0, 1001.0, True)],
)
def test_without_a_limit_reached_no_hours_are_known(tmp_path, ends, judged, is_known):
    """A run that is short, and a life beyond the hours to judge, as for `compsim wear`."""
    case = CASE | {"wear": CASE["wear"] | {"hours": judged}}
    found = hours(write_run(tmp_path, case, (0.0, 400.0, ends)), {"big_end": (0.12,) * 3})
    assert np.isfinite(found["big_end"]).all() == is_known


def test_a_folder_has_one_run(tmp_path):
    clearances = {"big_end": (0.15, 0.12, 0.2)}
    path = write_run(tmp_path)
    assert hours(tmp_path, clearances) == hours(path, clearances) == hours(path.parent, clearances)
    write_run(tmp_path, CASE | {"clearance_mm": 0.12})
    (tmp_path / "other.nc").write_bytes(b"text")
    write_dataset(tmp_path / "study.nc", xr.Dataset())
    for place, told in (
        (tmp_path / "wear", "has 2 wear runs"), (tmp_path / "absent.nc", "No such file"),
        (tmp_path / "study.nc", "holds no wear run"),
    ):  # fmt: skip
        with pytest.raises(StudyError, match=told):
            hours(place, clearances)
    with pytest.raises(StoreError, match="compsim wear the machine's case file"):
        hours(tmp_path / "other.nc", clearances)


# ---- the command


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
        "study: worn", "sound machines: 52 jobs of 52 draws", "worn machines: 156 jobs",
        "windows: 2 revolutions", "limits: for 1.9 % of false alarms", alarms.CAPTION,
    ):  # fmt: skip
        assert f"{line}\n" in out
    assert "  limit / usual  " in out
    rows = [line for line in out.splitlines() if line.startswith(("big_end ", "small_", "both "))]
    assert len(rows) == 3 * KINDS
    for joint in ("big_end", "small_end", "both"):
        first = next(row for row in rows if row.startswith(joint))
        best = found.isel(alarm=alarms.rank_alarms(found, joint)[0], noise=0).sel(joint=joint)
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
    panels = panels_of(alarms.draw_alarms(found))
    for panel, joint in zip(panels, found["joint"].values, strict=True):
        mine = found["worn_joint"].values == joint
        for trace in panel.traces:
            ranked, kinds = alarms.rank_alarms(found, joint), found["kind"].values
            best = next(n for n in ranked if kinds[n] == trace.name)
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
        (worn, ["deaf"], "study deaf has no sensor's record: write `body: true` and `sensor: "),
        (worn, ["worn"], "study worn has 2 draws of a sound machine"),
        (worn, ["worn", "--revolutions", "30"], "has no record of 30 revolutions: 12 too_short"),
        (worn_store, ["worn", "--band", "500-3900"], "passes up to 3125 Hz (sensor.low"),
        (worn_store, ["worn", "--band", "9-3"], "'9-3' is no band such as 1000-3000, in Hz"),
        (worn_store, ["worn", "--false-alarms", "7"], "7.0 is not in the range 0.0<x<1.0"),
        (worn_store, ["worn", "--revolutions", "1"], "1 is not in the range x>=2"),
        (worn_store, ["worn", "--noise", "1,1"], "a noise level is given twice"),
        (worn_store, ["worn", "--wear", str(tmp_path)], "has 0 wear runs: compsim wear"),
    ):  # fmt: skip
        assert told in compsim("alarms", *words, "-r", folder, "--quiet", code=2).err
