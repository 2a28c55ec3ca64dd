"""One machine judged: the paper's eleven cases of it simulated, and how far each claim is off."""

import hashlib
import json
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor.analysis import RULES, cases_of, claim_margins
from compressor.cases import Case, Study
from compressor.program import PROGRAM, CompsimError, Progress, ignore_warnings, no_progress
from compressor.store import (
    Folder,
    StoreError,
    coordinate_names,
    read_dataset,
    swept_column,
    write_dataset,
)
from compressor.sweep import JobLost, JobResult, Needs, run_here

CLAIMS = tuple(range(1, 9))
SHARES = ("apart", "hit", "energy_angle", "active")  # by which claim 7 is measured
IDEAL = ("typical", "design")


class Judged(NamedTuple):
    """What is stored of a machine.

    `margin`, `error`: of each claim, (8,); `share_margin`, `share_error`: of claim 7 by each of
    `SHARES` alone, (4,); nan where runs failed. `chaotic`: how many of the nine worn cases are.
    `failed`: which cases failed, and why.
    """

    margin: tuple[float, ...] = (math.nan,) * len(CLAIMS)
    error: tuple[float, ...] = (math.nan,) * len(CLAIMS)
    share_margin: tuple[float, ...] = (math.nan,) * len(SHARES)
    share_error: tuple[float, ...] = (math.nan,) * len(SHARES)
    chaotic: int = 0
    failed: str = ""


def judge(machine: Case) -> Judged:
    """Return how far a machine is from each claim's threshold, by its nine worn cases.

    machine: a case without clearance, whose machine, contact, friction, loads and solver settings
    count. Runs stay in memory. A machine with a failed case has no margins.
    """
    cases = cases_of(machine)
    runs: dict[str, xr.Dataset] = {}
    fits = len(cases) == PAPER_CASES
    problems = [] if fits else ["a load or a clearance of the paper does not fit the machine"]
    for name, case in cases.items():
        if name in IDEAL:
            continue
        run = simulate_quietly(case)
        if str(run["status"].item()) != "ok":
            problems.append(f"{name}: {run['reason'].item()}")
        runs[name] = run
    chaotic = sum(run.attrs.get("regime") == "chaotic" for run in runs.values())
    if problems:
        return Judged(chaotic=chaotic, failed="; ".join(problems))
    each, alone = claim_margins(runs | ideal_runs(ideal_text(machine)))
    shares = [alone[name] for name in SHARES]
    return Judged(
        tuple(margin.value for margin in each),
        tuple(margin.error for margin in each),
        tuple(margin.value for margin in shares),
        tuple(margin.error for margin in shares),
        chaotic,
    )


def cases_judged(machine: Case) -> Iterable[Case]:
    """Return the cases that a machine is judged by, which read its keys."""
    return cases_of(machine).values()


def simulate_quietly(case: Case) -> xr.Dataset:
    """Return a case's run; a solver's remarks are left aside."""
    from compressor.solve import simulate  # needs numba: only to simulate

    with ignore_warnings():
        return simulate(replace(case, output=replace(case.output, keep="series")))


def ideal_text(machine: Case) -> str:
    """Return the keys, as JSON, on which the ideal machines' motion and load depend.

    Masses and what joints do are not among them.
    """
    values: dict[str, Any] = machine.values()
    read_values = {key: values[key] for key in ("gas", "spring", "solve")}
    lengths = ("crank_radius_mm", "rod_length_mm", "speed_rpm")
    read_values["machine"] = {key: values["machine"][key] for key in lengths}
    return json.dumps(read_values, sort_keys=True)


@lru_cache(maxsize=8)
def ideal_runs(text: str) -> dict[str, xr.Dataset]:
    """Return both ideal machines' runs, which most machines of a study share."""
    cases = cases_of(Case.resolve(json.loads(text)))
    return {name: simulate_quietly(cases[name]) for name in IDEAL}


