"""Measure the errors behind each tolerance, each word of `accuracy` and each error bar.

`make accuracy` writes a small JSON file. The paper's nine fault cases are judged by the independent
reference of reference.py, 200 random cases by our own run at rtol 1e-12, which SciPy's DOP853
confirms on a few of them. Errors of acceleration are relative L2 errors over the whole run, those
of its peak relative; energy residuals are in units of their bound, 10 rtol a revolution.
"""

import argparse
import json
import platform
import time
from datetime import date
from importlib import metadata
from pathlib import Path

import numpy as np
import reference
from joblib import Parallel, delayed
from random_cases import SEED, random_cases

from compressor.cases.accuracy import ACCURACY
from compressor.cases.case import Case
from compressor.metrics import METRICS
from compressor.solve.simulate import measure, simulate

RTOLS = [10.0**-k for k in range(3, 10)]
NINE = [(joint, c) for joint in ("big_end", "small_end", "both") for c in (0.1, 0.2, 0.3)]
TRUTH = 1e-12
PERCENTILES = (50, 90, 95, 100)
CONFIRMED = 4  # random cases that DOP853 runs again
CONFIRMED_RTOL = 1e-10
CONTACT = ("max_penetration", "contact_loss_fraction", "impact_count")
EXACT = 1e-12  # of a metric: an error below it is rounding


def run(values, **solve):
    return simulate(Case.from_values({**values, "solve": {"error_bars": False, **solve}}))


def errors(found, acceleration, peak, rtol):
    """Error of acceleration, of its peak, and the energy residual over its bound."""
    away = found["acceleration"].values - acceleration
    return {
        "acceleration": float(np.linalg.norm(away) / np.linalg.norm(acceleration)),
        "peak": abs(float(found["peak_acceleration"]) / peak - 1),
        "residual": float(found["energy_residual"]) / (10 * rtol * 4),
    }


def paper_case(joint, clearance):
    """A paper case's errors by tolerance, its truth by sympy's equations."""
    values = {"joint": joint, "clearance_mm": clearance}
    best = run(values, rtol=1e-11)
    params = reference.paper_params("design", joint, clearance * 1e-3)
    truth = reference.reference_solution(params, joint, best["time"].values)["a"]
    peak = float(best["peak_acceleration"])
    rtols = sorted({*RTOLS, *(tier.rtol for tier in ACCURACY.values())}, reverse=True)
    return {rtol: errors(run(values, rtol=rtol), truth, peak, rtol) for rtol in rtols}


def random_case(values):
    """A random case's errors by tolerance and by word, its metrics and their error bars."""
    best = run(values, rtol=TRUTH)
    truth, peak = best["acceleration"].values, float(best["peak_acceleration"])
    found = {"rtols": {}, "words": {}}
    for rtol in RTOLS:
        found["rtols"][rtol] = errors(run(values, rtol=rtol), truth, peak, rtol)
    for word, tier in ACCURACY.items():
        case = Case.from_values({**values, "solve": {"accuracy": word}})
        done = simulate(case)
        found["words"][word] = {
            **errors(done, truth, peak, tier.rtol),
            "metrics": {name: done[name].values for name in METRICS},
            "bars": {name: done[f"{name}_error"].values for name in METRICS},
        }
    found["truth"] = {name: best[name].values for name in METRICS}
    return found


def cost(values):
    """By word, time with error bars over time without; each the best of three, in turn."""
    found = {}
    for word in ACCURACY:
        seconds = {False: [], True: []}
        for bars in 3 * [False, True]:
            solve = {"accuracy": word, "error_bars": bars}
            began = time.perf_counter()
            measure(Case.from_values({**values, "solve": solve}))
            seconds[bars].append(time.perf_counter() - began)
        found[word] = min(seconds[True]) / min(seconds[False])
    return found


def confirmed(values):
    """Relative L2 distance of DOP853's acceleration from the truth."""
    solve = {"rtol": CONFIRMED_RTOL, "method": "DOP853"}
    other = run(values, **solve)["acceleration"].values
    truth = run(values, rtol=TRUTH)["acceleration"].values
    return float(np.linalg.norm(other - truth) / np.linalg.norm(truth))


def percentiles(numbers):
    return [short(value) for value in np.percentile(numbers, PERCENTILES)]


def short(value):
    return float(f"{value:.3g}")


def trade(measured):
    """Percentiles of the errors by tolerance."""
    return [{"rtol": rtol, **spread([case["rtols"][rtol] for case in measured])} for rtol in RTOLS]


def spread(rows):
    """Percentiles of both errors, and the worst energy residual in units of its bound."""
    return {
        "acceleration": percentiles([row["acceleration"] for row in rows]),
        "peak": percentiles([row["peak"] for row in rows]),
        "residual": short(max(row["residual"] for row in rows)),
    }


def kept(row, tier):
    """Whether a run keeps its tier's promises."""
    return row["acceleration"] <= tier.promise and row["peak"] <= tier.peak


