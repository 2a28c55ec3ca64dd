"""The command line: exit codes, what each screen says, and how a run ends when it is told to."""

import contextlib
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from chaos.processes import members
from compsim import screen
from conftest import SHORT, wait_for

from compressor.cases import load
from compressor.cases.load import load_cases
from compressor.program import duration
from compressor.store import reader as store
from compressor.store.studies import read_studies
from compressor.studies.tradeoff import variants


@pytest.fixture
def case_file(tmp_path, monkeypatch, in_process):
    """Writes case files into the working directory (JSON is YAML)."""
    monkeypatch.chdir(tmp_path)

    def write(name, **values):
        values["solve"] = SHORT | values.get("solve", {})
        Path(name).write_text(json.dumps(values))
        return name

    return write


def test_a_run_says_what_it_did_and_what_comes_next(case_file, compsim):
    case_file("two.yaml", load=["none", "spring"])
    case_file("one.yaml", load="gas")
    out, err = compsim("run", "two.yaml", "one.yaml", "-j", "1", "-r", "out dir")
    assert [line.split() for line in out.splitlines()] == [
        ["two", "2", "jobs", "2", "ok", "0", "failed", "out", "dir/studies/two.json"],
        ["one", "1", "job", "1", "ok", "0", "failed", "out", "dir/studies/one.json"],
    ]
    assert "3 jobs run in" in err
    assert err.endswith("next: compsim report -r 'out dir'\n")
    assert "\r" not in err
    assert read_studies("out dir")[0].command == "compsim run two.yaml one.yaml -j 1 -r 'out dir'"
    stamps = {path: path.stat().st_mtime_ns for path in Path("out dir").glob("*/*")}
    again = compsim("run", "two.yaml", "one.yaml", "-r", "out dir")
    assert again.out == out
    assert {path: path.stat().st_mtime_ns for path in Path("out dir").glob("*/*")} == stamps
    assert again.err.startswith("nothing to do: all 3 jobs are stored in out dir\n")


@pytest.mark.parametrize("quiet", [[], ["--quiet"]])
def test_failed_jobs_are_listed_with_what_to_do(quiet, case_file, compsim):
    case_file("mix.yaml", joint="both", clearance_mm=0.1, solve={"max_steps": [5, 10**6]})
    for _ in range(2):
        out, err = compsim("run", "mix.yaml", "-j", "1", *quiet, code=3)
        assert out == "mix  2 jobs  1 ok  1 failed  results/studies/mix.json\n"
        assert "1 job failed:\n  mix solve.max_steps=5: budget_steps: more than 5 steps; job" in err
        assert "budget_steps (1): raise solve.max_steps" in err
        (key,) = re.findall(r"; job ([0-9a-f]{20})$", err, re.MULTILINE)
        assert store.read_store("results").status(key).reason == "budget_steps"
        assert "--rerun failed runs failed jobs again" in err
    assert "1 job run in" in compsim("run", "mix.yaml", "-j", "1", "--rerun", "failed", code=3).err


def test_only_selected_jobs_run_and_the_study_stays_whole(case_file, compsim):
    case_file("two.yaml", load=["none", "spring"])
    case_file("one.yaml", load="gas")
    only = ["--only", "load == none"]
    assert "is given twice" in compsim("run", "two.yaml", *only, *only, code=2).err
    out, err = compsim("run", "two.yaml", "one.yaml", "-j", "1", *only)
    assert [line.split()[1:6:2] for line in out.splitlines()] == [["1", "1", "0"], ["0", "0", "0"]]
    assert err.startswith("--only selects 1 of 3 jobs\n")
    assert store.open_study("results", "two").status.values.tolist() == ["ok", "missing"]
    assert "2 jobs run in" in compsim("run", "two.yaml", "one.yaml", "-j", "1").err
    assert store.open_study("results").status.values.tolist() == ["ok"] * 3


