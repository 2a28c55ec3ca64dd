"""Keep what `compsim tradeoff` and each variant of the model give (make tradeoff, ten minutes).

The paper's three faults at 0.2 mm. Each time is the best of three rounds. Writes a small JSON file
and, beside it, the figure.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
import xarray as xr
from compsim import cli
from result_pages import keep, provenance, run_campaign

from compressor.analysis.runs import settled_part
from compressor.cases.load import load_studies
from compressor.report.figures.pictures import render
from compressor.solve.simulate import simulate
from compressor.studies.tradeoff.changes import model_table
from compressor.studies.tradeoff.variants import faulty, make_variants, run_variants, scale_contact
from compressor.studies.tradeoff.work_precision import VARIABLES, draw_work_precision, tabulate

ROUNDS = 3
FAULTS = "joint: [big_end, small_end, both]\nclearance_mm: 0.2\n"
GRID = "peaks from the output grid"


def points(study):
    """A row for each point that was run."""
    for place, status in study["status"].to_series().items():
        if status:
            one = study.sel(dict(zip(study["status"].dims, place, strict=True)))
            yield {
                "scene": f"{place[0]} 0.2",
                **dict(zip(("method", "rtol"), place[1:], strict=True)),
                **{name: one[name].item() for name in VARIABLES},
            }


def changes(scene, case):
    """What each variant of the model does; peaks as the output grid has them."""
    table = model_table(run_variants(case, [*make_variants(case), *scale_contact(case)]))
    for row in table.rows:
        moved = {(m.variable, m.joint): change
                 for m, change in zip(table.measures, row.changes, strict=True)}  # fmt: skip
        forces = [moved["peak_contact_force", joint] for joint in faulty(case)]
        yield {
            "change": row.name,
            "scene": scene,
            "change_peak_acceleration": moved["peak_acceleration", ""],
            "change_peak_contact_force": max(forces, key=abs),
            "time_ratio": row.time_ratio,
            "note": row.note,
        }
    run = simulate(case)
    grid = settled_part(run)
    forces = np.hypot(*grid["contact_force"].transpose("axis", ...)).max("time")
    ratios = (forces / run["peak_contact_force"]).sel(joint=faulty(case)).min()
    peak = np.abs(grid["acceleration"]).max() / run["peak_acceleration"]
    yield {
        "change": GRID, "scene": scene, "time_ratio": None, "note": "",
        "change_peak_acceleration": float(peak) - 1,
        "change_peak_contact_force": float(ratios) - 1,
    }  # fmt: skip


def main(target):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "faults.yaml")
        file.write_text(FAULTS)
        rounds = []
        for number in range(ROUNDS):
            results = Path(folder, f"{number}")
            if code := cli.main(["tradeoff", str(file), "-r", str(results)]):
                sys.exit(code)
            path = results / "tradeoff" / "faults-tradeoff.nc"
            rounds.append(xr.load_dataset(path, engine="h5netcdf"))
        (study,) = load_studies(file)
        moved = [row for case in study.cases for row in changes(f"{case.joint} 0.2", case)]
    found = rounds[0].assign(seconds=xr.concat([one["seconds"] for one in rounds], "n").min("n"))
    kept = {**provenance("make tradeoff"), "points": [*points(found)], "changes": moved}
    keep(target, kept, 3)
    drawn = draw_work_precision(tabulate(kept["points"]))
    Path(target).with_suffix(".png").write_bytes(render(drawn))


if __name__ == "__main__":
    run_campaign(main)
