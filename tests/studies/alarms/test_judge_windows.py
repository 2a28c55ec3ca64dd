"""What alarms read, and what is made of it, of made-up windows whose detection is known."""

import math

import numpy as np
import pytest

from compressor.studies.alarms.alarms import check_draws, judge_windows, list_rows, rank_alarms
from compressor.studies.alarms.readings import LADDER, RECORD, Windows, band_velocity, read_windows
from compressor.studies.frame import StudyError
from compressor.vibration import Record

LEVELS = {0.2: 1.0, 0.3: 2.5, 0.4: 6.0}  # clearance, mm -> rms over the sound one


def made_windows(sound=20, draws=10, every_second=0.3, worn="draw"):
    """Windows of an rms that follows from the clearance; at one, of every second draw alone.

    worn: the name of worn draws, which are those of sound windows by default.
    """
    joints, clearances, names, values = [], [], [], []
    for number in range(sound):
        joints += ["none"] * 2
        clearances += [0.1] * 2
        names += [f"draw {number}"] * 2
        values += [1.0 + 0.001 * number] * 2
    for clearance, level in LEVELS.items():
        for number in range(draws):
            is_quiet = clearance == every_second and number % 2
            joints += ["small_end"] * 2
            clearances += [clearance] * 2
            names += [f"{worn} {number}"] * 2
            values += [1.0 if is_quiet else level] * 2
    rms = np.array(values)[:, None]
    size = (len(values), LADDER.size)
    readings = {
        "sensor_rms": rms, "sensor_peak": np.ones_like(rms), "sensor_counts_per_rev": np.zeros(size)
    }  # fmt: skip
    draws = np.array(names)
    return Windows(np.array(joints), np.array(clearances), draws, draws, {(0, RECORD): readings}, 0)


@pytest.fixture(scope="module")
def judged():
    return judge_windows(made_windows(), (0.0,), 0.05)


def test_rates_of_made_up_windows_are_known(judged):
    one = judged.isel(noise=0).sel(alarm="rms, record")
    assert one["clearance"].values.tolist() == [*LEVELS]
    assert one["detection"].sel(end="value").values.tolist() == [0.0, 0.5, 1.0]
    assert one["draws"].values.tolist() == [10, 10, 10]
    # the loudest sound draw is above the limit that the others set
    assert float(one["false_alarms"].sel(end="value")) == pytest.approx(1 / 20)
    assert one["first_clearance"].sel(joint="small_end").values.tolist() == [0.4, 0.4, math.inf]
    assert judged["alarm"].values[rank_alarms(judged, "small_end")[0]] == "rms, record"


def test_an_alarm_that_reads_nothing_new_never_detects(judged):
    (row,) = [row for row in list_rows(judged) if row[2] == "peak, record"]
    assert row[-1] == "> 0.4 [> 0.4, > 0.4]"
    assert "velocity of the record" not in judged["alarm"].values  # no window has it


def test_a_study_without_sound_or_worn_jobs_is_refused():
    class Source:
        name = "plant"

    many = made_windows()
    sound = many.joints == "none"
    one_draw = np.full(many.draws.size, "{}")
    for joints, draws, told in (
        (made_windows(sound=9).joints, made_windows(sound=9).draws, "has 9 draws of a sound mac"),
        (many.joints[sound], many.draws[sound], "none of its jobs with a record is worn: add cle"),
        (many.joints[~sound], many.draws[~sound], "has 0 draws of a sound machine .* limits need"),
        (many.joints, one_draw, "has 1 draws of a sound machine"),
    ):
        with pytest.raises(StudyError, match=told):
            check_draws(Source, Windows(joints, joints, draws, draws, {}, 0))


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


def test_velocity_is_the_integral_in_a_band():
    rate = 1000.0
    times = np.arange(1000) / rate
    accel = 5.0 + 3.0 * np.cos(2 * np.pi * 20 * times) + 9.0 * np.cos(2 * np.pi * 300 * times)
    found = band_velocity(accel, rate, 2.0, 100.0)
    np.testing.assert_allclose(found, 3.0 * np.sin(2 * np.pi * 20 * times) / (2 * np.pi * 20),
                               atol=1e-12)  # fmt: skip
