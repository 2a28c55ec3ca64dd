"""Averages of chaotic motions by two integrators (make chaotic).

Beyond the predictability horizon two correct solutions have nothing in common point by point. What
may still be compared are averages, each within its own error. Of random cases with a thousandth of
the damping it is counted how many say by themselves that they are chaotic, and how many of these
have the rms, by the standard error that they state, of a run by an implicit method, and a few of
one by SciPy. Its error is by batch means: revolutions follow on each other, so that single ones are
no independent draws. Writes a small JSON file.
"""

import math
from collections import Counter

import numpy as np
from joblib import Parallel, delayed
from random_cases import strangers
from result_pages import keep, provenance, run_campaign

from compressor.cases.case import Case
from compressor.outcome import Regime
from compressor.solve.request import revolutions
from compressor.solve.run import run_at_tolerance
from compressor.solve.run_metrics import metrics
from compressor.solve.simulate import measure

BATCHES = 16
DAMPING = 0.336  # N s/mm: a thousandth of the paper's
SEED, DRAWN, WANTED = 401, 260, 100  # random cases, and how many chaotic ones are judged
RANDOM = {"duration_rev": 44, "settle_rev": 4, "output_step_deg": 3.6, "timeout_s": 3000}
OTHER, OTHER_RTOL = "RODAS", 1e-6
SCIPY, FEW = "LSODA", 6  # half a minute each


def batch_mean(values):
    """Mean and its standard error, by the means of BATCHES runs of revolutions."""
    size = values.size // BATCHES
    means = values[: size * BATCHES].reshape(BATCHES, size).mean(axis=1)
    return float(means.mean()), float(means.std(ddof=1) / math.sqrt(BATCHES))


def compare_rms(values, method):
    """What a case says of itself, and how its rms differs from another integrator's."""
    values = {**values, "contact": {"damping_N_s_per_mm": DAMPING}}
    values |= {"solve": RANDOM, "output": {"keep": "metrics"}}
    of = Case.from_values(values)
    found = measure(of)
    row = {"regime": found.attributes.get("regime", ""), "reason": found.reason}
    if row["regime"] != Regime.CHAOTIC or found.status != "ok":
        return row
    how = {**RANDOM, "method": method, "rtol": OTHER_RTOL, "error_bars": False}
    other = Case.from_values({**values, "solve": how})
    ends = revolutions(of.settle, of.duration, of.turn)
    run = run_at_tolerance(other, OTHER_RTOL, how["timeout_s"], False, cuts=ends)
    if run.reason:
        return {**row, "other": run.reason}
    turns = run.trajectory.turns
    squares = np.array([metrics(run.p, turn)["rms_acceleration"] ** 2 for turn in turns])
    mean, error = batch_mean(squares)
    rms, theirs = float(found.numbers["rms_acceleration"]), math.sqrt(mean)
    ours = float(found.numbers["rms_acceleration_standard_error"])
    return {
        **row,
        "values": values,
        "apart": abs(rms - theirs) / math.hypot(ours, error / (2 * theirs)),
        "relative": abs(rms / theirs - 1),
        "known": ours / rms,
        "horizon_rev": float(found.numbers["predictability_horizon"]) / of.turn,
        "more": float(found.numbers["revolutions_to_one_percent"]),
    }


def random_row(drawn, wanted):
    """How random cases end, and how the chaotic ones agree with another integrator."""
    with Parallel(n_jobs=2) as parallel:
        rows = parallel(delayed(compare_rms)(values, OTHER) for values in strangers(SEED, drawn))
        judged = [row for row in rows if "apart" in row][:wanted]
        few = parallel(delayed(compare_rms)(row["values"], SCIPY) for row in judged[:FEW])

    def spread(name, *of):
        return np.percentile([row[name] for row in judged], of).tolist()

    return {
        "seed": SEED,
        "drawn": drawn,
        "method": OTHER,
        "rtol": OTHER_RTOL,
        "settle": RANDOM["settle_rev"],
        "revolutions": RANDOM["duration_rev"] - RANDOM["settle_rev"],
        "regimes": dict(Counter(row["regime"] or row["reason"] for row in rows)),
        "stopped": dict(Counter(row["other"] for row in rows if "other" in row)),
        "judged": len(judged),
        "within": {str(k): sum(row["apart"] <= k for row in judged) for k in (1, 2, 3)},
        "scipy": {"method": SCIPY, "apart": [row["apart"] for row in few]},
        "relative": spread("relative", 50, 90, 100),
        "known": spread("known", 50, 90, 100),
        "horizon_rev": spread("horizon_rev", 50, 90, 100),
        "more": spread("more", 50, 90, 100),
    }


def main(target, drawn=DRAWN, wanted=WANTED):
    kept = {**provenance("make chaotic"), "random": random_row(drawn, wanted)}
    keep(target, kept, 4)


if __name__ == "__main__":
    run_campaign(main)
