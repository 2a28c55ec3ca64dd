"""The card of a data set: what was simulated, what the numbers are, and what is not in it."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.cases import Sensor
from compressor.outcome import regime_words
from compressor.studies.diagnosis.data_set import LABELS, MODELS, WORDS

if TYPE_CHECKING:
    import xarray as xr

LEFT_OUT = {  # reasons that are the data set's; others are those of `compsim status`
    "missing": "not run yet",
    "damaged": "the stored file is damaged",
    "without_record": "no sensor, or no time series kept",
    "too_short": "fewer revolutions than a window",
    "silent_record": "a record of zeros, or with values that are no numbers",
}
SOUND = (
    "**Sound joints with a clearance.** A joint that `joint` does not name is ideal, while a sound "
    "bearing has a working clearance: to distinguish faults is easier here."
)
ABSENT = (
    "**Measured data.** Everything is simulated. Scores on this data say nothing of a real machine "
    "until they are repeated on one.",
    "**Feedback of the body.** The machine drives the body, and the body's motion does not come "
    "back.",
    "**Other faults.** Valves, rings, pistons, bearings and couplings are sound. Other machines on "
    "the same floor are absent. Noise is white: neighbours, flow and gear meshes are not.",
    "**Progress.** A clearance is constant over a record; nothing wears, and there is no history.",
    "**Frequencies of faults.** Kinds of joints are as often as the case file makes them, not as "
    "they are in the field, so that prior probabilities are not to be taken from here.",
)


def data_card(dataset: "xr.Dataset", parquet: bool) -> str:
    """Return the card of a data set (`make_data_set`) as Markdown.

    parquet: whether that is written.
    """
    fixed, models = (json.loads(dataset.attrs[name]) for name in ("fixed", "models"))
    parts = [
        f"# {dataset.attrs['title'].removeprefix('compsim: ').capitalize()}",
        describe_origin(dataset),
        "## What was simulated", describe_simulation(dataset, fixed),
        "The model of these jobs, by part:",
        table(("part", "kind, and how many jobs have it"), model_rows(models)),
        "## Windows, noise and split", describe_cuts(dataset),
        table(("joint", "split", "machines", "windows"),
              [(a, b, f"{m:,}", f"{w:,}") for a, b, m, w in counts(dataset)]),
        "## The body and its sensor", groups(fixed),
        "## Labels", labels(dataset),
        "## Features", feature_table(dataset),
        "## Files", files(dataset, parquet),
        "## What is not in it", "\n".join(f"- {line}" for line in absent(fixed, models)),
    ]  # fmt: skip
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a table of Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(escape_cell(cell) for cell in line)} |" for line in lines)


def escape_cell(cell: Any) -> str:
    """Return a cell's text: whatever it holds does not end the cell."""
    return str(cell).replace("|", r"\|").replace("\n", " ")


def describe_origin(dataset: "xr.Dataset") -> str:
    """Return the program, versions and case file."""
    versions_by_name = json.loads(dataset.attrs["versions"])
    versions = ", ".join(f"{name} {version}" for name, version in versions_by_name.items())
    return (
        f"Made by {dataset.attrs['program']} from the study `{dataset.attrs['study']}` of "
        f"`{dataset.attrs['case_file']}`. The study was run by: {versions}."
    )


