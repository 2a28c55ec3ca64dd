"""The paper's cases in a store: which runs there are, and how to get those that are missing."""

import math
import shlex
import warnings
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.analysis import CLEARANCES, FAULTS, LOADS, label, paper_cases
from compressor.cases import Case
from compressor.store import DamagedJob, Folder, Stored, StoredStudy, StoreWarning


@dataclass(frozen=True)
class PaperRuns:
    """The stored runs of the paper's cases by label; `usable` ones are whole and have series."""

    stored: dict[str, xr.Dataset]
    usable: dict[str, xr.Dataset]
    absent: dict[str, str]  # label -> why it is not usable


def find_paper_runs(stored: Stored, studies: Sequence[StoredStudy]) -> PaperRuns:
    """Return the runs with the physics of the paper's cases."""
    return find_runs(stored, studies, paper_cases())


def is_of_paper(stored: Stored, study: StoredStudy) -> bool:
    """Return whether all stored jobs of a study, and at least one, are cases of the paper."""
    there = sum(at >= 0 for at in stored.rows.find([*study.keys]))
    labels = {case.physics_key for case in paper_cases().values()}
    return 0 < there == len(paper_candidates(stored, [study], labels))


def find_runs(
    stored: Stored, studies: Sequence[StoredStudy], cases: Mapping[str, Case]
) -> PaperRuns:
    """Return the studies' runs with the physics of some cases by label; of several, the most
    exact.
    """
    labels = {case.physics_key: name for name, case in cases.items()}
    found: dict[str, xr.Dataset] = {}
    damaged = set()
    for key in paper_candidates(stored, studies, labels):
        name = labels[stored.physics_key(key)]
        try:
            run = stored.job(key)
        except DamagedJob as error:
            warnings.warn(str(error), StoreWarning, stacklevel=2)
            damaged.add(name)
            continue
        if name not in found or rank(run) > rank(found[name]):
            found[name] = run
    usable = {name: run for name, run in found.items() if rank(run)[:2] == (True, True)}
    absent = {n: why_absent(found.get(n), n in damaged) for n in labels.values() if n not in usable}
    return PaperRuns({n: found[n] for n in labels.values() if n in found}, usable, absent)


def paper_candidates(
    stored: Stored, studies: Sequence[StoredStudy], physics: Collection[str]
) -> list[str]:
    """Return the keys of the studies' stored jobs that simulate some physics, in the studies'
    order.
    """
    keys = list(dict.fromkeys(key for study in studies for key in study.keys))
    positions = stored.rows.find(keys)
    wanted = np.array([*physics], "S")
    same = np.isin(stored.rows.columns["physics_key"], wanted)
    return [key for key, at in zip(keys, positions, strict=True) if at >= 0 and same[at]]


def rank(run: xr.Dataset) -> tuple[bool, bool, float]:
    """Return what makes a run better than another of the same physics."""
    return str(run["status"].item()) == "ok", "time" in run.dims, -run.attrs.get("rtol", math.inf)


def why_absent(run: xr.Dataset | None, damaged: bool) -> str:
    """Return why a case of the paper cannot be drawn."""
    if run is None:
        return "its file is damaged" if damaged else "not stored"
    if str(run["status"].item()) != "ok":
        return f"failed: {run['reason'].item()}"
    return "stored without its time series"


def case_files(labels: Collection[str]) -> dict[str, str]:
    """Return the case files that give some of the paper's cases: the text of each by its name."""
    files = {f"{name}.yaml": f"load: {load}" for name, load in LOADS.items() if name in labels}
    for fault in FAULTS:
        sizes = [f"{c:g}" for c in CLEARANCES if label(fault, c) in labels]
        if sizes:
            text = f"joint: {fault}\nclearance_mm: [{', '.join(sizes)}]"
            files[f"{fault.replace('_', '-')}.yaml"] = text
    return files


def run_command(files: Iterable[str], results: Folder) -> str:
    """Return the command that runs case files into a store, for a shell."""
    return f"compsim run {' '.join(files)} -o {shlex.quote(str(results))}"
