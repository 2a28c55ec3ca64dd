"""Realistic mistakes on the command line: each is answered by one line that says what to do.

Click puts its usage above mistakes in the command itself. Exit code 2, nothing on stdout, no
traceback. A folder has the case files of a careless morning, a store `results` with the studies
`wear` (six jobs) and `big-end`, and this list.
"""

import json
import os
import shlex
import shutil
from pathlib import Path

import pytest
from conftest import CONFIGS, store

CASES = {
    "good.yaml": "joint: big_end\nclearance_mm: 0.2\n",
    "wear.yaml": "joint: big_end\nclearance_mm: [0.1, 0.2]\n",
    "typo.yaml": "machine: {sped_rpm: 700}\n",
    "many.yaml": "machine: {rod_mass_kg: {linspace: [1, 9, 1000000]}}\n",
    "empty.yaml": "",
    "again/wear.yaml": "load: none\n",
    "my case.yaml": "load: none\n",
}
# a command, and what its answer must contain, in this order
MISTAKES = [
    # names of files
    ("run waer.yaml", "waer.yaml: cannot be read: No such file", "compsim init"),
    ("run again", "again: cannot be read: Is a directory", "compsim run again/*.yaml"),
    ("run results/batches/BATCH.h5", "is not UTF-8 text; a case file is YAML"),
    ("run empty.yaml", "empty.yaml:1:1: is empty", "compsim init"),
    ("run wear.yaml again/wear.yaml", "would be stored under one name, wear"),
    ("run 'my case.yaml'", "name: the file's name gives none", "set name"),
    ("run *.yml", "cannot be read: No such file", "compsim init"),
    # what stands in them: tests/cases/mistakes.json has more
    ("run typo.yaml", "machine.sped_rpm: unknown key; did you mean machine.speed_rpm?"),
    ("run many.yaml", "jobs are more than 10000", "raise --max-jobs"),
    # options
    ("run good.yaml --set speed_rpm=700", "unknown key; did you mean machine.speed_rpm?"),
    ("run good.yaml -j -2", "'-j' / '--jobs'", "-2", "x>=1"),
    ("run good.yaml --set 'load=[none, spring]' --max-jobs 1",
     "--set load=[none, spring]: load: 2 jobs are more than 1: ask for fewer, or"),
    ("run good.yaml --only 'clearance_mm > 9'", "selects no job", "compsim plan"),
    *((f"run good.yaml --shard {part}", "no I/N with 1 <= I <= N, such as 2/8")
      for part in ("0/2", "3/2", "2", "a/b", "1/-2", "''")),
    ("run good.yaml -r ''", "'-r' / '--results'", "is a shell variable not set?"),
    # commands
    ("rnu good.yaml", "No such command 'rnu'"),
    ("init waer", "there is no template 'waer'; did you mean wear?"),
    ("init xyzzy", "there is no template 'xyzzy'; there are paper, machine, "),
    ("init wear -o 'my wear.yaml'", "'my wear.yaml' gives the study no name"),
    ("init wear -o good.yaml/wear.yaml", "good.yaml: is a file, where a folder is needed"),
    ("init wear", "wear.yaml exists, and is not overwritten: compsim init wear -o OTHER.yaml"),
    ("init paper -o link.yaml", "link.yaml exists, and is not overwritten: compsim init paper -o"),
    # folders of results
    ("status -r resluts", "resluts: there is no such folder of results; choose another"),
    ("plan wear.yaml --set joint=both --set joint=none", "--set joint=none: joint: is set twice"),
    ("plan wear.yaml --set machine.speed_rpm=9 --set 'machine={rod_mass_kg: 3}'", "is set twice"),
    ("run good.yaml --only ''", "an empty word"), ("run good.yaml --scheduler ''", "an empty word"),
    ("verify -r again", "again: holds no study; choose another folder"),
    ("report -o READONLY", "nothing may be written to READONLY", "another folder"),
    ("export -o READONLY/all.csv", "nothing may be written to READONLY", "another folder"),
    # studies, jobs and axes
    ("show waer clearance_mm=0.1", "holds no study 'waer'; did you mean wear?"),
    ("show wear.yaml", "did you mean wear?"),
    ("show wear", "wear is a study of 6 jobs; choose one by clearance_mm=… of 0.1, 0.2, 0.3"),
    ("show wear clearance_mm=0.1", "2 jobs of wear", "machine.rod_mass_kg=… of 3, 4.7"),
    ("show wear clearance=0.1", "wear has no axis 'clearance'; did you mean clearance_mm"),
    ("show wear clearance_mm=0.25", "no job of wear has clearance_mm=0.25; there are 0.1, 0.2"),
    ("show wear 0.1", "'0.1' is no AXIS=VALUE of wear; its axes are clearance_mm"),
    ("show ffffffff", "no job's key begins with 'ffffffff'"),
    ("show wear clearance_mm=0.1 clearance_mm=0.2", "an axis is given twice"),
    ("show wear --case --json", "--case prints a case file: leave out --json"),
    ("show wear --json --units plant", "--json has all numbers in SI", "leave out --units plant"),
    ("export gird -o x.csv", "holds no study 'gird'; it holds big-end, wear"),
    ("export wear -o k.xlsx", "k.xlsx: is no name of a CSV file; end it in .csv"),
    ("plot waer", "and no study is called so", "did you mean wear?"),
    ("plot wear --what orbit", "there is no figure 'orbit'; did you mean orbits?"),
    ("plot wear --over sped_rpm", "wear has no axis 'sped_rpm'; its axes are clearance_mm, "),
    ("identify good.csv --study wear", "good.csv: cannot be read", "time_s,acceleration_m_per_s2"),
    # questions
    ("tradeoff again/wear.yaml", "again/wear.yaml: a job of wear has no joint with clearance"),
    ("tradeoff good.yaml --set solve.methd=auto", "did you mean solve.method?"),
    ("follow good.yaml --over clearance_mm=0.1:0.2", "write KEY=LOW:HIGH:N, such as clearance_mm="),
    ("follow good.yaml --over sped_rpm=1:2:3", "--over sped_rpm=1:2:3: sped_rpm is no key of a num",
     "did you mean machine.speed_rpm?"),
    ("follow again/wear.yaml --over machine.speed_rpm=300:400:3", "again/wear.yaml: no joint has",
     "set joint and clearance_mm"),
    ("run good.yaml --scheduler tcp://a:1 -j 2", "-j counts processes here"),
    ("claims wear", "study wear has no machine with the paper's cases: compsim init claims writes"),
    ("judge waer", "did you mean wear?"),
    ("dataset wear -o faults", "write `body: true` and `sensor: {length_rev: 11}` into"),
    ("alarms wear --noise 0,loud", "'0,loud' is no list such as 0,0.1,1"),
    ("alarms wear --noise 0,-1", "noise is an rms"),
    ("dataset wear -o faults --revolutions 1", "--revolutions", "1 is not in the range x>=2"),
    ("find typo.yaml --over clearance_mm=0.01:0.3 --first 'peak_acceleration > 1'",
     "typo.yaml:1:11: machine.sped_rpm: unknown key; did you mean machine.speed_rpm?"),
    ("calibrate good.csv good.yaml --fit machine.rod_mass=3:8",
     "--fit machine.rod_mass=3:8: machine.rod_mass is no key of a number"),
    ("find good.yaml --over clearance_mm=0.1:0.3 --json --units plant", "--json has all numbers"),
]  # fmt: skip
OVER, FIRST = "--over clearance_mm=0.01:0.3", "--first 'peak_acceleration > 1'"
MISTAKES += [
    (f"find good.yaml {rest}".replace("OVER", OVER).replace("FIRST", FIRST), told)
    for rest, told in (
        ("OVER --first 'peak_accelleration > 1'", "did you mean peak_acceleration"),
        ("OVER --greatest contact_loss_fraction", "big_end|small_end"),
        ("OVER --first peak_acceleration", "is no comparison: write METRIC[.JOINT]"),
        ("OVER", "give one of --first, --greatest and --least"),
        ("--over clearance_mm=0.3:0.1 FIRST", "write the lower end first"),
        ("--over clearance_mm FIRST", "write KEY=LOW:HIGH"),
        ("--over clearance_mm=0.1:inf FIRST", "write KEY=LOW:HIGH"),
        ("--over clearance_mm=0:0.3 --log FIRST", "needs ends above 0"),
        ("--over clearence_mm=0.1:0.3 FIRST", "is no key of a number; did you mean clearance_mm?"),
        ("--over load=1:2 FIRST", "load is no continuous number: give a key"),
        ("--over solve.timeout_s=10:20 FIRST", "solve.timeout_s changes nothing"),
        ("--over clearance_mm=0.1:0.2 --set clearance_mm=0.1 FIRST",
         "--set clearance_mm: --over searches over it; leave one of the two out"),
        ("OVER FIRST --set 'load=[none, spring]'", "makes 2 jobs for one clearance_mm"),
        ("OVER FIRST --set joint=knee", "joint: needs none, big_end, small_end"),
    )
]  # fmt: skip