def describe_simulation(dataset: "xr.Dataset", fixed: dict[str, Any]) -> str:
    """Describe jobs and machines, swept keys, kinds of motion, and jobs that are left out."""
    machines = len({*dataset["machine"].values.tolist()})
    jobs = len({*dataset["key"].values.tolist()})
    first = (
        f"{dataset.attrs['jobs']:,} simulated jobs. {jobs:,} of them, of {machines:,} machines, "
        "gave windows. A machine is all that is built: every value of a case but load, speed, "
        "sensor and numerics."
    )
    rows = []
    for key, units, reach, count in json.loads(dataset.attrs["axes"]):
        numbers = reach and not isinstance(reach[0], str)
        values = f"{reach[0]:g} to {reach[1]:g}" if numbers else ", ".join(reach)
        rows.append((f"`{key}`", units if units != "1" else "", values, f"{count:,}"))
    swept = table(("swept key", "unit", "values", "different ones"), rows)
    regimes = Counter(
        dict(zip(dataset["key"].values, dataset["regime"].values, strict=True)).values()
    )
    kinds = "; ".join(
        f"{count:,} {regime_words(name) or 'not known'}" for name, count in regimes.most_common()
    )
    left = json.loads(dataset.attrs["left_out"])
    failed = "failed (`compsim status`)"
    lines = [f"- {n:,} {reason}: {LEFT_OUT.get(reason, failed)}" for reason, n in left.items()]
    out = "\n".join(["Left out, for these reasons:", "", *lines]) if left else "No job is left out."
    clipped, most = dataset.attrs["clipped_records"], 100 * dataset.attrs["clipped_most"]
    record = f"No record has {100 * Sensor.REPORTED:g} % or more of its samples clipped."
    if clipped:
        record = (
            f"**Clipped.** {clipped:,} of {jobs:,} records are clipped at `sensor.range_m_per_s2`, "
            f"at worst {most:.3g} % of their samples: features of these are of the clipped record."
        )
    others = ", ".join(
        f"`{name}` {value}" for name, value in (fixed.get("solve") or {}).items()
        if name in ("accuracy", "rtol", "duration_rev", "settle_rev", "method")
    )  # fmt: skip
    return "\n\n".join([
        first, swept,
        f"Motions: {kinds}. Chaotic ones stay, with the label `regime`. Numerics of the first job: "
        f"{others}.", record, out,
    ])  # fmt: skip


def describe_cuts(dataset: "xr.Dataset") -> str:
    """Describe how records were cut, disturbed and split."""
    attrs = dataset.attrs
    levels = ", ".join(f"{rms:g}" for rms in dataset["noise"].values)
    hops = "one after the other" if attrs["hop"] >= attrs["revolutions"] else "overlapping"
    text = (
        f"A window has {attrs['revolutions']} whole revolutions, from tacho pulse to tacho pulse; "
        f"the next begins {attrs['hop']} later ({hops}). Features are given at each noise level: "
        f"{levels} m/s² rms of white noise over half the sampling rate, added to the window's "
        "samples beside the noise that the sensor itself has. Its seed is [seed, key as a number, "
        f"first pulse, number of the level], by numpy's default generator; the seed is "
        f"{attrs['seed']}. "
    )
    return text + (
        f"The split is by machine, {attrs['test_share']:.0%} of those of each joint for testing: "
        "all windows of a machine stand on one side, at whatever load and speed."
    )


def counts(dataset: "xr.Dataset") -> list[tuple[str, str, int, int]]:
    """Return the machines and windows by joint and split: (joint, split, machines, windows)."""
    joints, splits, machines = (dataset[n].values for n in ("joint", "split", "machine"))
    found = []
    for joint in sorted({*joints.tolist()}):
        for split in ("train", "test"):
            mine = (joints == joint) & (splits == split)
            found.append((joint, split, len({*machines[mine].tolist()}), int(mine.sum())))
    return found


def groups(fixed: dict[str, Any]) -> str:
    """Return the body and the sensor of the first job, as a case file has them."""
    rows = [
        (f"`{group}.{name}`", value)
        for group in ("body", "sensor")
        for name, value in (fixed.get(group) or {}).items()
    ]
    text = "Values of the first job; swept ones stand above."
    return f"{text}\n\n{table(('key', 'value'), rows)}"


def labels(dataset: "xr.Dataset") -> str:
    """Describe the labels of a window, and their ranges."""
    rows = [(f"`{name}`", "", phrase, _words(dataset, name)) for name, phrase in WORDS.items()]
    for name, (unit, phrase, _) in LABELS.items():
        values = dataset[name].values
        rows.append((f"`{name}`", unit, phrase, f"{np.min(values):g} to {np.max(values):g}"))
    text = table(("label", "unit", "what it is", "values"), rows)
    healthy = json.loads(dataset.attrs["fixed"]).get("healthy_clearance_mm")
    if not healthy:
        return text
    ends = " and ".join(
        f"up to {size:g} mm at the {joint.replace('_', ' ')}" for joint, size in healthy.items()
    )
    return f"{text}\n\nA joint counts as sound, and not as a fault, with a clearance {ends}."


