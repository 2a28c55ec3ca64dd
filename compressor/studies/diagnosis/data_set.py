"""Labelled windows of sensors' records: what was simulated, features, and a split by machine.

A window is a whole number of revolutions of one record. A machine is what is built: all of a case
but its load, speed, sensor and numerics (`machine_of`). All windows of a machine are for training,
or all are for testing: windows of one machine are much alike, and a score over windows that were
split at random would measure how well a machine is recognised.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.cases import Case, PerJoint, Sensor
from compressor.outcome import Regime, regime_words
from compressor.program import PROGRAM, CompsimError, Progress, no_progress
from compressor.store import (
    DamagedFile,
    Folder,
    Stored,
    StoredStudy,
    find_study,
    healthy_clearance,
    read_store,
)
from compressor.studies.diagnosis.features import FEATURES, features
from compressor.vibration import MIN_REVOLUTIONS, RecordError, find_noise_mistake, noisy

if TYPE_CHECKING:
    import xarray as xr

RECORD = ("sensor_time", "sensor_acceleration", "tacho_time")
# groups of a case
NOT_BUILT = (
    "name", "load", "sensor", "solve", "output", "initial_offset_mm", "healthy_clearance_mm",
)  # fmt: skip
LABELS = {  # name -> (unit, phrase, key of a case file)
    "clearance_mm_big_end": ("mm", "radial clearance; 0: ideal joint", "clearance_mm.big_end"),
    "clearance_mm_small_end": ("mm", "radial clearance; 0: ideal joint", "clearance_mm.small_end"),
    "speed_rpm": ("rpm", "crank speed", "machine.speed_rpm"),
    "rod_mass_kg": ("kg", "rod mass", "machine.rod_mass_kg"),
    "reciprocating_mass_kg": (
        "kg", "crosshead, piston rod and piston", "machine.reciprocating_mass_kg",
    ),
}  # fmt: skip
WORDS = {
    "key": "the job that a window is of",
    "machine": "hash of what is built: all of a case but load, speed, sensor and numerics",
    "joint": "joints with clearance, or with more than is healthy: the fault",
    "load": "load on the piston",
    "regime": "; ".join(map(regime_words, Regime)),
}
MODELS = {  # parts of the model whose kind a study chooses: in words
    "contact": "contact law of joints with clearance",
    "friction": "friction law of the joints",
    "journals": "between journal and bore",
    "rod": "rod",
    "guide": "crosshead's guide",
    "crank": "crank's speed",
}
RECORD_NEEDED = "`body: true` and `sensor: {length_rev: 11}`"


class DataSetError(CompsimError):
    """A study that no data set can be made of, or options that contradict: and what to do."""

    exit_code = 2


@dataclass(frozen=True)
class DataSetOptions:
    """How to cut, to disturb and to split.

    revolutions: of a window; hop: from the begin of a window to that of the next, None: as many, so
    that windows do not overlap; noise: rms values (m/s2) of white noise that is added to a window's
    samples before its features are taken, over half the sampling rate, beside the sensor's own;
    test_share: of the machines; seed: of noise and split; signals: keep the windows' samples.
    """

    revolutions: int = 5
    hop: int | None = None
    noise: tuple[float, ...] = (0.0,)
    test_share: float = 0.3
    seed: int = 1
    signals: bool = True

    def __post_init__(self) -> None:
        if self.revolutions < MIN_REVOLUTIONS:
            raise DataSetError(
                f"a window has at least {MIN_REVOLUTIONS} revolutions, not {self.revolutions}"
            )
        if self.hop is not None and self.hop < 1:
            raise DataSetError(f"windows are at least 1 revolution apart, not {self.hop}")
        mistake = find_noise_mistake(self.noise)
        if mistake:
            raise DataSetError(mistake)
        if not 0.0 < self.test_share < 1.0:
            raise DataSetError(f"the test share is between 0 and 1, not {self.test_share:g}")


@dataclass(frozen=True)
class Window:
    """A part of a record, from the last sample not after a tacho pulse to the first not before one.

    `first`: the pulse that it begins with; `times` (s, (n,)) and `tacho` (s, (k,)) from the first
    sample on; `values`: m/s2, (n,).
    """

    first: int
    times: np.ndarray
    values: np.ndarray
    tacho: np.ndarray

    def slim(self, signals: bool) -> "Window":
        """Return the part that a data set keeps, without a view of the record.

        Two times, the tacho, and the samples with `signals`.
        """
        values = self.values.astype(np.float32) if signals else np.empty(0, np.float32)
        return Window(self.first, self.times[:2].copy(), values, self.tacho.copy())


def windows(record: dict[str, np.ndarray], revolutions: int, hop: int) -> Iterator[Window]:
    """Yield the windows of a record, by the names of `RECORD` (`features`).

    `hop` revolutions apart.
    """
    times, values, tacho = (record[name] for name in RECORD)
    for first in range(0, len(tacho) - revolutions, hop):
        pulses = tacho[first : first + revolutions + 1]
        begin = max(int(np.searchsorted(times, pulses[0], side="right")) - 1, 0)
        inside = slice(begin, int(np.searchsorted(times, pulses[-1])) + 1)
        since = times[begin]
        yield Window(first, times[inside] - since, values[inside], pulses - since)


def machine_of(case: Case) -> str:
    """Return a name for the machine of a case, 12 hexadecimal digits.

    It is the same at any load and speed.
    """
    built = {name: value for name, value in case.values().items() if name not in NOT_BUILT}
    built["machine"] = {k: v for k, v in built["machine"].items() if k != "speed_rpm"}
    return hashlib.sha256(json.dumps(built, sort_keys=True).encode()).hexdigest()[:12]


def split_by_machine(
    machines: Sequence[str], strata: Sequence[str], share: float, seed: int
) -> np.ndarray:
    """Return whether windows are for testing, (n,): all of a machine or none.

    machines, strata: of each window. Of the machines of each stratum a share is drawn, to the
    nearest number, and at least one of two; a single one is for training. The order of windows
    does not matter.
    """
    rng = np.random.default_rng(seed)
    stratum_of = dict(zip(machines, strata, strict=True))
    tested: set[str] = set()
    for stratum in sorted({*strata}):
        mine = sorted(machine for machine, its in stratum_of.items() if its == stratum)
        count = min(max(round(share * len(mine)), 1), len(mine) - 1)
        tested |= {mine[i] for i in rng.permutation(len(mine))[:count]}
    return np.array([machine in tested for machine in machines], bool)


def make_data_set(
    folder: Folder,
    study: str | None = None,
    options: DataSetOptions | None = None,
    progress: Progress = no_progress,
) -> "xr.Dataset":
    """Return the labelled windows of a stored study; None: the store's only one.

    Dimensions: `window`, `noise` (m/s2), `feature`; with signals also `sample` and `pulse`.
    Variables: `features` (window, noise, feature); labels by window: the `WORDS`, the `LABELS`,
    `first_pulse` and `split`, train or test; `signal` (m/s2, single precision, nan beyond a
    window's end) with `samples`, `rate` (Hz) and `tacho` (s). Failed and missing jobs, and records
    that are too short, are left out and counted in the attribute `left_out`; chaotic ones stay.

    Jobs are read one by one. What stays in memory are the windows, 4 bytes a sample, at the end
    twice, and twice again while they are written; without signals 1 kB a window. Raises
    DataSetError where nothing is left, StoreError where the store cannot be read.
    """
    options = options or DataSetOptions()
    source = find_study(folder, study)
    stored = read_store(folder).warned()
    if source.is_grid and source.fixed.get("sensor") is None:
        raise without_sensor(source)
    rows: list[dict[str, Any]] = []
    left: Counter[str] = Counter()
    models: dict[str, Counter[str]] = {part: Counter() for part in MODELS}
    keys, healthy = list(dict.fromkeys(source.keys)), healthy_clearance(source)
    for number, key in enumerate(keys):
        progress(number, len(keys), "")
        found = job_rows(stored, key, options, healthy)
        if isinstance(found, str):
            left[found] += 1
            continue
        rows += found
        for part, kind in found[0]["models"].items():
            models[part][kind] += 1
    progress(len(keys), len(keys), "")
    if not rows and {*left} == {"without_record"}:
        raise without_sensor(source)
    if not rows:
        reasons = ", ".join(f"{count} {reason}" for reason, count in left.items())
        text = f"study {source.name} has no record to cut windows of: {reasons}"
        more = f"sensor.length_rev: {options.revolutions + 1} or more"
        raise DataSetError(f"{text}; run what is missing, or with {more}")
    clipped = [*{row["key"]: row["clipped"] for row in rows}.values()]
    return label_rows(rows, options).assign_attrs(
        clipped_records=sum(share >= Sensor.REPORTED for share in clipped),
        clipped_most=float(np.nanmax([0.0, *clipped])),
        title=f"compsim: labelled windows of {source.name}", program=PROGRAM,
        study=source.name, case_file=source.case_file, fixed=json.dumps(source.fixed),
        versions=json.dumps(source.versions),
        axes=json.dumps([[a.key, a.units, *_reach(a.values)] for a in source.axes]),
        jobs=len(keys), left_out=json.dumps(left), models=json.dumps(models),
        revolutions=options.revolutions,
        hop=options.hop or options.revolutions, test_share=options.test_share, seed=options.seed,
    )  # fmt: skip


def without_sensor(study: StoredStudy) -> DataSetError:
    """Return the error that says which keys a study without records lacks."""
    text = f"study {study.name} has no sensor's record: write {RECORD_NEEDED} into"
    return DataSetError(f"{text} {study.case_file}, keep series, and run it again")


def _record(stored: Stored, key: str) -> dict[str, np.ndarray]:
    """Return a job's record by the names of `RECORD`; nothing where it has none."""
    found = stored.values(key, RECORD)
    return found if found.keys() == {*RECORD} else {}


def job_rows(
    stored: Stored, key: str, options: DataSetOptions, healthy: PerJoint
) -> list[dict[str, Any]] | str:
    """Return the windows of a job, each with labels and features; or why there are none.

    healthy: the clearance up to which a joint counts as sound.
    """
    found = stored.find_ok(key, healthy)
    if isinstance(found, str):
        return found
    case, outcome = found
    try:
        record = _record(stored, key)
    except DamagedFile:
        return "damaged"
    if not record:
        return "without_record"
    base = {
        "key": key, "machine": machine_of(case), "joint": case.worn_joint, "load": case.load,
        "regime": str(outcome.attributes.get("regime", "")), **labels_of(case),
        "models": models_of(case),
        "clipped": float(outcome.numbers["clipped_fraction"]),
    }  # fmt: skip
    rows = []
    hop = options.hop or options.revolutions
    try:
        for window in windows(record, options.revolutions, hop):
            numbers = features_by_noise(window, int(key, 16), options)
            rows.append({**base, "window": window.slim(options.signals), "features": numbers})
    except RecordError:
        return "silent_record"
    return rows or "too_short"


def models_of(case: Case) -> dict[str, str]:
    """Return the kind of each of the `MODELS` that a case has; a part that it lacks is left out."""
    friction, guide = case.friction, case.guide
    rubs = friction and (case.joint != "none" or friction.ideal_joints)
    found = {
        "friction": friction.law or "adams" if friction and rubs else "none",
        "rod": "elastic" if case.rod else "rigid",
        "guide": "ideal" if not guide else "with play" if guide.clearance_mm else "with friction",
        "crank": "of a motor" if case.drive else "constant",
    }
    if case.joint == "none":
        return found
    return found | {"contact": case.contact.law, "journals": "oil" if case.lubricant else "dry"}


def labels_of(case: Case) -> dict[str, float]:
    """Return the `LABELS` of a case; the clearance of an ideal joint is 0."""
    values = case.values()
    clearance = values.get("clearance_mm", {})
    found = {f"clearance_mm_{joint}": clearance.get(joint) for joint in ("big_end", "small_end")}
    for name, (_, _, key) in LABELS.items():
        group, _, inner = key.partition(".")
        if group == "machine":
            found[name] = values[group][inner]
    return {name: float(value or 0.0) for name, value in found.items()}


def features_by_noise(window: Window, key: int, options: DataSetOptions) -> np.ndarray:
    """Return the features of a window at each noise level, (levels, features)."""
    found = np.empty((len(options.noise), len(FEATURES)))
    for level, rms in enumerate(options.noise):
        values = noisy(window.values, rms, [options.seed, key, window.first, level])
        found[level] = [*features(window.times, values, window.tacho).values()]
    return found


def label_rows(rows: Sequence[dict[str, Any]], options: DataSetOptions) -> "xr.Dataset":
    """Return the rows of `job_rows` as a Dataset."""
    import xarray as xr

    dim = ("window",)
    machines, joints = ([row[name] for row in rows] for name in ("machine", "joint"))
    test = split_by_machine(machines, joints, options.test_share, options.seed)
    what = {"long_name": "features of the windows", "coordinates": "feature noise"}
    variables: dict[str, Any] = {
        "features": (("window", "noise", "feature"), np.array([r["features"] for r in rows]), what)
    }
    for name, phrase in WORDS.items():
        variables[name] = (dim, np.array([row[name] for row in rows]), {"long_name": phrase})
    for name, (unit, phrase, key) in LABELS.items():
        attrs = {"units": unit, "long_name": phrase, "case_key": key}
        variables[name] = (dim, np.array([row[name] for row in rows]), attrs)
    pulses = np.array([row["window"].first for row in rows])
    variables["first_pulse"] = (dim, pulses, {"long_name": "tacho pulse that a window begins with"})
    split = {"long_name": "train or test, by machine"}
    variables["split"] = (dim, np.where(test, "test", "train"), split)
    for name in ("unit", "phrase"):
        texts = [getattr(one, name) or "1" for one in FEATURES.values()]
        variables[f"feature_{name}"] = (("feature",), np.array(texts), {})
    if options.signals:
        variables |= signals([row["window"] for row in rows])
    rms = {"units": "m/s2", "long_name": "rms of the white noise that was added"}
    noise = xr.Variable(("noise",), np.array(options.noise, float), rms)
    index = np.arange(len(rows))
    return xr.Dataset(variables, {"window": index, "noise": noise, "feature": [*FEATURES]})


def signals(found: Sequence[Window]) -> dict[str, tuple]:
    """Return the samples of windows, without added noise."""
    sizes = np.array([one.values.size for one in found])
    values = np.full((len(found), sizes.max()), np.nan, np.float32)
    for row, one in zip(values, found, strict=True):
        row[: one.values.size] = one.values
    rate = np.array([1.0 / (one.times[1] - one.times[0]) for one in found])
    since = "tacho pulses since the first sample"
    return {
        "signal": (
            ("window", "sample"), values, {"units": "m/s2", "long_name": "samples of the sensor"}
        ),
        "samples": (("window",), sizes, {"units": "1", "long_name": "samples of the window"}),
        "rate": (("window",), rate, {"units": "Hz", "long_name": "sampling rate"}),
        "tacho": (
            ("window", "pulse"), np.array([one.tacho for one in found]),
            {"units": "s", "long_name": since},
        ),
    }  # fmt: skip


def _reach(values: Sequence[Any]) -> list[Any]:
    """Return the least and the greatest of a swept key's values, or its words.

    And how many differ.
    """
    known = [value for value in values if value is not None]
    numbers = all(isinstance(value, int | float) for value in known)
    kinds = {json.dumps(value) for value in known}
    if numbers and known and not any(isinstance(value, bool) for value in known):
        return [[min(known), max(known)], len(kinds)]
    return [sorted(str(json.loads(kind)) for kind in kinds), len(kinds)]
