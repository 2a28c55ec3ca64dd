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


@pytest.mark.parametrize(
    ("expected", "printed", "told"),
    [
        (["a 1.000 b"], "a 1.001 b\n", ""),
        (["a 1.000 b"], "a 1.01 b\n", "a 1.000 b"),
        (["a 1.000 b"], "a 1.000 c\n", "a 1.000 b"),
        (["a", "…", "c 2"], "a\nb\nb\nc 2\n", ""),
        (["a", "…", "c 2"], "a\nb\nb\nc 3\n", "c 2"),
        (["a"], "a\nb\n", "more is printed: b"),
        (["a", "…"], "a\nb\n", ""),
        (["took … s"], "took 12.3 s", ""),
        (["5.00 ± 0.02 kN"], "5.001 ± 0.03 kN", ""),
        (["5.00 ± 0.02 kN"], "5.2 ± 0.02 kN", "5.00 ± 0.02 kN"),
        (["x ≤ 1e-07 %"], "x ≤ 3e-08 %", ""),
        (["clearance_mm=0.2"], "clearance_mm=0.3", "clearance_mm=0.2"),
    ],
)
def test_how_outputs_are_compared(expected, printed, told):
    assert tutorial.missing(tuple(expected), printed) == told
