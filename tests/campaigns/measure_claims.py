"""Measure the paper's claims over a range of masses, which the paper does not give (make claims).

Writes a small JSON file: for every pair of rod and reciprocating mass, which claims hold and
by how much, and for each claim in how many of the mass sets it does.
"""

import json
import sys
from dataclasses import replace
from pathlib import Path

from joblib import Parallel, delayed
from measure_accuracy import provenance

from compressor.analysis.claim_rules import RULES
from compressor.analysis.claims import claims, held_share
from compressor.analysis.paper_cases import paper_cases
from compressor.cases.table import Solve
from compressor.solve.simulate import simulate

ROD_KG = (2.0, 4.7, 8.0)
RECIPROCATING_KG = (4.0, 8.0, 14.0, 25.0)


def verdicts(rod, reciprocating):
    """The claims at one pair of masses (kg)."""
    cases = paper_cases(rod_mass_kg=rod, reciprocating_mass_kg=reciprocating)
    exact = {label: replace(case, solve=Solve(accuracy="fine")) for label, case in cases.items()}
    runs = {label: simulate(case) for label, case in exact.items()}
    complete = {label: run for label, run in runs.items() if run.attrs["complete"]}
    return claims(complete)


def main(target):
    masses = [(rod, reciprocating) for rod in ROD_KG for reciprocating in RECIPROCATING_KG]
    found = Parallel(n_jobs=2)(delayed(verdicts)(*pair) for pair in masses)
    rows = [
        {
            "rod_mass_kg": rod,
            "reciprocating_mass_kg": mass,
            "held": [c.held for c in same],
            "margins": [c.margin for c in same],
        }
        for (rod, mass), same in zip(masses, found, strict=True)
    ]
    shares = [
        {"claim": number, "statement": RULES[number - 1].statement, "held": held, "of": of}
        for number, held, of in held_share(found)
    ]
    kept = {**provenance("make claims"), "claims": shares, "masses": rows}
    Path(target).write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    for share in shares:
        print(f"claim {share['claim']}: held in {share['held']} of {share['of']} mass sets")


if __name__ == "__main__":
    main(sys.argv[1])
