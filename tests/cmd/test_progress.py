"""Progress on stderr: one line on a terminal, few lines in a log, and no guess before it is one."""

import itertools
import re
import sys
import types

import pytest
from compsim import progress as module
from compsim.progress import ProgressReporter

from compressor.sweep.wanted import SweepProgress


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
    """What a terminal shows, without colours and the bar."""
    return re.sub(r"\x1b\[[0-9;]*m|[━╸╺]", "", text)


def test_a_terminal_gets_one_line_that_is_redrawn(terminal, capsys):
    terminal()
    progress = ProgressReporter(quiet=False)
    for event in [(2, 11, ""), (3, 11, ""), (11, 11, "")]:
        progress(*event)
        progress.line.refresh()
    progress.end()
    err = plain(capsys.readouterr().err)
    assert " 2 of 11 jobs, 18 %\r\x1b[2K" in err
    assert "\r\x1b[2K 3 of 11 jobs, 27 %" in err
    assert " 11 of 11 jobs, 100 %" in err
    assert err.endswith("\r\x1b[1A\x1b[2K")  # nothing of it stays
    assert err.count("\n") == 1
    assert "\x1b[?25l" not in err  # the cursor is never hidden


def test_failed_jobs_and_the_time_left_stand_in_the_line(terminal, capsys):
    terminal()
    progress = ProgressReporter(quiet=False)
    progress(40, 100, "")
    progress.show_sweep(SweepProgress(40, 3, 100, 75.0, True))
    progress.line.refresh()
    progress.end()
    err = capsys.readouterr().err
    assert "\x1b[31m, 3 failed\x1b[0m" in err  # in red
    assert re.search(r" 40 of 100 jobs, 40 %, 3 failed, over 7[45] s left", plain(err))


@pytest.mark.parametrize("columns", [20, 40, 60])
def test_a_narrow_terminal_gets_one_line_as_well(columns, terminal, capsys):
    terminal(columns)
    progress = ProgressReporter(quiet=False)
    progress(123456, 1000000, "")
    progress.show_sweep(SweepProgress(123456, 3456, 1000000, 7500.0))
    progress.line.refresh()
    progress.end()
    drawn = re.split(r"\r|\x1b\[\d?[AK]|\n", re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().err))
    assert max(map(len, drawn)) <= columns
    assert any("123456 of 100" in line for line in drawn)


def test_a_remark_stays_above_the_line(terminal, capsys):
    terminal()
    progress = ProgressReporter(quiet=False)
    for event in [(0, 11, ""), (0, 11, "compiled in 43 s"), (1, 11, "")]:
        progress(*event)
    progress.end()
    assert "\r\x1b[2Kcompiled in 43 s\n 0 of 11 jobs, 0 %" in plain(capsys.readouterr().err)


@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_a_terminal_that_shall_not_draw_is_a_log(name, value, terminal, capsys, monkeypatch):
    terminal()
    monkeypatch.setenv(name, value)
    progress = ProgressReporter(quiet=False)
    progress(0, 11, "a remark")
    progress.end()
    assert (progress.line, capsys.readouterr().err) == (None, "a remark\n")


def test_a_log_gets_a_line_at_the_start_some_between_and_one_at_the_end(clock, capsys):
    progress, lines = ProgressReporter(quiet=False), []
    for second in range(3600):
        clock[0] = 100.0 + second
        progress(second // 4, 900, "")
        if line := capsys.readouterr().err:
            lines.append((second, line))
    progress.end()
    seconds = [second for second, _ in lines]
    assert seconds[:4] == [1, 11, 21, 31]
    gaps = [after - before for before, after in itertools.pairwise(seconds)]
    assert gaps == sorted(gaps)
    assert 10 <= len(lines) < 100
    assert max(gaps) <= 3600 / 19
    assert lines[0][1] == "0 of 900 jobs, 0 %\n"
    assert re.fullmatch(r"\d+ of 900 jobs, \d+ %, \d+ min left\n", lines[10][1])
    assert capsys.readouterr().err == "899 of 900 jobs, 99 %, 1.0 s left\n"


def test_what_is_over_soon_writes_nothing(clock, capsys):
    progress = ProgressReporter(quiet=False, things="files")
    for done in range(10):
        clock[0] += 0.09
        progress(done, 9, "")
    progress.end()
    assert capsys.readouterr().err == ""


def test_one_thing_is_not_several(clock, capsys):
    progress = ProgressReporter(quiet=False, things="points")
    clock[0] += 1
    progress(0, 1, "")
    progress.end()
    assert capsys.readouterr().err == "0 of 1 point, 0 %\n"


def test_no_guess_is_made_of_what_waited_for_the_start(clock):
    """40 s of compiling, a first batch of 8 at once, then 4 a second."""
    progress = ProgressReporter(quiet=True)
    progress(0, 100, "")
    clock[0] += 40
    progress(8, 100, "")
    for done in (12, 16):
        assert progress.time_left() == ""
        clock[0] += 1
        progress(done, 100, "")
    assert progress.time_left() == ", 21 s left"
    clock[0] += 2
    assert progress.time_left() == ", 19 s left"
    clock[0] += 30
    assert progress.time_left() == ", under 1 s left"
    progress(100, 100, "")
    assert progress.time_left() == ""


def test_unequal_things_are_not_guessed(clock):
    progress = ProgressReporter(quiet=True, alike=False)
    for done in range(20):
        clock[0] += 1
        progress(done, 100, "")
    assert progress.time_left() == ""


def test_what_was_stored_before_is_no_pace(clock):
    progress = ProgressReporter(quiet=True)
    for done in (500, 501, 502, 503, 504, 505, 506):
        progress(done, 1000, "")
        clock[0] += 1
    assert progress.time_left() == ", 8 min left"


def test_quiet_is_quiet(clock, capsys):
    progress = ProgressReporter(quiet=True)
    for done in range(100):
        clock[0] += 1
        progress(done, 100, "a remark")
        progress.show_sweep(SweepProgress(done, 0, 100))
    progress.end()
    assert capsys.readouterr().err == ""
