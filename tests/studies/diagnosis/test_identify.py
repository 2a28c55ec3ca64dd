"""`compsim identify`: what it prints of files and jobs, and what it refuses."""

import json

import numpy as np
import pytest
from conftest import WORN_JOBS, struck
from scipy.io import wavfile

from compressor.store.reader import read_store
from compressor.studies.diagnosis import identify
from compressor.studies.diagnosis.features import features
from compressor.vibration import Record

STUDY = ("--study", "worn", "--quiet")


@pytest.fixture(scope="module")
def learned(worn_store):
    library = identify.read_library(worn_store, "worn")
    return library, identify.Identifier.fit(library)


@pytest.fixture(autouse=True)
def once_learned(request, monkeypatch):
    """What records of files are explained by is the same each time, and learned once."""
    if "mistakes" in request.node.name:
        return
    library, fitted = request.getfixturevalue("learned")
    fit = identify.Identifier.fit
    monkeypatch.setattr(identify, "read_library", lambda *_: library)
    monkeypatch.setattr(
        identify.Identifier, "fit",
        lambda jobs: fitted if len(jobs.keys) == len(library.keys) else fit(jobs),
    )  # fmt: skip


def written(path, times, values, tacho, wave=True):
    turn = tacho[1] - tacho[0]
    mark = (((times - tacho[0]) / turn + 0.5 / turn / 8000) % 1 < 0.1).astype(int)
    header = "time_s,acceleration_m_per_s2" + ",tacho" * wave
    columns = [times, values, mark][: 2 + wave]
    np.savetxt(path, np.column_stack(columns), "%.9g", ",", header=header, comments="")
    return str(path)


@pytest.fixture
def record(tmp_path):
    times, values, tacho = struck("small_end", [0.2], 5001)
    return written(tmp_path / "record.csv", times + 0.01, values, tacho + 0.01)


def test_a_library_holds_joints_clearances_features_and_what_else_is_swept(learned):
    library, _ = learned
    assert (len(library.keys), library.jobs) == (WORN_JOBS, WORN_JOBS)
    assert library.joints[:4].tolist() == ["none", "big_end", "small_end", "both"]
    assert (library.clearances[:4] > 0).tolist() == [[0, 0], [1, 0], [0, 1], [1, 1]]
    assert library.swept == ["machine.rod_mass_kg"]
    assert len({*library.machines.tolist()}) == WORN_JOBS
    ends = [c for c in library.clearances[7].tolist() if c]
    expected = features(Record(*struck(library.joints[7], ends, 7), 0.0))
    np.testing.assert_allclose(library.features[7], list(expected.values()), rtol=1e-9)


def test_a_record_is_explained(record, worn_store, compsim):
    out = compsim("identify", record, *STUDY, "-r", worn_store).out
    first, head, best, *_, last, _ = out.splitlines()
    assert first.startswith(f"{record}: ")
    assert "revolutions at 500 rpm, 8000 Hz" in first
    assert head.split()[:3] == ["rank", "joint", "probability"]
    rank, joint, chance, side, median, low, high = best.replace("[", " ").split()
    assert (rank, joint, side) == ("1", "small_end", "small_end")
    assert float(chance) > 0.8
    assert float(low.strip(",")) < float(median) < float(high.strip("]"))
    assert abs(float(median) - 0.2) < 0.06
    assert last.split() == ["varied", "machine.rod_mass_kg"]


def test_an_exported_job_is_explained_as_the_job_itself(tmp_path, worn_store, compsim):
    key, path = sorted(read_store(worn_store).keys())[5], str(tmp_path / "job.csv")
    compsim("export", key, "-r", worn_store, "-o", path)
    answers = []
    for record in (key, path):
        found = json.loads(compsim("identify", record, *STUDY, "-r", worn_store, "--json").out)
        answers.append({one["joint"]: one["probability"] for one in found["candidates"]})
    assert answers[1] == pytest.approx(answers[0], abs=0.05)  # by itself it is left out
    assert max(answers[1], key=answers[1].get) == max(answers[0], key=answers[0].get)


def test_what_a_file_does_not_say_options_do(tmp_path, worn_store, compsim):
    """The same record as whole numbers of WAV, in g, its tacho a quarter of a turn late."""
    times, values, tacho = struck("big_end", [0.3], 5002)
    as_csv = written(tmp_path / "bare.csv", times, values, tacho, wave=False)
    turns = (times - tacho[0]) / (tacho[1] - tacho[0])
    full, late = np.abs(values).max(), np.sin(2 * np.pi * (turns - 0.25))
    both = np.stack([late, values / full], axis=1)
    wavfile.write(tmp_path / "record.wav", 8000, np.round(both * (2**31 - 1)).astype(np.int32))
    hints = ["--channel", "2", "--unit", "g", "--full-scale", str(full / 9.80665), "--tacho", "1",
             "--tacho-deg", "90"]  # fmt: skip
    chances, steady = [], ["--rpm", "500", "--tdc", "0"]
    for words in ([as_csv, *steady], [str(tmp_path / "record.wav"), *hints]):
        found = json.loads(compsim("identify", *words, *STUDY, "-r", worn_store, "--json").out)
        best = found["candidates"][0]
        chances.append(best["probability"])
        assert best["joint"] == "big_end"
    assert chances[1] == pytest.approx(chances[0], abs=0.01)


def test_what_does_not_fit_is_said_first(tmp_path, worn_store, compsim):
    times, values, tacho = struck("none", [], 5003)
    values += 30 * np.sin(2 * np.pi * 300 * times)
    path = written(tmp_path / "hum.csv", times, values, tacho)
    lines = compsim("identify", path, *STUDY, "-r", worn_store).out.splitlines()
    assert lines[1].startswith("NOTHING IN THIS STUDY FITS: ")
    assert lines[2].startswith("compare noise (sensor.noise_m_per_s2), unit (g read as m/s2 is")


def test_without_scikit_learn_it_says_how_to_get_it(record, worn_store, compsim, monkeypatch):
    monkeypatch.setattr("compsim.identify.find_spec", lambda name: None)
    err = compsim("identify", record, *STUDY, "-r", worn_store, code=2).err
    assert "needs scikit-learn: pip install 'compsim[learn]'" in err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("RECORD --study torn", "holds no study 'torn'"),
        ("RECORD --study worn --rpm 500", "--rpm and --tdc belong together"),
        ("RECORD --study worn --rpm 500 --tdc 0", "has a tacho column"),
        ("abcdef --study worn --rpm 1 --tdc 0",
         "a stored job such as abcdef says all of its record; leave --rpm --tdc out"),
        ("RECORD --study worn --channel room", "--channel room: no channel of"),
    ],
)  # fmt: skip
def test_mistakes_are_named(words, told, record, worn_store, compsim):
    words = [record if word == "RECORD" else word for word in words.split()]
    assert told in compsim("identify", *words, "-r", worn_store, code=2).err
