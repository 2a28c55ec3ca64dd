"""Chaotic motions by two integrators: points differ, statistics agree (make chaotic).

Beyond the predictability horizon two correct solutions have nothing in common point by point. What
may still be compared are statistics, each within its own error: means over revolutions, with
errors by batch means (revolutions follow on each other, so that single ones are no independent
draws), and the distributions of the revolutions' peaks, by Kolmogorov and Smirnov's distance. Two
scenes are looked at closely. Of random cases with a thousandth of the damping it is counted how
many say by themselves that they are chaotic, and how many of these have the rms, by the standard
error that they tell, of a run by an implicit method, and a few of one by SciPy. Writes a small
JSON file.
"""

import argparse
import json
import math
from collections import Counter

import numpy as np
from joblib import Parallel, delayed
from random_cases import strangers
from result_pages import keep, provenance

from compressor.cases.case import Case
from compressor.metrics import JOINTS
from compressor.outcome import Regime
from compressor.solve.request import revolutions
from compressor.solve.run import run_at_tolerance
from compressor.solve.run_metrics import metrics
from compressor.solve.search import predictability_horizon
from compressor.solve.simulate import measure, simulate

REVOLUTIONS, SETTLE = 200, 8
BATCHES = 16
STEP = 0.6  # deg
METHODS = ("auto", "RODAS")  # an explicit pair, and an implicit method
RTOL = 1e-6
WITHIN, TIGHT = 0.8, 1e-12  # of the horizon, and the tolerance that points are compared at there
LIGHT = {"rod_mass_kg": 1, "reciprocating_mass_kg": 4, "speed_rpm": 1500}
SCENES = {
    "big end, light and fast": {
        "joint": "big_end", "clearance_mm": 0.3, "load": "gas", "machine": LIGHT,
        "contact": {"damping_N_s_per_mm": 0.336},
    },
    "both, the paper's but for damping": {
        "joint": "both", "clearance_mm": 0.3, "contact": {"damping_N_s_per_mm": 0.336},
    },
}  # fmt: skip
DAMPING = 0.336  # N s/mm: a thousandth of the paper's
SEED, DRAWN, WANTED = 401, 260, 100  # random cases, and how many chaotic ones are judged
RANDOM = {"duration_rev": 44, "settle_rev": 4, "output_step_deg": 3.6, "timeout_s": 3000}
OTHER, OTHER_RTOL = "RODAS", 1e-6
SCIPY, FEW = "LSODA", 6  # half a minute each


def case(values, method, revolutions=REVOLUTIONS, settle=SETTLE, rtol=RTOL):
    """A scene as a case over many revolutions."""
    solve = {
        "duration_rev": revolutions, "settle_rev": settle, "output_step_deg": STEP,
        "method": method, "rtol": rtol, "error_bars": False,
    }  # fmt: skip
    return Case.from_values({**values, "solve": solve})


def by_revolution(run):
    """Statistics of each settled revolution, shape (revolutions,), by name; forces on the grid."""
    turn = round(360 / STEP)
    kept = run.isel(time=slice(SETTLE * turn, -1))
    a = kept["acceleration"].values.reshape(-1, turn)
    found = {
        "mean square acceleration": (a**2).mean(axis=1),
        "peak acceleration": np.abs(a).max(axis=1),
    }
    faulty = [joint for joint in JOINTS if float(run["max_penetration"].sel(joint=joint)) > 0]
    for joint in faulty:
        force = np.abs(kept["contact_force"].sel(joint=joint)).max("axis").values
        found[f"contact loss, {joint}"] = (force == 0).reshape(-1, turn).mean(axis=1)
    return found


def batch_mean(values):
    """Mean and its standard error, by the means of BATCHES runs of revolutions."""
    size = values.size // BATCHES
    means = values[: size * BATCHES].reshape(BATCHES, size).mean(axis=1)
    return float(means.mean()), float(means.std(ddof=1) / math.sqrt(BATCHES))


