"""`compsim run --watch`: a page that is fresh while a sweep runs, and costs the sweep nothing."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from compsim import cli, watch
from compsim.watch import PageWatch, PageWriter

from compressor.report.page import document
from compressor.sweep.wanted import SweepProgress

SHORT = {"duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9}
NOW = SweepProgress(12, 3, 400, 125.0)
STANDS = {"done": 1, "failed": 0, "total": 2, "at": "12:00:00"}
PATIENCE = 60.0  # s
# stands in for the process: notes what it is told; what it answers are its arguments, in turn
CHILD = """
import json, signal, sys, time
name, *answers = sys.argv[1:]
def leave(*_): raise TimeoutError
signal.signal(signal.SIGINT, leave)
def note(text):
    with open(name, "a") as file: file.write(text + "\\n")
for line in sys.stdin:
    note(line.strip())
    answer = answers.pop(0)
    if answer == "die": sys.exit(7)
    if answer == "hang":
        try: time.sleep(60)
        except TimeoutError: answer = '{"left": true, "seconds": 0.1}'
    print(answer, flush=True)
note("final")
print(answers.pop(0) if answers else '{"seconds": 0.1}', flush=True)
"""


@pytest.fixture
def watched(tmp_path, monkeypatch):
    """Makes a Watch whose process answers as it is told to, and what the process has noted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(watch, "SECONDS", 0.0)
    notes = tmp_path / "notes"

    def made(*answers):
        def started(told):
            return subprocess.Popen(
                [sys.executable, "-S", "-c", CHILD, str(notes), *answers],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
            )  # fmt: skip

        monkeypatch.setattr(watch, "start_process", started)
        return PageWatch("results", "report", "compsim run a.yaml --watch")

    def noted():
        return notes.read_text().splitlines() if notes.exists() else []

    return made, noted


def until(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def answered(one):
    """Have a page written, and wait until the process has answered."""
    one.due = 0.0
    one.update(NOW)
    until(lambda: one.read_answers() or one.idle)


def test_the_process_is_told_how_the_sweep_stands_and_ends_with_the_ordinary_page(watched, capsys):
    made, noted = watched
    undrawn = '{"seconds": 0.2, "drawn": false}'
    with made('{"seconds": 1.5}', undrawn, '{"seconds": 0.2}') as one:
        answered(one)
        assert one.draw_due - time.monotonic() == pytest.approx(30.0, abs=5)
        one.due = time.monotonic() + 60
        one.update(NOW)  # too early
        answered(one)
        one.draw_due = 0.0
        answered(one)
    *orders, final = noted()
    first, second, third = map(json.loads, orders)
    assert [order["draw"] for order in (first, second, third)] == [True, False, True]
    at = first["running"].pop("at")
    assert re.fullmatch(r"\d\d:\d\d:\d\d", at)
    assert first["running"] == {
        "done": 12, "failed": 3, "total": 400, "eta_s": 125.0, "every_s": 0.0
    }  # fmt: skip
    assert final == "final"
    assert capsys.readouterr().err == "report/index.html is kept fresh until the run has ended\n"


def test_the_sweep_never_waits_for_a_page(watched):
    made, noted = watched
    with made("hang") as one:
        began = time.monotonic()
        for _ in range(1000):
            one.due = 0.0
            one.update(NOW)
        assert time.monotonic() - began < 5
        until(lambda: len(noted()) == 1)
    assert noted()[1:] == ["final"]  # and what is being written is left at the end
    assert time.monotonic() - began < 30


def test_a_page_that_fails_is_told_once_and_the_run_goes_on(watched, capsys):
    made, noted = watched
    problem = '{"seconds": 0.0, "problem": "KeyError: 7"}'
    with made(problem, problem, '{"seconds": 0.1}') as one:
        for _ in range(3):
            answered(one)
    assert len(noted()) == 4
    told = "report/index.html is not fresh: KeyError: 7; the run does not depend on it\n"
    assert capsys.readouterr().err.count(told) == 1


def test_a_process_that_dies_is_started_again_a_few_times(watched, capsys):
    made, noted = watched
    with made("die") as one:
        for deaths in range(1, watch.MAX_DEATHS + 1):
            answered(one)
            until(lambda deaths=deaths: one.read_answers() or one.deaths == deaths)
        one.due = 0.0
        one.update(NOW)  # given up
    assert len(noted()) == watch.MAX_DEATHS
    err = capsys.readouterr().err
    assert err.count("is not fresh: what writes it ended with exit code 7") == 1


def test_a_short_run_has_the_ordinary_page_alone(watched):
    made, noted = watched
    with made():
        pass
    assert noted() == ["final"]


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), cli.Interrupted(signal.SIGINT), ZeroDivisionError()]
)
def test_whatever_ends_a_run_the_page_stops_loading_itself(error, watched, capsys):
    made, noted = watched

    def run():
        with made('{"seconds": 0.1}') as one:
            answered(one)
            raise error

    with pytest.raises(type(error)):
        run()
    assert noted()[1:] == ["final"]
    again = "" if isinstance(error, Exception) else "; Ctrl-C again ends at once"
    assert f"writing report/index.html once more{again}\n" in capsys.readouterr().err


