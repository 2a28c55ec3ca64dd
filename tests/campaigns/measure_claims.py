"""Measure the paper's claims over machines (make claims).

Judges a fine map of the example `claims` and the design of `assumptions`, the machine of the
example `agreeing` in long runs. Jobs are kept in the folder `claims`, from which the same command
goes on. Writes a small JSON file.
"""

import json
import time
from pathlib import Path

from result_pages import keep, provenance, run_campaign

from compressor.analysis import RULES, cases_of
from compressor.cases.case import Case
from compressor.cases.examples import templates
from compressor.cases.load import load_studies
from compressor.report.figures.pictures import render
from compressor.solve.simulate import simulate
from compressor.store.studies import find_study
from compressor.studies.claims import (
    CLAIMS,
    assumptions,
    draw_map,
    judge_machines,
    mass_plane,
    measure,
    sensitivity,
)
from compressor.sweep.sweep import sweep

FOLDER = "claims"
FINE = (
    "machine.rod_mass_kg={linspace: [1.5, 9.3, 40]}",
    "machine.reciprocating_mass_kg={linspace: [2.5, 29.8, 40]}",
)
LONG_REV = 20.0  # of the machine in which all claims hold


def main(target):
    target = Path(target)
    found = {**provenance("make claims"), "statements": [rule.statement for rule in RULES]}
    judged, seconds = judged_study("claims", FINE)
    if not seconds:  # a map that goes on has no time of its own
        seconds = json.loads(target.read_text(encoding="utf-8"))["map"]["seconds"]
    plane = mass_plane(judged)
    found["map"] = {**counted(judged), "seconds": seconds}
    print(f"map: {seconds} s", flush=True)
    default = judged_alone(Case.from_values({}))
    found["default"] = {name: default[name] for name in ("margin", "error")}
    drawn, _ = judged_study("assumptions")
    table = sensitivity(drawn)
    found["assumptions"] = {
        **counted(drawn), "names": assumptions(drawn),
        **{name: table[name].values.round(4).tolist() for name in table},
    }  # fmt: skip
    found["agreeing"] = agreeing()
    keep(target, found)
    target.with_suffix(".svg").write_bytes(render(draw_map(plane), "svg"))


def judged_study(name, overrides=()):
    """The margins of an example's machines, and the seconds of its runs; 0 if some were stored."""
    (study,) = load_studies(templates()[name].path, overrides=overrides, max_jobs=20_000)
    began = time.perf_counter()
    done = sweep([study], FOLDER, 2)
    found = judge_machines(FOLDER, find_study(FOLDER, name))
    return found, 0 if done.done_before else round(time.perf_counter() - began, 1)


def judged_alone(machine):
    """The margins of one machine, run here."""
    runs = {name: simulate(case) for name, case in cases_of(machine).items()}
    lost = [f"{name}: {run['reason'].item()}" for name, run in runs.items() if run["reason"].item()]
    return measure(runs, "; ".join(lost))


def agreeing():
    """The margins of the machine in which all claims hold, in long runs."""
    (study,) = load_studies(
        templates()["agreeing"].path, overrides=[f"solve.duration_rev={LONG_REV:g}"]
    )
    found = judged_alone(study.cases[0])
    return {"margin": found["margin"], "error": found["error"], "revolutions": LONG_REV}


def counted(found):
    """Machines counted: judged, failed, by claim that holds, and where runs are chaotic."""
    known = found["failed"].values == ""
    held = found["margin"].values >= 0.0
    return {
        "judged": int(known.sum()), "failed": int((~known).sum()),
        "each": {claim: int(held[:, claim - 1].sum()) for claim in CLAIMS},
        "all": int(held.all(axis=1).sum()),
        "chaotic": int((found["chaotic"].values > 0).sum()),
    }  # fmt: skip


if __name__ == "__main__":
    run_campaign(main)