def test_plan_tells_what_a_run_will_do_and_stores_nothing(case_file, compsim):
    case_file("two.yaml", load=["none", "spring"])
    case_file("many.yaml", joint="big_end", clearance_mm={"linspace": [0.1, 0.4, 4]},
              blocks=[{}, {"joint": "none", "output": {"keep": "metrics"}}])  # fmt: skip
    both = ["two.yaml", "many.yaml", "-j", "1"]
    found = json.loads(compsim("plan", *both, "--json").out)
    assert not Path("results").exists()
    # the ideal machine with the spring load is a job of both studies
    assert [(s["study"], s["jobs"], s["missing"]) for s in found["studies"]] == [
        ("two", 2, 2), ("many", 4, 4)
    ]  # fmt: skip
    assert (found["jobs"], found["done"], found["missing"], found["workers"]) == (6, 0, 6, 1)
    assert len(found["first"]) == 5
    assert found["first"][0]["coordinates"] == {"load": "none"}
    assert found["seconds"] > 0

    assert "6 jobs run in" in compsim("run", *both).err
    size = sum(path.stat().st_size for path in Path("results/batches").iterdir())
    assert 0.99 < found["bytes"] / size < 1.02  # rows, too
    out = compsim("plan", "many.yaml", "--set", "load=[spring, none]", "-j", "1").out.splitlines()
    assert out[0].split() == ["many", "10", "jobs", "6", "done", "4", "missing"]
    assert out[1].startswith("about ")
    assert out[2] == "missing: many clearance_mm=0.1 load=none joint=big_end"
    ideal = ["--only", "joint == none", "--set", "machine.rod_mass_kg=3"]
    out = compsim("plan", "many.yaml", *ideal).out.splitlines()
    assert [out[0].split()[1], *out[2:]] == ["1", "missing: many joint=none"]
    out = compsim("plan", "two.yaml").out
    assert out.split() == ["two", "2", "jobs", "2", "done", "0", "missing"]


def test_shards_of_several_machines_are_one_store_when_they_are_copied(case_file, compsim):
    """One of the jobs is of both studies."""
    case_file("two.yaml", load=["none", "spring"], machine={"rod_mass_kg": [4, 5, 6]})
    case_file("one.yaml", load="none", machine={"rod_mass_kg": 5})
    both, ran = ["two.yaml", "one.yaml", "-j", "1"], 0
    for number in (1, 2, 3):
        words = ["--shard", f"{number}/3", "-r", f"part-{number}"]
        ahead = json.loads(compsim("plan", *both, *words, "--json").out)["missing"]
        assert compsim("run", *both, *words, "--quiet").err == ""  # as all is well
        assert len(store.read_store(f"part-{number}")) == ahead
        ran += len(store.read_store(f"part-{number}"))
        shutil.copytree(f"part-{number}", "results", dirs_exist_ok=True)
    assert ran == 6  # no job is in two parts
    Path("results/studies/other.json").write_text("{}")  # damage of another study is no matter
    assert "nothing to do: all 6 jobs" in compsim("run", *both).err


def test_verify_finds_damage_that_a_run_mends(case_file, compsim):
    case_file("two.yaml", load=["none", "spring"])
    compsim("run", "two.yaml", "-j", "1", "--quiet")
    assert compsim("verify") == ("", "no damage\n")
    file = min(Path("results/batches").iterdir()).absolute()
    data = bytearray(file.read_bytes())
    series = store.read_store("results").values(key := load_cases("two.yaml")[0].key, ["time"])
    data[data.index(series["time"].tobytes())] ^= 4
    file.write_bytes(data)
    out, err = compsim("verify", code=5)
    problem = "is damaged, or no file of compsim's"
    assert out == f"{file}: {problem}\n  job {key}\n    in two load=none\n"
    repair = f"compsim run {os.path.abspath('two.yaml')} -r results"
    assert err == f"1 damaged file, 1 job lost\nto repair: {repair}\n"
    file.with_name(f"{file.name}.damaged").rename(file)  # which verify has set aside
    (found,) = json.loads(compsim("verify", "--json", code=5).out)
    assert (found["path"], found["problem"]) == (str(file), problem)
    assert found["studies"] == {key: {"two": {"load": "none"}}}
    compsim(*shlex.split(repair)[1:], "-j", "1", "--quiet")
    compsim("verify")


