"""Which joint of a study, and which clearance, explain a record; or that nothing in it does.

By scikit-learn, on the features of the study's records, whose shares of the joints are the prior.
What is said of a study's own jobs comes from folds of machines: each is judged by the others.
"""

import math
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from sklearn.covariance import EmpiricalCovariance
from sklearn.decomposition import PCA
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, DotProduct, WhiteKernel
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import StratifiedGroupKFold, cross_val_predict
from sklearn.neighbors import KNeighborsRegressor, NearestNeighbors

from compressor import store, vibration
from compressor.digits import align_columns
from compressor.metrics import JOINTS
from compressor.program import Progress, no_progress
from compressor.studies import frame
from compressor.studies.diagnosis.dataset import name_machine
from compressor.studies.diagnosis.features import features

MIN_JOBS, MIN_IN_ALL = 30, 200  # jobs of one joint, for it to be identified, and of all
FOLDS = 10  # of machines
LEVEL = 0.9  # of the intervals
LIMIT = 0.01  # share of the study's own jobs that are as strange as what does not fit
ENDS = {"none": (), "big_end": (0,), "small_end": (1,), "both": (0, 1)}  # places in JOINTS
IDENTIFIED = ("joint", "clearance_mm", "sensor")  # groups of keys that are no caution
# least spread that a feature counts with: of one that the study does not vary, such as the speed, a
# record's timing moves the last digits alone (a thousandth is 0.2 % of the speed)
MIN_SPREAD = 1e-3
FARTHEST = 8.0  # standard deviations at which a feature that lies beyond is seen
# of the scores of joints: width and ridge of the kernel, by folds of a study of 1,200 machines, and
# the weight of the likelihood beside the squared weights of the scores
GAMMA, ALPHA, PENALTY = 0.01, 0.01, 50.0
NEIGHBOURS = 50  # jobs by whose errors an interval is as wide as it is
SAMPLE = 800  # jobs by which the kernel of a regression is chosen
# of strangeness: share of the variance that components have, how many of them foretell the others,
# and by which kernel
VARIANCE, STRONG, WIDTH, RIDGE = 0.999, 10, 0.02, 0.03


@dataclass(frozen=True)
class Library:
    """The n jobs of a study that have a sensor's record.

    joints: worn ones, (n,) none, big_end, small_end or both; clearances: mm, (n, 2) of big and
    small end, 0 where there is none; features: (n, FEATURES), nan where a record does not have one;
    machines: (n,), their names; jobs: of the study; swept: its other keys.
    """

    study: str
    keys: np.ndarray
    joints: np.ndarray
    clearances: np.ndarray
    features: np.ndarray
    machines: np.ndarray
    jobs: int
    swept: list[str]

    def only(self, mask: np.ndarray) -> "Library":
        """Return the jobs that a mask (n,) keeps."""
        columns = ("keys", "joints", "clearances", "features", "machines")
        return replace(self, **{name: getattr(self, name)[mask] for name in columns})


def read_library(folder: store.Folder, study: str, progress: Progress = no_progress) -> Library:
    """Return the library of a stored study. Raises StudyError without a record, and StoreError."""
    source, left = store.find_study(folder, study), Counter[str]()
    rows: list[tuple[Any, ...]] = []
    for job in frame.records(folder, source, left, progress):
        try:
            found = np.array([*features(job.record).values()])
        except vibration.RecordError:
            left["silent_record"] += 1
            continue
        ends = [getattr(job.case.clearance_mm, side) for side in JOINTS]
        rows.append((job.key, job.case.worn_joint, ends, found, name_machine(job.case)))
    if not rows:
        raise frame.no_records(source, left, vibration.MIN_REVOLUTIONS)
    keys_of = (axis.key for axis in source.axes)
    swept = [key for key in keys_of if key.partition(".")[0] not in IDENTIFIED]
    keys, joints, opened, found, machines = map(np.array, zip(*rows, strict=True))
    return Library(study, keys, joints, opened, found, machines, source.jobs, swept)


