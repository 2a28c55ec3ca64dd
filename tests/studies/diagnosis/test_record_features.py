"""Features of a record: against sines, bursts, noise and turns whose numbers are known."""

import math

import numpy as np
import pytest

from compressor.studies.diagnosis import features
from compressor.studies.diagnosis.features import BANDS, BEATS, FEATURES, SECTORS, SMALLEST
from compressor.vibration import Record, RecordError

RATE, SPEED, WHOLE = 25600.0, 8.0, 10  # Hz, rev/s, revolutions
FIRST = 0.0123  # s, of the first pulse: between two samples
TIMES = np.arange(round((WHOLE + 0.4) / SPEED * RATE)) / RATE
TACHO = FIRST + np.arange(WHOLE + 1) / SPEED
TURNS = (TIMES - FIRST) * SPEED
NOISE = np.random.default_rng(3).standard_normal(TIMES.size)
SILENT = math.log10(SMALLEST)


def describe(times, values, tacho):
    return features.features(Record(times, values, tacho, math.nan))


def sine(order, amplitude=1.0):
    return amplitude * np.sin(2 * np.pi * order * TURNS + 0.3)


def mean_turn(turns, orders=range(20, 500, 7)):
    """A revolution of many orders with phases of their own, as often as there are turns."""
    phases = np.random.default_rng(5).uniform(0, 2 * np.pi, 1000)
    return sum(np.cos(2 * np.pi * k * turns + phases[k]) for k in orders)


def test_a_sine():
    found = describe(TIMES, sine(100, 3.0), TACHO)  # 800 Hz
    assert [*found] == [*FEATURES]
    assert found["level"] == pytest.approx(math.log10(3.0 / math.sqrt(2)), abs=1e-6)
    assert found["speed"] == pytest.approx(math.log10(SPEED), abs=1e-12)
    assert found["crest_factor"] == pytest.approx(math.sqrt(2), rel=1e-3)
    assert found["kurtosis"] == pytest.approx(1.5, rel=1e-4)
    assert found["gini"] == pytest.approx(4 / math.pi - 1, abs=1e-3)  # Lorenz: 1 - cos(pi p / 2)
    assert found["above_swing"] == pytest.approx(0.0, abs=1e-6)
    assert found["synchronous"] == pytest.approx(1.0, abs=1e-6)
    assert found["band_700"] == pytest.approx(0.0, abs=1e-3)
    for k in range(SECTORS):
        assert found[f"sector_{15 * k}"] == pytest.approx(-math.log10(SECTORS), abs=2e-2)


