"""Which joint of a study, and which clearance, explain a record; or that nothing in it does.

The joint's probability is that of a logistic regression on summaries, which are regressions of
being each joint on the features (model choice with semi-automatic summaries: Prangle et al. 2014,
Aust. N. Z. J. Stat. 56, 297); its prior are the shares of the joints in the study. Clearances are
those of `approximate`. Nothing fits where the record is stranger than all but few of the study's
own jobs, by `strangeness`.
"""

from dataclasses import dataclass

import numpy as np

from compressor.program import CompsimError, Progress
from compressor.store import Folder
from compressor.studies.diagnosis.approximate import (
    Distance,
    Interval,
    KernelRidge,
    Logistic,
    Posterior,
    Strangeness,
)
from compressor.studies.diagnosis.features import FEATURES
from compressor.studies.diagnosis.library import SIDES, Library, open_library, vector
from compressor.vibration import Record

MIN_JOBS = 30  # of one joint, for it to be identified
MIN_IN_ALL = 200  # jobs: with fewer, no record can lie as far off as LIMIT requires
LIMIT = 0.01  # share of the study's own jobs that lie as far off as what does not fit
SHARES = {"none": (), "big_end": (0,), "small_end": (1,), "both": (0, 1)}  # columns of clearances
ODD = 4  # features that are named where nothing fits
# least spread that a feature counts with: of one that the study does not vary, such as the speed, a
# record's timing moves the last digits alone (a thousandth is 0.2 % of the speed)
MIN_SPREAD = 1e-3
FARTHEST = 8.0  # standard deviations at which regressions see a feature that lies beyond


class StudyError(CompsimError):
    """A study that nothing can be identified by."""

    exit_code = 2


@dataclass(frozen=True)
class Candidate:
    """A joint, its probability, and the interval of the clearance by faulty end."""

    joint: str
    probability: float
    clearances: dict[str, Interval]


@dataclass(frozen=True)
class Identification:
    """What explains a record.

    candidates: the most probable first; fits: whether anything does; p_value: share of the study's
    jobs that are as strange; near: distance from the nearest jobs; apart: of the features from what
    others of them foretell; nearest: the key of the nearest job; odd: the features that are
    farthest from what others foretell, by name, in standard deviations.
    """

    candidates: tuple[Candidate, ...]
    fits: bool
    p_value: float
    near: Distance
    apart: Distance
    nearest: str
    odd: dict[str, float]


@dataclass(frozen=True)
class Identifier:
    """A study made ready to explain records.

    joints: those that it knows; right: the share of the study's own jobs, left out in turn, whose
    joint is the most probable; covered: of whose clearances lie in their intervals, by joint and
    end; equal: whether clearances at both ends were always the same.
    """

    library: Library
    joints: tuple[str, ...]
    middle: np.ndarray  # of features, (F,)
    scale: np.ndarray
    scores: KernelRidge
    logistic: Logistic
    posteriors: dict[str, Posterior]
    strangeness: Strangeness
    right: float
    covered: dict[str, dict[str, float]]
    equal: bool

    @classmethod
    def fit(cls, library: Library) -> "Identifier":
        """Return the identifier of a library's jobs.

        Raises StudyError where there are too few.
        """
        counts = {joint: int((library.joints == joint).sum()) for joint in SHARES}
        joints = tuple(joint for joint, count in counts.items() if count >= MIN_JOBS)
        library = library.only(np.isin(library.joints, joints))
        if len(library.keys) < MIN_IN_ALL:
            numbers = ", ".join(f"{joint} {count}" for joint, count in counts.items())
            problem = f"study {library.study} has too few jobs with a sensor's record: {numbers}"
            least = f"{MIN_JOBS} of each joint and {MIN_IN_ALL} in all, better thousands"
            raise StudyError(f"{problem}; draw at least {least}")
        middle = np.nan_to_num(np.nanmedian(library.features, axis=0))
        filled = np.where(np.isnan(library.features), middle, library.features)
        scale = np.maximum(filled.std(axis=0), MIN_SPREAD)
        points = np.clip((filled - middle) / scale, -FARTHEST, FARTHEST)
        labels = np.array([joints.index(joint) for joint in library.joints])
        scores = KernelRidge.fit(points, np.eye(len(joints))[labels])
        logistic = Logistic.fit(scores.left_out, labels)
        right = float((logistic.probabilities(scores.left_out).argmax(axis=1) == labels).mean())
        both = library.clearances[library.joints == "both"]
        equal = bool(len(both) and (both[:, 0] == both[:, 1]).all())
        posteriors = {
            joint: Posterior.fit(points[mine], library.clearances[mine][:, _ends(joint, equal)])
            for joint in joints
            if SHARES[joint] and (mine := library.joints == joint).any()
        }
        covered = {
            joint: dict(zip(_sides(joint), found.covered.tolist(), strict=False))
            for joint, found in posteriors.items()
        }
        return cls(
            library, joints, middle, scale, scores, logistic, posteriors,
            Strangeness.fit((filled - middle) / scale), right, covered, equal,
        )  # fmt: skip

    def identify(self, row: np.ndarray) -> Identification:
        """Return the joints that explain a record with these features, (FEATURES,)."""
        filled = np.where(np.isnan(row), self.middle, row)
        plain = (filled - self.middle) / self.scale
        point = np.clip(plain, -FARTHEST, FARTHEST)
        chances = self.logistic.probabilities(self.scores.predict(point[None]))[0]
        found = []
        for place in np.argsort(-chances):
            joint, intervals = self.joints[place], []
            if joint in self.posteriors:
                intervals = self.posteriors[joint].intervals(point)
            if len(intervals) < len(SHARES[joint]):
                intervals *= 2  # the same at both ends
            ends = dict(zip(_sides(joint), intervals, strict=True))
            found.append(Candidate(joint, float(chances[place]), ends))
        chance, near, apart = self.strangeness.judge(plain)
        off = self.strangeness.deviations(plain)
        odd = {list(FEATURES)[k]: float(off[k]) for k in np.argsort(-np.abs(off))[:ODD]}
        nearest = str(self.library.keys[self.strangeness.nearest(plain)])
        return Identification(tuple(found), chance >= LIMIT, chance, near, apart, nearest, odd)


def _ends(joint: str, equal: bool) -> list[int]:
    """Return the columns of clearances that are estimated at a joint.

    One where both are always equal.
    """
    return list(SHARES[joint][:1] if equal else SHARES[joint])


def _sides(joint: str) -> list[str]:
    return [SIDES[k] for k in SHARES[joint]]


def explain_record(
    record: Record, folder: Folder, study: str, key: str, progress: Progress
) -> tuple[Identifier, Identification]:
    """Return the joints that explain a record by a stored study, and the identifier.

    key: a job left out.

    Raises RecordError, StoreError, and StudyError where the study has too little.
    """
    row = vector(record)
    fitted = Identifier.fit(open_library(folder, study, progress).without(key))
    return fitted, fitted.identify(row)
