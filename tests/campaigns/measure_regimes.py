"""Follow a machine with little damping over its clearance, up and down (make regimes).

Runs the example `regimes` into the folder `results`, from which the same command goes on, and says
of each value and direction what was found. Writes a small JSON file.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np
from measure_accuracy import provenance

from compressor.cases.examples import example
from compressor.cases.load import load_studies
from compressor.report.figures.pictures import render
from compressor.studies.regimes.captions import bifurcation
from compressor.studies.regimes.dataset import open_regimes
from compressor.studies.regimes.figures import draw_bifurcation
from compressor.studies.regimes.run import run_regimes

FOLDER = "results"


def main(target):
    (study,) = load_studies(example("regimes"), follow=True)
    run_regimes([study], FOLDER, 2, lambda *told: None)
    data = open_regimes(FOLDER, study.name)
    over = data.attrs["over"]
    rows = []
    for direction in data["direction"].values.tolist():
        for value in data[over].values.tolist():
            one = data.sel({"direction": direction, over: value})
            rows.append({
                "direction": direction, "value": value, "regime": one["regime"].item(),
                "period": none(one["period"]), "points": distinct(one, value),
                "exponent": none(one["lyapunov_exponent"]),
                "error": none(one["lyapunov_exponent_error"]),
            })  # fmt: skip
    found = {
        **provenance("make regimes"), "over": over, "rows": rows, "differ": differing(data),
        "said": bifurcation(data),
    }  # fmt: skip
    Path(target).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    Path(target).with_suffix(".svg").write_bytes(render(draw_bifurcation(data), "svg"))
    print(found["said"])


def differing(data):
    """Where up and down differ, and how many motions further simulation reached there."""
    some = data.isel({data.attrs["over"]: data["differs"].values == 1})
    return [
        {"value": value.item(), "confirmed": bool(yes), "motions": int(motions)}
        for value, yes, motions in zip(
            some[data.attrs["over"]].values, some["confirmed"].values, some["motions"].values,
            strict=True,
        )
    ]  # fmt: skip


def none(value):
    """A number, None for nan."""
    number = value.item()
    return None if math.isnan(number) else number


def distinct(one, clearance):
    """How many Poincaré points are farther apart than a thousandth of the clearance (mm)."""
    points = one["section"].sel(joint="big_end").values[:, :2]
    points = points[np.isfinite(points).all(axis=1)]
    kept = []
    for point in points:
        if all(np.linalg.norm(point - other) > 1e-6 * clearance for other in kept):
            kept.append(point)
    return len(kept)


if __name__ == "__main__":
    main(sys.argv[1])
