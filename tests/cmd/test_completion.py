"""What a shell completes: commands, options, files and folders, by click."""

import pytest
from click.shell_completion import BashComplete
from compsim import cli


@pytest.fixture
def complete(monkeypatch):
    """What bash is offered for the last of some words."""

    def run(*words):
        monkeypatch.setenv("COMP_WORDS", " ".join(["compsim", *words]))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        return BashComplete(cli.cli, {}, "compsim", "_COMPSIM_COMPLETE").complete().splitlines()

    return run


def test_commands_choices_files_and_folders_are_completed(complete):
    assert complete("sta") == ["plain,status"]
    assert complete("plot", "--format", "s") == ["plain,svg"]
    assert complete("run", "conf") == ["file,conf"]  # the shell goes on
    assert complete("status", "-r", "res") == ["dir,res"]
