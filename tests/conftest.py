"""Fixtures that several test modules share; what is slow is made once for all test processes."""

import base64
import contextlib
import fcntl
import json
import os
import shutil
import signal
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

from compsim.screen import one_thread_each

one_thread_each()  # before numpy loads: as the commands do, so that sums are theirs to the bit
import h5py
import hypothesis
import numpy as np
import pytest
from compsim import cli

from compressor.analysis.runs import paper_cases
from compressor.cases.case import Case
from compressor.cases.load import CaseFileError, load_studies
from compressor.metrics import NUMBERS, SIZES
from compressor.outcome import ROW, Outcome
from compressor.physics._jit import ENABLED
from compressor.solve.simulate import simulate
from compressor.store.batch import encode_batch, make_batches, publish_batch
from compressor.store.stored import read_store
from compressor.store.studies import read_studies, write_study
from compressor.sweep.warm_up import Part, compile_once
from compressor.sweep.worker import End

# nohup ignores SIGHUP, and a shell SIGINT of what it runs behind: tests that send them, and the
# commands that they start, are to get them
for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
    if signal.getsignal(number) == signal.SIG_IGN:
        usual = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        signal.signal(number, usual)
hypothesis.settings.register_profile("untimed", deadline=None)  # other work shares the machine
hypothesis.settings.load_profile("untimed")

CHAOTIC = {  # light, fast and without damping: it can be foretold for half a revolution
    "joint": "big_end",
    "clearance_mm": 0.3,
    "machine": {"rod_mass_kg": 1, "speed_rpm": 1000},
    "contact": {"damping_N_s_per_mm": 0},
}
CONFIGS = sorted((Path(__file__).parent.parent / "configs").glob("*.yaml"))


LONG = ("test_newcomer", "test_pages", "test_cluster", "test_pool", "test_tutorial")
PARTS = ("plain", "laws", "features")  # of the equations: the first two take as long as the last


def pytest_configure(config):
    """All tests of a module run in one process, since they share what they make."""
    if getattr(config.option, "dist", "no") == "load":  # which -n alone asks for
        config.option.dist, config.option.loadscopereorder = "loadfile", False


def pytest_collection_modifyitems(items):
    """Begin with the longest modules: at the end one process would wait for the other."""
    items.sort(key=lambda item: item.path.stem not in LONG)


@pytest.fixture(scope="session")
def base(tmp_path_factory):
    """The folder that all processes of a session share."""
    own = tmp_path_factory.getbasetemp()
    return own.parent if "PYTEST_XDIST_WORKER" in os.environ else own


@contextlib.contextmanager
def locked(path):
    """One process at a time is inside."""
    with open(path, "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@pytest.fixture(scope="session", autouse=True)
def equations(base):
    """Two processes compile the parts of the equations from both ends, and all wait.

    Else two would compile the same at once. A single process compiles what its tests need.
    """
    if int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")) > 1 and ENABLED:
        number = int(os.environ["PYTEST_XDIST_WORKER"].removeprefix("gw"))
        for part in PARTS if number % 2 == 0 else PARTS[::-1]:
            with locked(base / f"{part}.lock"):
                compile_once([Part(part)], lambda remark: None)


@pytest.fixture(scope="session")
def once(base):
    """Fill a folder once a session, whichever process comes first: once(name, fill) -> folder."""

    def made(name, fill):
        with locked(base / f"{name}.lock"):
            if not (base / f"{name}.done").exists():
                fill(base / name)
                (base / f"{name}.done").touch()
        return base / name

    return made


@pytest.fixture
def two_cores(monkeypatch):
    """A copy of the process may work beside it, whatever idle threads other tests have left."""
    monkeypatch.setattr(threading, "active_count", lambda: 1)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 1}, raising=False)


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Read the text of a case file, whose name in messages is case.yaml, as a study."""
    monkeypatch.chdir(tmp_path)

    def read(text, *overrides, **more):
        (tmp_path / "case.yaml").write_text(text, encoding="utf-8")
        (study,) = load_studies("case.yaml", **{"overrides": overrides, **more})
        return study

    return read


SHORT = {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}


@pytest.fixture
def studies(tmp_path):
    """Makes the studies of short jobs from values by name, lists being swept (JSON is YAML)."""

    def make(**values):
        short = {name: {**content, "solve": SHORT | content.get("solve", {})}
                 for name, content in values.items()}  # fmt: skip
        return load_studies(*write_cases(tmp_path, **short))

    return make


@pytest.fixture
def compsim(capsys):
    """Run a command, which ends with `code`, and return what it printed: `out` and `err`."""

    def run(*words, code=0):
        capsys.readouterr()
        assert cli.main([*map(str, words)]) == code
        return capsys.readouterr()

    return run


def refused(read, text, *overrides, **more):
    """What is said of the text of a case file that cannot be read, a line each."""
    with pytest.raises(CaseFileError) as caught:
        read(text, *overrides, **more)
    return str(caught.value).split("\n")


def outcome_of(dataset):
    """The outcome of a job's Dataset, whatever it holds."""
    numbers = np.full(1, np.nan, ROW)[0]
    for name in NUMBERS:
        if name in dataset:
            numbers[name] = dataset[name].values
    texts = (str(dataset[name].values) for name in ("status", "reason"))
    found = Outcome(*texts, numbers, dict(dataset.attrs))
    if "time" not in dataset.dims:
        return found
    series = {
        name: (item.dims, item.values, item.attrs)
        for name, item in dataset.variables.items()
        if item.dtype.kind == "f" and item.dims and name not in NUMBERS and name not in SIZES
    }
    return found.with_series(series, Case.from_attribute(dataset.attrs["case"]).output.precision)


