"""Labelled windows of sensors' records, to learn diagnosis from.

A machine is what is built: all of a case but its load, speed, sensor and numerics. All windows of a
machine are for training, or all are for testing: windows of one machine are much alike, and a score
over windows that were split at random would measure how well a machine is recognised.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor import cases, store, vibration
from compressor.cases import Case
from compressor.program import Progress, no_progress
from compressor.studies import frame
from compressor.studies.diagnosis.features import FEATURES, features

# groups of a case that are no part of a machine
NOT_BUILT = (
    "name", "load", "sensor", "solve", "output", "initial_offset_mm", "healthy_clearance_mm",
)  # fmt: skip
TEST_SHARE, SEED = 0.3, 1  # of the machines of each joint that are for testing, and of their draw
NOT_IN_IT = (
    "Everything is simulated: scores on these data say nothing of a real machine until they are "
    "repeated on one. The body's motion does not come back to the machine. Valves, rings, pistons, "
    "bearings and couplings are sound; neighbours, flow and gear meshes make no noise. A clearance "
    "is constant over a record. Joints are as often worn as the case file has it, not as in the "
    "field."
)


class Label(NamedTuple):
    """A label's unit, what it is, and how it is read of a job."""

    unit: str
    phrase: str
    read: Callable[[frame.RecordedJob], Any]


def name_machine(case: Case) -> str:
    """Return a name for the machine of a case, 12 hexadecimal digits, at any load and speed."""
    built = {name: value for name, value in case.values().items() if name not in NOT_BUILT}
    built["machine"] = {k: v for k, v in built["machine"].items() if k != "speed_rpm"}
    return hashlib.sha256(json.dumps(built, sort_keys=True).encode()).hexdigest()[:12]


CLEARANCE = "radial clearance; 0: ideal joint"
LABELS = {
    "key": Label("", "the job that a window is of", lambda job: job.key),
    "machine": Label("", "hash of all of a case but load, speed, sensor and numerics",
                     lambda job: name_machine(job.case)),
    "joint": Label("", "joints with clearance, or with more than is healthy: the fault",
                   lambda job: job.case.worn_joint),
    "load": Label("", "load on the piston", lambda job: job.case.load),
    "regime": Label("", "kind of motion; chaotic ones stay",
                    lambda job: str(job.outcome.attributes.get("regime", ""))),
    "clearance_mm_big_end": Label("mm", CLEARANCE, lambda job: job.case.clearance_mm.big_end),
    "clearance_mm_small_end": Label("mm", CLEARANCE, lambda job: job.case.clearance_mm.small_end),
    "speed_rpm": Label("rpm", "crank speed", lambda job: job.case.machine.speed_rpm),
    "rod_mass_kg": Label("kg", "rod mass", lambda job: job.case.machine.rod_mass_kg),
    "reciprocating_mass_kg": Label("kg", "crosshead, piston rod and piston",
                                   lambda job: job.case.machine.reciprocating_mass_kg),
}  # fmt: skip


def make_data_set(
    folder: store.Folder,
    study: str | None = None,
    revolutions: int = 5,
    progress: Progress = no_progress,
) -> xr.Dataset:
    """Return the labelled windows of a stored study; None: the store's only one.

    revolutions: whole ones, of a window. Dimensions: `window`, `feature`, `sample`, `pulse`.
    Variables: `features`, the `LABELS`, `first_pulse`, `split` (train or test), `signal` (m/s2,
    single precision, nan beyond a window's end) with `samples`, `rate` (Hz) and `tacho` (s). Jobs
    that give no window are counted in the attribute `left_out`. In memory are the windows, 4 bytes
    a sample. Raises StudyError where nothing is left, StoreError where the store cannot be read.
    """
    source = store.find_study(folder, study)
    left: Counter[str] = Counter()
    rows: list[dict[str, Any]] = []
    clipped: list[float] = []
    for job in frame.records(folder, source, left, progress):
        labels = {name: label.read(job) for name, label in LABELS.items()}
        try:
            own = [
                labels | {
                    "features": [*features(window).values()], "first_pulse": first,
                    # copies: a view would keep the whole record
                    "signal": window.values.astype(np.float32), "rate": window.rate,
                    "tacho": window.tacho.copy(),
                }
                for first, window in vibration.cut_windows(job.record, revolutions)
            ]  # fmt: skip
        except vibration.RecordError:
            left["silent_record"] += 1
            continue
        left["too_short"] += not own
        rows += own
        clipped += [float(job.outcome.numbers["clipped_fraction"])] if own else []
    if not rows:
        raise frame.no_records(source, +left, revolutions)
    return stack_rows(rows).assign_attrs(
        title=f"compsim: labelled windows of {source.name}", comment=NOT_IN_IT,
        study=source.name, case_file=source.case_file, fixed=json.dumps(source.fixed),
        versions=json.dumps(source.versions), jobs=len({*source.keys}), left_out=json.dumps(+left),
        revolutions=revolutions, clipped_most=float(np.nanmax([0.0, *clipped])),
        clipped_records=sum(share >= cases.Sensor.REPORTED for share in clipped),
    )  # fmt: skip


