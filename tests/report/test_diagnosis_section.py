"""The report's diagnosis: captions say what the runs measure, and figures draw it."""

import re

import numpy as np
import pytest

from compressor.analysis.runs import CLEARANCES, FAULTS, label
from compressor.analysis.shaking import frame_forces
from compressor.report.figures import FIGURES
from compressor.report.figures.diagnosis import BIN, NEEDS, measure_shaking
from compressor.report.figures.drawing import panels_of
from compressor.report.paper_sections import draw_diagnosis, force_table

KEPT = slice(1200, 4800)  # three settled revolutions


@pytest.fixture(scope="module")
def found(paper_runs):
    return measure_shaking(paper_runs)


@pytest.fixture(scope="module")
def drawn(paper_runs, found):
    return {name: one.make(paper_runs, found) for name, one in FIGURES["diagnosis"].items()}


def high(run):
    """X above order 12, by numpy's Fourier transform."""
    lines = np.fft.rfft(frame_forces(run)["shaking_force"][KEPT, 0])
    lines[: 12 * 3 + 1] = 0.0
    return np.fft.irfft(lines)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def numbers(shown, *words):
    """The numbers of a caption under each label that has any of the words, in their order."""
    return [[float(one) for one in re.findall(r"[\d.]+", text)] for label, text in shown.numbers
            if any(word in label for word in words)]  # fmt: skip


def test_the_rms_is_told(drawn, paper_runs):
    told = numbers(drawn["diagnosis-spectra"], "with ", "at both joints")
    expected = [[rms(high(paper_runs[label(f, c)])) for c in CLEARANCES] for f in FAULTS]
    assert np.array(told) == pytest.approx(np.array(expected), rel=1e-3)


def test_both_shares_are_told(drawn, paper_runs, found):
    shown = drawn["diagnosis-angles"]
    turns = numbers(shown, "turns at")
    shares = numbers(shown, "near these", "elsewhere")
    for place, joint in enumerate(("big_end", "small_end")):
        assert turns[place] == pytest.approx(found[f"{joint} 0.3"].turns, abs=0.51)
        expected = [[], []]
        for c in CLEARANCES:
            run, one = paper_runs[label(joint, c)], found[label(joint, c)]
            angle = np.degrees(run["crank_angle"].values[KEPT]) % 360
            near = np.zeros(angle.size, bool)
            for turn in one.turns:
                near |= ((angle - turn + 10) % 360) < 60
            square = high(run) ** 2
            for part, values in zip((near, ~near), expected, strict=True):
                values.append(np.sqrt(square[part].sum() / square.size))
        told = shares[2 * place : 2 * place + 2]
        assert np.array(told) == pytest.approx(np.array(expected), rel=0.01, abs=1)
    assert numbers(shown, "in flight") == [[0.0] * 3] * 2
    profile = next(one for one in shown.figure.data if one.name == "0.1 mm").y
    whole = np.sqrt(np.mean(profile[:-1] ** 2))
    assert profile.size == 360 / BIN + 1
    assert whole == pytest.approx(rms(high(paper_runs["big_end 0.1"])), rel=5e-3)


def test_no_shared_scale_has_an_open_end(drawn):
    """Plotly would show -1 to 4 of it, whatever is drawn."""
    for shown in drawn.values():
        axes = [axis for panel in panels_of(shown.figure) for axis in (panel.x, panel.y)]
        assert not [axis for axis in axes if axis.matches and None in (axis.range or ())]
    *_, (low, high) = (one.y.range for one in panels_of(shown.figure)[::2])
    drawn_to = max(one.y.max() for one in shown.figure.data if (one.name or "").endswith(" mm"))
    assert low == 0
    assert drawn_to < high < 1.1 * drawn_to


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
    assert draw_diagnosis(some, "usual") == []