def test_the_unforeseen_is_told_with_its_traceback(case_file, compsim, monkeypatch):
    def broken(*arguments, **options):
        raise ZeroDivisionError("no reason")

    monkeypatch.setattr("compressor.cases.load_studies", broken)
    err = compsim("run", case_file("one.yaml"), code=1).err
    assert "in broken" in err
    assert err.endswith("compsim: internal error: please report it, with the lines above\n")


@pytest.mark.parametrize(
    ("say", "thing", "text"),
    [
        (duration, 9.9, "9.9 s"), (duration, 99, "99 s"), (duration, 101, "2 min"),
        (duration, 7200, "2 h 00 min"), (screen.size, 999, "999 B"), (screen.size, 1000, "1 kB"),
        (screen.point_text, {"a": 0.56 / 3, "b": "gas", "c": 700.0}, " a=0.186667 b=gas c=700"),
        (screen.size, 2_345_678, "2.35 MB"), (screen.size, 12_345_678_901, "12.35 GB"),
    ],
)  # fmt: skip
def test_durations_points_and_sizes(say, thing, text):
    assert say(thing) == text


def test_explain_tells_cost_and_what_is_paid_for(case_file, compsim):
    case_file(
        "two.yaml", joint="big_end", clearance_mm=[0.1, 0.2], machine={"gravity_m_per_s2": 1e-4}
    )
    out, err = compsim("explain", "two.yaml")
    assert out.startswith("two: 2 jobs; explained: clearance_mm = 0.2\nrtol ")
    assert max(map(len, out.splitlines())) <= 80
    flat = " ".join(out.split())
    assert "without a feature acceleration force time needed, or below 2 %: can go" in flat
    assert re.search(r"for 2 jobs with \d+ workers?,", flat)
    assert re.search(r"no gravity \S+ .* machine\.gravity_m_per_s2: 0", flat)
    assert re.search(r"no friction [+-]\S+ % [+-]\S+ % × \S+ needed", flat)
    assert err.startswith(
        "running the one of 2 jobs with the greatest clearance, as none with a known\n"
        "  force is stored of two, clearance_mm = 0.2, and with one change at a time\n"
    )


def test_tradeoff_stores_draws_and_lists(case_file, compsim, monkeypatch):
    import xarray as xr

    case_file("a.yaml", joint=["big_end", "both"], clearance_mm=0.2, solve={"duration_rev": 0.1})
    sets = ["solve.method=[auto, RODAS]", "solve.rtol=[1e-3, 1e-5]", "solve.timeout_s=600"]
    words = ["tradeoff", "a.yaml", "-r", "kept", *(w for text in sets for w in ("--set", text))]
    out = compsim(*words).out
    with xr.open_dataset("kept/tradeoff/a-tradeoff.nc", engine="h5netcdf") as study:
        assert study["scene"].values.tolist() == ["big_end", "both"]
        assert (study["status"] == "ok").all()
        error = study["error_acceleration"].sel({"scene": "both", "method": "auto"})
    decade = 10.0 ** -(next(k for k in range(1, 9) if error.values[0] > 10.0**-k) - 1)
    assert re.search(rf"^both +{decade:.0e}  auto +1e-0[35]", out, re.MULTILINE)
    assert Path("kept/tradeoff/a-tradeoff.png").read_bytes().startswith(b"\x89PNG")
    for kind in ("png", "nc"):
        assert f"kept/tradeoff/a-tradeoff.{kind}\n" in out
        assert Path(f"kept/tradeoff/a-tradeoff.{kind}").exists()
    monkeypatch.setattr("compressor.report.plots.render", lambda *_: b"")
    assert compsim(*words).out == out  # all of it was stored


def test_explain_models_prints_what_moves_metrics(case_file, compsim, monkeypatch):
    """Six numbers in doubt, and no laws and mechanisms, which compile: test_tradeoff has them."""
    few, vary = "compressor.studies.tradeoff.variants.%s", variants.vary_numbers
    monkeypatch.setattr(few % "vary_numbers", lambda *of: [*vary(*of)][:6])
    monkeypatch.setattr(few % "other_models", lambda *of: [])
    case_file("worn.yaml", joint="big_end", clearance_mm=[0.2, 0.3], solve={"duration_rev": 0.1})
    out = compsim("explain", "--models", "worn.yaml", "-r", "kept").out
    assert out.startswith("worn, clearance_mm = 0.3\n")
    assert re.search(r"^  \S+ [\d.]+ +[-+][\d.]+ %$", out, re.MULTILINE)


