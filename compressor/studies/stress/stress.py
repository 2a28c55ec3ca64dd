"""A campaign of extreme scenes: how many run, how many fail and why, and whether any lies.

Scenes of `extremes` are judged one by one (`judge`) in worker processes. What is finished is kept
in the folder's stress.nc, from which the same command goes on. The result is a Dataset with the
dimension scene.
"""

import math
import time
from collections import Counter
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from compressor.cases import MODEL_VERSION, Case, CaseError
from compressor.program import PROGRAM, Progress, no_progress
from compressor.reasons import Reason
from compressor.store import Folder, StoreError, read_dataset, write_dataset
from compressor.studies.stress import extremes
from compressor.studies.stress.extremes import Budget
from compressor.sweep import JobLost, JobResult, Needs, run_here

FILE = "stress.nc"
FULL_BUDGET = Budget()
TIMEOUT = 300.0  # s that a scene may take with all of its judges
SECONDS_BETWEEN_WRITES = 30.0  # s between two writings of what is finished
VERDICTS = ("ok", "failed", "silent_wrong", "unjudged")
REMEDY = "give another folder, or delete it"

Row = dict[str, Any]

TEXTS = {
    "verdict": "ok, failed (see reason), silent_wrong or unjudged",
    "reason": "why a run failed, or was not judged, by a stable name",
    "detail": "what is known of a failure beyond its reason",
    "load": "load on the piston",
    "joint": "joints with clearance",
    "judges": "integrators that judged; in parentheses: did not reach the end",
    "worst_metric": "the metric that is farthest beyond what its error bar tells",
}
NUMBERS = {
    "seconds": ("s", "wall time of the run with its error bars"),
    "judging_seconds": ("s", "wall time of the run and its judges"),
    "steps": ("1", "integration steps of the run, refused ones included"),
    "evaluations": ("1", "evaluations of the right-hand side"),
    "end": ("1", "share of the span that the run came through"),
    "energy_residual": ("1", "worst energy imbalance relative to the contact's losses"),
    "horizon": ("1", "share of the span in which a shifted run stays close"),
    "judged": ("1", "share of the span that was judged by number"),
    "apart": ("1", "how far the journals came apart from the judge's, over their room"),
    "excess": ("1", "greatest error of a metric over the greatest that is told or expected"),
    "error": ("1", "relative error of the worst metric"),
    "bar": ("1", "relative error bar of the worst metric"),
    "excess_beyond": ("1", "the same of statistics, beyond the horizon"),
    "peak_memory": ("B", "resident memory of the worker, at most, until then"),
}


def run_scene(task: tuple[int, int, Budget]) -> Row:
    """Draw, run and judge scene (number, seed, budget): a row of the campaign."""
    import resource  # not on Windows, where nothing is run

    from compressor.studies.stress.judge import (  # needs numba: only where something is simulated
        PARTS,
        judge,
    )

    number, _, _ = task
    values = extremes.values(*task)
    row: Row = {"scene": number, "load": values["load"], "joint": values["joint"]}
    try:
        case = Case.resolve(values)
    except CaseError as error:
        return row | {
            "verdict": "failed",
            "reason": str(Reason.INVALID_INPUT),
            "detail": "; ".join(map(str, error.problems)),
        }
    began = time.perf_counter()
    result = judge(case)
    run = result.found.trajectory
    end = run.stop_time / case.duration
    return row | extremes.place(case) | {
        "verdict": result.verdict,
        "reason": str(result.reason),
        "detail": result.detail,
        "judges": " ".join(result.by),
        "worst_metric": result.worst.metric or result.beyond.metric,
        "seconds": result.seconds,
        "judging_seconds": time.perf_counter() - began,
        "steps": run.steps + run.rejected,
        "evaluations": run.evaluations,
        "end": 1.0 if math.isnan(end) else end,
        "energy_residual": result.residual,
        "horizon": result.horizon / PARTS,
        "judged": result.judged / PARTS,
        "apart": result.apart,
        "excess": result.worst.ratio,
        "error": result.worst.error,
        "bar": result.worst.bar,
        "excess_beyond": result.beyond.ratio,
        "peak_memory": 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
    }  # fmt: skip


DRAWN = {
    "": "",
    extremes.LAWS: "; with laws drawn",
    extremes.FEATURES: "; with laws and features drawn",
}


def repeat(number: int, seed: int, drawn: str = "") -> tuple[dict[str, Any], Row]:
    """Return the values of a scene's case, by key, and its row, from another run."""
    budget = Budget(drawn)
    return extremes.values(number, seed, budget), run_scene((number, seed, budget))


def campaign(
    folder: Folder,
    count: int,
    seed: int,
    workers: int,
    progress: Progress = no_progress,
    budget: Budget = FULL_BUDGET,
) -> xr.Dataset:
    """Return the first `count` scenes of a seed, and run those that the folder lacks.

    Raises StoreError where it holds other scenes.
    """
    path = Path(folder) / FILE
    rows = {row["scene"]: row for row in read_kept_rows(path, seed, budget)}
    missing = [number for number in range(count) if number not in rows]
    total, written = count, time.monotonic()
    progress(total - len(missing), total, "")
    tasks = [(number, (number, seed, budget), TIMEOUT) for number in missing]
    remark = partial(progress, total - len(missing), total)
    features = budget.drawn == extremes.FEATURES
    needs = Needs(("auto",), plain=True, laws=bool(budget.drawn), features=features)
    running = run_here(run_scene, tasks, needs, workers, remark)
    try:
        for end in running:
            rows[end.id] = scene_row(end)
            progress(sum(number < count for number in rows), total, "")
            if time.monotonic() - written > SECONDS_BETWEEN_WRITES:
                write_dataset(path, campaign_dataset(rows.values(), seed, budget))
                written = time.monotonic()
    finally:
        running.close()
        if rows:
            write_dataset(path, campaign_dataset(rows.values(), seed, budget))
    found = campaign_dataset([rows[number] for number in range(count)], seed, budget)
    found.encoding["source"] = str(path)  # as xarray names a file that it has read
    return found


