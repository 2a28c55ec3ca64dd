"""One machine judged: the paper's eleven cases of it simulated, and how far each claim is off."""

import json
import math
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import xarray as xr

from compressor.analysis import cases_of, claim_margins
from compressor.cases import Case
from compressor.program import ignore_warnings

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
    """Simulate the paper's nine worn cases of a machine and measure every claim on them.

    machine: a case without clearance, whose machine, contact, friction, loads and solver settings
    count. Runs stay in memory. A machine with a failed case has no margins.
    """
    runs, problems = {}, []
    for name, case in cases_of(machine).items():
        if name in IDEAL:
            continue
        run = simulated(case)
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


def simulated(case: Case) -> xr.Dataset:
    """Return a case's run; a solver's remarks are left aside."""
    from compressor.solve import simulate  # needs numba: only to simulate

    with ignore_warnings():
        return simulate(replace(case, output=replace(case.output, keep="series")))


def ideal_text(machine: Case) -> str:
    """Return what the ideal machines' motion and load depend on: not the masses, nor what joints
    do.
    """
    values: dict[str, Any] = machine.values()
    kept = {key: values[key] for key in ("gas", "spring", "solve")}
    lengths = ("crank_radius_mm", "rod_length_mm", "speed_rpm")
    kept["machine"] = {key: values["machine"][key] for key in lengths}
    return json.dumps(kept, sort_keys=True)


@lru_cache(maxsize=8)
def ideal_runs(text: str) -> dict[str, xr.Dataset]:
    """Return both ideal machines' runs, which most machines of a study share."""
    cases = cases_of(Case.resolve(json.loads(text)))
    return {name: simulated(cases[name]) for name in IDEAL}
