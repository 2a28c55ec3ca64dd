"""The tutorial: each command is run, and each output compared."""

import contextlib
import io
import re

import pytest
from page_commands import missing, run_command
from page_tables import ROOT

TEXT = (ROOT / "compressor/cases/examples/TUTORIAL.md").read_text(encoding="utf-8")
LESS = {"compsim run sampling.yaml": ("--set", "solve.error_bars=false")}  # which none shows
BLOCK = re.compile(r"^```(console|py)\n(.*?)^```\n(?:\n```text\n(.*?)^```\n)?", re.M | re.S)


@pytest.mark.slow
def test_each_command_prints_what_the_page_says(tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    names = {}
    for kind, source, expected in BLOCK.findall(TEXT):
        if kind == "console":  # commands after a prompt, and what they print
            commands = re.findall(r"^\$ (.*)\n", source, re.M)
            expected = re.sub(r"^\$ .*\n", "", source, flags=re.M)
            printed = "".join(run_command(tmp_path, one, *LESS.get(one, ())) for one in commands)
        else:
            with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.chdir(tmp_path):
                exec(source, names)
            printed = out.getvalue()
        assert missing(tuple(expected.splitlines()), printed) == "", (source, printed)