def _words(dataset: "xr.Dataset", name: str) -> str:
    found = sorted({*dataset[name].values.tolist()})
    return f"{len(found):,} different" if name in ("key", "machine") else ", ".join(found)


def feature_table(dataset: "xr.Dataset") -> str:
    """Return the names, units and phrases."""
    columns = (dataset[name].values for name in ("feature", "feature_unit", "feature_phrase"))
    rows = [(f"`{name}`", unit, phrase) for name, unit, phrase in zip(*columns, strict=True)]
    return table(("feature", "unit", "what it is"), rows)


def files(dataset: "xr.Dataset", parquet: bool) -> str:
    """Describe the files, and how they are opened."""
    signal = "their samples, " if "signal" in dataset else ""
    lines = [
        f"- `windows.nc` (netCDF-4, which is HDF5): the windows, {signal}labels and features; "
        "`xarray.open_dataset(path, engine='h5netcdf')`."
    ]
    if parquet:
        lines.append(
            "- `features.parquet`: a row for each window and noise level, labels and features; "
            "`pyarrow.parquet.read_table(path)`, or any data frame library."
        )
    else:
        lines.append("- No Parquet file: pyarrow was not installed when this was written.")
    return "\n".join(lines)


def model_rows(models: dict[str, dict[str, int]]) -> list[tuple[str, str]]:
    """Return the kinds of each part of the model, with the number of jobs that have them."""
    return [
        (MODELS[part], ", ".join(f"{kind} ({count:,})" for kind, count in kinds.items()))
        for part, kinds in models.items() if kinds
    ]  # fmt: skip


def unmodelled_parts(models: dict[str, dict[str, int]]) -> Iterator[str]:
    """Yield the effects that the chosen models leave out, each with the jobs concerned."""

    def of_jobs(part: str, kind: str) -> str:
        count, every = models[part].get(kind, 0), sum(models[part].values())
        return "" if count == every else f" This is said of {count:,} of {every:,} jobs."

    laws = {*models["contact"]}, {*models["friction"]} - {"none"}
    laws_text = " and ".join(
        f"one law of {name}" for name, known in zip(("contact", "friction"), laws, strict=True)
        if len(known) == 1
    )  # fmt: skip
    if laws_text:
        yield f"**Other laws.** The joints have {laws_text} (see the table above)."
    stiff = "Crank, crosshead and guide are rigid, the rod" + (
        f" too.{of_jobs('rod', 'rigid')}" if "rigid" in models["rod"] else " is elastic."
    )
    yield (f"**Flexible parts.** {stiff} The casing has one mode at the guide and one at the main "
           "bearing, or none.")  # fmt: skip
    if "dry" in models["journals"]:
        text = "No film carries, damps or separates the journals."
        yield f"**Oil.** {text}{of_jobs('journals', 'dry')}"
    if "constant" in models["crank"]:
        text = "But for the sensor's slow jitter, the speed of a record is constant."
        yield f"**Changing speed.** {text}{of_jobs('crank', 'constant')}"


def absent(fixed: dict[str, Any], models: dict[str, dict[str, int]]) -> list[str]:
    """Describe the parts that the data set does not have."""
    body, sensor = fixed.get("body") or {}, fixed.get("sensor") or {}
    found = [*ABSENT, *unmodelled_parts(models)]
    if not fixed.get("healthy_clearance_mm"):
        found.insert(2, SOUND)
    if body:
        found.append(
            f"**Other foundations.** The body of the first job has {body['mass_kg']:g} kg and "
            f"natural frequencies of {body['frequency_x_Hz']:g} Hz and {body['frequency_y_Hz']:g} "
            "Hz; unless these are swept, levels and bands are of this one."
        )
    if sensor:
        found.append(
            f"**Other sensors.** The first job's is at the {sensor['place']}, along "
            f"{sensor['direction']}; unless that is swept, there is no other."
        )
    if body.get("start") == "steady":
        found.append(
            "**Revolutions of their own.** A steady record repeats the settled revolutions that "
            "were simulated; what differs from one to the next is jitter and noise."
        )
    return found
