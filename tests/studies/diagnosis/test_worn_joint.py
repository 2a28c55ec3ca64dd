"""Which joint is worn, on made-up libraries whose answers are known."""

import numpy as np
import pytest

from compressor.studies.diagnosis.features import FEATURES
from compressor.studies.diagnosis.identify import LIMIT, Identifier, StudyError
from compressor.studies.diagnosis.library import Library

JOINTS = np.array(["none", "big_end", "small_end", "both"])
LOADING = np.random.default_rng(0).normal(size=(4, len(FEATURES)))


def made(count, seed, equal=False, joints=JOINTS):
    """Records whose features are linear in which joint is worn, and in its log clearance."""
    rng = np.random.default_rng(seed)
    told = joints[np.arange(count) % len(joints)]
    clearances = 0.05 * 10 ** rng.random((count, 2))
    if equal:
        clearances[:, 1] = clearances[:, 0]
    worn = np.column_stack(
        [np.isin(told, ["big_end", "both"]), np.isin(told, ["small_end", "both"])]
    )
    clearances = np.where(worn, clearances, 0.0)
    depth = np.where(worn, np.log(np.where(worn, clearances, 1.0) / 0.15), 0.0)
    hidden = np.column_stack([worn, depth])
    features = hidden @ LOADING + rng.normal(0, 0.3, (count, len(FEATURES)))
    keys = np.array([f"{number:020x}" for number in range(count)])
    return Library("made", keys, told, clearances, features, count, {})


@pytest.fixture(scope="module")
def identifier():
    return Identifier.fit(made(600, 1))


def test_the_joint_is_told_and_its_clearance_lies_in_its_interval(identifier):
    new = made(200, 2)
    right, held = [], []
    for joint, clearance, row in zip(new.joints, new.clearances, new.features, strict=True):
        answer = identifier.identify(row)
        assert sum(one.probability for one in answer.candidates) == pytest.approx(1.0)
        right.append(answer.candidates[0].joint == joint)
        own = next(one for one in answer.candidates if one.joint == joint)
        for side, interval in own.clearances.items():
            truth = clearance[["big_end", "small_end"].index(side)]
            held.append(interval.low <= truth <= interval.high)
    assert np.mean(right) > 0.97
    assert identifier.right > 0.97
    assert 0.84 < np.mean(held) < 0.96


def test_candidates_are_ranked_with_the_clearances_of_their_ends(identifier):
    answer = identifier.identify(made(4, 3).features[3])
    chances = [one.probability for one in answer.candidates]
    assert chances == sorted(chances, reverse=True)
    ends = {one.joint: list(one.clearances) for one in answer.candidates}
    assert ends == {"none": [], "big_end": ["big_end"], "small_end": ["small_end"],
                    "both": ["big_end", "small_end"]}  # fmt: skip
    assert answer.candidates[0].joint == "both"


def test_own_records_fit_and_others_do_not(identifier):
    own = [identifier.identify(row).fits for row in made(200, 4).features]
    assert np.mean(own) > 0.96
    row = made(4, 5).features[1].copy()
    row[[8, 9]] += (9.0, -9.0)
    answer = identifier.identify(row)
    assert not answer.fits
    assert answer.p_value < LIMIT
    assert {list(FEATURES)[8], list(FEATURES)[9]} <= answer.odd.keys()
    assert answer.odd[list(FEATURES)[8]] > 3


def test_no_record_is_so_far_off_that_there_is_no_answer(identifier):
    answer = identifier.identify(np.full(len(FEATURES), 1e6))
    assert not answer.fits
    assert np.isfinite([one.probability for one in answer.candidates]).all()


def test_a_feature_that_a_record_does_not_have_is_borne(identifier):
    row = made(4, 6).features[2].copy()
    row[5] = np.nan
    assert identifier.identify(row).candidates[0].joint == "small_end"


def test_equal_clearances_are_told_as_one():
    found = Identifier.fit(made(400, 7, equal=True))
    assert found.equal
    answer = found.identify(made(4, 8, equal=True).features[3])
    both = next(one for one in answer.candidates if one.joint == "both")
    assert both.clearances["big_end"] == both.clearances["small_end"]


def test_a_study_of_one_joint_is_sure_of_it():
    found = Identifier.fit(made(220, 9, joints=JOINTS[1:2]))
    (only,) = found.identify(made(1, 10, joints=JOINTS[1:2]).features[0]).candidates
    assert (only.joint, only.probability) == ("big_end", 1.0)


def test_joints_with_few_jobs_are_not_told():
    library = made(600, 11)
    few = (library.joints != "both") | (np.arange(600) < 80)
    assert Identifier.fit(library.only(few)).joints == ("none", "big_end", "small_end")


def test_too_few_jobs_are_refused():
    with pytest.raises(StudyError, match=r"study made has too few jobs .* none 25, big_end 25"):
        Identifier.fit(made(100, 12))
