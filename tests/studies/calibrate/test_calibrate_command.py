"""`compsim calibrate`: a simulated record gives its own machine back, and what it refuses."""

import contextlib
import io
import json
from pathlib import Path

import numpy as np
import pytest
from compsim import cli
from conftest import jobs_here

from compressor.cases.load import load_cases
from compressor.solve.simulate import simulate
from compressor.store.reader import read_store

CASE = {
    "load": "gas",
    "gas": {"switching": "exact"},
    "body": True,
    "sensor": {
        "rate_Hz": 2560, "mounting_Hz": 2500, "noise_m_per_s2": 0.001, "length_rev": 8,
    },
    "solve": {"duration_rev": 2},
}  # fmt: skip
TRUTH = {"machine.reciprocating_mass_kg": 16.0, "body.mass_kg": 450.0}
FIT = ["--fit", "machine.reciprocating_mass_kg=10:20", "--fit", "body.mass_kg=300:600"]


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A folder with a case file, a record of another machine, and what `calibrate` prints."""
    place = tmp_path_factory.mktemp("calibrate")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        Path("machine.yaml").write_text(json.dumps(CASE))
        machine = {"reciprocating_mass_kg": 16.0}
        truth = CASE | {"machine": machine, "body": {"mass_kg": 450.0}}
        Path("truth.yaml").write_text(json.dumps(truth))
        (case,) = load_cases("truth.yaml")
        run = simulate(case)
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
    """Values in their intervals, these narrow; asked again nothing runs."""
    place, words, _ = fitted
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


def test_what_is_printed_is_a_case_file(fitted, monkeypatch):
    place, _, text = fitted
    monkeypatch.chdir(place)
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
    assert "its sensor's band holds no order of" in err
    Path("bare.yaml").write_text('{"load": "gas", "gas": {"switching": "exact"}}')
    again = ["bare.yaml" if word == "machine.yaml" else word for word in words]
    assert "body and sensor" in compsim(*again[:5], *again[7:], code=2).err
