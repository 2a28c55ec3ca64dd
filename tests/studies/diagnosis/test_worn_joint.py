"""Which joint is worn, on made-up libraries whose answers are known."""

from dataclasses import astuple

import numpy as np
import pytest

from compressor.studies.diagnosis import identify
from compressor.studies.diagnosis.features import FEATURES
from compressor.studies.frame import StudyError

JOINTS = np.array(["none", "big_end", "small_end", "both"])
LOADING = np.random.default_rng(0).normal(size=(4, len(FEATURES)))


def made(count, seed, equal=False, joints=JOINTS):
    """Records whose features are linear in which joint is worn, and in its log clearance."""
    rng = np.random.default_rng(seed)
    told = joints[np.arange(count) % len(joints)]
    clearances = 0.05 * 10 ** rng.random((count, 2))
    if equal:
        clearances[:, 1] = clearances[:, 0]
    worn = np.column_stack([np.isin(told, [end, "both"]) for end in ("big_end", "small_end")])
    clearances = np.where(worn, clearances, 0.0)
    depth = np.where(worn, np.log(np.where(worn, clearances, 1.0) / 0.15), 0.0)
    hidden = np.column_stack([worn, depth])
    features = hidden @ LOADING + rng.normal(0, 0.3, (count, len(FEATURES)))
    keys = np.array([f"{number:020x}" for number in range(count)])
    return identify.Library("made", keys, told, clearances, features, keys, count, {})


@pytest.fixture(scope="module")
def identifier():
    return identify.Identifier.fit(made(400, 1))


def test_the_joint_is_told_and_its_clearance_lies_in_its_interval(identifier):
    new = made(200, 2)
    right, held, fits = [], [], []
    for joint, clearance, row in zip(new.joints, new.clearances, new.features, strict=True):
        answer = identifier.identify(row)
        chances = [one.probability for one in answer.candidates]
        assert sum(chances) == pytest.approx(1.0)
        assert chances == sorted(chances, reverse=True)
        ends = {one.joint: list(one.clearances) for one in answer.candidates}
        assert ends == {"none": [], "big_end": ["big_end"], "small_end": ["small_end"],
                        "both": ["big_end", "small_end"]}  # fmt: skip
        right.append(answer.candidates[0].joint == joint)
        fits.append(answer.fits)
        own = next(one for one in answer.candidates if one.joint == joint)
        for side, interval in own.clearances.items():
            truth = clearance[["big_end", "small_end"].index(side)]
            held.append(interval.low <= truth <= interval.high)
    assert np.mean(right) > 0.97
    assert identifier.right > 0.97
    assert np.mean(fits) > 0.96
    assert 0.84 < np.mean(held) < 0.96


def test_records_of_something_else_do_not_fit(identifier):
    row = made(4, 5).features[1].copy()
    row[[8, 9]] += (9.0, -9.0)
    answer = identifier.identify(row)
    assert not answer.fits
    assert answer.p_value < identify.LIMIT
    # none is so far off that there is no answer
    answer = identifier.identify(np.full(len(FEATURES), 1e6))
    assert not answer.fits
    assert np.isfinite([one.probability for one in answer.candidates]).all()


def test_a_study_of_one_joint_is_sure_of_it():
    found = identify.Identifier.fit(made(220, 9, joints=JOINTS[1:2]))
    (only,) = found.identify(made(1, 10, joints=JOINTS[1:2]).features[0]).candidates
    assert (only.joint, only.probability) == ("big_end", 1.0)


def test_too_few_jobs_are_refused():
    with pytest.raises(StudyError, match=r"study made has too few jobs .* none 25, big_end 25"):
        identify.Identifier.fit(made(100, 12))


# clearances whose posterior is known exactly: conjugate Gaussian


NOISE, PRIOR, SLOPES = 0.5, 0.6, np.array([1.0, -0.7, 0.4, 0.0])
NORMAL_95 = 1.6449  # standard deviations to each end of a 90 % interval


def drawn(count, seed):
    """Log clearances N(-1, PRIOR^2) and features: linear with Gaussian noise."""
    rng = np.random.default_rng(seed)
    logs = rng.normal(-1.0, PRIOR, count)
    return logs[:, None] * SLOPES + rng.normal(0, NOISE, (count, 4)), logs


@pytest.fixture(scope="module")
def clearance():
    points, logs = drawn(600, 1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(identify, "SAMPLE", 150)  # jobs choose the kernel, as in large studies
        return identify.Clearance.fit(points, logs[:, None], np.arange(600))


def test_intervals_are_the_exact_ones(clearance):
    points, logs = drawn(600, 2)
    best, low, high = np.log([astuple(clearance.locate(point)[0]) for point in points]).T
    precision = 1 / PRIOR**2 + (SLOPES**2).sum() / NOISE**2
    mean = (points @ SLOPES / NOISE**2 - 1.0 / PRIOR**2) / precision
    spread = precision**-0.5
    assert np.sqrt(((best - mean) ** 2).mean()) < 0.3 * spread
    assert np.median(high - low) == pytest.approx(2 * NORMAL_95 * spread, rel=0.1)
    assert ((low <= logs) & (logs <= high)).mean() == pytest.approx(identify.LEVEL, abs=0.05)


def test_intervals_are_wide_where_errors_are_great():
    """Noise that grows with the clearance: a width of the middle would be wrong at both ends."""
    rng = np.random.default_rng(3)
    logs = rng.uniform(-3.0, 0.0, 300)
    points = (logs + rng.normal(0, 1.0, 300) * 0.1 * (3.2 + logs))[:, None]
    found = identify.Clearance.fit(points, logs[:, None], np.arange(300))
    (small,), (large,) = map(found.locate, np.array([[-2.7], [-0.5]]))
    assert np.log(large.high / large.low) > 2.5 * np.log(small.high / small.low)


def test_a_machine_is_judged_by_others_alone():
    machines = np.repeat(np.arange(40), 5)
    labels = np.array(["none", "both"])[machines % 2]
    for others, own in identify.split_into_folds(labels, machines):
        assert not {*machines[others]} & {*machines[own]}
        assert {*labels[others]} == {"none", "both"}
    # of one sound machine each job stands for itself
    one = identify.split_into_folds(labels, np.where(labels == "none", 0, machines))
    assert len(one) == identify.FOLDS