@dataclass(frozen=True)
class Interval:
    """What a clearance is: the best value and the ends of its interval, mm."""

    median: float
    low: float
    high: float


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
    jobs that are as strange; nearest: the key of the nearest job.
    """

    candidates: list[Candidate]
    fits: bool
    p_value: float
    nearest: str


@dataclass(frozen=True)
class Clearance:
    """Log clearances of k ends by n jobs' features, with intervals that hold as often as they say.

    A Gaussian process tells them. Its error about a record is that of the jobs of which it tells
    alike, times the factor by which `LEVEL` of the n lie inside (split by folds: a conformal
    interval, Lei et al. 2018, J. Am. Stat. Assoc. 113, 1094).
    """

    models: list[GaussianProcessRegressor]
    spread: KNeighborsRegressor
    factor: np.ndarray  # (k,)
    span: np.ndarray  # least and greatest log clearance, (2, k)

    @classmethod
    def fit(cls, points: np.ndarray, logs: np.ndarray, machines: np.ndarray) -> "Clearance":
        """Return the regressions of log clearances, (n, k), on points, (n, F)."""
        folds = split_into_folds(np.zeros(len(points)), machines)
        sample = slice(None, None, -(-len(points) // SAMPLE))
        models, told = [], np.empty_like(logs)
        for k, column in enumerate(logs.T):
            smooth = ConstantKernel() * RBF(10.0) + ConstantKernel() * DotProduct()
            kernel = smooth + WhiteKernel(0.1)
            tuned = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ConvergenceWarning)  # of a kernel at its bounds
                kernel = tuned.fit(points[sample], column[sample]).kernel_
            model = GaussianProcessRegressor(kernel, optimizer=None, normalize_y=True)
            told[:, k] = cross_val_predict(model, points, column, cv=folds)
            models.append(model.fit(points, column))
        errors = np.abs(logs - told)
        near = KNeighborsRegressor(min(NEIGHBOURS, len(points) - 1)).fit(told, errors)
        # of each job's neighbours, without itself
        spread = errors[near.kneighbors(return_distance=False)].mean(axis=1)
        share = min(1.0, math.ceil((len(points) + 1) * LEVEL) / len(points))
        scores = errors / np.maximum(spread, 1e-12)
        factor = np.quantile(scores, share, axis=0, method="higher")
        return cls(models, near, factor, np.array([logs.min(axis=0), logs.max(axis=0)]))

    def locate(self, point: np.ndarray) -> list[Interval]:
        """Return the clearances at a record's point, cut where the study's end."""
        told = np.array([model.predict(point[None])[0] for model in self.models])
        half = self.factor * self.spread.predict(told[None]).reshape(-1)
        ends = np.clip([told, told - half, told + half], *self.span)
        return [Interval(*column) for column in np.exp(ends).T.tolist()]


def split_into_folds(
    labels: np.ndarray, machines: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return folds of jobs, (others, own) places each: a machine is in one of them alone.

    Where a label has too few machines, whatever is alike, each job stands for itself.
    """
    groups = np.arange(len(labels)) if has_few_machines(labels, machines) else machines
    return [*StratifiedGroupKFold(FOLDS).split(labels, labels, groups)]


def has_few_machines(labels: np.ndarray, machines: np.ndarray) -> bool:
    """Return whether any label has fewer machines than there are folds."""
    return min(len({*machines[labels == one].tolist()}) for one in np.unique(labels)) < FOLDS


