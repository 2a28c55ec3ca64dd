"""Labelled windows of sensors' records, to learn diagnosis from: netCDF, Parquet, and a card.

A machine is what is built: all of a case but its load, speed, sensor and numerics. All windows of a
machine are for training, or all are for testing: windows of one machine are much alike, and a score
over windows that were split at random would measure how well a machine is recognised.
"""

import hashlib
import io
import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor.cases import Case, Sensor, values_given
from compressor.program import PROGRAM, Progress, no_progress
from compressor.store import Folder, find_study, publish, swept_column, write_dataset
from compressor.studies.diagnosis.features import FEATURES, features
from compressor.studies.frame import RecordedJob, StudyError, cut_windows, no_records, records
from compressor.vibration import RecordError, noisy

# groups of a case that are no part of a machine
NOT_BUILT = (
    "name", "load", "sensor", "solve", "output", "initial_offset_mm", "healthy_clearance_mm",
)  # fmt: skip
WINDOWS, TABLE, CARD_FILE = "windows.nc", "features.parquet", "README.md"
NO_PARQUET = (
    f"{TABLE} is left out, since pyarrow is not installed: pip install 'compsim[dataset]', and "
    "run the same command again"
)
MAX_WORDS = 8  # kinds of a label that are listed


class Label(NamedTuple):
    """A label's unit, what it is, and how it is read of a job."""

    unit: str
    phrase: str
    read: Callable[[RecordedJob], Any]


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
    folder: Folder,
    study: str | None = None,
    revolutions: int = 5,
    hop: int = 0,
    noise: Sequence[float] = (0.0,),
    test_share: float = 0.3,
    seed: int = 1,
    signals: bool = True,
    progress: Progress = no_progress,
) -> xr.Dataset:
    """Return the labelled windows of a stored study; None: the store's only one.

    revolutions, hop: see `cut_windows`; noise: rms (m/s2) of white noise that is added to a
    window's samples before its features are taken, beside the sensor's own; test_share: of the
    machines of each joint; seed: of noise and split; signals: keep the windows' samples.

    Dimensions: `window`, `noise`, `feature`; with signals also `sample` and `pulse`. Variables:
    `features`, the `LABELS`, `first_pulse` and `split` (train or test); `signal` (m/s2, single
    precision, nan beyond a window's end) with `samples`, `rate` (Hz) and `tacho` (s). Jobs that
    give no window are counted in the attribute `left_out`. In memory are the windows, 4 bytes a
    sample. Raises StudyError where nothing is left, StoreError where the store cannot be read.
    """
    source = find_study(folder, study)
    left: Counter[str] = Counter()
    rows: list[dict[str, Any]] = []
    clipped: list[float] = []
    for job in records(folder, source, left, progress):
        labels = {name: label.read(job) for name, label in LABELS.items()}
        own = []
        try:
            for first, window in cut_windows(job.record, revolutions, hop):
                found = [
                    [*features(replace(window, values=values)).values()]
                    for level, rms in enumerate(noise)
                    for values in [
                        noisy(window.values, rms, [seed, int(job.key, 16), first, level])
                    ]
                ]
                # copies: a view would keep the whole record
                samples = window.values.astype(np.float32) if signals else None
                more = {"features": found, "first_pulse": first, "signal": samples}
                own.append(labels | more | {"rate": window.rate, "tacho": window.tacho.copy()})
        except RecordError:
            left["silent_record"] += 1
            continue
        left["too_short"] += not own
        rows += own
        clipped += [float(job.outcome.numbers["clipped_fraction"])] if own else []
    if not rows:
        raise no_records(source, +left, revolutions)
    return stack_rows(rows, noise, test_share, seed).assign_attrs(
        title=f"compsim: labelled windows of {source.name}", program=PROGRAM, study=source.name,
        case_file=source.case_file, fixed=json.dumps(source.fixed),
        versions=json.dumps(source.versions),
        axes=json.dumps([
            [axis.key, swept_column(axis.key, axis.values)[1].get("units", ""),
             list_values(axis.values)]
            for axis in source.axes
        ]),
        jobs=len({*source.keys}), left_out=json.dumps(+left), revolutions=revolutions,
        hop=hop or revolutions, test_share=test_share, seed=seed,
        clipped_records=sum(share >= Sensor.REPORTED for share in clipped),
        clipped_most=float(np.nanmax([0.0, *clipped])),
    )  # fmt: skip