PAPER_CASES = 11  # that a machine is judged by
SECONDS_BETWEEN_WRITES = 3.0  # s between two writings of what is finished
TIMEOUT = 900.0  # s that a machine may take, with all of its cases
REMEDY = "delete it, or choose another folder"
OTHER_MACHINES = "holds machines of another case file, or of another version of compsim"
ELSEWHERE = "choose another folder by -o, or delete it"
ROLES = ("joint", "load", "clearance_mm", "initial_offset_mm", "body", "sensor")
UNIT = {"units": "1"}
ABOUT = ("machine_title", "machine_notes")  # attributes: what a case file says of its machine


class ClaimsError(CompsimError, ValueError):
    """A study that makes no machines to judge."""

    exit_code = 2


def machines(study: Study) -> list[Case]:
    """Return the machines of a study.

    Raises ClaimsError where it gives what the paper's cases decide.
    """
    swept = [axis.key for axis in study.axes if axis.key.partition(".")[0] in ROLES]
    decided = swept or [key for key in ROLES if is_given(study.cases[0], key)]
    if decided:
        raise ClaimsError(
            f"{study.path}: {decided[0]}: the paper's cases decide it, by which every machine is "
            "judged: leave it out"
        )
    return [*study.cases]


def is_given(case: Case, key: str) -> bool:
    """Return whether a case has another value of a key than the default."""
    default = Case.from_values({})
    return getattr(case, key) != getattr(default, key)


def judge_machines(
    study: Study,
    folder: Folder,
    workers: int,
    progress: Progress = no_progress,
) -> xr.Dataset:
    """Return all machines of a study, and run those that FOLDER/NAME.nc does not hold.

    As `machines_dataset` makes it. Whatever ends the run early, what was finished is stored, but
    for the last seconds. Raises ClaimsError, WorkersFailed, and StoreError also where the file
    holds finished machines that the study does not have, which would be lost.
    """
    cases, path = machines(study), Path(folder) / f"{study.name}.nc"
    keys = [machine_key(case) for case in cases]
    known = read_kept_machines(path)
    if not known.keys() <= {*keys}:
        raise StoreError(path, OTHER_MACHINES, ELSEWHERE)
    missing = [number for number, key in enumerate(keys) if key not in known]
    total, written, done = len(keys), time.monotonic(), len(keys) - len(missing)
    progress(done, total, "")
    tasks = [(number, cases[number], TIMEOUT) for number in missing]
    needs = Needs.of(cases)
    running = run_here(judge, tasks, needs, workers, partial(progress, done, total))
    try:
        for end in running:
            known[keys[end.id]] = judge_end(end)
            done += 1
            progress(done, total, "")
            if time.monotonic() - written > SECONDS_BETWEEN_WRITES:
                write_dataset(path, machines_dataset(study, keys, known))
                written = time.monotonic()
    finally:
        running.close()
        if missing:
            write_dataset(path, machines_dataset(study, keys, known))
    found = machines_dataset(study, keys, known)
    if not missing and about_machine(read_machines(path)) != about_machine(found):
        write_dataset(path, found)
    found.encoding["source"] = str(path)
    return found


def machine_key(case: Case) -> str:
    """Return the hash of a machine's case and of the rules by which claims are measured."""
    rules = "\n".join(f"{rule.statement} {rule.threshold}" for rule in RULES)
    return hashlib.sha256(f"{case.key} {rules}".encode()).hexdigest()[:20]


def judge_end(end: JobResult | JobLost) -> Judged:
    """Return the verdict of a job that ended, also of one that took its worker with it."""
    return (
        end.result if isinstance(end, JobResult) else Judged(failed=f"{end.reason}: {end.detail}")
    )


