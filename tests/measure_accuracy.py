"""Measure the error behind each tolerance and each word of `accuracy` (make accuracy).

Writes a small JSON file: for the paper's nine fault cases the relative L2 error of acceleration
over 0.48 s and the error of its peak, against the independent reference of tests/reference.py.
"""

import json
import platform
import sys
from datetime import date
from importlib import metadata
from pathlib import Path

import numpy as np
import reference
from joblib import Parallel, delayed

from compressor.case import ACCURACY, Case
from compressor.simulation import simulate

RTOLS = [10.0**-k for k in range(3, 11)]
CASES = [(joint, c) for joint in ("big_end", "small_end", "both") for c in (0.1, 0.2, 0.3)]


def run(joint, clearance, **solve):
    return simulate(Case.from_values({"joint": joint, "clearance_mm": clearance, "solve": solve}))


def measure(joint, clearance):
    """Rows of one case: a row a tolerance."""
    best = run(joint, clearance, rtol=1e-11)
    params = reference.paper_params("design", joint, clearance * 1e-3)
    truth = reference.reference_solution(params, joint, best["time"].values)["a"]
    peak = float(best["peak_acceleration"])
    rows = []
    for rtol in sorted({*RTOLS, *ACCURACY.values()}, reverse=True):
        found = run(joint, clearance, rtol=rtol)
        error = np.linalg.norm(found["acceleration"].values - truth) / np.linalg.norm(truth)
        rows.append(
            {
                "joint": joint,
                "clearance_mm": clearance,
                "rtol": rtol,
                "acceleration_error": float(f"{error:.3g}"),
                "peak_error": float(f"{abs(float(found['peak_acceleration']) / peak - 1):.3g}"),
                "energy_residual": float(f"{float(found['energy_residual']):.3g}"),
                "steps": int(found["steps"]),
                "evaluations": int(found["evaluations"]),
            }
        )
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


def main(target):
    measured = Parallel(n_jobs=2)(delayed(measure)(*case) for case in CASES)
    rows = [row for one_case in measured for row in one_case]
    words = {
        word: {
            "rtol": rtol,
            **{
                key: max(row[key] for row in rows if row["rtol"] == rtol)
                for key in ("acceleration_error", "peak_error")
            },
        }
        for word, rtol in ACCURACY.items()
    }
    kept = {**provenance("make accuracy"), "words": words, "rows": rows}
    Path(target).write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(words, indent=1))


if __name__ == "__main__":
    main(sys.argv[1])
