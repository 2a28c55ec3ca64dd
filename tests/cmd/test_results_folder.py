"""Where results are looked for: the first argument or -i, in every command; and completion."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.shell_completion import BashComplete
from compsim import cli
from compsim.results import one_word, results_folder


@pytest.fixture
def here(paper_store, tmp_path, monkeypatch):
    """A working directory with the paper's cases in `results`, and in `wear`, too."""
    monkeypatch.chdir(tmp_path)
    shutil.copytree(paper_store, "results")
    shutil.copytree(paper_store, "wear")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "option", "named", "folder", "rest"),
    [
        ([], None, True, "results", []),
        ([], "wear", True, "wear", []),
        (["wear"], None, False, "wear", []),
        (["absent"], None, False, "absent", []),
        (["wear"], "./wear", False, "wear", []),
        (["big-end"], None, True, "results", ["big-end"]),
        (["big-end"], "wear", True, "wear", ["big-end"]),
        (["wear", "big-end", "a=1"], None, True, "wear", ["big-end", "a=1"]),
        (["absent/", "big-end"], None, True, "absent/", ["big-end"]),
        (["wear", "big-end"], "wear", True, "wear", ["big-end"]),
        (["both/", "x"], None, True, "both/", ["x"]),
        (["both", "x"], "results", True, "results", ["both", "x"]),
        (["reg"], "reg", True, "reg", ["reg"]),
        (["reg"], "./reg", True, "./reg", ["reg"]),
    ],
)
def test_the_folder_is_the_first_word_or_an_option(words, option, named, folder, rest, here):
    Path("both").mkdir()  # also a study's name
    Path("reg/regimes/reg").mkdir(parents=True)
    Path("reg/regimes/reg/study.json").touch()
    assert results_folder(words, option, named) == (folder, tuple(rest))


@pytest.mark.parametrize(
    ("words", "option", "named", "told"),
    [
        (["wear"], "results", False, "two folders of results are given, 'wear' and -i 'results'"),
        (["wear", "x"], "results", True, "leave one out"),
        (["wear", "results"], None, False, "takes one folder of results, not 2: 'wear', 'results'"),
        (["both"], None, True, "'both' is a folder, and a study in results: write both/ for"),
    ],
)
def test_what_is_not_clear_is_refused(words, option, named, told, here):
    Path("both").mkdir()
    with pytest.raises(click.UsageError, match=told):
        results_folder(words, option, named)


def test_one_word_is_one(here):
    assert one_word(["a"], "STUDY") == "a"
    with pytest.raises(click.UsageError, match="Missing argument 'STUDY'"):
        one_word([], "STUDY")
    with pytest.raises(click.UsageError, match="takes one STUDY, not 2: a, b"):
        one_word(["a", "b"], "STUDY")


@pytest.mark.parametrize(
    "command",
    [
        ["status"],
        ["verify"],
        ["show", "big-end", "clearance_mm=0.1"],
        ["export", "big-end", "-o", "made/", "--force"],
    ],
)
def test_every_command_takes_the_folder_in_both_ways(command, here, capsys):
    shutil.move("results", "elsewhere")  # so that nothing is found by default
    verb, *words = command
    assert cli.main([verb, "wear", *words]) == 0
    by_argument = capsys.readouterr()
    assert cli.main([verb, *words, "-i", "wear"]) == 0
    assert capsys.readouterr() == by_argument
    assert cli.main([verb, *words]) == 2
    assert "results: there is no such folder of results; there are" in capsys.readouterr().err


def test_report_takes_it_and_tries_its_own_folder_first(here, capsys, monkeypatch):
    made = []
    monkeypatch.setattr("compressor.report.write_report", lambda *a: made.append(a[0]) or "page")
    assert cli.main(["report", "wear", "-o", "page"]) == 0
    assert made == ["wear"]
    monkeypatch.setattr("os.access", lambda path, mode: Path(path).absolute() != here)
    assert cli.main(["report", "wear", "-o", "page"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("compsim: page: nothing may be written to .; get the permission")
    assert made == ["wear"]


# ---- what a shell completes -----------------------------------------------------------------


@pytest.fixture
def complete(here, monkeypatch):
    """What bash is offered for the last of some words."""

    def run(*words):
        monkeypatch.setenv("COMP_WORDS", " ".join(["compsim", *words]))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        offered = BashComplete(cli.cli, {}, "compsim", "_COMPSIM_COMPLETE").complete()
        return [line.split(",", 1)[1] for line in offered.splitlines()]

    return run


def test_studies_keys_and_values_are_completed(complete):
    study = json.loads(Path("results/studies/big-end.json").read_text())
    assert complete("sta") == ["status"]
    assert "big-end" in complete("show", "big")
    assert complete("show", "wear", "small") == ["small-end"]
    assert complete("show", "big-end", "clear") == [f"clearance_mm={v}" for v in (0.1, 0.2, 0.3)]
    key = study["keys"][0]
    assert complete("export", "-i", "wear", key[:5]) == [key]
    assert complete("dataset", "b") == ["big-end", "both"]
    assert complete("identify", "x.csv", "--study", "t") == ["typical"]
    assert complete("compare", "x.csv", "big") == ["big-end"]
    assert "x" in complete("compare", "x")  # a file
    assert complete("run", "conf") == ["conf"]  # a file: the shell goes on
    assert complete("completion", "z") == ["zsh"]


def test_completion_bears_what_is_not_there(complete):
    Path("results/studies/big-end.json").write_text("{")
    assert complete("show", "big-end", "clear") == []
    assert "big-end" in complete("show", "big")
    assert complete("show", "-i", "absent", "") == []


def test_completion_loads_no_library(complete):
    code = (
        "import sys, compsim.cli\nfrom click.shell_completion import BashComplete\n"
        "BashComplete(compsim.cli.cli, {}, 'compsim', '').complete()\n"
        "print([m for m in ('numpy', 'h5py', 'yaml') if m in sys.modules])"
    )
    words = {"COMP_WORDS": "compsim show big-end cl", "COMP_CWORD": "3"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | words, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout == "[]\n"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script_for_each_shell(shell, capsys):
    assert cli.main(["completion", shell]) == 0
    assert f"_COMPSIM_COMPLETE={shell}_complete" in capsys.readouterr().out
    assert cli.main(["completion"]) == 0
    assert f"compsim completion {shell}" in capsys.readouterr().out
