"""Measure by how much a run's difference from another one bounds its error (make calibration).

Cases of seeds that judge nothing are run at a ladder of tolerances, each with companions tighter
and looser, and at 1e-12. Kept are percentiles of true error over distance by the ratio of the two
tolerances, for acceleration, and by ratio and metric how many true errors the bars would hold and
how long they would be. From these the shares of `compressor.metrics` and
`compressor.solve.error_bars` were chosen; `make accuracy` judges them on other seeds.
"""

from joblib import Parallel, delayed
from measure_accuracy import errors_and_bars, judge_bars, percentiles
from random_cases import strangers
from result_pages import keep, provenance, run_campaign

from compressor.cases.case import Case
from compressor.metrics import METRICS
from compressor.solve.error_bars import TIGHTER_DISTANCE_FACTOR, bars, closeness
from compressor.solve.run import run_at_tolerance
from compressor.solve.series import distances

SEEDS = (101, 102, 103)
TRUTH = 1e-12
RTOLS = (2e-5, 2e-6, 2e-7, 2e-8, 1e-9, 1e-10)
RATIOS = (0.4, 0.5, 3.0, 10.0, 30.0, 100.0, 1000.0)  # of the other run's tolerance
LOOSEST = 1e-4  # of the other run: beyond it both may take the same wrong course
SMALL = 0.1  # distances beyond are no estimates
LIMITS = (50, 90, 95, 99, 99.5)


def one_case(values):
    """By tolerance and ratio: error and distance of acceleration; each metric's error and bar."""
    case = Case.from_values({**values, "solve": {"rtol": TRUTH}})
    runs = {}

    def run(rtol):
        if rtol not in runs:
            runs[rtol] = run_at_tolerance(case, rtol, 600.0, False)
        return runs[rtol]

    truth, rows = run(TRUTH), []
    for rtol in RTOLS:
        for ratio in RATIOS:
            other_rtol = float(f"{ratio * rtol:.3g}")
            if other_rtol > LOOSEST or run(rtol).reason or run(other_rtol).reason:
                continue
            here, other = run(rtol), run(other_rtol)
            apart = distances(here.samples, other.samples)
            found = bars(here.metrics, other.metrics, ratio, apart, 0.0)
            rows.append({
                "rtol": rtol,
                "ratio": ratio,
                "error": float(distances(truth.samples, here.samples)["acceleration"]),
                "distance": float(apart["acceleration"]),
                "metrics": {
                    name: errors_and_bars(name, here.metrics, truth.metrics, found)
                    for name in METRICS
                },
            })  # fmt: skip
    return rows


def series_row(rows, ratio):
    """Percentiles of error over distance at a ratio, and over what the shares make of it."""
    over = [
        row["error"] / row["distance"]
        for row in rows
        if row["ratio"] == ratio and 0 < row["distance"] < SMALL
    ]
    return {
        "ratio": ratio,
        "pairs": len(over),
        "error_over_distance": percentiles(over, LIMITS),
        "share": TIGHTER_DISTANCE_FACTOR * closeness(ratio),
    }


def metric_row(rows, name, ratio):
    """What the bars of a metric are worth at a ratio."""
    return {
        "ratio": ratio,
        **judge_bars([row["metrics"][name] for row in rows if row["ratio"] == ratio]),
    }


def main(target, jobs=2, cases=350):
    drawn = [values for seed in SEEDS for values in strangers(seed, cases)]
    found = Parallel(n_jobs=jobs)(delayed(one_case)(values) for values in drawn)
    rows = [row for case in found for row in case]
    result = {
        **provenance("make calibration"),
        "cases": {"seeds": SEEDS, "of_each": cases, "percentiles": LIMITS},
        "series": [series_row(rows, ratio) for ratio in RATIOS],
        "metrics": {
            name: [metric_row(rows, name, ratio) for ratio in RATIOS] for name in METRICS
        },
    }  # fmt: skip
    keep(target, result, 4)


if __name__ == "__main__":
    run_campaign(main)
