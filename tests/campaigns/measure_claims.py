"""Measure the paper's claims over machines (make claims).

Judges the map of the example `claims` and the design of `assumptions`, searches for the least
change that makes all claims hold, and looks at neighbours on the map between which a claim changes
sides: bisection follows the margin from one to the other. Machines are kept in the folder `claims`,
from which the same command goes on. Writes a small JSON file.
"""

import json
import random
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from measure_accuracy import provenance

from compressor.analysis.claims import RULES
from compressor.cases.case import Case
from compressor.cases.examples import example
from compressor.cases.load import load_studies
from compressor.report.figures.pictures import render
from compressor.studies.claims.figures import draw_claims_map
from compressor.studies.claims.findings import (
    change,
    changes,
    consistency,
    coordinate_in_words,
    count_claims,
    flips,
    most_consistent,
    rank_assumptions,
    sensitivity,
    summary,
)
from compressor.studies.claims.search import least_change
from compressor.studies.claims.study import (
    CLAIMS,
    SHARES,
    cases_judged,
    judge,
    judge_machines,
    machines,
)

FOLDER = "claims"
GENERATIONS = 12
PAIRS = 12  # of neighbours a claim, that are looked between
HALVINGS = 18
SEED = 13


def main(target):
    found = {**provenance("make claims"), "statements": [rule.statement for rule in RULES]}
    (study,) = load_studies(example("claims"))
    begun, began = Path(FOLDER, "claims.nc").exists(), time.perf_counter()
    plane = judge_machines(study, FOLDER, 2)
    seconds = round(time.perf_counter() - began, 1)
    if begun:  # a map that goes on has no time of its own
        seconds = json.loads(Path(target).read_text(encoding="utf-8"))["map"]["seconds"]
    found["map"] = {**told(plane), "seconds": seconds}
    found["map"]["said"].append(consistency(plane))
    found["consistent"] = most_consistent(plane)._asdict()
    print(f"map: {seconds} s", flush=True)
    if not (plane["status"] == "ok").all():
        print("some machines of the map have no verdict", file=sys.stderr)
    found["flips"] = {claim: flips(plane, claim)._asdict() for claim in CLAIMS}
    found["between"] = between(study, plane)
    default = judge(Case.from_values({}))
    found["default"] = {
        "margin": default.margin, "error": default.error,
        "shares": dict(zip(SHARES, default.share_margin, strict=True)),
    }  # fmt: skip
    (drawn,) = load_studies(example("assumptions"), variants=cases_judged)
    judged = judge_machines(drawn, FOLDER, 2)
    table = sensitivity(judged)
    found["assumptions"] = {
        **told(judged),
        "deciding": [*rank_assumptions(table)], "unknown": table["unknown"].item(),
        "names": [coordinate_in_words(str(name)) for name in table["assumption"].values],
        **{name: table[name].values.round(4).tolist() for name in table if table[name].ndim == 2},
    }  # fmt: skip
    search = least_change(drawn, FOLDER, 2, GENERATIONS)
    best = search.isel(machine=0)
    found["search"] = {
        **told(search), "looked": int(search.attrs["looked"]),
        "said": [*change(search)], "changes": changes(best),
        "margin": best["margin"].values.tolist(), "error": best["error"].values.tolist(),
        "values": {str(n): best[n].item() for n in best.coords if "case_key" in best[n].attrs},
    }  # fmt: skip
    Path(target).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    default = Case.from_values({}).machine
    place = default.rod_mass_kg, default.reciprocating_mass_kg
    Path(target).with_suffix(".svg").write_bytes(render(draw_claims_map(plane, place), "svg"))
    print("\n".join([*found["map"]["said"], *found["assumptions"]["deciding"], *change(search)]))


def told(found):
    """Machines counted, and what is said of them."""
    judged, each, whole = count_claims(found)
    failed = int((found["status"] == "failed").sum())
    held = (found["held"] == 1).sel(claim=[1, 2, 3, 4, 5, 6, 8]).all("claim")
    return {"judged": judged, "failed": failed, "each": each, "all": whole,
            "but_7": int(held.sum()), "chaotic": int((found["chaotic"] > 0).sum()),
            "said": [*summary(found)]}  # fmt: skip


def between(study, plane):
    """For each claim, what bisection finds between some neighbours of which one holds it."""
    draw = random.Random(SEED)
    cases = np.array(machines(study), object).reshape(plane["status"].shape)
    rows = {}
    for claim in CLAIMS:
        held = plane["held"].sel(claim=claim).values
        pairs = [
            (at, tuple(np.add(at, step)))
            for at in np.ndindex(held.shape)
            for step in ((1, 0), (0, 1))
            if np.add(at, step)[0] < held.shape[0] and np.add(at, step)[1] < held.shape[1]
            and {held[at], held[tuple(np.add(at, step))]} == {0, 1}
        ]  # fmt: skip
        some = draw.sample(pairs, min(PAIRS, len(pairs)))
        ends = Parallel(n_jobs=2)(delayed(closed)(cases[a], cases[b], claim) for a, b in some)
        rows[claim] = {
            "pairs": len(some),
            "closed": sum(within for within, _ in ends),
            "widest": max((width for _, width in ends), default=0.0),
        }
    return rows


def closed(one, other, claim):
    """Whether a margin comes within its error between two machines, and how far apart they are.

    The distance is a share of that of the two neighbours.
    """
    width = 1.0
    sides = [side(one, claim), side(other, claim)]
    for _ in range(HALVINGS):
        if any(near for _, near in sides):
            return True, width
        middle = midway(one, other)
        found = side(middle, claim)
        width /= 2.0
        if found[0] == sides[0][0]:
            one, sides[0] = middle, found
        else:
            other, sides[1] = middle, found
    return any(near for _, near in sides), width


def side(machine, claim):
    """Whether a claim holds at a machine, and whether its margin is within its error."""
    found = judge(machine)
    margin, error = found.margin[claim - 1], found.error[claim - 1]
    return margin >= 0.0, abs(margin) <= error


def midway(one, other):
    """The machine with the mean masses of two."""
    masses = {
        name: 0.5 * (getattr(one.machine, name) + getattr(other.machine, name))
        for name in ("rod_mass_kg", "reciprocating_mass_kg")
    }
    # the inertia of a uniform bar follows its mass
    machine = replace(one.machine, **masses, rod_centre_mm=None, rod_inertia_kg_m2=None)
    return Case.from_values({**one.values(), "machine": as_values(machine)})


def as_values(machine):
    """A machine as a case file has it."""
    return {name: value for name, value in vars(machine).items() if value is not None}


if __name__ == "__main__":
    main(sys.argv[1])
