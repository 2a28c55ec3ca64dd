"""Orders of the crank speed: against signals whose lines, means and energies are known."""

import itertools

import numpy as np
import pytest

from compressor.vibration.spectra import (
    SignalError,
    angle_window,
    order_spectrum,
    resample_angle,
    rms_above,
    samples_a_turn,
    synchronous_average,
)

TURN = 2 * np.pi
M = 360


def even(turns: float, a_turn: int = M, begin: float = 0.0) -> np.ndarray:
    return begin + TURN * np.arange(round(turns * a_turn)) / a_turn


def at_varying_speed(turns: int, samples: int) -> np.ndarray:
    """Crank angles at equal times; the speed swings by 20 % twice a revolution, and runs up."""
    time = np.linspace(0.0, 1.0, samples)
    angle = TURN * turns * (0.8 * time + 0.2 * time**2)
    return angle + 0.1 * np.sin(2 * angle)


def noise(size: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(size)


@pytest.mark.parametrize("begin", [0.0, 0.7, -40.0])
def test_even_samples_stay_as_they_are(begin):
    values = noise(3 * M)
    found = resample_angle(even(3, begin=begin), values, M)
    assert found == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize(("extra", "turns"), [(-1, 2), (0, 3), (1, 3), (M - 1, 3), (M, 4)])
def test_only_whole_revolutions_are_kept(extra, turns):
    angle = TURN * np.arange(3 * M + extra) / M
    assert resample_angle(angle, np.cos(angle), M).shape == (turns * M,)


def test_a_sine_is_restored_from_unequal_angles():
    """The spline errs by the fourth power of the interval."""
    errors = []
    for samples in (4001, 8001):
        angle = at_varying_speed(10, samples)
        found = resample_angle(angle, np.sin(5 * angle), 600)
        error = np.abs(found - np.sin(5 * even(found.size / 600, 600)))
        errors.append(np.max(error[600:-600]))  # the ends are worse
    assert errors[0] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.25)


def test_samples_a_turn():
    assert samples_a_turn(even(3)) == M
    assert samples_a_turn(even(3, 361)) == 362
    assert samples_a_turn(at_varying_speed(10, 4001)) == pytest.approx(400, rel=0.25)


@pytest.mark.parametrize("window", ["rectangular", "hann", "flattop"])
@pytest.mark.parametrize("turns", [None, 1, 2, 3])
def test_a_line_has_its_order_and_amplitude(turns, window):
    angle = even(6)
    values = -0.4 + 3.0 * np.sin(12 * angle + 0.3) + 0.25 * np.cos(50 * angle)
    orders, found = order_spectrum(angle, values, turns, window)
    assert orders[[0, 1, -1]] == pytest.approx([0.0, 1 / (turns or 6), M / 2], abs=1e-15)
    lines = dict(zip(orders, found, strict=True))
    assert (lines[12.0], lines[50.0]) == pytest.approx((3.0, 0.25), abs=1e-9)
    if window == "rectangular":
        assert lines[0.0] == pytest.approx(0.4, abs=1e-9)
        rest = [one for order, one in lines.items() if order not in (0.0, 12.0, 50.0)]
        assert max(rest) < 1e-9
    _, rms = order_spectrum(angle, values, turns, window, rms=True)
    assert rms[orders == 12.0] == pytest.approx(3.0 / np.sqrt(2), abs=1e-9)


def test_half_an_order_needs_blocks_of_two_turns():
    angle = even(6)
    orders, found = order_spectrum(angle, 0.7 * np.sin(0.5 * angle), 2)
    assert found[orders == 0.5] == pytest.approx(0.7, abs=1e-9)


def test_resampling_gathers_a_line_that_varying_speed_smears():
    angle = at_varying_speed(20, 40_001)
    values = 1.5 * np.sin(24 * angle)
    orders, found = order_spectrum(angle, values)
    assert found[orders == 24.0] == pytest.approx(1.5, abs=1e-4)
    assert np.max(found[orders != 24.0]) < 1e-4
    in_time, smeared = order_spectrum(np.linspace(0, angle[-1], angle.size), values)
    assert smeared[in_time == 24.0] < 0.5


def test_squares_of_the_spectrum_add_up_to_the_mean_square():
    values = 5.0 + noise(8 * M)
    for turns in (None, 1, 4):
        _, found = order_spectrum(even(8), values, turns, rms=True)
        assert np.sum(found**2) == pytest.approx(np.mean(values**2), rel=1e-12)


@pytest.mark.parametrize("window", ["rectangular", "hann", "flattop"])
def test_rms_above_an_order(window):
    angle = even(9)
    values = 8.0 * np.cos(angle) + 2.0 * np.sin(12 * angle) + 0.6 * np.sin(30 * angle) - 0.2
    orders, found = order_spectrum(angle, values, 9, window, rms=True)
    expected = {
        12.0 if window == "rectangular" else 20.0: 0.6 / np.sqrt(2),
        5.0: np.hypot(0.6, 2.0) / np.sqrt(2),
        100.0: 0.0,
    }
    for order, known in expected.items():
        assert rms_above(orders, found, order, window) == pytest.approx(known, abs=1e-9)


