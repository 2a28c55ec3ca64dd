"""`compsim compare`: jobs beside a record of another; sines, shifts and noise that are known."""

import json
import math

import numpy as np
import pytest
from conftest import store_cases
from scipy.io import wavfile

from compressor.studies.compare import CAPTION, curves, measure_likeness
from compressor.vibration import Record, by_revolutions, read_record, record_columns

HEARD = {"length_rev": 10, "noise_m_per_s2": 0.05}
CASE = {
    "joint": "big_end", "clearance_mm": 0.2, "sensor": HEARD,
    "body": {"frequency_x_Hz": 20, "frequency_y_Hz": 20},
    "solve": {"accuracy": "draft"},
}  # fmt: skip
OTHERS = {  # in words -> what differs; correlation, envelope, ratio of rms, as measured once
    "other noise": ({"sensor": HEARD | {"seed": 2}}, (1.00, 1.00, 1.00)),
    "loud noise": ({"sensor": HEARD | {"noise_m_per_s2": 10, "seed": 2}}, (0.88, 0.93, 0.51)),
    "0.1 mm": ({"clearance_mm": 0.1}, (0.50, 0.66, 3.02)),
    "0.3 mm": ({"clearance_mm": 0.3}, (-0.15, 0.80, 1.06)),
    "no friction": ({"friction": False}, (-0.70, 0.86, 0.57)),
    "520 rpm, not 500": ({"machine": {"speed_rpm": 520}}, (0.08, 0.87, 0.96)),
}
TOLERANCE = {"correlation": 0.1, "envelope": 0.05, "rms_ratio": 0.05}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("compare")
    others = CASE | {"blocks": [differs for differs, _ in OTHERS.values()]}
    studies = store_cases(place, base=CASE, others=others, deaf={"solve": CASE["solve"]})
    keys = [[case.key for case in study.cases] for study in studies]
    return place, keys[0][0], dict(zip(OTHERS, keys[1], strict=True)), keys[2][0]


@pytest.fixture
def compare(folder, compsim):
    def run(*words, code=0):
        found = compsim("compare", *words, "-r", folder[0] / "results", code=code)
        return found.err if code else found.out

    return run


@pytest.fixture
def export(folder, compsim):
    path = folder[0] / "record.csv"
    compsim("export", folder[1], "-r", folder[0] / "results", "-o", path, "--force")
    return path


def test_a_unit_or_a_speed_that_was_perhaps_mistaken_is_named(folder, compare, export):
    record, path = read_record(export), folder[0] / "record.wav"
    tacho = record_columns(record.times, record.values, record.tacho)["tacho"]
    signals = np.stack([record.values, tacho], axis=1).astype(np.float32)
    wavfile.write(path, round(1 / record.times[1]), signals)
    words = ["--channel", "1", "--tacho", "2", "--tacho-deg", "20", "--unit"]
    for unit, times in (("g", "9.81"), ("mm/s2", "0.001")):
        told = f"the rms is {times} times the job's: m/s2 were perhaps read as {unit}; check --unit"
        assert told in compare(path, folder[1], *words, unit)
    assert "perhaps" not in compare(path, folder[1], *words, "in/s2")
    assert "perhaps" not in compare(folder[2]["loud noise"], folder[2]["0.1 mm"])  # 5.9 times
    quieter = compare(path, folder[2]["no friction"], *words, "g")  # of 0.57 times the rms
    assert "times the job's: m/s2 were perhaps read as g; check --unit" in quieter
    faster = compare(path, folder[1], "--channel", "1", "--unit", "m/s2", "--rpm", "900",
                     "--tdc", "0")  # fmt: skip
    assert "it turns at 900 rpm, and the nearest job at 500 rpm: check the tacho, --rpm" in faster
    assert "it turns" not in compare(path, folder[2]["520 rpm, not 500"], *words, "m/s2")