def write_batch(folder, outcomes):
    """Store outcomes as a batch, in a folder that is made; return its path."""
    make_batches(folder)
    return publish_batch(folder, encode_batch(outcomes))


def keep(folder, *datasets):
    """Store jobs as they are, whatever they hold, as a sweep would."""
    for dataset in datasets:
        write_batch(folder, [outcome_of(dataset)])


def wait_for(condition, seconds=600.0):
    """Wait until something holds, which may take long on a busy machine, or fail."""
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert condition()


def flip(path, values):
    """Flip a bit of the first of some values in a file; return what it held."""
    whole = path.read_bytes()
    data = bytearray(whole)
    data[data.index(values.tobytes())] ^= 1
    path.write_bytes(data)
    return whole


def damage_series(folder, key):
    """Flip a bit in each time series of a stored job; return its batch."""
    stored = read_store(folder)
    path, row = stored.batch_of(stored.position(key))
    with h5py.File(path) as file:
        places = [
            data.id.get_chunk_info_by_coord((row, *(0 for _ in data.shape[1:]))).byte_offset
            for data in file.values()
            if data.chunks and data.ndim > 1 and data.chunks[0] == 1
        ]
    content = bytearray(path.read_bytes())
    for place in places:
        content[place + 100] ^= 1
    path.write_bytes(content)
    return path


def store(folder, *paths, overrides=()):
    """Simulate the studies of case files into a store, as a sweep would; returns the studies."""
    studies = load_studies(*paths, overrides=overrides)
    for study in studies:
        write_study(folder, study, "compsim run")
        stored = read_store(folder).keys()
        new = [case for case in study.cases if case.key not in stored]
        if new:
            write_batch(folder, [outcome_of(simulate(case)) for case in new])
    return studies


def write_cases(folder, **studies):
    """Write case files of values by the names of studies (JSON is YAML); returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.yaml" for name in studies]
    for path, values in zip(paths, studies.values(), strict=True):
        path.write_text(json.dumps(values), encoding="utf-8")
    return paths


def store_cases(folder, **studies):
    """Simulate studies of values by name into `results` of a folder; returns the studies."""
    return store(folder / "results", *write_cases(folder, **studies))


def part_of(whole, folder, *names):
    """Make a store with some of a store's studies, by name; returns its folder."""
    stored = read_store(whole)
    (folder / "studies").mkdir(parents=True, exist_ok=True)
    for study in read_studies(whole):
        if study.name in names:
            shutil.copy(whole / "studies" / f"{study.name}.json", folder / "studies")
            write_batch(folder, [outcome_of(stored.job(key)) for key in study.keys])
    return folder


@pytest.fixture(scope="session")
def paper_store(once):
    """A results folder with the paper's eleven cases at draft accuracy."""
    return once("paper", lambda folder: store(folder, *CONFIGS, overrides=["solve.accuracy=draft"]))


@pytest.fixture(scope="session")
def paper_runs(paper_store):
    """The paper's eleven runs by label, at draft accuracy."""
    labels = {case.physics_key: label for label, case in paper_cases().items()}
    stored = read_store(paper_store)
    runs = [stored.job(key) for key in sorted(stored.keys())]
    return {labels[run.attrs["physics_key"]]: run for run in runs}


WORN_SENSOR = {"length_rev": 11, "rate_Hz": 6400, "mounting_Hz": 6000, "speed_jitter": 0.002}
WORN = {
    "name": "worn",
    "body": {"frequency_x_Hz": 30, "frequency_y_Hz": 30},
    "sensor": WORN_SENSOR,
    "machine": {"speed_rpm": [400, 600]},
    "solve": {"duration_rev": 3, "settle_rev": 1, "output_step_deg": 3.6, "accuracy": "draft"},
    "blocks": [
        {"joint": "none"},
        {"joint": "big_end", "clearance_mm": [0.1, 0.2, 0.4]},
        {"joint": "big_end", "clearance_mm": 0.3, "solve": {"max_steps": 1}},  # fails
        {"joint": "both", "clearance_mm": {"big_end": 0.1, "small_end": 0.3}},
        {"joint": "big_end", "clearance_mm": 0.2, "sensor": {"length_rev": 3}},  # too short
    ],
}
DEAF = {"name": "deaf", "joint": "big_end", "clearance_mm": 0.1, "solve": WORN["solve"]}