def stack_rows(
    rows: Sequence[dict[str, Any]], noise: Sequence[float], test_share: float, seed: int
) -> xr.Dataset:
    """Return windows, each with its labels, features and samples, as a Dataset."""
    column = {name: np.array([row[name] for row in rows]) for name in (*LABELS, "first_pulse")}
    test = split_by_machine(column["machine"].tolist(), column["joint"].tolist(), test_share, seed)
    found: dict[str, Any] = {
        "features": (("window", "noise", "feature"), np.array([row["features"] for row in rows]),
                     {"long_name": "features of the windows"}),
        **{name: ("window", column[name], {"units": one.unit or "1", "long_name": one.phrase})
           for name, one in LABELS.items()},
        "first_pulse": ("window", column["first_pulse"],
                        {"long_name": "tacho pulse that a window begins with"}),
        "split": ("window", np.where(test, "test", "train"),
                  {"long_name": "train or test, by machine"}),
        "feature_phrase": ("feature", [*FEATURES.values()]),
    }  # fmt: skip
    if rows[0]["signal"] is not None:
        sizes = np.array([row["signal"].size for row in rows])
        signal = np.full((len(rows), sizes.max()), np.nan, np.float32)
        for values, row in zip(signal, rows, strict=True):
            values[: row["signal"].size] = row["signal"]
        found |= {
            "signal": (("window", "sample"), signal,
                       {"units": "m/s2", "long_name": "samples, without added noise"}),
            "samples": ("window", sizes, {"units": "1", "long_name": "samples of the window"}),
            "rate": ("window", np.array([row["rate"] for row in rows]),
                     {"units": "Hz", "long_name": "sampling rate"}),
            "tacho": (("window", "pulse"), np.array([row["tacho"] for row in rows]),
                      {"units": "s", "long_name": "tacho pulses since the first sample"}),
        }  # fmt: skip
    rms = {"units": "m/s2", "long_name": "rms of the white noise that was added"}
    where = {"window": np.arange(len(rows)), "feature": [*FEATURES]}
    return xr.Dataset(found, where | {"noise": ("noise", np.array(noise, float), rms)})


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


def list_values(values: Iterable[Any]) -> str:
    """Return the reach of numbers, or words with how often there are, as a cell of a table."""
    known = [value for value in values if value is not None]
    if known and all(isinstance(one, int | float) and not isinstance(one, bool) for one in known):
        return f"{min(known):g} to {max(known):g}"
    kinds = Counter(map(str, known))
    if len(kinds) > MAX_WORDS:
        return f"{len(kinds):,} different"
    return ", ".join(f"{kind or 'not known'} ({count:,})" for kind, count in sorted(kinds.items()))


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


CARD = """\
# Labelled windows of {study}

Made by {program} from the study `{study}` of `{case_file}`, which was run by: {versions}.
**Everything is simulated**: scores on these data say nothing of a real machine until they are
repeated on one.

{warnings}
## What is in it

`{windows_file}` (netCDF-4): windows with labels, features and, unless they were left out, samples;
`xarray.open_dataset(path, engine="h5netcdf")`. `{table_file}`, where pyarrow was installed: a row
for each window and noise level, with labels and features.

A window has whole revolutions, from tacho pulse to tacho pulse. The noise is white, over half the
sampling rate, beside the sensor's own; its seed is [seed, key as a number, first pulse, number of
the level], by numpy's default generator. The split is by machine: all windows of a machine stand on
one side, at whatever load and speed.

{facts}

{counts}

## Labels

{labels}

## Features

{features}

## Swept keys

{swept}

## The case of the first job

Swept keys have other values in other jobs, and blocks of a case file may have other parts.

{case}

## What is not in it

- **Feedback of the body.** The machine drives the body, whose motion does not come back. Unless it
  is swept, levels and bands are of this one body, and of this one sensor.
- **Other faults.** Valves, rings, pistons, bearings and couplings are sound; no other machine
  stands on the floor; neighbours, flow and gear meshes make no noise.
- **Progress.** A clearance is constant over a record; nothing wears, and there is no history. A
  record of a steady body repeats the revolutions that were simulated.
- **Frequencies of faults.** Joints are as often worn as the case file has it, not as in the field.
"""