@pytest.mark.parametrize(("name", "code"), [("INT", 130), ("TERM", 143), ("HUP", 129)])
def test_exit_codes_of_signals_but_of_those_ignored(name, code, case_file, compsim, monkeypatch):
    """They arrive while the case files are read."""
    number, read = signal.Signals[f"SIG{name}"], load.load_studies

    def raised(*words, **more):
        signal.raise_signal(number)  # to this thread: another one may be slow to hand it over
        return read(*words, **more)

    monkeypatch.setattr("compressor.cases.load_studies", raised)
    path, former = case_file("one.yaml"), signal.signal(number, signal.SIG_DFL)
    try:
        assert compsim("run", path, code=code).err == f"interrupted by {number.name}\n"
        assert signal.getsignal(number) == signal.SIG_DFL
        signal.signal(number, signal.SIG_IGN)  # as nohup does, and a shell for what runs behind it
        assert "interrupted" not in compsim("plan", path).err
        assert signal.getsignal(number) == signal.SIG_IGN
    finally:
        signal.signal(number, former)


JOBS = 60  # more than are done when a run is told to end


def test_a_run_that_is_told_to_end(tmp_path):
    """A real one, in its own process group, with at least one job done."""
    rods = [4 + number / 1000 for number in range(JOBS)]
    values = {"joint": "both", "clearance_mm": 0.1, "machine": {"rod_mass_kg": rods}}
    solve = SHORT | {"method": "DOP853"}
    (tmp_path / "many.yaml").write_text(json.dumps(values | {"solve": solve}))
    run = subprocess.Popen(
        [sys.executable, "-m", "compsim", "run", "many.yaml", "-j", "1"],
        cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        wait_for(lambda: run.poll() is not None or [*tmp_path.glob("results/batches/*.h5")])
        os.killpg(run.pid, signal.SIGINT)  # Ctrl-C reaches the whole group
        err = run.communicate(timeout=600)[1]
        assert run.returncode == 130
        wait_for(lambda: not members(run.pid))
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
    stored = store.read_store(tmp_path / "results")
    assert 0 < len(stored) < JOBS
    assert {stored.status(key).status for key in stored.keys()} == {"ok"}  # noqa: SIM118
    goes_on = f"of {JOBS} jobs are stored in results; the same command goes on from there"
    slow = rf"(compil.+\n(  .+\n)*|\d+ of {JOBS} jobs, .+\n)*"  # told where it takes long
    machine = r"many: its machine, .+\n(  .+\n)+"
    assert re.fullmatch(rf"{machine}{slow}at least \d+ {goes_on}\ninterrupted by SIGINT\n", err)


def test_a_run_says_what_the_file_means_and_what_is_odd_about_it(case_file, compsim):
    """In plan, too; --quiet leaves out the numbers, and no warning; so does explain."""
    halved = {"stroke_mm": 120, "rod_length_mm": 600}  # R / L = 0.1
    case_file("m.yaml", load="gas", machine=halved, gas={"switching": "exact"})
    warning = "m.yaml: warning: machine.stroke_mm: rod: crank ratio 0.1, where at least 0.12 is"
    for words in (["plan"], ["run", "-r", "a"], ["run", "-r", "b", "--quiet"], ["explain"]):
        err = compsim(words[0], "m.yaml", *words[1:]).err
        assert err.startswith(warning), words
        assert ("piston     mean speed 2 m/s" in err) == (words in (["plan"], ["run", "-r", "a"]))
    assert "mean speed" not in compsim("run", "m.yaml", "-r", "a").err  # nothing to do
    found = json.loads(compsim("plan", "m.yaml", "-r", "a", "--json").out)
    numbers = found["machines"]["m"]["numbers"]
    (speed,) = (one for one in numbers if one["name"] == "piston, mean speed")
    assert (speed["low"], speed["unit"], speed["usual_low"]) == (2.0, "m/s", 0.5)