def test_the_order_itself_is_left_out():
    tenths = np.arange(100) * 0.1  # three of them are a little more than 0.3
    assert rms_above(tenths, np.ones(100), 0.3) == pytest.approx(np.sqrt(96), rel=1e-12)


def test_the_mean_revolution_and_what_is_left():
    angle = even(8, begin=0.5)
    wave = np.cos(angle) + 0.3 * np.sin(17 * angle)
    half = 0.2 * np.sin(0.5 * angle)  # changes its sign with each revolution
    mean, rest = synchronous_average(angle, wave + half, M)
    assert mean == pytest.approx(wave[:M], abs=1e-9)
    assert rest == pytest.approx(half, abs=1e-9)


def test_noise_falls_by_the_root_of_the_revolutions():
    mean, rest = synchronous_average(even(100), noise(100 * M), M)
    assert np.std(mean) == pytest.approx(0.1, rel=0.1)
    assert rest.reshape(-1, M).sum(axis=0) == pytest.approx(np.zeros(M), abs=1e-9)


@pytest.mark.parametrize(
    ("begin", "end", "inside", "whole"),
    [
        (30.0, 60.0, range(30, 60), 3),
        (350.0, 20.0, [*range(350, 360), *range(20)], 2),  # the first and the last are cut
        (-10.0, 20.0, [*range(350, 360), *range(20)], 2),
        (0.0, 360.0, range(360), 3),
    ],
)
def test_a_window_takes_its_own_angles(begin, end, inside, whole):
    degrees = np.arange(3 * M)
    values = np.where(np.isin(degrees % 360, [*inside]), -2.0, 50.0)
    values[M + inside[-1]] = 3.0
    found = angle_window(np.radians(degrees), values, begin, end)
    assert found.rms.size == found.peak.size == whole
    assert np.bincount(found.inside + 1)[1:].tolist() == [len(inside)] * whole
    assert sorted(found.peak.tolist()) == [2.0] * (whole - 1) + [3.0]
    usual = found.peak == 2.0
    assert found.rms[usual] == pytest.approx(2.0, abs=1e-12)
    raised = np.sqrt((4.0 * (len(inside) - 1) + 9.0) / len(inside))
    assert found.rms[~usual] == pytest.approx(raised, abs=1e-12)


def test_windows_that_share_a_revolution_share_its_energy():
    angle, values = even(5), noise(5 * M)
    cuts = (0.0, 35.0, 190.0, 360.0)
    energy = np.zeros(5)
    for begin, end in itertools.pairwise(cuts):
        energy += (end - begin) / 360 * angle_window(angle, values, begin, end).rms ** 2
    assert energy == pytest.approx(np.mean(values.reshape(5, M) ** 2, axis=1), rel=1e-12)


def test_rms_in_a_window_is_over_angle_not_over_samples():
    angle = at_varying_speed(4, 8001)
    found = angle_window(angle, np.cos(angle), 0.0, 90.0)
    assert found.rms == pytest.approx(np.sqrt(0.5), abs=2e-3)
    # of a degree each: the window is from -0.5 to 89.5, and the crowd is where the signal is large
    crowded = np.unique(np.concatenate([even(4), np.linspace(0.2, 0.4, 3000)]))
    found = angle_window(crowded, np.cos(crowded), 0.0, 90.0)
    assert found.rms[0] == pytest.approx(np.sqrt(45.5 / 90), abs=1e-4)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: resample_angle(even(0.9), even(0.9), M), "pass at least one revolution"),
        (lambda: resample_angle(even(2) % TURN, even(2), M), "after index 359: unwrap it"),
        (lambda: resample_angle(even(2), even(3), M), "720 angles and 1080 values"),
        (lambda: resample_angle(even(2), np.full(2 * M, np.nan), M), "cut these samples off"),
        (lambda: resample_angle(even(2), np.ones((2 * M, 2)), M), "pass one component"),
        (lambda: resample_angle(even(2), 1j * even(2), M), "complex"),
        (lambda: resample_angle(np.arange(3.0), np.arange(3.0), M), "at least 4"),
        (lambda: resample_angle(even(2), even(2), 3.5), "pass a whole number"),
        (lambda: resample_angle(even(2), even(2), 1), "pass at least 2"),
        (lambda: order_spectrum(even(2), even(2), 3), "choose fewer turns"),
        (lambda: order_spectrum(even(2), even(2), 0), "pass at least 1"),
        (lambda: order_spectrum(even(2), even(2), window="kaiser"), "choose one of"),
        (lambda: rms_above(np.arange(3.0), np.arange(4.0), 1), "one for each"),
        (lambda: angle_window(even(2), even(2), 10, 10), "two different angles"),
        (lambda: angle_window(even(2), even(2), 0, 400), "within a revolution"),
        (lambda: angle_window(even(1), even(1), 350, 10), "more revolutions"),
        (lambda: angle_window(even(2), even(2), 10.2, 10.4), "a wider window"),
    ],
)
def test_bad_input_is_told_with_a_remedy(call, told):
    with pytest.raises(SignalError, match=told):
        call()