def stack_rows(rows: Sequence[dict[str, Any]]) -> xr.Dataset:
    """Return windows, each with its labels, features and samples, as a Dataset."""
    column = {name: np.array([row[name] for row in rows]) for name in (*LABELS, "first_pulse")}
    test = split_by_machine(column["machine"].tolist(), column["joint"].tolist(), TEST_SHARE, SEED)
    sizes = np.array([row["signal"].size for row in rows])
    signal = np.full((len(rows), sizes.max()), np.nan, np.float32)
    for values, row in zip(signal, rows, strict=True):
        values[: row["signal"].size] = row["signal"]
    found: dict[str, Any] = {
        "features": (("window", "feature"), np.array([row["features"] for row in rows]),
                     {"long_name": "features of the windows"}),
        **{name: ("window", column[name], {"units": one.unit or "1", "long_name": one.phrase})
           for name, one in LABELS.items()},
        "first_pulse": ("window", column["first_pulse"],
                        {"long_name": "tacho pulse that a window begins with"}),
        "split": ("window", np.where(test, "test", "train"),
                  {"long_name": "train or test, by machine"}),
        "feature_phrase": ("feature", [*FEATURES.values()]),
        "signal": (("window", "sample"), signal, {"units": "m/s2", "long_name": "samples"}),
        "samples": ("window", sizes, {"units": "1", "long_name": "samples of the window"}),
        "rate": ("window", np.array([row["rate"] for row in rows]),
                 {"units": "Hz", "long_name": "sampling rate"}),
        "tacho": (("window", "pulse"), np.array([row["tacho"] for row in rows]),
                  {"units": "s", "long_name": "tacho pulses since the first sample"}),
    }  # fmt: skip
    return xr.Dataset(found, {"window": np.arange(len(rows)), "feature": [*FEATURES]})


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


def count_windows(dataset: xr.Dataset) -> list[tuple[str, str, int, int]]:
    """Return the machines and windows by joint and split: (joint, split, machines, windows)."""
    joints, splits, machines = (dataset[n].values for n in ("joint", "split", "machine"))
    return [
        (joint, split, len({*machines[mine].tolist()}), int(mine.sum()))
        for joint in sorted({*joints.tolist()})
        for split in ("train", "test")
        for mine in [(joints == joint) & (splits == split)]
    ]


def list_warnings(dataset: xr.Dataset) -> Iterator[str]:
    """Yield what a user of a data set has to know before all else."""
    attrs = dataset.attrs
    if attrs["clipped_records"]:
        yield (
            f"{attrs['clipped_records']:,} records are clipped at sensor.range_m_per_s2, at worst "
            f"{100 * attrs['clipped_most']:.3g} % of their samples: their features are of that"
        )
    alone = [
        joint for joint, split, count, _ in count_windows(dataset) if (split, count) == ("test", 0)
    ]
    if alone:
        yield f"too few machines to test on: {', '.join(alone)}"
    if not json.loads(attrs["fixed"]).get("healthy_clearance_mm"):
        yield (
            "sound joints are ideal, while a sound bearing has a working clearance: faults are "
            "easier to tell apart here (healthy_clearance_mm says up to which one is sound)"
        )