@pytest.fixture(scope="session")
def worn(once):
    """A folder with the studies `worn`, of seven cases at two speeds each, and `deaf`."""
    return once("worn", lambda folder: store_cases(folder, worn=WORN, deaf=DEAF)) / "results"


STRUCK = {"none": (), "big_end": (90,), "small_end": (330,), "both": (90, 330)}  # degrees
WORN_JOBS = 208
TURN = 0.12  # s


def struck(joint, clearances, seed):
    """A made-up record: a sine, noise, and a ringing as high as its clearance where a joint hits.

    Times, values and pulses of four revolutions.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(round(4.05 * TURN * 8000)) / 8000
    values = np.sin(2 * np.pi * times / TURN) + rng.normal(0, 0.05, times.size)
    for degrees, clearance in zip(STRUCK[joint], clearances, strict=True):
        since = (times - TURN * degrees / 360) % TURN
        values += 40 * clearance * np.exp(-since / 0.004) * np.sin(2 * np.pi * 2000 * since)
    return times, values, TURN * np.arange(5)


def store_worn(folder):
    """A study `worn` of made-up records, without simulating more than one of its cases."""
    rng = np.random.default_rng(9)
    joints = [list(STRUCK)[number % len(STRUCK)] for number in range(WORN_JOBS)]
    drawn = (0.05 * 10 ** rng.random((WORN_JOBS, 2))).round(5).tolist()
    ends = {
        side: [
            c[k] if joint in (side, "both") else 0 for joint, c in zip(joints, drawn, strict=True)
        ]
        for k, side in enumerate(("big_end", "small_end"))
    }
    rods = rng.uniform(2, 8, WORN_JOBS).round(4).tolist()
    together = ["joint", *(f"clearance_mm.{side}" for side in ends), "machine.rod_mass_kg"]
    values = {
        "joint": joints, "clearance_mm": ends, "machine": {"rod_mass_kg": rods},
        "zip": [together], "body": True, "sensor": True,
        "solve": {"duration_rev": 1, "settle_rev": 0, "accuracy": "draft", "error_bars": False},
    }  # fmt: skip
    (study,) = load_studies(*write_cases(folder, worn=values))
    write_study(folder, study, "compsim run")
    case = study.cases[0]
    plain = replace(case, body=None, sensor=None)
    run, jobs = simulate(plain)[["status", "reason", "crank_angle"]], []
    for number, case in enumerate(study.cases):
        sides = [getattr(case.clearance_mm, side) for side in ends]
        times, values, tacho = struck(case.joint, [c for c in sides if c], number)
        heard = {"sensor_time": ("sensor_time", times), "tacho_time": ("pulse", tacho),
                 "sensor_acceleration": ("sensor_time", values)}  # fmt: skip
        jobs.append(outcome_of(run.assign(heard).assign_attrs(case.attributes())))
    write_batch(folder, jobs)


@pytest.fixture(scope="session")
def worn_store(once):
    """A results folder with the study `worn`, which `identify` can read."""
    return once("struck", store_worn)


def assert_same_bits(one, other):
    """Assert that two Datasets are equal, floats to the bit."""
    assert one.identical(other)
    for name in one.variables:
        a, b = one[name].values, other[name].values
        assert a.dtype == b.dtype, name
        assert a.dtype.kind != "f" or a.tobytes() == b.tobytes(), name


@contextlib.contextmanager
def jobs_here():
    """Jobs of sweeps and studies run in this process, one after the other: no worker starts."""

    def run_batches(work, jobs, workers, store=None):
        done, jobs = 0, [*jobs]
        while some := jobs[done : 2 * done if done > 7 else done + 1]:  # in few files if many
            found = (store or list)([work(payload) for _, payload, _ in some])
            yield from (End(job[0], one, 0.01) for job, one in zip(some, found, strict=True))
            done += len(some)

    with pytest.MonkeyPatch.context() as patch:
        module = sys.modules["compressor.sweep.sweep"]
        patch.setattr(module, "run_batches", run_batches)
        patch.setattr(module, "REPORT_SECONDS", 0.0)  # progress is told of each job
        yield


@contextlib.contextmanager
def without_pictures():
    """Reports have all but their pictures, of which each takes a quarter of a second."""
    from compressor.report import plots
    from compressor.report.figures import pictures

    with pytest.MonkeyPatch.context() as patch:
        for module in (pictures, plots):
            patch.setattr(module, "render", lambda *drawing: b"drawn")
        yield


@pytest.fixture
def in_process():
    """No worker starts in a test: where it matters how processes end, a test does without this."""
    with jobs_here():
        yield


def decoded(packed):
    """The numbers of an array as plotly's JSON has it."""
    shape = [int(part) for part in packed.get("shape", "-1").split(",")]
    return np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"]).reshape(shape)


def listed(figure):
    """The names in a figure's legend, in its order."""
    named = [trace for trace in figure.data if trace.showlegend]
    return [trace.name for trace in named]