def write_card(dataset: xr.Dataset) -> str:
    """Return the card of a data set as Markdown: facts in tables, and warnings."""
    attrs = dataset.attrs
    left = json.loads(attrs["left_out"])
    facts = {
        "simulated jobs": attrs["jobs"],
        "jobs that gave windows": len({*dataset["key"].values.tolist()}),
        "machines": len({*dataset["machine"].values.tolist()}),
        "revolutions of a window": attrs["revolutions"],
        "revolutions to the next window": attrs["hop"],
        "rms of added noise, m/s²": ", ".join(f"{rms:g}" for rms in dataset["noise"].values),
        "share of machines for testing": attrs["test_share"],
        "seed of noise and split": attrs["seed"],
        **{f"jobs left out: {reason}": count for reason, count in left.items()},
    }
    described = zip(dataset["feature"].values, dataset["feature_phrase"].values, strict=True)
    return CARD.format(
        study=attrs["study"], program=attrs["program"], case_file=attrs["case_file"],
        windows_file=WINDOWS, table_file=TABLE,
        versions=", ".join(" ".join(item) for item in json.loads(attrs["versions"]).items()),
        warnings="".join(f"- **Warning:** {text}\n" for text in list_warnings(dataset)),
        facts=tabulate(("fact", "value"), facts.items()),
        counts=tabulate(("joint", "split", "machines", "windows"), count_windows(dataset)),
        labels=tabulate(("label", "unit", "what it is", "values"),
                        [(name, one.unit, one.phrase, list_values(dataset[name].values.tolist()))
                         for name, one in LABELS.items()]),
        features=tabulate(("feature", "what it is"), described),
        swept=tabulate(("key", "unit", "values"), json.loads(attrs["axes"])),
        case=tabulate(("key", "value"), values_given(json.loads(attrs["fixed"])).items()),
    )  # fmt: skip


def tabulate(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a table of Markdown; whatever a cell holds does not end it."""
    lines = [head, ["---"] * len(head), *rows]
    cells = [[str(cell).replace("|", r"\|").replace("\n", " ") for cell in line] for line in lines]
    return "\n".join(f"| {' | '.join(line)} |" for line in cells)


def check_folder(folder: Folder) -> None:
    """Raise StudyError where a folder has a README.md that is no data set's card."""
    place = Path(folder)
    if (place / CARD_FILE).exists() and not (place / WINDOWS).exists():
        text = f"{place} has a {CARD_FILE} of something else, which the card would replace"
        raise StudyError(f"{text}: choose another folder, such as {place / 'faults'}")


def write_data_set(folder: Folder, dataset: xr.Dataset) -> list[Path]:
    """Write a data set into a folder, each file whole or not at all; return their paths.

    Files of an earlier one are replaced. Parquet needs pyarrow, and is left out without. Raises
    StoreError where the disk refuses, StudyError as `check_folder` does.
    """
    check_folder(folder)
    place = Path(folder)
    paths = [write_dataset(place / WINDOWS, dataset), place / CARD_FILE]
    publish(paths[1], write_card(dataset).encode(errors="replace"))
    (place / TABLE).unlink(missing_ok=True)  # of an earlier data set
    labels = dataset[["split", "first_pulse", *LABELS]].to_dataframe().reset_index()
    rows = labels.loc[labels.index.repeat(dataset.sizes["noise"])].reset_index(drop=True)
    rows["noise"] = np.tile(dataset["noise"].values, dataset.sizes["window"])
    rows[[*FEATURES]] = dataset["features"].values.reshape(-1, len(FEATURES))
    file = io.BytesIO()
    try:
        rows.to_parquet(file, engine="pyarrow", index=False)
    except ImportError:
        return paths
    publish(place / TABLE, file.getvalue())
    return [*paths, place / TABLE]
