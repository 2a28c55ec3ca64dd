"""The report's diagnosis: captions say what the runs measure, and figures draw it."""

import re

import numpy as np
import pytest

from compressor.analysis.captions import diagnosis_caption
from compressor.analysis.runs import CLEARANCES, label
from compressor.analysis.shaking import frame_forces
from compressor.report.figures.diagnosis import BIN
from compressor.report.paper_sections import (
    NEEDS,
    PaperRuns,
    diagnosis_drawings,
    diagnosis_sections,
    force_table,
    shakings,
)

KEPT = slice(1200, 4800)  # three settled revolutions


@pytest.fixture(scope="module")
def paper(paper_runs):
    return PaperRuns(paper_runs, paper_runs, {})


@pytest.fixture(scope="module")
def found(paper):
    return shakings(paper)


@pytest.fixture(scope="module")
def drawn(found, paper):
    """Captions and drawings by name."""
    return {name: (text, figure)
            for name, _, text, figure in diagnosis_drawings(found, paper)}  # fmt: skip


def high(run):
    """X above order 12, by numpy's Fourier transform."""
    lines = np.fft.rfft(frame_forces(run)["shaking_force"][KEPT, 0])
    lines[: 12 * 3 + 1] = 0.0
    return np.fft.irfft(lines)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def newtons(text):
    return [float(number) for number in re.findall(r"([\d.]+) N\b", text)]


def test_both_shares_are_told(drawn, paper_runs, found):
    text, figure = drawn["diagnosis-angles"]
    for joint, words in (("big_end", "big end"), ("small_end", "small end")):
        (sentence,) = re.findall(
            rf"At the {words} the force turns at (.*? N, the one elsewhere .*?)\.", text
        )
        turns = [float(one) for one in re.findall(r"(\d+)°", sentence)]
        assert turns == pytest.approx(found[f"{joint} 0.3"].turns, abs=0.51)
        shares = []
        for clearance in ("0.1", "0.3"):
            run, one = paper_runs[f"{joint} {clearance}"], found[f"{joint} {clearance}"]
            angle = np.degrees(run["crank_angle"].values[KEPT]) % 360
            near = np.zeros(angle.size, bool)
            for turn in one.turns:
                near |= ((angle - turn + 10) % 360) < 60
            square = high(run) ** 2
            shares += [np.sqrt(square[part].sum() / square.size) for part in (near, ~near)]
        near_first, rest_first, near_last, rest_last = shares
        told = newtons(sentence)
        expected = [near_first, near_last, rest_first, rest_last]
        assert told[:4] == pytest.approx(expected, rel=0.01, abs=1)
    assert "rings at order 7" in text
    assert "no flight and no impact" in text
    profile = figure.panels[0].traces[0].y
    whole = np.sqrt(np.mean(profile[:-1] ** 2))
    assert profile.size == 360 / BIN + 1
    assert whole == pytest.approx(rms(high(paper_runs["big_end 0.1"])), rel=5e-3)


def test_captions_follow_the_numbers_and_not_the_names(found, paper_runs):
    """With the runs of both joints exchanged, what rises falls."""
    other = dict(found)
    for clearance in CLEARANCES:
        one, two = label("big_end", clearance), label("small_end", clearance)
        other[one], other[two] = found[two], found[one]
    text = diagnosis_caption("spectra", other, paper_runs)
    assert re.search(r"With the big end's clearance [^.]*\.1 to 0\.3 mm [^.]* falls", text)
    assert re.search(r"With the small end's clearance [^.]*\.1 to 0\.3 mm [^.]* rises", text)


def test_the_table_has_every_case(found, paper_runs):
    table = force_table(found)
    assert len(table.rows) == len(NEEDS) == 10
    for row, name in zip(table.rows, NEEDS, strict=True):
        expected = rms(high(paper_runs[name]))
        assert float(row.cells[2].text.removesuffix(" N")) == pytest.approx(
            expected, rel=1e-3, abs=0.06
        )


def test_nothing_is_drawn_where_a_case_is_missing(paper_runs):
    some = {name: run for name, run in paper_runs.items() if name != "both 0.2"}
    paper = PaperRuns(some, some, {"both 0.2": "not stored"})
    assert shakings(paper) == {}
    assert not [*diagnosis_drawings({}, paper)]
    assert not [*diagnosis_sections({}, [])]