@pytest.fixture(scope="module")
def morning(tmp_path_factory):
    """The folder; made once, since no mistake may change it."""
    place = tmp_path_factory.mktemp("morning")
    for name, text in CASES.items():
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_text(text)
    grid = {"name": "wear", "joint": "big_end", "clearance_mm": [0.1, 0.2, 0.3],
            "machine": {"rod_mass_kg": [3, 4.7]},
            "solve": {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft"}}  # fmt: skip
    (place / "grid").write_text(json.dumps(grid))
    (big_end,) = (path for path in CONFIGS if path.stem == "big-end")
    store(place / "results", place / "grid", big_end, overrides=["solve.accuracy=draft"])
    (place / "READONLY").mkdir()
    (place / "link.yaml").symlink_to("absent")
    batch = min((place / "results" / "batches").iterdir(), key=os.path.getsize)
    shutil.copy(batch, batch.with_name("BATCH.h5"))
    return place


@pytest.mark.parametrize(("line", "parts"), [(line, parts) for line, *parts in MISTAKES])
def test_a_mistake_is_answered_by_one_line_that_says_what_to_do(
    line, parts, compsim, morning, monkeypatch
):
    monkeypatch.chdir(morning)
    real = os.access  # but that not even root may write to READONLY
    monkeypatch.setattr(os, "access", lambda *of: Path(of[0]).name != "READONLY" and real(*of))
    before = sorted(map(str, morning.rglob("*")))
    out, err = compsim(*shlex.split(line), code=2)
    assert out == ""
    *usage, line = err.splitlines()
    if usage:  # of a command that is not understood: click's own
        assert [text.split()[0] for text in usage[:2]] == ["Usage:", "Try"]
        assert (usage[2:], line[:7]) == ([""], "Error: ")
    assert "Traceback" not in err
    place = 0
    for part in parts:
        place = err.find(part, place)
        assert place >= 0, (part, err)
    assert sorted(map(str, morning.rglob("*"))) == before