def scene_row(end: JobResult | JobLost) -> Row:
    """Return the row of a scene, also of one that took its worker with it."""
    if isinstance(end, JobResult):
        return dict(end.result)
    row = {"scene": end.id, "verdict": "failed", "reason": str(end.reason), "detail": end.detail}
    return row | {"seconds": TIMEOUT if end.reason == Reason.BUDGET_SECONDS else math.nan}


def campaign_dataset(rows: Iterable[Row], seed: int, budget: Budget = FULL_BUDGET) -> xr.Dataset:
    """Return the rows as a Dataset with the dimension scene, in order.

    Numbers that there are not are nan.
    """
    rows = sorted(rows, key=lambda row: row["scene"])
    numbers = [row["scene"] for row in rows]
    found: dict[str, tuple] = {}
    for name, phrase in TEXTS.items():
        texts = np.array([row.get(name, "") for row in rows], object)
        found[name] = "scene", texts, {"long_name": phrase}
    of_numbers = {
        name: {"units": unit, "long_name": phrase} for name, (unit, phrase) in NUMBERS.items()
    }
    for name, attrs in (drawn_ranges() | of_numbers).items():
        values = np.array([row.get(name, math.nan) for row in rows], float)
        found[name] = "scene", values, attrs
    inside = np.array([int(extremes.is_supported(number)) for number in numbers])
    phrase = "1: drawn inside the range that is documented as supported"
    found["supported"] = "scene", inside, {"units": "1", "long_name": phrase}
    coordinates = {"scene": ("scene", np.array(numbers, np.int64), {"long_name": "scene"})}
    attrs = {
        "title": "outcomes of extreme scenes",
        "seed": seed,
        "drawn": budget.drawn,
        "settings": settings(budget),
        "program": PROGRAM,
    }
    return xr.Dataset(found, coordinates, attrs)


def drawn_ranges() -> dict[str, dict[str, Any]]:
    """Return the attributes of each drawn parameter: its unit, the ranges that it is drawn from.

    `range` is that of all scenes, `supported_range` that of the supported half; `logarithmic`: 1
    where it is drawn evenly in its logarithm.
    """
    return {
        name: {
            "units": unit,
            "long_name": "where the scene lies",
            "range": list(whole),
            "supported_range": list(narrow or whole),
            "logarithmic": int(log),
        }
        for name, (unit, whole, narrow, log) in extremes.SPANS.items()
    }


def settings(budget: Budget) -> str:
    """Return the settings on which scenes and verdicts depend beside the seed."""
    return (
        f"model {MODEL_VERSION}; {budget.revolutions:g} revolutions, "
        f"{budget.max_steps} steps or {budget.seconds:g} s{DRAWN[budget.drawn]}"
    )


def read_kept_rows(path: Path, seed: int, budget: Budget) -> list[Row]:
    """Return the rows of an earlier run. Raises StoreError if they are of other scenes."""
    if not path.exists():
        return []
    found = read_dataset(path, REMEDY)
    attrs = found.attrs
    if (attrs["seed"], attrs["settings"]) != (seed, settings(budget)):
        raise StoreError(path, f"holds scenes of seed {attrs['seed']}, {attrs['settings']}", REMEDY)
    columns = {str(name): found[name].values.tolist() for name in found.variables}
    return [
        {name: values[i] for name, values in columns.items()} for i in range(found.sizes["scene"])
    ]


def counts(study: xr.Dataset) -> dict[str, dict[str, int]]:
    """Return the number of scenes by end, in the supported range and in the whole.

    An end is a verdict, or the reason of a failed one.
    """
    table = {}
    for kind, inside in (("supported", 1), ("whole", 0)):
        some = study.isel(scene=study["supported"].values == inside)
        ends = zip(some["verdict"].values.tolist(), some["reason"].values.tolist(), strict=True)
        table[kind] = dict(
            Counter(reason if verdict == "failed" else verdict for verdict, reason in ends)
        )
    return table


def worst(study: xr.Dataset, most: int = 10) -> xr.Dataset:
    """Return the scenes that are most wrong: by verdict, then by excess."""
    study = study.isel(scene=study["verdict"].values != "failed")
    ranks = {"silent_wrong": 2.0, "unjudged": 1.0, "ok": 0.0}
    rank = np.array([ranks[verdict] for verdict in study["verdict"].values])
    excess = np.fmax(study["excess"].values, study["excess_beyond"].values)
    order = np.lexsort((-np.nan_to_num(excess, nan=-1.0), -rank))
    return study.isel(scene=order[:most])


def slowest(study: xr.Dataset) -> xr.Dataset | None:
    """Return the ok scene whose run took the most time, if any is ok."""
    good = study.isel(scene=study["verdict"].values == "ok")
    return good.isel(scene=int(np.argmax(good["seconds"].values))) if good.sizes["scene"] else None
