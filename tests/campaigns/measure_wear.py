"""How far hours of wear are from those of finer steps: `make wear`.

The convergence of one machine chose the default; machines drawn at random, evenly in the logarithm
of each range, judge it.
"""

import random
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from result_pages import keep, provenance, run_campaign

from compressor.cases.case import Case
from compressor.studies.wear import Worn, life

ONE = {"joint": "both", "clearance_mm": 0.2}
LIMIT = 1.5  # clearances, at which it ends
SOLVE = {"settle_rev": 2, "duration_rev": 5, "error_bars": False}
STEPS, FINEST = (0.08, 0.04, 0.02, 0.01, 0.005), 0.00125  # mm
DEFAULT, FINE = 0.02, 0.005
SEED, COUNT = 1601, 40


def followed(values, step_mm):
    """Hours to the limit, clearances (mm) where it is passed, and why it failed."""
    wear = {"hours": 1e8, "limit_mm": LIMIT * values["clearance_mm"], "step_mm": step_mm}
    of = Worn(Case.from_values({**values, "solve": SOLVE, "wear": wear}))
    stages = [of.make_row([])]
    while not of.over(stages[-1]):
        stages.append(of.make_row(stages))
    found = of.to_dataset(stages)
    hours = life(of, found).hours
    opened = [float(np.interp(hours, found["hours"], 1e3 * one)) for one in found["clearance"].T]
    return hours, opened, stages[-1]["reason"]


def convergence():
    """One machine by step, against the finest."""
    hours, opened, _ = followed(ONE, FINEST)
    errors = {step: abs(followed(ONE, step)[0] / hours - 1.0) for step in STEPS}
    rows = [{"step_mm": step, "hours": error} for step, error in errors.items()]
    return {"hours": hours, "opened_mm": opened, "finest": FINEST, "rows": rows}


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
    """A stranger at the default step and at a quarter of it."""
    hours, _, reason = followed(values, DEFAULT)
    fine, _, other = followed(values, FINE)
    found = {"values": values, "reason": reason or other}
    return found if found["reason"] else found | {"hours": fine, "error": abs(hours / fine - 1.0)}


def main(target):
    cases = list(strangers(SEED, COUNT))
    with ProcessPoolExecutor(2) as pool:
        one, machines = pool.submit(convergence), [*pool.map(judged, cases)]
        kept = {**provenance("make wear"), "convergence": one.result()}
    kept |= {"step_mm": DEFAULT, "seed": SEED, "machines": machines}
    keep(target, kept)
    errors = [row["error"] for row in machines if not row["reason"]]
    print(f"{len(errors)} of {COUNT}: hours differ by {np.median(errors):.2%}, at most "
          f"{max(errors):.2%}")  # fmt: skip


if __name__ == "__main__":
    run_campaign(main)