def compare(one, other):
    """By statistic, the distance of two means in units of its standard error."""
    apart = {}
    for name in one:
        (mean, error), (others, others_error) = batch_mean(one[name]), batch_mean(other[name])
        apart[name] = abs(mean - others) / math.hypot(error, others_error)
    return apart


def distance(one, other):
    """Kolmogorov and Smirnov's distance of the revolutions' peaks."""
    a, b = (np.sort(found["peak acceleration"]) for found in (one, other))
    everywhere = np.concatenate([a, b])
    shares = (np.searchsorted(x, everywhere, side="right") / x.size for x in (a, b))
    return float(np.abs(next(shares) - next(shares)).max())


def pointwise(run, other, begin, end=math.inf):
    """Relative L2 distance of acceleration from a time (s) to another."""
    seen = (run["time"].values >= begin) & (run["time"].values <= end)
    a, b = (r["acceleration"].values[seen] for r in (run, other))
    return float(np.linalg.norm(a - b) / np.linalg.norm(a))


def within(values, methods, horizon):
    """Relative L2 distance of acceleration of two tight runs, up to WITHIN of the horizon (s)."""
    turns = math.ceil(horizon / case(values, "auto").turn)
    runs = [simulate(case(values, method, turns, 0, TIGHT)) for method in methods]
    return pointwise(*runs, 0, WITHIN * horizon)


def short(value):
    """A number to three digits."""
    return float(f"{value:.3g}")


def scene_row(values, methods, revolutions=REVOLUTIONS):
    """What the integrators say of one scene, and how far each is from the first."""
    cases = {method: case(values, method, revolutions) for method in methods}
    runs = {method: simulate(made) for method, made in cases.items()}
    assert all(run.attrs["complete"] for run in runs.values())
    first = cases[methods[0]]
    horizon = predictability_horizon(first)
    found = {method: by_revolution(run) for method, run in runs.items()}
    rows = []
    for method in methods[1:]:
        apart = compare(found[methods[0]], found[method])
        rows.append({
            "method": method,
            "within": short(within(values, (methods[0], method), horizon)),
            "beyond": short(pointwise(runs[methods[0]], runs[method], horizon)),
            "standard_errors": {name: short(value) for name, value in apart.items()},
            "peaks_distance": short(distance(found[methods[0]], found[method])),
        })  # fmt: skip
    return {
        "horizon_rev": short(horizon / first.turn),
        "means": {
            method: {name: [*map(short, batch_mean(values))] for name, values in stats.items()}
            for method, stats in found.items()
        },
        "against": methods[0],
        "others": rows,
    }


def told(values, method):
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
        rows = parallel(delayed(told)(values, OTHER) for values in strangers(SEED, drawn))
        judged = [row for row in rows if "apart" in row][:wanted]
        few = parallel(delayed(told)(row["values"], SCIPY) for row in judged[:FEW])

    def spread(name, *of):
        return [short(value) for value in np.percentile([row[name] for row in judged], of)]

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
        "scipy": {"method": SCIPY, "apart": [short(row["apart"]) for row in few]},
        "relative": spread("relative", 50, 90, 100),
        "known": spread("known", 50, 90, 100),
        "horizon_rev": spread("horizon_rev", 50, 90, 100),
        "more": spread("more", 50, 90, 100),
    }


def main(target, drawn, wanted):
    kept = {
        **provenance("make chaotic"),
        "revolutions": REVOLUTIONS, "settle": SETTLE, "batches": BATCHES, "rtol": RTOL,
        "scenes": {name: scene_row(values, METHODS) for name, values in SCENES.items()},
        "random": random_row(drawn, wanted),
    }  # fmt: skip
    keep(target, kept)
    print(json.dumps(kept, indent=1))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", help="file to write")
    parser.add_argument("--drawn", type=int, default=DRAWN, help="random cases")
    parser.add_argument("--wanted", type=int, default=WANTED, help="chaotic ones that are judged")
    asked = parser.parse_args()
    main(asked.target, asked.drawn, asked.wanted)