@dataclass(frozen=True)
class Strangeness:
    """How far the weak components of records are from what the strong ones foretell of them.

    own: sorted distances of the study's jobs, each foretold by those of other machines.
    """

    whiten: PCA
    foretell: KernelRidge
    metric: EmpiricalCovariance
    own: np.ndarray
    nearest: NearestNeighbors

    @classmethod
    def fit(cls, points: np.ndarray, folds: Sequence[Any]) -> "Strangeness":
        """Return the judge of records whose points should be like those of n jobs, (n, F)."""
        whiten = PCA(VARIANCE, whiten=True, svd_solver="full").fit(points)
        white = whiten.transform(points)
        strong, weak = np.split(white, [min(STRONG, white.shape[1] // 2)], axis=1)
        foretell = KernelRidge(kernel="rbf", gamma=WIDTH, alpha=RIDGE)
        left = weak - cross_val_predict(foretell, strong, weak, cv=folds)
        own = np.empty(len(points))
        for others, mine in folds:  # a job must not narrow its own distance
            own[mine] = EmpiricalCovariance().fit(left[others]).mahalanobis(left[mine])
        return cls(
            whiten, foretell.fit(strong, weak), EmpiricalCovariance().fit(left), np.sort(own),
            NearestNeighbors().fit(white),
        )  # fmt: skip

    def judge(self, point: np.ndarray) -> tuple[float, int]:
        """Return the share of jobs that are as strange as a record, and the nearest one's place."""
        white = self.whiten.transform(point[None])
        strong, weak = np.split(white, [self.foretell.X_fit_.shape[1]], axis=1)
        far = self.metric.mahalanobis(weak - self.foretell.predict(strong))[0]
        as_far = len(self.own) - int(np.searchsorted(self.own, far))
        nearest = self.nearest.kneighbors(white, 1, return_distance=False)[0, 0]
        return (1 + as_far) / (1 + len(self.own)), int(nearest)


@dataclass(frozen=True)
class Identifier:
    """A study made ready to explain records.

    joints: those that it knows; right: the share of the study's jobs whose joint is told by those
    of others that stand `apart`: machines, or jobs.
    """

    library: Library
    joints: list[str]
    middle: np.ndarray  # of features, (F,)
    scale: np.ndarray
    scorer: KernelRidge
    chooser: LogisticRegression | None  # None: it knows one joint alone
    clearances: dict[str, Clearance]
    strangeness: Strangeness
    right: float
    apart: str

    @classmethod
    def fit(cls, library: Library) -> "Identifier":
        """Return the identifier of a library's jobs. Raises StudyError where there are too few."""
        counts = {joint: int((library.joints == joint).sum()) for joint in ENDS}
        joints = [joint for joint, count in counts.items() if count >= MIN_JOBS]
        library = library.only(np.isin(library.joints, joints))
        if len(library.keys) < MIN_IN_ALL:
            numbers = ", ".join(f"{joint} {count}" for joint, count in counts.items())
            problem = f"study {library.study} has too few jobs with a sensor's record: {numbers}"
            least = f"{MIN_JOBS} of each joint and {MIN_IN_ALL} in all, better thousands"
            raise frame.StudyError(f"{problem}; draw at least {least}")
        middle = np.nan_to_num(np.nanmedian(library.features, axis=0))
        filled = np.where(np.isnan(library.features), middle, library.features)
        scale = np.maximum(filled.std(axis=0), MIN_SPREAD)
        points = np.clip((filled - middle) / scale, -FARTHEST, FARTHEST)
        folds = split_into_folds(library.joints, library.machines)
        are_few = has_few_machines(library.joints, library.machines)
        one_hot = (library.joints[:, None] == joints).astype(float)
        scorer, chooser, right = KernelRidge(kernel="rbf", gamma=GAMMA, alpha=ALPHA), None, 1.0
        if len(joints) > 1:
            scores = cross_val_predict(scorer, points, one_hot, cv=folds)
            chooser = LogisticRegression(C=PENALTY, max_iter=1000).fit(scores, library.joints)
            right = float(chooser.score(scores, library.joints))
        scorer.fit(points, one_hot)
        clearances = {}
        for joint in joints:
            mine, ends = library.joints == joint, list(ENDS[joint])
            if ends:
                logs = np.log(library.clearances[mine][:, ends])
                clearances[joint] = Clearance.fit(points[mine], logs, library.machines[mine])
        return cls(
            library, joints, middle, scale, scorer, chooser, clearances,
            Strangeness.fit(points, folds), right, "jobs" if are_few else "machines",
        )  # fmt: skip

    def identify(self, row: np.ndarray) -> Identification:
        """Return the joints that explain a record with these features, (FEATURES,)."""
        filled = np.where(np.isnan(row), self.middle, row)
        point = np.clip((filled - self.middle) / self.scale, -FARTHEST, FARTHEST)
        chances = dict.fromkeys(self.joints, 1.0)
        if self.chooser is not None:
            found = self.chooser.predict_proba(self.scorer.predict(point[None]))[0].tolist()
            chances = dict(zip(self.chooser.classes_.tolist(), found, strict=True))
        candidates = []
        for joint in sorted(self.joints, key=lambda joint: -chances[joint]):
            inside = self.clearances[joint].locate(point) if joint in self.clearances else []
            ends = dict(zip([JOINTS[end] for end in ENDS[joint]], inside, strict=True))
            candidates.append(Candidate(joint, chances[joint], ends))
        p_value, nearest = self.strangeness.judge(point)
        return Identification(
            candidates, p_value >= LIMIT, p_value, str(self.library.keys[nearest])
        )


def explain_record(
    record: vibration.Record, folder: store.Folder, study: str, key: str, progress: Progress
) -> tuple[Identifier, Identification]:
    """Return the joints that explain a record by a stored study, and the identifier.

    key: a job left out, since it must not explain itself. Raises RecordError, StoreError, and
    StudyError where the study has too little.
    """
    row = np.array([*features(record).values()])
    library = read_library(folder, study, progress)
    fitted = Identifier.fit(library.only(library.keys != key))
    return fitted, fitted.identify(row)


def list_joints(fitted: Identifier, answer: Identification) -> Iterator[str]:
    """Yield the ranking of joints, first that nothing fits where nothing does, and its grounds."""
    library = fitted.library
    if not answer.fits:
        yield f"NOTHING IN THIS STUDY FITS: {answer.p_value:.2%} of its own jobs are as strange"
        yield (
            "compare noise (sensor.noise_m_per_s2), unit (g read as m/s2 is a factor of 9.8), "
            "tacho and sensor; then widen what the study varies; do not trust the ranking"
        )
    rows = [("rank", "joint", "probability", "clearance, mm: best [90 % interval]")]
    for rank, one in enumerate(answer.candidates, 1):
        ends = [
            f"{side} {found.median:.3f} [{found.low:.3f}, {found.high:.3f}]"
            for side, found in one.clearances.items()
        ]
        rows.append((str(rank), one.joint, f"{one.probability:.3f}", "; ".join(ends)))
    yield from align_columns(rows, "<<>")
    left = [joint for joint in ENDS if joint not in fitted.joints]
    facts = {
        "jobs of the study": f"{len(library.keys)} of {library.jobs}",
        f"of these, joint right by those of other {fitted.apart}": f"{fitted.right:.1%}",
        "of these, as strange as the record": f"{answer.p_value:.1%}",
        "nearest job": answer.nearest,
        "joints with too few jobs": ", ".join(left) or "none",
        "varied": ", ".join(library.swept) or "none",
    }
    yield from align_columns(facts.items())
    yield "all else, such as the laws of contact and friction, is as in the study's case file"


def jsonable_answer(record: str, fitted: Identifier, answer: Identification) -> dict[str, Any]:
    """Return an answer as JSON says it."""
    return {
        "record": record, "study": fitted.library.study, "jobs": len(fitted.library.keys),
        "jobs_of_study": fitted.library.jobs, **asdict(answer),
        "study_joint_right": fitted.right, "by_other": fitted.apart,
        "joints": fitted.joints,
    }  # fmt: skip
