"""Files of records: what was written is read, and what is wrong is named with its place."""

import math

import numpy as np
import pytest
from scipy.io import savemat, wavfile

from compressor.vibration.record_files import RecordError, read_record, record_columns

RATE, TURN = 1000.0, 0.1
TIMES = np.arange(450) / RATE
VALUES = np.sin(50 * TIMES)
PULSES = np.array([0.0375, 0.1375, 0.2375, 0.3375, 0.4375])
COLUMNS = record_columns(TIMES, VALUES, PULSES)
STEADY = {"rpm": 60 / TURN, "tdc": PULSES[2]}
USUAL = "time_s,acceleration_m_per_s2"


def voltage(times=TIMES):
    """A tacho that passes the middle of its range upwards at PULSES."""
    return 2.0 + 3.0 * np.sin(2 * np.pi * (times - PULSES[0]) / TURN)


@pytest.fixture
def written(tmp_path):
    """Writes columns as CSV."""

    def write(columns, header=f"{USUAL},tacho"):
        lines = [",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True)]
        path = tmp_path / "record.csv"
        path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
        return path

    return write


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


def test_a_tacho_that_chatters_at_its_middle_counts_once(written):
    noisy = voltage() + np.random.default_rng(1).normal(0, 0.4, TIMES.size)
    assert len(read_record(written([TIMES, VALUES, noisy])).tacho) == len(PULSES)


def test_a_steady_speed_stands_in_for_a_tacho(written):
    found = read_record(written([TIMES, VALUES], USUAL), **STEADY)
    np.testing.assert_allclose(found.tacho, PULSES, atol=1e-12)


ONE = {"channel": "1", "unit": "g"}
CHANNELS = [TIMES, VALUES, VALUES, voltage()]
BROKEN = np.where(np.arange(450) == 16, np.nan, VALUES)
OF_CSV = [
    ([TIMES, VALUES], "x,acceleration_m_per_s2", {}, ".csv: no column time_s, only x, acceler"),
    ([TIMES, VALUES], "t,acceleration_m_per_s2", STEADY, "t has no unit of time: give --time-"),
    ([TIMES], "time_s", {}, "no column acceleration_m_per_s2"),
    ([TIMES, VALUES], USUAL, {}, "no column tacho: add it, or give"),
    ([TIMES, VALUES], USUAL, STEADY | {"tacho_deg": 30}, "leave it out with --rpm"),
    ([TIMES, VALUES, VALUES], f"{USUAL},tacho", STEADY, "has a tacho column: leave --rpm"),
    ([TIMES, VALUES, 0 * TIMES], f"{USUAL},tacho", {}, "tacho: is 0 all the time"),
    ([TIMES[:200], VALUES[:200], voltage()[:200]], f"{USUAL},tacho", {},
     "2 passes of top dead centre in 0.199 s: at least 3; record for longer"),
    ([TIMES, VALUES, np.where((TIMES > 0.2) & (TIMES < 0.3), -1, voltage())],
     f"{USUAL},tacho", {}, "one a revolution, none missed"),
    (CHANNELS, "time_s,a1,a1,t", {"channel": "a1", "unit": "g", "tacho": "t"},
     "--channel a1: 2 channels of this name"),
    (CHANNELS, "time_s,a1,a1,key phase", {"channel": "3", "unit": "g", "tacho": "key fase"},
     "key fase: no channel of this name; did you mean key"),
    (CHANNELS, "time_s,acceleration_g,acceleration_m_per_s2,tacho", {},
     "csv: 2 channels are acceleration, acceleration_g, "),
]  # fmt: skip
OF_WAV = [
    (STEADY, "only 1, 2; name the channel by --channel and --unit"),
    ({"channel": "1", **STEADY}, "channel 1 has no unit of acceleration: give --unit, one of m/s2"),
    (ONE | STEADY | {"full_scale": 50.0}, "has the values themselves: leave --full-scale out"),
    (ONE | {"tacho": "3"}, "--tacho 3: no channel of this name; there are 1, 2;"),
    (ONE | STEADY | {"rate": 1000}, "says its times: leave --rate out"),
]
OF_MAT = [
    ({"acceleration_g": VALUES, "tacho": voltage()},
     "x.mat: no column time_s, only acceleration_g, tacho"),
    ({"acceleration_g": VALUES, "tacho": voltage()[:-1], "rate_Hz": RATE},
     "different length: acceleration_g 450, tacho 449; cut"),
    ({"acceleration_g": BROKEN, "tacho": voltage(), "rate_Hz": RATE},
     "x.mat: acceleration_g: sample 17 is nan, not finite; cut"),
]  # fmt: skip


def refused(path, **hints):
    with pytest.raises(RecordError) as found:
        read_record(path, **hints)
    return str(found.value)


@pytest.mark.parametrize(("columns", "header", "hints", "told"), OF_CSV)
def test_what_is_no_record_is_refused(columns, header, hints, told, written):
    assert told in refused(written(columns, header), **hints)


@pytest.mark.parametrize(("hints", "told"), OF_WAV)
def test_wav_says_neither_unit_nor_which_channel(hints, told, tmp_path):
    assert told in refused(encoded(tmp_path, ".wav"), **hints)


@pytest.mark.parametrize(("variables", "told"), OF_MAT)
def test_variables_of_matlab_that_are_no_record_are_refused(variables, told, tmp_path):
    savemat(tmp_path / "x.mat", variables)
    assert told in refused(tmp_path / "x.mat")


def encoded(folder, suffix):
    """Writes the record to a file of a type."""
    path = folder / f"record{suffix}"
    if suffix == ".mat":
        savemat(path, COLUMNS, oned_as="column")
    else:
        signals = [COLUMNS["acceleration_m_per_s2"], COLUMNS["tacho"]]
        wavfile.write(path, int(RATE), np.stack(signals, axis=1).astype(np.float32))
    return path


@pytest.mark.parametrize(
    ("suffix", "hints", "error"),
    [
        (".wav", {"channel": "1", "tacho": "2", "unit": "m/s2"}, 6e-8),  # of 32-bit floats
        (".mat", {}, 0.0),
    ],
)
def test_records_of_every_type_are_read(suffix, hints, error, tmp_path):
    path = encoded(tmp_path, suffix)
    found = read_record(path, **hints)
    np.testing.assert_allclose(found.times, TIMES, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.values, VALUES, rtol=error, atol=0)
    np.testing.assert_allclose(found.tacho, PULSES, atol=1e-5)
    assert math.isnan(found.clipped)


@pytest.mark.parametrize(
    ("dtype", "full", "zero"), [(np.int16, 2**15, 0), (np.int32, 2**31, 0), (np.uint8, 2**7, 128)]
)
def test_whole_numbers_of_wav_are_shares_of_the_full_scale(dtype, full, zero, tmp_path):
    """A sample of half the full scale is half of what the greatest means."""
    path = tmp_path / "x.wav"
    half = np.where(TIMES < 0.2, 0.5, -0.25) * full + zero
    wavfile.write(path, 1000, half.astype(dtype))
    found = read_record(path, unit="g", full_scale=50.0, **STEADY).values
    np.testing.assert_array_equal(found, np.where(TIMES < 0.2, 25.0, -12.5) * 9.80665)
    assert "has whole numbers: give --full-scale" in refused(path, unit="g", **STEADY)


def test_a_matlab_file_may_hold_a_matrix_and_a_rate(tmp_path):
    path = tmp_path / "x.mat"
    savemat(path, {"data": np.column_stack([voltage(), VALUES]), "rate_Hz": RATE, "note": "text"})
    found = read_record(path, channel="data(:,2)", tacho="data(:,1)", unit="m/s^2")
    np.testing.assert_array_equal(found.values, VALUES)
    np.testing.assert_allclose(found.tacho, PULSES, atol=1e-5)
    savemat(path, {"acceleration_g": VALUES, "tacho": voltage()})
    np.testing.assert_array_equal(read_record(path, rate=RATE).values, 9.80665 * VALUES)


@pytest.mark.parametrize("suffix", [".wav", ".mat"])
def test_a_file_that_is_cut_or_of_something_else_is_named(suffix, tmp_path):
    """Also a text that is cut between two lines, or between two data sets."""
    whole = encoded(tmp_path, suffix).read_bytes()
    path = tmp_path / f"cut{suffix}"
    hints = {"channel": "1", "tacho": "2", "unit": "m/s2"} if suffix == ".wav" else {}
    for data in (
        b"",
        b"RIFF",
        b"\xff\xfe\x00" * 99,
        *(whole[:n] for n in range(1, len(whole) - 9, 371)),
    ):
        path.write_bytes(data)
        assert str(path) in refused(path, **hints)
    absent = tmp_path / f"absent{suffix}"
    assert f"{absent}: cannot be read: No such file" in refused(absent)


@pytest.mark.parametrize("degrees", [30.0, -90.0, 400.0])
def test_a_tacho_may_rise_at_another_angle(degrees, written):
    """The wave is moved by the angle, so that top dead centre stays where it was."""
    wave = voltage(TIMES - degrees / 360 * TURN)
    found = read_record(written([TIMES, VALUES, wave]), tacho_deg=degrees).tacho
    np.testing.assert_allclose(found, PULSES, atol=2e-5)


def test_columns_of_other_names_are_chosen(written):
    """By name or number; what is not chosen may be anything."""
    path = written(CHANNELS, "time_s,a1,a1,key phase")
    found = read_record(path, channel="3", unit="g", tacho="key phase")
    np.testing.assert_array_equal(found.values, 9.80665 * VALUES)


GERMAN = "Analyser: PRO-4000\nSerial;12\n\nTime [ms];Acc [g];Keyphasor [V]\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_a_record_as_analysers_write_it_is_read(encoding, tmp_path):
    """Semicolons, decimal commas, lines above the header, ms, g, and a keyphasor."""
    path = tmp_path / "plant.csv"
    rows = zip(1e3 * TIMES, VALUES / 9.80665, voltage(), strict=True)
    lines = [f"{t:.6f};{a:.9f};{v:.6f}\n".replace(".", ",") for t, a, v in rows]
    path.write_text(GERMAN + "".join(lines), encoding=encoding)
    found = read_record(path)
    np.testing.assert_allclose(found.times, TIMES, atol=1e-12)
    np.testing.assert_allclose(found.values, VALUES, atol=1e-7)
    np.testing.assert_allclose(found.tacho, PULSES, atol=1e-5)
    layout, tacho = found.remarks
    assert "separator semicolon, decimal comma, header in line 4, 3 columns; time Time" in layout
    assert "Keyphasor [V]: its rise counts as top dead centre; --tacho-deg says its angle" in tacho
    assert len(read_record(path, tacho_deg=30.0).remarks) == 1
    other = read_record(path, tacho_deg=30.0, unit="m/s2")
    np.testing.assert_allclose(other.values, VALUES / 9.80665, atol=1e-7)
    assert other.remarks[1].endswith("the file says g, taken as --unit m/s2 says")


@pytest.mark.parametrize(("share", "drift"), [(0.05, 0.0), (0.002, 0.0), (0.0, 0.08)])
def test_samples_at_uneven_times_are_put_on_equal_ones(share, drift, written):
    """As the sine is at those times; as if steps were equal, it is wrong by up to its size."""
    steps = 1.0 + share * np.random.default_rng(2).uniform(-1, 1, TIMES.size)
    steps += drift * np.sin(np.linspace(0, 2 * np.pi, TIMES.size))
    times = np.cumsum(steps / RATE)
    found = read_record(written([times, np.sin(50 * times), voltage(times)]))
    assert np.ptp(np.diff(found.times)) < 1e-12
    np.testing.assert_allclose(found.values, np.sin(50 * (times[0] + found.times)), atol=1e-5)
    np.testing.assert_allclose(found.tacho[:4], PULSES[:4] - times[0], atol=2e-5)
    (remark,) = found.remarks
    assert "samples are put on equal steps by their own times" in remark


def test_rounded_times_are_no_uneven_ones(written):
    """To 1e-4 of a step of 1e-3 s, or by the 2.4e-7 s that a float of 1.7e9 s has."""
    for times in (np.round(TIMES * 1.00037, 4), 1.7e9 + TIMES):
        found = read_record(written([times, VALUES, voltage()]))
        np.testing.assert_array_equal(found.values, VALUES)
        assert found.remarks == ()
        assert found.rate == pytest.approx((times.size - 1) / (times[-1] - times[0]), rel=1e-9)


@pytest.mark.parametrize("levels", [256, 163, 82, 20])
@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_a_coarse_tacho_is_as_early_as_late(levels, phase, tmp_path):
    """A sine of few levels, 4 to 50 samples a level, from its middle on: no pulse is lost."""
    rate, turn = 25600, 0.12 + phase * 1e-3
    times = np.arange(round(5.2 * turn * rate)) / rate
    sine = np.sin(2 * np.pi * (times - phase / rate) / turn)
    coarse = np.round(sine * (levels - 1) / 2).astype(np.int16)
    wavfile.write(tmp_path / "x.wav", rate, np.column_stack([coarse, coarse]))
    hints = {"channel": "1", "tacho": "2", "unit": "g", "full_scale": 1.0}
    found = read_record(tmp_path / "x.wav", **hints).tacho
    expected = phase / rate + turn * np.arange(6)
    assert len(found) == len(expected)
    a_level = turn * rate / np.pi / levels  # samples
    assert np.abs(found - expected).max() * rate < max(0.25, 0.12 * a_level)
