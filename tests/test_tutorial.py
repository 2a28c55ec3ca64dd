"""The tutorial: each command is run, and each output compared.

Its notebook is that page, cell by cell.
"""

import contextlib
import io

import pytest
import tutorial

TEXT = tutorial.PAGE.read_text(encoding="utf-8")
CELLS = [one for one in tutorial.pieces(TEXT) if one.kind != "markdown"]


@pytest.mark.slow
def test_each_command_prints_what_the_page_says(tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    names = {}
    for one in CELLS:
        if one.kind == "console":
            lines = one.source.splitlines()
            printed = "".join(tutorial.run_command(tmp_path, line) for line in lines)
        else:
            with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.chdir(tmp_path):
                exec(one.source, names)
            printed = out.getvalue()
        assert tutorial.missing(one.output, printed) == "", (one.source, printed)


def test_the_notebook_is_made_from_the_page():
    written = tutorial.NOTEBOOK.read_text(encoding="utf-8")
    assert written == tutorial.notebook(TEXT), "stale: run make pages"
