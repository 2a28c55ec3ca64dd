"""`compsim plot`: files and captions of jobs and studies, and what is said where there is none."""

import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from compsim import cli
from conftest import damage_series, store_cases

from compressor.analysis.shaking import frame_forces
from compressor.metrics import JOINTS
from compressor.report.figures import FIGURES
from compressor.report.figures.table import spell
from compressor.report.plots import job_title, select_jobs
from compressor.store.reader import read_store
from compressor.store.studies import read_studies

SOLVE = {"duration_rev": 3, "settle_rev": 1, "accuracy": "draft", "output_step_deg": 0.5,
         "error_bars": False}  # fmt: skip
CASES = {
    "worn": {"joint": "big_end", "clearance_mm": [0.1, 0.3], "friction": False,
             "contact": {"damping_N_s_per_mm": 100},
             "machine": {"speed_rpm": [400, 500], "rod_mass_kg": 1}},
    "ideal": {"load": "gas"},
    "halted": {"joint": "big_end", "clearance_mm": 0.1, "solve": {"max_steps": 100}},
    "bare": {"joint": "big_end", "clearance_mm": 0.1, "output": {"keep": "metrics"}},
    "short": {"joint": "big_end", "clearance_mm": 0.15,
              "solve": {"duration_rev": 0.4, "settle_rev": 0}},
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A store of short studies, one of them failed, one without series, one not run."""
    home = tmp_path_factory.mktemp("plots")
    store_cases(home, **{name: {**values, "solve": SOLVE | values.get("solve", {})}
                         for name, values in CASES.items()})  # fmt: skip
    return home / "results"


@pytest.fixture
def plot(folder, tmp_path, monkeypatch, capsys):
    """Runs the command; gives code, the captions by file's name, stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        code = cli.main(["plot", *words, "-r", str(folder)])
        out, err = capsys.readouterr()
        lines = out.splitlines()
        paths, captions = lines[::2], [line.strip() for line in lines[1::2]]
        for path in paths:
            assert Path(path).read_bytes()[:5] == b"\x89PNG\r"
        return code, dict(zip(paths, captions, strict=True)), err

    return run


def key(folder, name, place=0):
    return {study.name: study for study in read_studies(folder)}[name].keys[place]


@pytest.fixture
def unpainted(monkeypatch):
    """No pixels are made, which takes long: files have their first bytes."""
    monkeypatch.setattr("compressor.report.plots.render", lambda *_: b"\x89PNG\r")


def job(folder, name, place=0):
    return read_store(folder).job(key(folder, name, place))


def test_ideal_joints_have_cards_and_no_contacts_to_draw(plot, folder, unpainted):
    """The power of the gas is the work that the piston force takes, over the time."""
    mine = key(folder, "ideal")
    code, found, err = plot(mine)
    assert (code, err) == (0, "")
    drawn = [name.rpartition("-")[2] for name in found]
    assert drawn == ["analyst.png", "signals.png", "cards.png", "spectra.png"]
    (cards,) = plot("ideal", "--what", "cards")[1].items()  # its one job is named by it
    assert cards in found.items()
    power = -float(job(folder, "ideal")["load_work"]) / 0.36e3
    said = float(re.search(r"Indicated power, head end: ([\d.]+) kW", cards[1])[1])
    assert said == pytest.approx(power, rel=5e-3)
    assert len(plot("ideal")[1]) == 2  # of the study


def test_a_job_is_drawn_with_its_numbers(plot, folder, unpainted):
    mine = key(folder, "worn", 3)
    code, found, err = plot("worn", "clearance_mm=0.3", "machine.speed_rpm=500")
    assert (code, err) == (0, "")
    drawn = [name for name in FIGURES["job"] if name != "cards"]  # there is no gas
    assert [*found] == [f"plots/{mine[:10]}-{name}.png" for name in drawn]
    run = job(folder, "worn", 3)
    analyst, signals, spectra, orbits = found.values()
    force, last = frame_forces(run), slice(2 * 720, None)
    x = force["shaking_force"][last, 0] / 1e3
    assert f"along the cylinder: {spell(x.min())} to {spell(x.max())} kN" in signals
    assert f"Greatest acceleration: {spell(peak(run, last))} m/s²" in analyst
    torque = force["crank_torque"][last]
    assert f"drives the crank: {spell(torque.min())} to {spell(torque.max())} N m" in signals
    assert "drives the crank, without clearance: " in signals
    lines = np.fft.rfft(force["shaking_force"][720:2160, 0]) / 1440
    above = np.sqrt(2 * (np.abs(lines[25:]) ** 2).sum())
    told = float(re.search(r"above order 12: ([\d.]+) N; without clearance: 0 N", spectra)[1])
    assert told == pytest.approx(above, rel=0.01)
    assert f"gap: {spell(1e6 * run['penetration'].values[last, 0].max())} µm" in orbits
    off = (run["penetration"].values[last, 0] < 0).mean()
    assert f"off its wall: {spell(100 * off, '%')} of the time" in orbits


def peak(run, last):
    return np.abs(run["acceleration"].values[last]).max()


def test_a_job_is_titled_by_its_run_and_not_by_a_search(folder):
    run = next(study for study in read_studies(folder) if study.name == "worn")
    search = replace(run, name="a-search", command="compsim find worn.yaml")
    assert job_title([search, run], run.keys[0], "orbits").startswith("worn: orbits")


def test_a_study_is_drawn_along_an_axis(plot, folder, unpainted):
    code, found, _ = plot("worn", "--over", "speed_rpm", "--at", "clearance_mm=0.3")
    assert code == 0
    cycles, waterfall = found.values()
    assert [*found] == [f"plots/worn-{name}.png" for name in ("cycles", "waterfall")]
    peaks = {speed: peak(job(folder, "worn", place), slice(1440, None))
             for speed, place in ((400, 2), (500, 3))}  # fmt: skip
    least, greatest = sorted(peaks, key=peaks.get)
    ends = [f"{spell(peaks[speed])} m/s² at {speed}" for speed in (least, greatest)]
    assert f"least {ends[0]}, greatest {ends[1]}" in cycles
    assert f"{spell(peaks[greatest] / 9.80665)} g" in cycles
    assert "each value of speed (rpm)" in waterfall
    assert "Here clearance_mm 0.3." in waterfall
    assert re.search(r"least \S+ N at (400|500), greatest \S+ N at (400|500)", waterfall)
    _, default = plot("worn")[1].values()
    assert "each value of clearance (mm)" in default
    assert "Here machine.speed_rpm 400." in default


def test_rows_name_both_clearances_and_words():
    """Rows by one clearance alone showed the other's effect, or a law's, as if it were its own."""
    sizes = [0.3, None, 0.1], [0.05, None, 0.35]  # the job in the middle has ideal joints
    axes = [SimpleNamespace(key=f"clearance_mm.{joint}", values=values)
            for joint, values in zip(JOINTS, sizes, strict=True)]  # fmt: skip
    axes.append(SimpleNamespace(key="contact.law", values=["impact", None, "hertz"]))
    study = SimpleNamespace(name="two", axes=axes, keys=["a", "i", "b"], jobs=3, is_grid=False)
    jobs, title, where = select_jobs("", study, axes[0].key, (), 5)
    assert jobs == [(" /  / ", "i"), ("0.1 / 0.35 / hertz", "b"), ("0.3 / 0.05 / impact", "a")]
    assert title == "clearance, big end (mm) / clearance, small end (mm) / law"
    varied = f"{axes[1].key}, {axes[2].key} vary with it"
    assert where == [f"in the order of {axes[0].key}; {varied}"]


def test_a_damaged_job_is_a_row_without_series(folder, tmp_path, compsim, unpainted):
    """It ended the plot of its study."""
    home = shutil.copytree(folder, tmp_path / "results")
    damage_series(home, key(home, "worn", 0))
    words = ["plot", "worn", "--what", "waterfall", "-r", home, "-o", tmp_path / "out"]
    assert "Not drawn: 1 of 2 jobs (damaged)." in compsim(*words).out
    damage_series(home, key(home, "worn", 2))
    told = " ".join(compsim(*words, code=2).err.split())
    assert f"can be drawn: damaged: compsim verify -r {home} names the file" in told


@pytest.mark.parametrize(
    ("words", "told"),
    [  # KEY-x stands for the key of a job of study x
        ("worn clearance_mm=0.3", "2 jobs of worn have clearance_mm=0.3; choose one"),
        ("worn --what orbits", "worn is a study: for orbits name a job, such as"),
        ("worn --what noise", "there is no figure 'noise'; there are analyst"),
        ("worn --at speed_rpm=450", "no job of worn has machine.speed_rpm=450; there are 400"),
        ("worn --at clearance_mm=0.1", "needs key=value of an axis other than"),
        ("worn --at speed_rpm=400 --at speed_rpm=500", "machine.speed_rpm is given twice"),
        ("bare", "no job of bare can be drawn: no series: run it again with --set output.keep"),
        ("short", "too short: run it with a longer solve.duration_rev"),
        ("KEY-halted", "failed: budget_steps"),
        ("KEY-bare", "kept no time series: run it again"),
        ("KEY-short", "no whole settled revolution"),
        ("KEY-worn --over clearance_mm", "--over and --at are for studies"),
        ("KEY-worn --what cycles", "has no figure 'cycles'"),
        ("KEY-worn --what cards", "has no gas in its cylinder: cards are of load: gas"),
        ("KEY-ideal --what orbits", "ideal joints"),
    ],
)
def test_what_cannot_be_drawn_is_told(plot, folder, words, told):
    named = re.sub(r"KEY-(\w+)", lambda found: key(folder, found[1]), words)
    code, found, err = plot(*named.split())
    assert (code, found) == (2, {})
    assert told in " ".join(err.split())
