"""Where up and down differ, and whether a second attractor is confirmed."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.cases.load import load_studies
from compressor.studies.regimes import confirm as module
from compressor.studies.regimes.chains import Chain, ChainTask, run_chain
from compressor.studies.regimes.confirm import (
    APART_TOLERANCES,
    START_COUNT,
    START_ROOM,
    ChainPair,
    Doubt,
    MotionSignature,
    Verdict,
    VerdictBook,
    confirm,
    differ,
    doubts,
    other_starts,
    read_verdicts,
    signature_of_row,
)
from compressor.studies.regimes.group import Regimes
from compressor.studies.regimes.run import chains_of
from compressor.studies.regimes.values import empty

WITHIN = 1e-3
TWO = """
joint: big_end
machine: {rod_mass_kg: 2}
contact: {damping_N_s_per_mm: 60}
solve: {accuracy: draft, output_step_deg: 1}
regimes: {over: clearance_mm, from: 0.7536, to: 1.024, n: 3, log: true, direction: both,
          exponent: false}
"""
ASKED = Regimes("clearance_mm", 0.1, 0.3, 3, direction="both", measure_rev=8)
CASES = [
    Case.from_values({"joint": "both", "clearance_mm": c, "solve": {"accuracy": "draft"}})
    for c in ASKED.values
]
PAIR = ChainPair(*(Chain.of("made", ASKED, way, CASES) for way in ASKED.directions))


def periodic(period=1, at=0.0):
    points = np.zeros((period, 2, 2))
    points[:, 0, 0] = at + 0.1 * np.arange(period)
    return MotionSignature("periodic", float(period), points, 200.0, 0.0)


def chaotic(rms=200.0, error=1.0):
    return MotionSignature(
        "chaotic", math.nan, np.random.default_rng(1).random((64, 2, 2)), rms, error
    )


UNKNOWN = MotionSignature("", math.nan, np.zeros((0, 2, 2)), math.nan, math.nan)
UNDECIDED = chaotic()._replace(regime="undecided")


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (periodic(), periodic(), False),
        (periodic(), periodic(at=0.9 * APART_TOLERANCES * WITHIN), False),
        (periodic(), periodic(at=1.1 * APART_TOLERANCES * WITHIN), True),
        (periodic(2), periodic(1), True),
        (periodic(2), periodic(2), False),
        (periodic(2)._replace(places=periodic(2).places * 10 * WITHIN), periodic(), False),
        (periodic(2), periodic(2)._replace(places=periodic(2).places[::-1]), False),
        (periodic(), chaotic(), True),
        (chaotic(), chaotic(), False),
        (chaotic(200, 1), chaotic(204, 1), False),
        (chaotic(200, 1), chaotic(205, 1), True),
        (chaotic(), UNDECIDED, False),
        (periodic(), UNDECIDED, False),
        (UNKNOWN, periodic(), False),
        (UNKNOWN, UNKNOWN, False),
    ],
)
def test_what_makes_two_motions_different(one, other, expected):
    assert differ(one, other, WITHIN) is expected
    assert differ(other, one, WITHIN) is expected


def row(case, period, at):
    """A row of a motion of a period, at a place in clearances."""
    found = empty(ASKED, case) | {"status": "ok", "regime": "periodic"}
    found["section"][:period] = 0.0
    found["section"][:period, 0, 0] = 1e-3 * case.clearance_mm.big_end * at
    known = {"period": period, "revolutions": 6, "rms_acceleration": 1.0}
    return found | {name: np.asarray(float(value)) for name, value in known.items()}


def test_a_row_says_what_it_has_seen():
    seen = signature_of_row(row(CASES[1], 2, 0.7), CASES[1])
    assert (seen.regime, seen.period) == ("periodic", 2.0)
    assert seen.places.shape == (2, 2, 2)
    np.testing.assert_allclose(seen.places[:, 0, 0], 0.7)
    assert signature_of_row(empty(ASKED, CASES[1]), CASES[1]).regime == ""


@pytest.fixture
def hysteresis(monkeypatch):
    """Chains that differ at their middle value alone: it is at 0.2 going up and 0.8 going down."""
    up = [row(case, 1, at) for case, at in zip(CASES, (0.1, 0.2, 0.9), strict=True)]
    down = [row(case, 1, at) for case, at in zip(CASES, (0.1, 0.8, 0.9), strict=True)]
    rows = {PAIR.up.key: up, PAIR.down.key: down[::-1]}
    monkeypatch.setattr(module, "read_kept_rows", lambda chain, path: rows[chain.key])
    return rows


def test_values_at_which_chains_differ_are_doubted(hysteresis, tmp_path):
    (doubt,) = doubts(PAIR, tmp_path)
    assert (doubt.number, doubt.case) == (1, CASES[1])
    hysteresis[PAIR.down.key] = hysteresis[PAIR.down.key][:1]
    assert doubts(PAIR, tmp_path) == []


@pytest.mark.parametrize(
    ("up", "down", "starts", "verdict"),
    [
        (periodic(), periodic(at=0.5), periodic(), Verdict(1, 1, 2, START_COUNT, 0)),
        (periodic(), periodic(at=0.5), periodic(at=0.5), Verdict(1, 1, 2, 0, START_COUNT)),
        (periodic(), periodic(), periodic(), Verdict(1, 0, 1, START_COUNT, START_COUNT)),
        (periodic(), periodic(), chaotic(), Verdict(1, 1, 2, 0, 0)),
        (UNKNOWN, periodic(), periodic(), Verdict(1, 0, 1, 0, START_COUNT)),
        (periodic(), chaotic(), periodic(at=0.3), Verdict(1, 1, 3, 0, 0)),
    ],
)
def test_two_motions_that_are_reached_confirm(monkeypatch, up, down, starts, verdict):
    ends = {0: up, 1: down}
    monkeypatch.setattr(
        module,
        "follow_on",
        lambda case, state, chain: starts if state is None else ends[int(state[0])],
    )
    assert confirm(Doubt(1, CASES[1], np.array([0.0]), np.array([1.0]), PAIR)) == verdict


def test_other_starts_are_within_the_clearances_and_always_the_same():
    starts = other_starts(CASES[1])
    assert starts == other_starts(CASES[1])
    assert len({case.key for case in starts}) == START_COUNT
    for case in starts:
        offset = case.initial_offset_mm
        for joint in ("big_end", "small_end"):
            size = math.hypot(getattr(offset, f"{joint}_x"), getattr(offset, f"{joint}_y"))
            assert 0 < size < START_ROOM * 0.2
    alone = Case.from_values({"joint": "big_end", "clearance_mm": 0.2})
    assert all(case.initial_offset_mm.small_end_x == 0 for case in other_starts(alone))


def test_verdicts_are_kept(hysteresis, tmp_path):
    book = VerdictBook(PAIR, tmp_path, 0.0)
    assert [doubt.number for doubt in book.missing] == [1]
    assert book.count() == (1, 0)
    told = Verdict(1, 1, 2, 3, 5)
    book.add(1, told)
    assert read_verdicts(PAIR, tmp_path)[1] == told
    again = VerdictBook(PAIR, tmp_path, 0.0)
    assert again.missing == []
    assert again.count() == (1, 1)


def test_a_machine_with_two_motions_is_found_and_confirmed(tmp_path, monkeypatch):
    """Going up from a motion of two revolutions, and down from one of one: two of one meet."""
    path = tmp_path / "two.yaml"
    path.write_text(TWO, encoding="utf-8")
    (study,) = load_studies(path)
    pair = ChainPair(*chains_of(study, 0))
    for chain in (pair.up, pair.down):
        assert run_chain(ChainTask(str(tmp_path), chain)).failed == ()
    (doubt,) = doubts(pair, tmp_path)
    assert doubt.number == 1
    monkeypatch.setattr(module, "FURTHER", 20)
    monkeypatch.setattr(module, "START_COUNT", 2)
    verdict = confirm(doubt)
    assert (verdict.differs, verdict.confirmed, verdict.motions) == (1, 1, 2)
    assert verdict.starts_like_up + verdict.starts_like_down == 2


def test_the_paper_s_machine_has_one_motion():
    """Two far ends of it are the same motion again after some revolutions."""
    case = Case.from_values(
        {"joint": "big_end", "clearance_mm": 0.2, "solve": {"accuracy": "draft"}}
    )
    pair = ChainPair(*(Chain.of("real", ASKED, way, [case] * 3) for way in ASKED.directions))
    seen = [module.follow_on(one, None, pair.up) for one in other_starts(case)[:2]]
    assert [one.regime for one in seen] == ["periodic"] * 2
    assert not differ(*seen, WITHIN)
