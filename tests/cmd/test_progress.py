"""Progress on stderr: rich's line on a terminal, few lines in a log."""

import itertools
import re
import sys
import types

import pytest
from compsim import progress as module
from compsim.progress import ProgressReporter


@pytest.fixture
def clock(monkeypatch):
    """The clock of progress, a list with the present time (s)."""
    now = [100.0]
    monkeypatch.setattr(module, "time", types.SimpleNamespace(monotonic=lambda: now[0]))
    return now


@pytest.fixture
def terminal(monkeypatch):
    """Called in a test, makes stderr a terminal of so many columns."""

    def made(columns=100):
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
        monkeypatch.setenv("TERM", "xterm")
        monkeypatch.setenv("COLUMNS", str(columns))
        for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE"):
            monkeypatch.delenv(name, raising=False)

    return made


def plain(text):
    """What a terminal shows, without colours, the cursor's looks and the bar."""
    return re.sub(r"\x1b\[[0-9;?]*[mhl]|[━╸╺]", "", text)


def test_a_terminal_gets_one_line_that_goes_at_the_end(terminal, clock, capsys):
    terminal()
    with ProgressReporter(quiet=False) as progress:
        for done in (500, 501, 502, 503):  # those stored before are no pace
            progress.count_failed(done - 500)
            progress(done, 1000, "compiled in 43 s" if done == 501 else "")
            clock[0] += 1
        progress.line.refresh()
        progress(1000, 1000, "")
        progress.line.refresh()
    err = capsys.readouterr().err
    assert "\x1b[31m, 3 failed\x1b[0m" in err  # in red
    err = plain(err)
    assert " 503 of 1000 jobs, 50 %, 3 failed 0:08:17" in err
    assert "compiled in 43 s\n" in err  # above the line
    assert " 1000 of 1000 jobs, 100 %, 3 failed 0:00:00" in err
    assert err.endswith("\r\x1b[1A\x1b[2K")  # nothing of it stays


@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_a_terminal_that_shall_not_draw_is_a_log(name, value, terminal, capsys, monkeypatch):
    terminal()
    monkeypatch.setenv(name, value)
    with ProgressReporter(quiet=False) as progress:
        progress(0, 11, "a remark")
    assert capsys.readouterr().err == "a remark\n"


def test_a_log_gets_a_line_at_the_start_some_between_and_one_at_the_end(clock, capsys):
    lines = []
    with ProgressReporter(quiet=False) as progress:
        for second in range(3600):
            clock[0] = 100.0 + second
            progress(second // 4, 900, "")
            if line := capsys.readouterr().err:
                lines.append((second, line))
    seconds = [second for second, _ in lines]
    assert seconds[:4] == [1, 11, 21, 31]
    gaps = [after - before for before, after in itertools.pairwise(seconds)]
    assert gaps == sorted(gaps)
    assert 10 <= len(lines) < 100
    assert max(gaps) <= 3600 / 19
    assert lines[0][1] == "0 of 900 jobs, 0 %\n"
    assert re.fullmatch(r"\d+ of 900 jobs, \d+ %, about \d+ min left\n", lines[10][1])
    assert capsys.readouterr().err == "899 of 900 jobs, 99 %\n"
