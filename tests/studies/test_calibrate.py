"""`compsim calibrate`: fits of an oscillator in closed form, and of a simulated record."""

import contextlib
import io
import json
from pathlib import Path

import numpy as np
import pytest
from compsim import cli
from conftest import jobs_here

from compressor.cases import Case, load_cases
from compressor.solve.simulate import simulate
from compressor.store.reader import read_store
from compressor.studies.calibrate import MODEL_ERROR, fit_orders, orders_of
from compressor.vibration import Record

ORDERS = np.arange(1, 25)
FORCES = 1.0 / ORDERS**1.5


def accelerations(shares, mass=True):
    """Orders of a mass on a spring, whose frequency, damping and force are shares of a range.

    The force counts over the mass, so that with both nothing tells them apart.
    """
    shares = np.asarray(shares, float)
    frequency = 3.0 + 2.5 * shares[..., :1]
    damping = 0.02 + 0.2 * shares[..., 1:2]
    force = 1.0 + shares[..., 2:3]
    body = 1.0 + shares[..., 3:4] if mass else 1.0
    gain = -(ORDERS**2) / (frequency**2 - ORDERS**2 + 2j * damping * frequency * ORDERS)
    return force / body * FORCES * gain


def measured(truth, seed, noise=1e-3, model=0.0, mass=True):
    """Orders with noise, and off by a share that no unknown can explain."""
    rng = np.random.default_rng(seed)
    exact = accelerations(truth, mass)
    wrong = 1.0 + model * (rng.normal(size=ORDERS.size) + 1j * rng.normal(size=ORDERS.size))
    errors = np.full(ORDERS.size, noise)
    blur = rng.normal(size=(2, ORDERS.size)) * noise / np.sqrt(2)
    return exact * wrong + blur[0] + 1j * blur[1], errors


def design(unknowns, seed=1):
    return np.random.default_rng(seed).random((12 * unknowns, unknowns))


def fit_of(truth, seed, **kinds):
    amplitudes, errors = measured(truth, seed, **kinds)
    mass = kinds.get("mass", True)
    return fit_orders(lambda s: accelerations(s, mass), amplitudes, errors, design(len(truth)))


def test_known_numbers_come_back():
    truth = np.array([0.3, 0.6, 0.8])
    found = fit_of(truth, 1, noise=1e-9, mass=False)
    # the drifts take a share of what a force of 2 % of the range less would explain
    assert found.shares == pytest.approx(truth, abs=0.01)
    assert found.misfit < 0.1
    assert found.explained == pytest.approx(1.0, abs=1e-6)
    assert found.open_directions == ()


def test_intervals_hold_where_the_model_errs_as_it_may():
    """95 % of intervals, over 100 machines; at most a tenth wider than they need be."""
    rng = np.random.default_rng(7)
    inside, sizes = [], []
    for seed in range(100):
        truth = 0.15 + 0.7 * rng.random(3)
        found = fit_of(truth, seed, model=MODEL_ERROR, mass=False)
        off = (found.shares - truth) / found.deviations
        inside += (np.abs(off) < 1.96).tolist()
        sizes += off.tolist()
    assert 0.9 <= np.mean(inside) <= 1.0
    assert 0.6 < np.std(sizes) < 1.2


def test_what_is_not_told_apart_is_named():
    """Force and mass: their ratio alone is heard; each stays as wide as the other's range lets."""
    truth = np.array([0.3, 0.6, 0.5, 0.5])
    found = fit_of(truth, 3)
    assert found.open_directions == ((2, 3),)
    assert found.deviations[0] < 0.02 < 0.15 < found.deviations[2]
    assert (1 + found.shares[2]) / (1 + found.shares[3]) == pytest.approx(1.0, abs=0.02)


def test_a_machine_that_is_another_says_so():
    found = fit_of(np.array([0.3, 0.6, 0.8]), 4, model=0.2, mass=False)
    assert found.misfit > 5.0
    usual = fit_of(np.array([0.3, 0.6, 0.8]), 4, model=MODEL_ERROR, mass=False)
    assert found.deviations.min() > 3.0 * usual.deviations.min()


def test_points_that_fail_are_left():
    """Half of the design fails: the fit begins at the rest."""
    truth = np.array([0.7, 0.5, 0.4])
    amplitudes, errors = measured(truth, 5, mass=False)

    def half(shares):
        found = accelerations(shares, False)
        return np.where(np.asarray(shares)[..., :1] < 0.4, np.nan, found)

    found = fit_orders(half, amplitudes, errors, design(3))
    assert found.shares == pytest.approx(truth, abs=0.02)
    assert fit_orders(lambda s: half(s) * np.nan, amplitudes, errors, design(3)) is None


