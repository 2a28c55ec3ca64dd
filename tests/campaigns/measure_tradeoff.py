"""Keep what `compsim tradeoff` measures, for the README (make tradeoff, about five minutes).

Runs the command on the paper's three faults at 0.2 mm and writes a small JSON file and, beside it,
the figure. The file's fingerprint is the work of a few fixed runs, which hardly depends on the
machine: tests/test_pages.py counts it again and says when the measurement is stale.
"""

import json
import shutil
import sys
import tempfile
from pathlib import Path

import xarray as xr
from compsim import cli
from measure_accuracy import provenance

from compressor.cases.parameter import ACCURACY
from compressor.solve.simulate import simulate
from compressor.studies.tradeoff.page import model_table
from compressor.studies.tradeoff.work_precision import (
    ERRORS,
    default_cases,
    fastest,
    faulty,
    solve_by_method,
)

SERIES = "series kinematics (Eq. 3-4)"
COMPILED = ("auto", "RODAS")


def fingerprint():
    """Evaluations of the default cases by the compiled methods, and the tolerances of the words."""
    counts = {
        f"{name}, {method}": int(
            simulate(solve_by_method(case, method, ACCURACY["standard"].rtol))["evaluations"]
        )
        for name, case in default_cases().items()
        for method in COMPILED
    }
    return {"rtol": {word: tier.rtol for word, tier in ACCURACY.items()}, "evaluations": counts}


def digits(value):
    """A number to three digits; None for nan."""
    return None if value != value else float(f"{value:.3g}")


def points(study):
    """A row for each point that was run."""
    for place, status in study["status"].to_series().items():
        if status == "missing":
            continue
        one = study.sel(dict(zip(study["status"].dims, place, strict=True)))
        yield {
            "scene": place[0],
            "method": place[1],
            "rtol": place[2],
            "reason": one["reason"].item(),
            "seconds": digits(one["seconds"].item()),
            "evaluations": one["evaluations"].item(),
            **{f"error_{name}": digits(one[f"error_{name}"].item()) for name in ERRORS},
        }


def paper(study):
    """The paper's own numerics, and how far the references can be trusted, by scene."""
    for name in study["scene"].values:
        one = study.sel(scene=name)
        yield {
            "scene": str(name),
            "seconds": digits(one["paper_seconds"].item()),
            **{f"error_{q}": digits(one[f"paper_error_{q}"].item()) for q in ERRORS},
            "reference_uncertainty": digits(
                one["reference_uncertainty"].sel(quantity="acceleration").item()
            ),
        }


def changes(trade):
    """What each change of the model does, where it applies, and the series kinematics."""
    cases = default_cases()
    for scene in trade["scene"].values:
        one = trade.sel(scene=scene)
        table = model_table(one)
        for row in table.rows:
            moved = {(m.variable, m.joint): change
                     for m, change in zip(table.measures, row.changes, strict=True)}  # fmt: skip
            forces = [moved["peak_contact_force", joint] for joint in faulty(cases[scene])]
            yield {
                "change": row.name,
                "scene": str(scene),
                "change_peak_acceleration": digits(moved["peak_acceleration", ""]),
                "change_peak_contact_force": digits(max(forces, key=abs)),
                "time_ratio": digits(row.time_ratio),
                "reason": str(one["reason"].sel(choice=row.name).item()),
            }
        error = digits(one["acceleration_error"].item())
        yield {"change": SERIES, "scene": str(scene), "change_acceleration": error, "reason": ""}


def main(target):
    with tempfile.TemporaryDirectory() as folder:
        if code := cli.main(["tradeoff", "-o", folder]):
            sys.exit(code)
        study, trade = (
            xr.load_dataset(Path(folder, f"{name}.nc"), engine="h5netcdf")
            for name in ("tradeoff", "modelling")
        )
        shutil.copyfile(Path(folder, "tradeoff.svg"), Path(target).with_suffix(".svg"))
    rows = [{**row, **{k: digits(row[k]) for k in ("seconds", "error")}} for row in fastest(study)]
    kept = {
        **provenance("make tradeoff"),
        "fingerprint": fingerprint(),
        "seconds_compile": digits(study["seconds_compile"].item()),
        "place_error": {
            str(scene): digits(value) for scene, value in trade["place_error"].to_series().items()
        },
        "fastest": rows,
        "paper": [*paper(study)],
        "changes": [*changes(trade)],
        "points": [*points(study)],
    }
    Path(target).write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
