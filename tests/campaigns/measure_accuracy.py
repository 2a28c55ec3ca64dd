"""Measure whether runs keep what `accuracy` promises, what it costs, and whether error bars hold.

`make accuracy` writes a small JSON file. The paper's nine fault cases are judged by the independent
reference of reference.py; 1,000 random cases, of seeds that chose nothing, by our own run at rtol
1e-12, which SciPy's DOP853 confirms on a few of them. Errors of acceleration are relative L2 errors
after settling. Cases that say they are chaotic are confirmed by a shifted run at rtol 1e-12.
"""

import time
from collections import Counter

import numpy as np
import reference
from joblib import Parallel, delayed
from random_cases import load_equations, strangers
from result_pages import keep, provenance, run_campaign

from compressor.cases.case import Case
from compressor.cases.parameter import ACCURACY
from compressor.metrics import METRICS
from compressor.outcome import Regime
from compressor.solve.search import LOOK_SHIFT, predictability_horizon
from compressor.solve.simulate import simulate

SEEDS = (1401, 1402, 1403)
NINE = [(joint, c) for joint in ("big_end", "small_end", "both") for c in (0.1, 0.2, 0.3)]
TRUTH = 1e-12
PERCENTILES = (50, 90, 95, 100)
CONFIRMED = 4  # random cases that DOP853 runs again
CONFIRMED_RTOL = 1e-10
CONTACT = tuple(name for name, row in METRICS.items() if row.contact)
EXACT = 1e-12  # of a metric: an error below it is rounding


def run(values, **solve):
    return simulate(Case.from_values({**values, "solve": {"error_bars": False, **solve}}))


def settled(found):
    """Acceleration after settling."""
    return found["acceleration"].values[found["time"].values >= found.attrs["settle"]]


def apart(one, exact):
    """Relative L2 distance."""
    return float(np.linalg.norm(one - exact) / np.linalg.norm(exact))


def timed(values, **solve):
    """A run, and the processor time (s) that it took."""
    began = time.process_time()
    return simulate(Case.from_values({**values, "solve": solve})), time.process_time() - began


def cost(values, word):
    """Time with errors over time without; each the best of three, in turn."""
    seconds = {False: [], True: []}
    for errors_ in 3 * [False, True]:
        seconds[errors_].append(timed(values, accuracy=word, error_bars=errors_)[1])
    return min(seconds[True]) / min(seconds[False])


def paper_case(joint, clearance):
    """A paper case by word: its true error by sympy's equations, what it says, and its cost."""
    load_equations()
    values = {"joint": joint, "clearance_mm": clearance}
    rows = {}
    params = reference.paper_params("spring", joint, clearance * 1e-3)
    truth = None
    for word in ACCURACY:
        found = simulate(Case.from_values({**values, "solve": {"accuracy": word}}))
        if truth is None:
            whole = reference.reference_solution(params, joint, found["time"].values)
            truth = whole[found["time"].values >= found.attrs["settle"]]
        rows[word] = {
            "error": apart(settled(found), truth),
            "told": float(found["acceleration_error"]),
            "promise": found.attrs["promise"],
            "cost": cost(values, word),
        }
    return rows


def random_case(values):
    """A random case by word: how it ended, its true and told errors, its metrics, its cost."""
    load_equations()
    best = run(values, rtol=TRUTH)
    truth = settled(best)
    found = {"words": {}, "truth": {name: best[name].values for name in METRICS}}
    for word in ACCURACY:
        done, seconds = timed(values, accuracy=word)
        bare, alone = timed(values, accuracy=word, error_bars=False)
        found["words"][word] = {
            "reason": str(done["reason"].values),
            "promise": done.attrs["promise"],
            "regime": done.attrs["regime"],
            "error": apart(settled(done), truth),
            "bare_error": apart(settled(bare), truth),
            "told": float(done["acceleration_error"]),
            "seconds": seconds,
            "cost": seconds / alone,
            "metrics": {name: done[name].values for name in METRICS},
            "bars": {name: done[f"{name}_error"].values for name in METRICS},
        }
    if any(row["regime"] == Regime.CHAOTIC for row in found["words"].values()):
        case = Case.from_values(values)
        found["parted"] = predictability_horizon(case, shift=LOOK_SHIFT) < case.duration
    return found


