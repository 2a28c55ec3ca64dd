"""What alarms read, and what is made of it, of made-up windows whose detection is known."""

import math

import numpy as np
import pytest

from compressor.cases import Sensor
from compressor.studies.alarms.alarms import (
    FACTORS,
    judge_windows,
    rank_alarms,
)
from compressor.studies.alarms.readings import (
    LADDER,
    RECORD,
    band_velocity,
    default_bands,
    read_windows,
    score_by_counts,
    score_by_ratio,
)
from compressor.studies.alarms.windows import (
    AlarmOptions,
    AlarmsError,
    Windows,
    check_draws,
    highest_passed,
)
from compressor.studies.alarms.words import list_alarms, list_remarks, table_rows
from compressor.vibration import Record

LEVELS = {0.2: 1.5, 0.3: 2.5, 0.4: 6.0}  # clearance, mm -> rms over the sound one


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
    return Windows(
        (), np.array(joints), np.array(clearances), draws, draws, {(0, RECORD): readings}
    )


@pytest.fixture(scope="module")
def judged():
    return judge_windows(made_windows(), AlarmOptions(factor=2.0))


def test_rates_of_made_up_windows_are_known(judged):
    one = judged.isel(noise=0).sel(alarm="rms, record")
    assert one["clearance"].values.tolist() == [*LEVELS]
    assert one["detection"].values.tolist() == [0.0, 0.5, 1.0]
    assert one["draws"].values.tolist() == [10, 10, 10]
    assert float(one["false_alarms"]) == 0.0
    assert float(one["first_clearance"].sel(joint="small_end")) == 0.4
    assert float(one["first_clearance_low"].sel(joint="small_end")) == 0.4
    assert math.isinf(float(one["first_clearance_high"].sel(joint="small_end")))
    assert judged["alarm"].values[rank_alarms(judged, "small_end")[0]] == "rms, record"


def test_curves_are_rates_at_each_limit(judged):
    one = judged.isel(noise=0).sel(alarm="rms, record")
    usual = 1.0095  # the folds' medians lie within 0.002 of it
    for state, (clearance, level) in enumerate(LEVELS.items()):
        expected = np.where(level / usual > FACTORS, 1.0, 0.0)
        if clearance == 0.3:
            expected = (expected + (1.0 / usual > FACTORS)) / 2
        far = (np.abs(FACTORS - level / usual) > 0.02) & (np.abs(FACTORS - 1.0) > 0.02)
        found = one["curve_detection"].values[state]
        np.testing.assert_allclose(found[far], expected[far], atol=1e-12)
    false = one["curve_false_alarms"].values
    assert (np.diff(false) <= 0.0).all()
    assert (false[0], false[-1]) == pytest.approx((1.0, 0.0))


def test_noise_is_not_said_to_disturb_the_velocity_of_the_body():
    """No noise is in it: its column with noise has no clearance."""
    windows = made_windows()
    plain = windows.readings[0, RECORD]
    plain["body_velocity_rms"] = plain["sensor_rms"]
    windows.readings[1, RECORD] = plain
    found = judge_windows(windows, AlarmOptions(noise=(0.0, 1.0), factor=2.0))
    head, rows = table_rows(found)
    assert head[-1] == "with noise of 1 m/s2"
    last = {row[1]: row[-1] for row in rows}
    assert last["velocity of the body"] == "-"
    assert last["rms, record"].startswith("0.4 mm [")


def test_an_alarm_that_reads_nothing_new_never_detects(judged):
    one = judged.isel(noise=0).sel(alarm="peak, record", joint="small_end")
    assert math.isinf(float(one["first_clearance_low"]))
    (line,) = [
        line for line in list_alarms(judged.assign_attrs(study="made")) if "  peak, record" in line
    ]
    assert line.split()[-1] == "never"
    assert "velocity of the record" not in judged["alarm"].values  # no window has it


def test_what_sets_a_limit_does_not_judge_it():
    """A sound draw that is far above the others trips: no limit that judges it knows of it."""
    windows = made_windows()
    windows.readings[0, RECORD]["sensor_rms"][:2] = 50.0
    found = judge_windows(windows, AlarmOptions()).isel(noise=0).sel(alarm="rms, record")
    assert float(found["false_alarms"]) >= 1 / 20
    assert float(found["false_alarms_low"]) > 0.0
    # the worn ones of the folds that know of it are below their limit
    assert float(found["detection"].values[-1]) <= 0.3
    assert found.attrs["attainable"] == pytest.approx(1 / 17)  # 16 of 20 draws set a limit