def tier_row(word, paper, measured, costs):
    """A word's promise and how it is kept: worst of the nine, spread and share of the random."""
    tier = ACCURACY[word]
    nine = [case[tier.rtol] for case in paper]
    rows = [case["words"][word] for case in measured]
    return {
        "rtol": tier.rtol,
        "promise": tier.promise,
        "peak_promise": tier.peak,
        "nine": {key: short(max(row[key] for row in nine)) for key in nine[0]},
        "random": spread(rows),
        "kept": short(np.mean([kept(row, tier) for row in rows])),
        "cost": short(np.median([row[word] for row in costs])),
    }


def bar_row(word, name, measured):
    """How many true errors lie within their bars, and how much longer the bars are (median).

    Every joint and axis counts, but not the contact of ideal joints, which is exact. Tightness is
    over errors above rounding.
    """
    errors_, bars = [], []
    for case in measured:
        row = case["words"][word]
        found, truth, bar = (
            np.ravel(x[name]) for x in (row["metrics"], case["truth"], row["bars"])
        )
        there = case["truth"]["max_penetration"] != 0 if name in CONTACT else slice(None)
        error = np.abs(found - truth)
        errors_.append(np.where(error > EXACT * np.abs(truth), error, 0.0)[there])
        bars.append(bar[there])
    error, bar = np.concatenate(errors_), np.concatenate(bars)
    wrong = error > 0
    return {
        "within": short(np.mean(error <= bar)),
        "tightness": short(np.median(bar[wrong] / error[wrong])) if wrong.sum() >= 10 else None,
        "wrong": int(wrong.sum()),
        "of": error.size,
    }


def missed(word, cases, measured):
    """Random cases that miss their tier, what their bars tell, and their error without friction."""
    tier, rows = ACCURACY[word], []
    for values, case in zip(cases, measured, strict=True):
        row = case["words"][word]
        if kept(row, tier):
            continue
        smooth = {**values, "friction": False}
        truth = run(smooth, rtol=TRUTH)
        plain = errors(
            run(smooth, accuracy=word), truth["acceleration"].values,
            float(truth["peak_acceleration"]), tier.rtol,
        )  # fmt: skip
        size = float(row["metrics"]["peak_acceleration"])
        bar = float(row["bars"]["peak_acceleration"]) / size
        rms = float(row["metrics"]["rms_acceleration"] / case["truth"]["rms_acceleration"] - 1)
        loss = row["metrics"]["contact_loss_fraction"] - case["truth"]["contact_loss_fraction"]
        rows.append({
            **values["machine"],
            **{key: values[key] for key in ("load", "joint", "clearance_mm")},
            "acceleration": short(row["acceleration"]),
            "peak": short(row["peak"]),
            "peak_bar": short(bar),
            "told": bool(bar >= row["peak"]),
            "rms": short(abs(rms)),
            "contact_loss": short(np.abs(loss).max()),
            "without_friction": short(plain["acceleration"]),
        })  # fmt: skip
    return rows


def provenance(command):
    """Date, machine and versions of a kept measurement."""
    names = ("compsim", "numpy", "scipy", "numba")
    return {
        "command": command,
        "date": date.today().isoformat(),
        "machine": f"{platform.machine()}, Python {platform.python_version()}",
        "versions": {name: metadata.version(name) for name in names},
    }


def main(target, jobs, count):
    cases = random_cases(count)
    with Parallel(n_jobs=jobs) as parallel:
        paper = parallel(delayed(paper_case)(*case) for case in NINE)
        measured = parallel(delayed(random_case)(values) for values in cases)
        some = cases[:: max(1, count // CONFIRMED)][:CONFIRMED]
        costs = parallel(delayed(cost)(values) for values in cases[::10])
        distance = parallel(delayed(confirmed)(values) for values in some)
    words = {word: tier_row(word, paper, measured, costs) for word in ACCURACY}
    bars = {word: {name: bar_row(word, name, measured) for name in METRICS} for word in ACCURACY}
    result = {
        **provenance("make accuracy"),
        "random": {"cases": count, "seed": SEED, "percentiles": PERCENTILES},
        "truth": {"rtol": TRUTH, "DOP853": CONFIRMED_RTOL, "apart": [short(x) for x in distance]},
        "words": words,
        "bars": bars,
        "missed": {word: missed(word, cases, measured) for word in ACCURACY},
        "trade": trade(measured),
    }
    text = json.dumps(result, indent=1)
    Path(target).write_text(text + "\n", encoding="utf-8")
    print(json.dumps({"words": words, "bars": bars}, indent=1))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", help="file to write")
    parser.add_argument("--jobs", type=int, default=2, help="worker processes")
    parser.add_argument("--cases", type=int, default=200, help="random cases")
    asked = parser.parse_args()
    main(asked.target, asked.jobs, asked.cases)