def test_numbers_say_how_far_a_record_is_off(folder, compare, tmp_path):
    """And the figure's table has the curves of both."""
    found = json.loads(compare(folder[1], "others", "--json", "-o", tmp_path / "x.csv"))
    head = (tmp_path / "x.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert "(b): record: peak and rms of 10° segments (m/s²)" in head
    jobs = {job["key"]: job for job in found["jobs"]}
    for name, key in folder[2].items():
        for (number, tolerance), value in zip(TOLERANCE.items(), OTHERS[name][1], strict=True):
            assert jobs[key][number]["value"] == pytest.approx(value, abs=tolerance), (name, number)
    apart = [job["difference"]["value"] for job in found["jobs"]]
    assert apart == sorted(apart)
    assert jobs[folder[2]["0.1 mm"]]["what"].startswith("big_end 0.1 mm, friction")
    assert jobs[folder[2]["520 rpm, not 500"]]["what"].endswith(", machine.speed_rpm 520.0")


def test_an_exported_record_is_its_job(folder, compare, export):
    picture = folder[0] / "x.png"
    record, _, job, file, caption = compare(export, folder[1], "-o", picture).splitlines()
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert (file, caption.strip()) == (str(picture), CAPTION)
    assert record.endswith("record.csv: 9 revolutions at 500 rpm, 25600 Hz, 5.153 m/s2 rms up to "
                           "order 1200")  # fmt: skip
    key, *what, rpm = job.split()[:5]
    assert folder[1].startswith(key)
    assert (what, rpm) == (["big_end", "0.2", "mm"], "500")
    assert job.split()[5::3] == ["0.000", "1.000", "1.000", "1.000"]


def test_mistakes_are_named(folder, compare, tmp_path):
    for words, told in (
        ([folder[1], "othrs"], "did you mean others?"),
        ([folder[1], "deaf"], "none of the 1 jobs has a sensor's record of two revolutions"),
        ([folder[1], "others", "-o", "x.pdf"], "-o x.pdf: end the name in .png, .csv"),
    ):
        assert told in compare(*words, code=2)
    assert "has no sensor's record" in compare(folder[3], "others", code=5)
    slow = tmp_path / "slow.csv"
    times = np.arange(200) / 200.0
    wave = np.sin(2 * np.pi * (times - 0.01) / 0.12)
    np.savetxt(slow, np.column_stack([times, wave, wave]), "%.9g", ",", comments="",
               header="time_s,acceleration_m_per_s2,tacho")  # fmt: skip
    out = compare(slow, "others", code=2)
    assert "slow.csv: the sampling rate holds the orders up to 9 alone" in out


def test_a_job_is_compared_with_the_others_of_its_study(folder, compare):
    """Not with itself, unless it is named; a job without a record is counted."""
    mine = folder[2]["0.1 mm"]
    found = json.loads(compare(mine, "others", "deaf", "--json"))
    assert {job["key"] for job in found["jobs"]} == {*folder[2].values()} - {mine}
    assert found["left_out"] == 1
    alone = json.loads(compare(mine, mine, "--json"))
    assert [job["key"] for job in alone["jobs"]] == [mine]


# ---- numbers that are known

RATE, TURN, WHOLE = 8000.0, 0.1003, 6
FIRST = 0.01237  # s, of the first pulse: between two samples
TIMES = np.arange(round((WHOLE + 0.5) * TURN * RATE)) / RATE
TACHO = FIRST + TURN * np.arange(WHOLE + 1)
ORDERS = 300


def record(*waves, noise=0.0, seed=1):
    """A record of sines: order, amplitude, and by how many degrees each comes later."""
    turns = (TIMES - FIRST) / TURN
    values = sum(a * np.sin(2 * np.pi * k * (turns - late / 360)) for k, a, late in waves)
    values = values + np.random.default_rng(seed).normal(0.0, noise, TIMES.size)
    return by_revolutions(Record(TIMES, values, TACHO, math.nan))


def likeness(one, two):
    lines = [turned.lines(ORDERS) for turned in (one, two)]
    return measure_likeness(*lines, *map(curves, lines))


def test_curves_are_those_of_the_sines():
    found = curves(record((3, 2.0, 0.0), (40, 1.0, 0.0)).lines(ORDERS))
    angle = np.radians(found.angle)
    whole = 2 * np.sin(3 * angle) + np.sin(40 * angle)
    np.testing.assert_allclose(found.mean, whole, atol=0.02)
    assert np.sum(found.spectrum**2) == pytest.approx((4 + 1) / 2, rel=1e-3)
    np.testing.assert_allclose(found.envelope, 1.0, atol=0.02)  # of order 40 alone
    for k in (0, 7, 35):
        inside = (found.angle >= 10 * k - 1e-9) & (found.angle < 10 * k + 10 - 1e-9)
        assert found.peak[k] == pytest.approx(np.abs(whole[inside]).max(), abs=0.02)
        assert found.rms[k] == pytest.approx(np.sqrt(np.mean(whole[inside] ** 2)), abs=0.02)


@pytest.mark.parametrize("degrees", [0.0, 7.0, -20.0])
def test_a_shift_and_a_size_are_found_apart(degrees):
    """A shifted sine correlates by the cosine of its phase; the ratio of rms is that of size."""
    waves = [(5, 1.0), (6, 0.5)]
    late = record(*((k, 3 * a, degrees) for k, a in waves))
    found = likeness(late, record(*((k, a, 0.0) for k, a in waves)))
    power = {k: a**2 for k, a in waves}
    cosine = sum(p * math.cos(math.radians(k * degrees)) for k, p in power.items())
    assert found["correlation"].value == pytest.approx(cosine / sum(power.values()), abs=1e-3)
    assert found["rms_ratio"].value == pytest.approx(3.0, rel=1e-3)


def test_the_envelope_hears_bursts_whatever_rings_in_them():
    """Two bursts at the same angles, of other orders: their waves have nothing in common."""
    turns = (TIMES - FIRST) / TURN
    burst = sum(np.exp(-(((turns - at) % 1.0 - 0.1) ** 2) / 0.001) for at in (0.2, 0.6))
    waves = [burst * np.sin(2 * np.pi * k * turns) for k in (80, 117)]
    one, two = (by_revolutions(Record(TIMES, wave, TACHO, math.nan)) for wave in waves)
    found = likeness(one, two)
    assert abs(found["correlation"].value) < 0.05
    assert found["envelope"].value > 0.98


def test_noise_costs_the_correlation_what_it_should():
    """Of a mean of n revolutions: 1 / sqrt(1 + noise / signal / n) by their powers in the band."""
    clean, noisy = record((5, 1.0, 0.0)), record((5, 1.0, 0.0), noise=1.0)
    in_band = 2 * ORDERS / (RATE * TURN)  # share of the noise's power
    expected = 1 / math.sqrt(1 + in_band / 0.5 / WHOLE)
    found = likeness(noisy, clean)
    assert found["correlation"].value == pytest.approx(expected, abs=3 * found["correlation"].error)
    assert 0.003 < found["correlation"].error < 0.1


def test_errors_are_those_of_the_revolutions():
    """Of the rms, by error propagation: s(mean square) / (2 root) / the job's rms."""
    rng = np.random.default_rng(5)
    lines = np.zeros((9, ORDERS), complex)
    lines[:, 4] = 1.0 + 0.02 * rng.normal(size=9)
    job = np.zeros((2, ORDERS), complex)
    job[:, 4] = 2.0
    found = measure_likeness(lines, job, curves(lines), curves(job))["rms_ratio"]
    squares = np.abs(lines[:, 4]) ** 2
    assert found.value == pytest.approx(math.sqrt(squares.mean()) / 2.0)
    by_hand = squares.std(ddof=1) / 3.0 / (2.0 * math.sqrt(squares.mean())) / 2.0
    assert found.error == pytest.approx(by_hand, rel=0.02)
    assert math.isnan(measure_likeness(job, job, curves(job), curves(job))["rms_ratio"].error)
