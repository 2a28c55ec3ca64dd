"""A record's CSV file: what was written is read, and what is wrong is named with its place."""

import math

import numpy as np
import pytest

from compressor.studies.diagnosis.features import RecordError
from compressor.studies.diagnosis.record_files import SteadySpeed, read_record

RATE, TURN = 1000.0, 0.1
TIMES = np.arange(450) / RATE
VALUES = np.sin(50 * TIMES)
PULSES = np.array([0.0375, 0.1375, 0.2375, 0.3375, 0.4375])


def voltage(times=TIMES):
    """A tacho that passes the middle of its range upwards at PULSES."""
    return 2.0 + 3.0 * np.sin(2 * np.pi * (times - PULSES[0]) / TURN)


@pytest.fixture
def written(tmp_path):
    """Writes columns, or lines, as CSV."""

    def write(columns, header="time_s,acceleration_m_per_s2,tacho", change=None):
        lines = [",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True)]
        for number, line in (change or {}).items():
            lines[number - 2] = line
        path = tmp_path / "record.csv"
        path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
        return path

    return write


def test_a_record_reads_back(written):
    found = read_record(written([TIMES, VALUES, voltage()]))
    np.testing.assert_allclose(found.times, TIMES, atol=1e-12)
    np.testing.assert_array_equal(found.values, VALUES)
    np.testing.assert_allclose(found.tacho, PULSES, atol=1e-5)  # a sine is bent between samples
    assert math.isnan(found.clipped)


def test_columns_may_stand_in_any_order_among_others(written):
    columns = [voltage(), 0 * TIMES, VALUES, TIMES]
    found = read_record(written(columns, "tacho, room ,acceleration_m_per_s2, time_s"))
    np.testing.assert_array_equal(found.values, VALUES)


def test_a_tacho_of_zeros_and_ones_is_known_to_half_a_sample(written):
    logic = (voltage() > 2.0).astype(float)
    found = read_record(written([TIMES, VALUES, logic])).tacho
    assert np.abs(found - PULSES).max() <= 0.5 / RATE


@pytest.mark.parametrize("width", [0.001, 0.002, 0.05])  # s: one sample, two, half a revolution
def test_a_pulse_s_shape_does_not_change_the_speed_of_a_steady_machine(width, written):
    turn = 0.1003  # the pulses step through the samples
    since = (TIMES - 0.01234) % turn
    found = read_record(written([TIMES, VALUES, (since < width).astype(float)])).tacho
    assert len(found) == 5
    np.testing.assert_allclose(np.diff(found), turn, atol=0.2 / RATE)  # one sample apart, as read
    wave = np.sin(2 * np.pi * (TIMES - 0.01234) / turn)
    np.testing.assert_allclose(
        np.diff(read_record(written([TIMES, VALUES, wave])).tacho), turn, atol=2e-5
    )


def test_a_record_may_begin_at_top_dead_centre(written):
    """At the middle of the rise, as a record of ours does, but not far behind it."""
    for first, count in ((0.0, 5), (0.0003, 5), (0.004, 4)):
        wave = np.sin(2 * np.pi * (TIMES + first) / TURN - 1e-9 * (first == 0))
        found = read_record(written([TIMES, VALUES, wave])).tacho
        assert len(found) == count
        assert found[0] == pytest.approx(-first if count == 5 else TURN - first, abs=2e-5)


def test_lines_at_the_end_without_a_record_are_left_out(written):
    rest = dict.fromkeys(range(TIMES.size - 8, TIMES.size + 2), ",,")
    found = read_record(written([TIMES, VALUES, voltage()], change=rest))
    assert found.times.size == TIMES.size - 10
    with pytest.raises(RecordError, match=r"record\.csv:9: the cells are empty, and the record"):
        read_record(written([TIMES, VALUES, voltage()], change={9: ",,"}))


def test_a_tacho_that_chatters_at_its_middle_counts_once(written):
    noisy = voltage() + np.random.default_rng(1).normal(0, 0.4, TIMES.size)
    assert len(read_record(written([TIMES, VALUES, noisy])).tacho) == len(PULSES)


def test_times_that_were_rounded_are_made_equal(written):
    times = np.round(np.arange(2000) / 25600, 6)  # steps of 39 and 40 us
    path = written([times, np.ones(2000)], "time_s,acceleration_m_per_s2")
    found = read_record(path, SteadySpeed(3000, 0.001))
    assert np.diff(found.times) == pytest.approx(1 / 25600, rel=1e-4)


def test_a_steady_speed_stands_in_for_a_tacho(written):
    path = written([TIMES, VALUES], "time_s,acceleration_m_per_s2")
    found = read_record(path, SteadySpeed(60 / TURN, PULSES[2]))
    np.testing.assert_allclose(found.tacho, PULSES, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({9: "0.007,abc,1"}, "record.csv:9:2: acceleration_m_per_s2: 'abc' is no number"),
        ({9: "0.007,,1"}, "record.csv:9:2: acceleration_m_per_s2: '' is no number"),
        ({9: "0.007"}, "record.csv:9:2: acceleration_m_per_s2: '' is no number"),
        ({9: "0.007,nan,1"}, "record.csv:9:2: acceleration_m_per_s2: 'nan' is not finite"),
        ({9: "inf,1,1"}, "record.csv:9:1: time_s: 'inf' is not finite"),
        (
            {9: "0.0075,1,1"},
            "record.csv:9: time_s: a step of 0.0015 s, where the mean one is 0.001",
        ),
        ({9: "0.006,1,1"}, "record.csv:9: time_s: a step of 0 s"),
    ],
)
def test_mistakes_name_line_and_column(change, told, written):
    with pytest.raises(RecordError) as found:
        read_record(written([TIMES, VALUES, voltage()], change=change))
    assert told in str(found.value)


@pytest.mark.parametrize(
    ("columns", "header", "steady", "told"),
    [
        ([TIMES, VALUES], "t,acceleration_m_per_s2", None, ".csv:1: no column time_s, only t"),
        ([TIMES], "time_s", None, "no column acceleration_m_per_s2"),
        ([TIMES, VALUES], "time_s,acceleration_m_per_s2", None, "no column tacho: add it, or give"),
        ([TIMES, VALUES, VALUES], "time_s,acceleration_m_per_s2,tacho", SteadySpeed(500, 0),
         "has a tacho column: leave --rpm"),
        ([TIMES, VALUES, 0 * TIMES], "time_s,acceleration_m_per_s2,tacho", None,
         "tacho: is 0 all the time"),
        ([TIMES[:200], VALUES[:200], voltage()[:200]], "time_s,acceleration_m_per_s2,tacho", None,
         "2 passes of top dead centre in 0.199 s: at least 3; record for longer"),
        ([TIMES, VALUES, np.where((TIMES > 0.2) & (TIMES < 0.3), -1, voltage())],
         "time_s,acceleration_m_per_s2,tacho", None, "one a revolution, none missed"),
        ([TIMES, VALUES], "time_s,acceleration_m_per_s2", SteadySpeed(0, 0), "0 rpm"),
        ([TIMES[:1], VALUES[:1]], "time_s,acceleration_m_per_s2", SteadySpeed(500, 0), "1 samples"),
    ],
)  # fmt: skip
def test_what_is_no_record_is_refused(columns, header, steady, told, written):
    with pytest.raises(RecordError) as found:
        read_record(written(columns, header), steady)
    assert told in str(found.value)


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(RecordError, match=r"absent\.csv: cannot be read: No such file"):
        read_record(tmp_path / "absent.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RecordError, match="is no CSV file in UTF-8"):
        read_record(tmp_path / "binary.csv")