def test_a_run_that_is_killed_leaves_the_ordinary_page(watched):
    made, noted = watched
    one = made('{"seconds": 0.1}')
    answered(one)
    os.close(one.process.stdin.fileno())  # as a kill does
    until(lambda: noted()[1:] == ["final"])
    with contextlib.suppress(OSError):
        one.process.stdin.close()
    one.process.wait()


# ---- the process --------------------------------------------------------------------------------


@pytest.fixture
def writer(tmp_path):
    handler = signal.getsignal(signal.SIGINT)
    yield PageWriter({"results": "results", "report": str(tmp_path), "command": "compsim run"})
    signal.signal(signal.SIGINT, handler)


def test_a_page_that_cannot_be_written_is_a_problem_in_a_line(writer, monkeypatch):
    def broken(*arguments):
        raise KeyError("a\nb")

    monkeypatch.setattr("compressor.report.write_report", broken)
    answer = writer.write(STANDS)
    assert answer["problem"] == "KeyError: 'a\\nb'"
    assert answer["seconds"] >= 0


def test_between_drawings_the_page_says_how_the_run_stands(writer, monkeypatch, tmp_path):
    def drawn(results, report, command, claims, running):
        (tmp_path / "index.html").write_text(document([], running=running))

    monkeypatch.setattr("compressor.report.write_report", drawn)
    assert writer.write(STANDS, draw=False)["drawn"]  # there is no page yet
    for done, at in ((5, "12:00:05"), (9, "12:00:10")):
        answer = writer.write(STANDS | {"done": done, "at": at, "eta_s": 20.0}, draw=False)
        assert (answer["drawn"], answer.get("problem")) == (False, None)
        page = " ".join((tmp_path / "index.html").read_text().split())
        assert f"{done} of 2 jobs done, 0 failed, under a minute left, at {at}." in page
        assert "Figures and tables are those of 12:00:00;" in page
    (tmp_path / "index.html").unlink()
    assert "FileNotFoundError" in writer.write(STANDS, draw=False)["problem"]


def test_a_page_that_is_out_of_date_is_left(writer, monkeypatch):
    def slow(results, report, command, claims, running):
        with contextlib.suppress(Exception):  # as whoever handles all errors
            signal.raise_signal(signal.SIGINT)
        return "written"

    monkeypatch.setattr("compressor.report.write_report", slow)
    assert writer.write(STANDS)["left"]
    assert "left" not in writer.write(None)  # the last page is never left


# ---- together -----------------------------------------------------------------------------------


@pytest.fixture
def case_file(tmp_path, monkeypatch, in_process):
    monkeypatch.chdir(tmp_path)
    values = {"joint": "both", "clearance_mm": [0.1, 0.2], "solve": SHORT,
              "output": {"keep": "metrics"}}  # fmt: skip
    Path("a.yaml").write_text(json.dumps(values))
    return "a.yaml"


def test_a_run_is_watched_from_its_first_page_to_its_last(case_file, capsys, monkeypatch):
    pages = []

    def update(self, now):
        if not pages:
            real(self, now)
            until(lambda: self.read_answers() or self.idle)
            pages.append((now, Path("report/index.html").read_text()))

    real = PageWatch.update
    monkeypatch.setattr(watch, "SECONDS", 0.0)
    monkeypatch.setattr(PageWatch, "update", update)
    assert cli.main(["run", case_file, "-j", "1", "--watch"]) == 0
    assert capsys.readouterr().err.endswith("page: report/index.html\n")
    ((now, page),) = pages
    assert now == SweepProgress(0, 0, 2)
    assert '<meta http-equiv="refresh" content="' in page
    words = "<strong>Still running:</strong> 0 of 2 jobs done, 0 failed, at "
    assert words in " ".join(page.split())
    page = Path("report/index.html").read_text()
    assert "refresh" not in page
    assert "Still running" not in page
    assert "2 jobs: 2 ok" in page
