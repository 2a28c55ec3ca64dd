"""Follow a machine with little damping over its clearance, up and down (make regimes).

Runs the example `regimes` into the folder `results`, from which the same command goes on, and says
of each value and direction what was found. Writes a small JSON file.
"""

import math
from pathlib import Path

import numpy as np
from result_pages import keep, provenance, run_campaign

from compressor.cases.examples import templates
from compressor.report.figures.pictures import render
from compressor.studies.follow.figure import draw_followed, table
from compressor.studies.follow.follow import follow, load_values, read_over

FOLDER = "results"
ALONG = read_over("clearance_mm=0.01:1:80", log=True, both=True)


def main(target):
    study = load_values(templates()["regimes"].path, ALONG)
    data = follow(study, ALONG, FOLDER, 2, lambda *told: None).data.isel(job=0)
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
        **provenance("make regimes"), "over": over, "rows": rows,
        "differ": data[over].values[data["differs"].values == 1].tolist(),
    }  # fmt: skip
    keep(target, found)
    Path(target).with_suffix(".svg").write_bytes(render(draw_followed(data), "svg"))
    print(*table(data), sep="\n")


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
    run_campaign(main)