def test_draws_that_set_no_limit_are_judged_by_the_limit_of_all():
    """A loud sound draw lifts the limit above all worn windows; in its fold it would not."""
    windows = made_windows(worn="worn draw")
    windows.readings[0, RECORD]["sensor_rms"][:2] = 50.0
    found = judge_windows(windows, AlarmOptions())
    one = found.isel(noise=0).sel(alarm="rms, record")
    assert one["detection"].values.tolist() == [0.0, 0.0, 0.0]
    usual = np.median(windows.readings[0, RECORD]["sensor_rms"][windows.is_sound])
    steps = LEVELS[0.4] / usual > FACTORS  # all are judged by what is usual of all sound windows
    np.testing.assert_array_equal(one["curve_detection"].values[-1], steps)
    assert float(one["false_alarms"]) >= 1 / 20
    assert float(one["limit_high"]) == pytest.approx(50.0, rel=0.02)
    assert float(one["limit_low"]) < 1.1  # of the fold with the loud draw
    said = [*list_remarks(found.assign_attrs(left_out="{}", clipped=0))]
    assert any(text.startswith("limits of 1 alarms differ by more than 2 times") for text in said)


def test_a_study_without_sound_or_worn_jobs_is_refused():
    class Source:
        name = "plant"

    few, many = made_windows(sound=9), made_windows()
    with pytest.raises(AlarmsError, match=r"are 9 draws of what it varies .* need 10 at the least"):
        check_draws(Source, few)
    only_sound = many.is_sound
    for mask, told in (
        (only_sound, "none of its jobs with a record is worn: add clearances"),
        (~only_sound, "of a sound machine, by which limits are set: add joint: no"),
    ):
        part = Windows((), many.joints[mask], many.clearances[mask], many.draws[mask],
                       many.keys[mask], {})  # fmt: skip
        with pytest.raises(AlarmsError, match=told):
            check_draws(Source, part)
    one = Windows((), many.joints, many.clearances, np.full(many.draws.size, "{}"), many.keys, {})
    with pytest.raises(AlarmsError, match="one draw of what it varies"):
        check_draws(Source, one)


def test_a_score_is_the_greatest_ratio_to_the_sound_median():
    values = np.array([[1.0, 10.0], [3.0, 30.0], [2.0, 20.0], [4.0, 100.0], [0.0, 0.0]])
    sound = np.array([True, True, True, False, False])
    assert score_by_ratio("x")({"x": values}, sound).tolist() == [0.5, 1.5, 1.0, 5.0, 0.0]
    silent = np.array([[0.0], [0.0], [0.0], [2.0], [0.0]])
    assert score_by_ratio("x")({"x": silent}, sound).tolist() == [1.0, 1.0, 1.0, math.inf, 1.0]


def test_counts_are_over_the_next_level_of_the_ladder():
    peaks = np.array([[4.0], [4.0], [9.0]])
    counts = np.tile(np.arange(LADDER.size, 0.0, -1.0), (3, 1))
    counts[2] += 1000.0
    found = score_by_counts(0.5)({"sensor_peak": peaks, "sensor_counts_per_rev": counts},
                             np.array([True, True, False]))  # fmt: skip
    usual = LADDER.size - np.flatnonzero(LADDER >= 2.0)[0]
    assert found.tolist() == pytest.approx([1.0, 1.0, 1.0 + 1000.0 / usual])
    none = {"sensor_peak": peaks, "sensor_counts_per_rev": np.array([[0.0], [0.0], [3.0]])
            * np.ones(LADDER.size)}  # fmt: skip
    assert score_by_counts(1.0)(none, np.array([True, True, False])).tolist() == [0.0, 0.0, 3.0]


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


def test_all_windows_of_no_number_of_draws_are_sure():
    found = judge_windows(made_windows(), AlarmOptions(factor=2.0, detected=1.0))
    said = " ".join(list_remarks(found.assign_attrs(left_out="{}", clipped=0)))
    assert "a clearance has 10 draws, and no number of them makes sure of 1 of windows" in said


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"revolutions": 0}, "at least 1 revolution, not 0"),
        ({"false_alarms": 7.0}, "between 0 and 1, not 7"),
        ({"false_alarms": math.nan}, "between 0 and 1, not nan"),
        ({"factor": 0.0}, "above 0, not 0"),
        ({"factor": math.inf}, "above 0, not inf"),
        ({"detected": -1.0}, "1 at most, not -1"),
        ({"bands": ((2.0, 9.0), (2.0, 9.0))}, "a band is given twice"),
    ],
)
def test_options_that_mean_nothing_are_refused(wrong, told):
    with pytest.raises(AlarmsError, match=told):
        AlarmOptions(**wrong)


def test_bands_fill_what_a_record_holds():
    assert default_bands(25600.0) == ((2.0, 1000.0), (1000.0, 3200.0), (3200.0, 10000.0))
    assert default_bands(25600.0, 5000.0) == ((2.0, 1000.0), (1000.0, 2200.0), (2200.0, 5000.0))
    assert highest_passed(Sensor(low_pass_Hz=5000.0)) == 5000.0
    assert highest_passed(Sensor(mounting_Hz=8000.0)) == 8000.0
    assert default_bands(4096.0) == ((2.0, 1000.0),)
    assert default_bands(1024.0) == ((2.0, 400.0),)
    with pytest.raises(AlarmsError, match="--band 3000-1000: give the lower frequency first"):
        AlarmOptions(bands=((3000.0, 1000.0),))
