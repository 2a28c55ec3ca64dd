"""Measure the paper's claims over machines (make claims).

Judges a fine map of the example `claims` and the design of `assumptions`, the machine of the
example `agreeing` in long runs, and looks at neighbours on the map between which a claim changes
sides: bisection follows the margin from one to the other. Jobs are kept in the folder `claims`,
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
from result_pages import keep, provenance

from compressor.analysis import RULES, cases_of
from compressor.cases.case import Case
from compressor.cases.examples import example
from compressor.cases.load import load_studies
from compressor.report.figures.pictures import render
from compressor.solve.simulate import simulate
from compressor.store.studies import find_study
from compressor.studies.claims import (
    CLAIMS,
    RECIPROCATING,
    ROD,
    SHARES,
    assumptions,
    draw_map,
    judge_machines,
    mass_plane,
    measure,
    most_consistent,
    sensitivity,
)
from compressor.sweep.sweep import sweep

FOLDER = "claims"
FINE = (
    "machine.rod_mass_kg={linspace: [1.5, 9.3, 40]}",
    "machine.reciprocating_mass_kg={linspace: [2.5, 29.8, 40]}",
)
LONG_REV = 20.0  # of the machine in which all claims hold
PAIRS = 12  # of neighbours a claim, that are looked between
HALVINGS = 18
SEED = 13


def main(target):
    target = Path(target)
    found = {**provenance("make claims"), "statements": [rule.statement for rule in RULES]}
    judged, seconds = judged_study("claims", FINE)
    if not seconds:  # a map that goes on has no time of its own
        seconds = json.loads(target.read_text(encoding="utf-8"))["map"]["seconds"]
    plane = mass_plane(judged)
    found["map"] = {**counted(judged), "seconds": seconds}
    found["consistent"] = most_consistent(plane)._asdict()
    print(f"map: {seconds} s", flush=True)
    found["flips"] = {claim: flips(plane, claim) for claim in CLAIMS}
    found["between"] = between(plane)
    default = judged_alone(Case.from_values({}))
    found["default"] = {
        "margin": default.margin, "error": default.error,
        "shares": dict(zip(SHARES, default.share_margin, strict=True)),
    }  # fmt: skip
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
    (study,) = load_studies(example(name), overrides=overrides, max_jobs=20_000)
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
    (study,) = load_studies(example("agreeing"), overrides=[f"solve.duration_rev={LONG_REV:g}"])
    found = judged_alone(study.cases[0])
    return {"margin": found.margin, "error": found.error, "revolutions": LONG_REV}


def counted(found):
    """Machines counted: judged, failed, by claim that holds; by share of claim 7."""
    known = found["failed"].values == ""
    held = found["margin"].values >= 0.0
    return {
        "judged": int(known.sum()), "failed": int((~known).sum()),
        "each": {claim: int(held[:, claim - 1].sum()) for claim in CLAIMS},
        "all": int(held.all(axis=1).sum()),
        "but_7": int(held[:, [claim != 7 for claim in CLAIMS]].all(axis=1).sum()),
        "chaotic": int((found["chaotic"].values > 0).sum()),
    }  # fmt: skip


def flips(plane, claim):
    """Pairs of neighbours, those of which one alone holds, and of these those within the error."""
    one = plane.sel(claim=claim)
    counts = np.zeros(3, int)
    for dim in (ROD, RECIPROCATING):
        (a, ea), (b, eb) = (
            (one["margin"].isel({dim: part}).values, one["error"].isel({dim: part}).values)
            for part in (slice(None, -1), slice(1, None))
        )
        known = ~(np.isnan(a) | np.isnan(b))
        turned = known & ((a >= 0.0) != (b >= 0.0))
        within = turned & ((np.abs(a) <= ea) | (np.abs(b) <= eb))
        counts += [known.sum(), turned.sum(), within.sum()]
    return dict(zip(("pairs", "flips", "within"), counts.tolist(), strict=True))


def between(plane):
    """For each claim, what bisection finds between some neighbours of which one holds it."""
    draw = random.Random(SEED)
    rods, masses = plane[ROD].values, plane[RECIPROCATING].values
    rows = {}
    for claim in CLAIMS:
        margin = plane["margin"].sel(claim=claim).transpose(ROD, RECIPROCATING).values
        pairs = [
            (at, to)
            for at in np.ndindex(margin.shape)
            for to in ((at[0] + 1, at[1]), (at[0], at[1] + 1))
            if to[0] < rods.size and to[1] < masses.size
            and {margin[at] >= 0.0, margin[to] >= 0.0} == {False, True}
            and not np.isnan(margin[at] + margin[to])
        ]  # fmt: skip
        some = [
            [machine(rods[i], masses[j]) for i, j in pair]
            for pair in draw.sample(pairs, min(PAIRS, len(pairs)))
        ]
        ends = Parallel(n_jobs=2)(delayed(closed)(*pair, claim) for pair in some)
        rows[claim] = {
            "pairs": len(some),
            "closed": sum(within for within, _ in ends),
            "widest": max((width for _, width in ends), default=0.0),
        }
    return rows


def machine(rod, reciprocating, **solve):
    """The machine with two masses."""
    masses = {"rod_mass_kg": float(rod), "reciprocating_mass_kg": float(reciprocating)}
    return Case.from_values({"machine": masses, "solve": solve})


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
    found = judged_alone(machine)
    margin, error = found.margin[claim - 1], found.error[claim - 1]
    return margin >= 0.0, abs(margin) <= error


def midway(one, other):
    """The machine with the mean masses of two."""
    masses = {
        name: 0.5 * (getattr(one.machine, name) + getattr(other.machine, name))
        for name in (ROD, RECIPROCATING)
    }
    # the inertia of a uniform bar follows its mass
    machine = replace(one.machine, **masses, rod_centre_mm=None, rod_inertia_kg_m2=None)
    given = {name: value for name, value in vars(machine).items() if value is not None}
    return Case.from_values({**one.values(), "machine": given})


if __name__ == "__main__":
    main(sys.argv[1])