def test_only_the_level_knows_the_size():
    small, large = (describe(TIMES, size * NOISE, TACHO) for size in (1e-6, 1e6))
    assert large["level"] - small["level"] == pytest.approx(12.0, abs=1e-12)
    for name in {*FEATURES} - {"level"}:
        assert large[name] == pytest.approx(small[name], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("order", [1, 5, 12])
def test_the_swing_of_a_machine_without_clearance_is_no_sound(order):
    found = describe(TIMES, sine(order) + sine(200, 0.1), TACHO)
    assert found["above_swing"] == pytest.approx(math.log10(0.01 / 1.01), abs=1e-3)
    assert found["synchronous"] == pytest.approx(1.0, abs=1e-3)
    assert found["band_0"] == pytest.approx(math.log10(1 / 1.01), abs=1e-3)
    assert found["band_1100"] == pytest.approx(math.log10(0.01 / 1.01), abs=2e-2)


@pytest.mark.parametrize("sector", [0, 4, 23])
def test_a_burst_stands_in_its_sector(sector):
    place = (TURNS % 1.0) * SECTORS - sector
    burst = np.where((place > 0) & (place < 1), np.sin(np.pi * place) ** 2, 0.0) * sine(400)
    found = describe(TIMES, burst, TACHO)
    for k in range(SECTORS):
        assert found[f"sector_{15 * k}"] == pytest.approx(0.0 if k == sector else SILENT, abs=1e-3)
    # of the burst's energy, sin^4, 90 % stand in a share of the sector; the carrier's zeros can go
    x = np.linspace(0, 1, 100001)
    energy = np.sort(np.sin(np.pi * x) ** 4 / np.mean(np.sin(np.pi * x) ** 4))[::-1]
    span = np.searchsorted(np.cumsum(energy) / x.size, 0.9) / x.size
    assert found["energy_angle"] < span / SECTORS
    assert found["energy_angle"] > 0.5 * span / SECTORS


def test_bands_of_white_noise_are_as_wide_as_they_are():
    found = describe(TIMES, NOISE, TACHO)
    for low, high in zip(BANDS, (*BANDS[1:], RATE / 2), strict=True):
        lines = (high - low) * WHOLE / SPEED  # independent lines of a chi-square law
        share = math.log10((high - low) / (RATE / 2))
        assert found[f"band_{low:g}"] == pytest.approx(share, abs=3 * 0.44 / math.sqrt(lines))
    assert sum(10 ** found[f"band_{low:g}"] for low in BANDS) == pytest.approx(1.0)
    assert found["kurtosis"] == pytest.approx(3.0, abs=0.1)
    assert found["gini"] == pytest.approx(math.sqrt(2) - 1, abs=0.01)  # of a half-normal law


def test_a_turn_that_repeats_itself_is_synchronous():
    found = describe(TIMES, mean_turn(TURNS), TACHO)
    assert found["synchronous"] == pytest.approx(1.0, abs=1e-6)
    lines = np.fft.rfft(NOISE)
    lines[lines.size // 4 :] = 0.0  # the spline that resamples takes from the highest frequencies
    low = np.fft.irfft(lines, NOISE.size)
    noisy = describe(TIMES, mean_turn(TURNS) / np.std(mean_turn(TURNS)) + low / np.std(low), TACHO)
    assert noisy["synchronous"] == pytest.approx((1 + 1 / WHOLE) / 2, abs=0.02)


def test_turns_at_their_own_pace_are_still_synchronous():
    """The speed swings by 0.2 % over four revolutions; pulses alone tell."""
    swing = 0.002 * 4 / (2 * np.pi)

    def angle(times):
        turns = (times - FIRST) * SPEED
        return turns + swing * np.sin(2 * np.pi * turns / 4)

    fine = np.linspace(0, TIMES[-1], 2_000_001)
    tacho = np.interp(np.arange(WHOLE + 1), angle(fine), fine)
    values = mean_turn(angle(TIMES), range(20, 60, 7))
    assert describe(TIMES, values, tacho)["synchronous"] > 0.99
    assert describe(TIMES, values, TACHO)["synchronous"] < 0.98


@pytest.mark.parametrize("beat", BEATS)
def test_a_modulated_carrier_has_its_order_in_the_envelope(beat):
    carrier = sine(250)  # 2000 Hz
    values = (1.0 + 0.4 * np.cos(2 * np.pi * beat * TURNS)) * carrier
    found = describe(TIMES, values, TACHO)
    for one in BEATS:
        assert found[f"envelope_{one}"] == pytest.approx(0.4 if one == beat else 0.0, abs=1e-3)


@pytest.mark.parametrize("share", [0.0, 0.0005, 0.3, 0.999])
@pytest.mark.parametrize("speed", [5.0, 8.0, 11.67, RATE / 3200.3331])
def test_every_revolution_between_pulses_counts(speed, share):
    """Wherever pulses fall between samples, and though samples end with the last pulse."""
    tacho = (share + 3) / RATE + np.arange(4) / speed
    times = np.arange(math.ceil(tacho[-1] * RATE - 1e-9) + 1) / RATE
    turn = np.floor((times - tacho[0]) * speed)
    values = np.where(turn == 2, 1.0, 0.0) * np.sin(2 * np.pi * 500 * times)  # the last alone
    found = describe(times, values, tacho)
    assert found["level"] == pytest.approx(math.log10(math.sqrt(1 / 6)), abs=2e-3)


@pytest.mark.parametrize(
    ("values", "tacho", "told"),
    [
        (NOISE, TACHO[:2], "2 tacho pulses are too few: at least 3"),
        (NOISE, TACHO[:0], "0 tacho pulses are too few"),
        (np.where(TURNS > 3, np.nan, NOISE), TACHO, "not all numbers"),
        (0.0 * NOISE, TACHO, "all zero"),
        (NOISE, TACHO + 1.0, "pulses lie beyond the samples"),
        (NOISE, TACHO - 0.1, "pulses lie beyond the samples"),
        (NOISE, TACHO[::-1], "do not increase"),
        (NOISE, np.where(TACHO > 1, np.nan, TACHO), "do not increase"),
        (NOISE[1:], TACHO, f"{TIMES.size} times and {TIMES.size - 1} values"),
    ],
)
def test_a_record_that_tells_nothing_is_refused(values, tacho, told):
    with pytest.raises(RecordError, match=told):
        describe(TIMES, values, tacho)
