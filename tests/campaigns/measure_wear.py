"""How far hours and profiles of wear are from those of finer steps and sectors: `make wear`.

The convergence of one machine chose the defaults; machines drawn at random, evenly in the logarithm
of each range, judge them.
"""

import json
import math
import random
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from measure_accuracy import provenance

from compressor.cases.case import Case
from compressor.studies.wear.stages import Worn, first_stage, life, next_stage, stages_dataset

ONE = {"joint": "big_end", "clearance_mm": 0.2}
LIMIT = 1.5  # clearances, at which it ends
STEPS, SECTORS = (0.04, 0.02, 0.01, 0.005), (24, 36, 72, 144)
FINEST = {"step_mm": 0.00125, "sectors": 180}
SEED, COUNT = 1601, 40


def followed(values, **wear):
    """Hours to the limit, the profiles of the stage nearest below it (m), and why it failed."""
    of = Worn(Case.from_values({**values, "wear": {"hours": 1e8, **wear}}))
    stages = [first_stage(of)]
    while not of.over(stages[-1]):
        stages.append(next_stage(of, stages[-1]))
    reached = life(of, stages_dataset(of, stages))
    return reached.hours, at_limit(of, stages), stages[-1]["reason"]


def at_limit(of, stages):
    """The profiles where the limit is passed, by a straight line between two stages."""
    if len(stages) < 2:
        return stages[-1]["worn_depth"]
    before, after = (stage["worn_depth"] for stage in stages[-2:])
    deep, deeper = (float((of.clearances + one.max(axis=1)).max()) for one in (before, after))
    share = (of.limit - deep) / (deeper - deep) if deeper > deep else 1.0
    return before + min(max(share, 0.0), 1.0) * (after - before)


def apart(profile, exact):
    """Greatest difference of two profiles at their common nodes, over the deepest place."""
    common = math.gcd(profile.shape[1], exact.shape[1])
    one, other = (p[:, :: p.shape[1] // common] for p in (profile, exact))
    return float(np.abs(one - other).max() / exact.max())


def convergence():
    """One machine by step and by sectors, against the finest of both."""
    limit = {"limit_mm": LIMIT * ONE["clearance_mm"]}
    rows = []
    hours, exact, _ = followed(ONE, **limit, **FINEST)
    ways = [{"step_mm": step, "sectors": FINEST["sectors"]} for step in STEPS]
    ways += [{"step_mm": FINEST["step_mm"], "sectors": sectors} for sectors in SECTORS]
    for way in ways:
        found, profile, _ = followed(ONE, **limit, **way)
        error = {"hours": abs(found / hours - 1.0), "profile": apart(profile, exact)}
        rows.append(way | error)
    return {"hours": hours, "finest": FINEST, "rows": rows}


def strangers(seed, count):
    """Machines that nothing here was chosen by."""
    draw = random.Random(seed)

    def between(low, high):
        return low * (high / low) ** draw.random()

    for _ in range(count):
        yield {
            "joint": draw.choice(["big_end", "small_end", "both"]),
            "load": draw.choice(["spring", "gas"]),
            "clearance_mm": between(0.05, 0.3),
            "machine": {"speed_rpm": between(200.0, 900.0), "rod_mass_kg": between(2.0, 12.0),
                        "reciprocating_mass_kg": between(5.0, 40.0)},
            "contact": {"stiffness_N_per_mm15": between(1e5, 1e6),
                        "damping_N_s_per_mm": between(30.0, 400.0)},
        }  # fmt: skip


def judged(values):
    """A stranger at the defaults and at a quarter of the step with twice the sectors."""
    limit = {"limit_mm": LIMIT * values["clearance_mm"]}
    hours, profile, reason = followed(values, **limit)
    fine, exact, other = followed(values, **limit, step_mm=0.0025, sectors=144)
    found = {"values": values, "reason": reason or other}
    if found["reason"]:
        return found
    return found | {"hours": fine, "hours_error": abs(hours / fine - 1.0),
                    "profile_error": apart(profile, exact)}  # fmt: skip


def main(target):
    cases = list(strangers(SEED, COUNT))
    with ProcessPoolExecutor(2) as pool:
        one, machines = pool.submit(convergence), [*pool.map(judged, cases)]
        kept = {**provenance("make wear"), "convergence": one.result()}
    kept |= {"seed": SEED, "machines": machines}
    Path(target).write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    errors = [row["hours_error"] for row in machines if not row["reason"]]
    print(f"{len(errors)} of {COUNT}: hours differ by {np.median(errors):.2%}, at most "
          f"{max(errors):.2%}")  # fmt: skip


if __name__ == "__main__":
    main(sys.argv[1])