def confirmed(values):
    """Relative L2 distance of DOP853's acceleration from the truth."""
    other = run(values, rtol=CONFIRMED_RTOL, method="DOP853")
    return apart(settled(other), settled(run(values, rtol=TRUTH)))


def percentiles(numbers, of=PERCENTILES):
    return np.percentile(numbers, of).tolist()


def word_row(word, paper, measured):
    """What a word promises, how its runs ended, and what they cost."""
    tier, rows = ACCURACY[word], [case["words"][word] for case in measured]
    nine = [case[word] for case in paper]
    kept = [row for row in rows if row["promise"] == "kept"]
    chaotic = [case for case in measured if case["words"][word]["regime"] == Regime.CHAOTIC]
    return {
        "rtol": tier.rtol,
        "promise": tier.promise,
        "nine": {
            "error": max(row["error"] for row in nine),
            "told": max(row["told"] for row in nine),
            "kept": sum(row["promise"] == "kept" for row in nine),
            "cost": max(row["cost"] for row in nine),
        },
        "kept": len(kept),
        "broken": sum(row["error"] > tier.promise for row in kept),
        "regimes": dict(Counter(row["regime"] for row in rows if not row["reason"])),
        "chaotic_confirmed": sum(case["parted"] for case in chaotic),
        "silent": sum(
            not row["reason"] and row["promise"] != "kept" and row["regime"] != Regime.CHAOTIC
            for row in rows
        ),
        "refused": dict(Counter(row["reason"] for row in rows if row["reason"])),
        "error": percentiles([row["error"] for row in kept]),
        "told_over_error": np.median([r["told"] / r["error"] for r in kept if r["error"] > 0]),
        "bare_kept": np.mean([row["bare_error"] <= tier.promise for row in rows]),
        "seconds": percentiles([row["seconds"] for row in rows], (50, 90)),
        "cost": {
            "mean": np.mean([row["cost"] for row in rows]),
            "median": np.median([row["cost"] for row in rows]),
        },
    }


def errors_and_bars(name, found, truth, bars):
    """Errors and bars of a metric, of joints with contact where it is one of contact.

    Every joint and axis counts, but not the contact of ideal joints, which is exact.
    """
    there = np.ravel(truth["max_penetration"]) != 0 if name in CONTACT else slice(None)
    value, sure, bar = (np.ravel(each[name])[there] for each in (found, truth, bars))
    error = np.abs(value - sure)
    return np.where(error > EXACT * np.abs(sure), error, 0.0), bar


def judge_bars(pairs):
    """How many errors lie within their bars, and how much longer the bars are (median).

    Tightness is over errors above rounding.
    """
    error, bar = (np.concatenate(part) for part in zip(*pairs, strict=True))
    wrong = error > 0
    return {
        "within": np.mean(error <= bar),
        "tightness": np.median(bar[wrong] / error[wrong]) if wrong.sum() >= 10 else None,
        "wrong": int(wrong.sum()),
        "of": error.size,
    }


def bar_row(word, name, measured):
    """What the bars of a metric are worth in the runs that keep their promise."""
    rows = [(case["words"][word], case["truth"]) for case in measured]
    return judge_bars([
        errors_and_bars(name, row["metrics"], truth, row["bars"])
        for row, truth in rows if row["promise"] == "kept"
    ])  # fmt: skip


def main(target, jobs=2, count=334, seeds=SEEDS):
    cases = [values for seed in seeds for values in strangers(seed, count)]
    with Parallel(n_jobs=jobs) as parallel:
        paper = parallel(delayed(paper_case)(*case) for case in NINE)
        measured = parallel(delayed(random_case)(values) for values in cases)
        some = cases[:: max(1, len(cases) // CONFIRMED)][:CONFIRMED]
        distance = parallel(delayed(confirmed)(values) for values in some)
    words = {word: word_row(word, paper, measured) for word in ACCURACY}
    bars = {word: {name: bar_row(word, name, measured) for name in METRICS} for word in ACCURACY}
    result = {
        **provenance("make accuracy"),
        "random": {"cases": len(cases), "seeds": seeds, "percentiles": PERCENTILES},
        "truth": {"rtol": TRUTH, "DOP853": CONFIRMED_RTOL, "apart": distance},
        "words": words,
        "bars": bars,
    }
    keep(target, result, 4)


if __name__ == "__main__":
    run_campaign(main)
