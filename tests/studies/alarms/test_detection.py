"""Limits, rates and readings against their definitions, and how often intervals hold."""

import math

import numpy as np
import pytest

from compressor.studies.alarms import alarms
from compressor.studies.alarms.readings import LADDER, RECORD, Windows, read_windows
from compressor.studies.frame import StudyError
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
    assert alarms.compute_rate(np.zeros(10), names(10)) == pytest.approx(
        (0, 0, square / (10 + square))
    )
    assert alarms.compute_rate(np.ones(10), names(10)) == pytest.approx((1, 10 / (10 + square), 1))
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
        rates = [
            alarms.compute_rate((rng.random(40) < one).astype(float), names(40)) for one in truth
        ]
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
    joints, clearances, names, values = [], [], [], []
    for number in range(sound):
        joints += ["none"] * 2
        clearances += [0.1] * 2
        names += [f"draw {number}"] * 2
        values += [1.0 + 0.001 * number] * 2
    for clearance, level in LEVELS.items():
        for number in range(draws):
            is_quiet = clearance == 0.3 and number % 2
            joints += ["small_end"] * 2
            clearances += [clearance] * 2
            names += [f"draw {number}"] * 2
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
    return alarms.judge_windows(made_windows(), (0.0,), 0.05)


def test_rates_of_made_up_windows_are_known(judged):
    one = judged.isel(noise=0).sel(alarm="rms, record")
    assert one["clearance"].values.tolist() == [*LEVELS]
    assert one["detection"].sel(end="value").values.tolist() == [0.0, 0.5, 1.0]
    assert one["draws"].values.tolist() == [10, 10, 10]
    # the loudest sound draw is above the limit that the others set
    assert float(one["false_alarms"].sel(end="value")) == pytest.approx(1 / 20)
    assert one["first_clearance"].sel(joint="small_end").values.tolist() == [0.4, 0.4, math.inf]
    assert judged["alarm"].values[alarms.rank_alarms(judged, "small_end")[0]] == "rms, record"
    (row,) = [
        row for row in alarms.list_rows(judged) if row[2] == "peak, record"
    ]  # reads nothing new
    assert row[-1] == "> 0.4 [> 0.4, > 0.4]"
    assert "velocity of the record" not in judged["alarm"].values  # no window has it


def test_a_study_without_sound_or_worn_jobs_is_refused():
    class Source:
        name = "plant"

    alarms.check_draws(Source, made_windows(sound=10))
    for windows, told in (
        (made_windows(sound=9), "has 9 draws of a sound machine .* limits need"),
        (made_windows(draws=0), "none of its jobs with a record is worn: add cle"),
    ):
        with pytest.raises(StudyError, match=told):
            alarms.check_draws(Source, windows)


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