def test_orders_are_amplitude_and_phase_from_top_dead_centre():
    """Of a record that begins anywhere: cosines of the crank angle, and noise."""
    rate, speed, late = 5000.0, 12.3, 0.0371
    times = np.arange(6000) / rate
    angle = 2 * np.pi * speed * (times - late)
    values = 2.0 * np.cos(3 * angle + 0.5) + 0.25 * np.cos(20 * angle - 1.0)
    noise = np.random.default_rng(2).normal(0.0, 0.1, times.size)
    pulses = late + np.arange(14) / speed
    found = orders_of(Record(times, values + noise, pulses[pulses < times[-1]], np.nan))
    expected = np.zeros(found.amplitudes.size, complex)
    expected[2], expected[19] = 2.0 * np.exp(0.5j), 0.25 * np.exp(-1j)
    assert np.abs(found.amplitudes - expected).max() < 5.0 * found.errors.max()
    # white noise of sigma: each line of a revolution has 2 sigma / sqrt(samples)
    scatter = 2 * 0.1 / np.sqrt(rate / speed) / np.sqrt(found.revolutions)
    assert np.median(found.errors) == pytest.approx(scatter, rel=0.2)
    assert found.amplitudes.size == int(rate / 2.56 / speed)


# ---- the command: a simulated record gives its own machine back


CASE = {
    "load": "gas",
    "gas": {"switching": "exact"},
    "body": True,
    "sensor": {"rate_Hz": 2560, "mounting_Hz": 2500, "noise_m_per_s2": 0.001, "length_rev": 8},
    "solve": {"duration_rev": 2, "error_bars": False},
}  # fmt: skip
TRUTH = {"machine.reciprocating_mass_kg": 16.0, "body.mass_kg": 450.0}
FIT = ["--fit", "machine.reciprocating_mass_kg=10:20", "--fit", "body.mass_kg=300:600"]


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    place = tmp_path_factory.mktemp("calibrate")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        Path("machine.yaml").write_text(json.dumps(CASE))
        truth = {"machine": {"reciprocating_mass_kg": 16.0}, "body": {"mass_kg": 450.0}}
        run = simulate(Case.from_values(CASE | truth))
        times, values = run["sensor_time"].values, run["sensor_acceleration"].values
        tacho = np.isin(np.arange(times.size), np.searchsorted(times, run["tacho_time"].values))
        rows = np.column_stack((times, values, tacho))
        head = "time_s,acceleration_m_per_s2,tacho"
        np.savetxt("healthy.csv", rows, delimiter=",", header=head, comments="", fmt="%.12g")
        words = ["calibrate", "healthy.csv", "machine.yaml", *FIT, "-j", "1", "--quiet"]
        with jobs_here(), contextlib.redirect_stdout(io.StringIO()) as out:
            assert cli.main(words) == 0
        yield place, words, out.getvalue()


def test_the_machine_of_a_record_comes_back(fitted, monkeypatch, compsim):
    """Values in their intervals, these narrow; asked again nothing runs. Printed is a case file."""
    place, words, text = fitted
    monkeypatch.chdir(place)
    stored = len(read_store("results").keys())
    found = json.loads(compsim(*words, "--json").out)
    for key, value in TRUTH.items():
        one = found["keys"][key]
        assert one["low"] < value < one["high"]
        assert one["high"] - one["low"] < 0.25 * value
        assert one["value"] == pytest.approx(value, rel=0.06)
    assert found["misfit"] < 1.5
    assert found["explained"] > 0.99
    assert found["not_told_apart"] == []
    assert found["speed_rpm"] == pytest.approx(500.0, abs=0.05)
    assert len(read_store("results").keys()) == stored
    Path("sound.yaml").write_text(text)
    (case,) = load_cases("sound.yaml")
    assert case.machine.reciprocating_mass_kg == pytest.approx(16.0, rel=0.06)
    assert case.body.mass_kg == pytest.approx(450.0, rel=0.06)
    assert case.machine.speed_rpm == pytest.approx(500.0, abs=0.05)
    assert case.sensor.noise_m_per_s2 == 0.001
    comments = [line for line in text.splitlines() if line.startswith("#")]
    assert any("95 % interval" in line and "body.mass_kg" in line for line in comments)


def test_a_case_without_a_sensor_and_the_speed_are_refused(fitted, monkeypatch, compsim):
    place, words, _ = fitted
    monkeypatch.chdir(place)
    err = compsim(*words, "--fit", "machine.speed_rpm=400:500", code=2).err
    assert "machine.speed_rpm is the record's own" in err
    err = compsim(*words, "--set", "sensor.low_pass_Hz=1", code=2).err
    assert "warning: body.casing_mass_kg: 18 kg is the default" in err  # as a run has it
    assert "its sensor's band holds no order of" in err
    Path("bare.yaml").write_text('{"load": "gas", "gas": {"switching": "exact"}}')
    again = ["bare.yaml" if word == "machine.yaml" else word for word in words]
    assert "body and sensor" in compsim(*again[:5], *again[7:], code=2).err