def machines_dataset(study: Study, keys: Sequence[str], rows: Mapping[str, Judged]) -> xr.Dataset:
    """Return the machines of a study by their assumptions, with `margin` and `held`.

    Both are over (claim, ...). A grid has a dimension for each swept key, any other study the
    dimension machine; the keys are coordinates, in the case file's unit. `margin` and `error` are
    relative to the threshold; `held` is 1, 0, or -1 where the machine was not judged. `status` is
    ok, failed (see `failed`) or "".
    """
    names = coordinate_names([axis.key for axis in study.axes])
    on_grid = study.is_grid and bool(study.axes)
    dims = tuple(names.values()) if on_grid else ("machine",)
    shape = tuple(len(axis.values) for axis in study.axes) if on_grid else (len(keys),)
    coordinates: dict[str, tuple] = {
        names[axis.key]: (
            (names[axis.key],) if on_grid else dims, *swept_column(axis.key, axis.values)
        )
        for axis in study.axes
    }  # fmt: skip
    found = [rows.get(key, Judged()) for key in keys]
    status = [
        "" if key not in rows else "failed" if row.failed else "ok"
        for key, row in zip(keys, found, strict=True)
    ]
    margin = np.array([row.margin for row in found])
    held = np.where(np.isnan(margin), -1, margin >= 0.0).astype(np.int8)
    phrases: dict[str, tuple[Any, tuple[str, ...], str]] = {
        "margin": (margin, ("claim",), "how far a claim is from its threshold, relative to it"),
        "error": ([r.error for r in found], ("claim",), "how far the margin may be off"),
        "held": (held, ("claim",), "1: the claim holds, 0: it does not, -1: not judged"),
        "share_margin": (
            [row.share_margin for row in found], ("share",),
            "margin of claim 7 by one share of the revolution alone",
        ),
        "share_error": (
            [row.share_error for row in found], ("share",), "how far that margin may be off"
        ),
        "chaotic": ([row.chaotic for row in found], (), "how many of the nine cases are chaotic"),
    }  # fmt: skip
    texts = {"status": status, "failed": [row.failed for row in found], "key": [*keys]}
    variables: dict[str, tuple] = {}
    for name, (values, extra, phrase) in phrases.items():
        array = np.array(values)
        array = array.reshape(*shape, *array.shape[1:])
        variables[name] = ((*dims, *extra), array, UNIT | {"long_name": phrase})
    for name, words in texts.items():
        variables[name] = (dims, np.array(words, object).reshape(shape))
    coordinates |= {
        "claim": ("claim", np.array(CLAIMS), {"long_name": "claim of the paper"}),
        "share": ("share", np.array(SHARES, object), {"long_name": "measure of claim 7"}),
    }
    attrs = {
        "title": "the paper's claims over machines",
        "study": study.name,
        "case": study.cases[0].attributes()["case"],
        "thresholds": "; ".join(f"{n}. {r.threshold}" for n, r in enumerate(RULES, 1)),
        "program": PROGRAM,
    }
    said = zip(ABOUT, (study.title, study.notes), strict=True)
    attrs |= {name: text for name, text in said if text}
    return xr.Dataset(variables, coordinates, attrs)


def about_machine(found: xr.Dataset) -> list[str]:
    """Return the title and the notes that a case file gives of its machines, "" without."""
    return [str(found.attrs.get(name, "")) for name in ABOUT]


def read_kept_machines(path: Path) -> dict[str, Judged]:
    """Return the machines of a file by key; none where there is no file. Raises StoreError."""
    if not path.exists():
        return {}
    return rows_of(read_machines(path))


def read_machines(path: Path) -> xr.Dataset:
    """Return the machines of a file of `machines_dataset`. Raises StoreError where it is none."""
    found = read_dataset(path, REMEDY)
    if "share_margin" not in found or "key" not in found:
        raise StoreError(path, "is no file of judged machines", REMEDY)
    return found.set_coords([name for name in found if "case_key" in found[name].attrs])


def rows_of(found: xr.Dataset) -> dict[str, Judged]:
    """Return the stored verdicts of machines, by key."""
    flat = found.stack(all_machines=found["key"].dims, create_index=False)
    flat = flat.transpose("all_machines", ...)
    columns = [flat[name].values.tolist() for name in Judged._fields]
    keys, status = flat["key"].values.tolist(), flat["status"].values.tolist()
    rows: dict[str, Judged] = {}
    for key, known, values in zip(keys, status, zip(*columns, strict=True), strict=True):
        if known:
            margin, error, share_margin, share_error, chaotic, failed = values
            rows[key] = Judged(
                tuple(margin),
                tuple(error),
                tuple(share_margin),
                tuple(share_error),
                chaotic,
                failed,
            )
    return rows
