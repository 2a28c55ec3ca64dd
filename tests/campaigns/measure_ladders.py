"""Error against tolerance, and the limit of no clearance (make ladders, about a minute).

The ladder: the paper's three faults at 0.2 mm by `auto`, from rtol 1e-2 to 1e-10, against SciPy's
DOP853 at 1e-12; RODAS at 1e-12 says how far that can be trusted. Runs that fail the energy audit
are not repeated here. The limit: clearances from 1 mm to 1 nm with the contact scaled along, so
that compliance shrinks as the clearance does: K with c^-1.5, the penetration of full damping with
c, the damping with c^-0.5. Writes a small JSON file and, beside it, both figures.
"""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from campaign_figures import RUNGS, draw_scaled_limit, draw_tolerance_ladder
from result_pages import keep, provenance

from compressor.analysis.runs import FAULTS, label, paper_cases
from compressor.cases.case import Case
from compressor.cases.groups import Contact, Output
from compressor.report.figures.pictures import render
from compressor.solve.run import run_at_tolerance
from compressor.solve.run_metrics import allowed_residual
from compressor.solve.simulate import simulate, with_series
from compressor.studies.tradeoff.variants import faulty
from compressor.studies.tradeoff.work_precision import REFERENCES

TOLERANCES = [10.0**-k for k in range(2, 11)]
CLEARANCES = [10.0**-k for k in range(7)]  # mm
PAPER = 0.1  # mm: the clearance at which the contact is the paper's
AUDIT = 10  # rtol a revolution: the bound of the energy residual


def short(value):
    """A number to three digits."""
    return float(f"{value:.3g}")


def default_cases():
    """The paper's three faults at 0.2 mm, by label."""
    cases = paper_cases()
    return {label(fault, 0.2): cases[label(fault, 0.2)] for fault in FAULTS}


def solve_by_method(case, method, rtol):
    """A case by another method and tolerance: series kept, no error bars, no horizon."""
    solve = replace(case.solve, method=method, rtol=rtol, accuracy="standard", error_bars=False,
                    horizon=False)  # fmt: skip
    return replace(case, solve=solve, output=Output())


def errors(run, truth, case):
    """Relative errors of the acceleration (L2) and of its peak."""
    a, true_a = (one["acceleration"].values for one in (run, truth))
    peaks = [float(one["peak_acceleration"]) for one in (run, truth)]
    forces = [one["peak_contact_force"].sel(joint=faulty(case)).values for one in (run, truth)]
    return {
        "acceleration": float(np.linalg.norm(a - true_a) / np.linalg.norm(true_a)),
        "peak_acceleration": abs(peaks[0] / peaks[1] - 1),
        "peak_contact_force": float(np.abs(forces[0] / forces[1] - 1).max()),
    }


def reference(case, method):
    """A reference run."""
    run = simulate(solve_by_method(case, method, 1e-12))
    assert run.attrs["complete"], run.attrs["detail"]
    return run


def alone(case):
    """The Dataset of one run at the case's own tolerance, whatever the energy audit says of it."""
    found = run_at_tolerance(case, case.rtol, case.solve.timeout_s, sampled=True)
    assert not found.reason, found.detail
    outcome, variables = with_series(case, found)
    return xr.Dataset(outcome.table(variables), attrs=outcome.attributes)


def rung(case, rtol, truth):
    """One tolerance of the ladder: the variables of RUNGS."""
    run = alone(solve_by_method(case, "auto", rtol))
    found = errors(run, truth, case)
    numbers = {name: found[name.removeprefix("error_")] for name in list(RUNGS)[:2]}
    return {**numbers, "energy_residual": float(run["energy_residual"])}


def ladder():
    """Rows of (scene, rtol), and how far apart the references are, by scene."""
    rows, apart = [], {}
    for name, case in default_cases().items():
        truth, other = (reference(case, method) for method in REFERENCES)
        apart[f"{name} mm"] = short(errors(other, truth, case)["acceleration"])
        for rtol in TOLERANCES:
            numbers = {key: short(value) for key, value in rung(case, rtol, truth).items()}
            rows.append({"scene": f"{name} mm", "rtol": rtol, **numbers})
    return rows, apart


def scaled(joint, clearance):
    """A case with the contact scaled to its clearance (mm); its first revolution."""
    ratio = clearance / PAPER
    paper = Contact()
    contact = {
        "stiffness_N_per_mm15": paper.stiffness_N_per_mm15 * ratio**-1.5,
        "full_damping_mm": paper.full_damping_mm * ratio,
        "damping_N_s_per_mm": paper.damping_N_s_per_mm * ratio**-0.5,
    }
    solve = {"duration_rev": 1, "settle_rev": 0, "error_bars": False}
    values = {"joint": joint, "contact": contact, "solve": solve}
    if joint != "none":
        values["clearance_mm"] = clearance
    return Case.from_values(values)


def limit(joints=FAULTS, clearances=CLEARANCES):
    """Rows of (scene, clearance): the greatest deviation of x from the ideal machine's (m)."""
    ideal = simulate(scaled("none", PAPER))["displacement"].values
    rows = []
    for joint in joints:
        for clearance in clearances:
            case = scaled(joint, clearance)
            run = simulate(case)
            assert run.attrs["complete"], run["reason"].item()
            away = np.abs(run["displacement"].values - ideal).max()
            rows.append({
                "scene": joint, "clearance": clearance / 1000, "deviation": short(away),
                "residual": short(float(run["energy_residual"]) / (AUDIT * case.rtol)),
            })  # fmt: skip
    return rows


def slopes(rows):
    """By scene the slope of log deviation over log clearance: fitted, and of each decade."""
    found = {}
    for scene in dict.fromkeys(row["scene"] for row in rows):
        points = [row for row in rows if row["scene"] == scene]
        x, y = (np.log10([row[key] for row in points]) for key in ("clearance", "deviation"))
        steps = np.diff(y) / np.diff(x)
        found[scene] = {
            "fitted": short(np.polyfit(x, y, 1)[0]),
            "least": short(steps.min()),
            "greatest": short(steps.max()),
        }
    return found


def table(rows, along, **coordinate):
    """Rows of (scene, along) as a Dataset."""
    scenes = [*dict.fromkeys(row["scene"] for row in rows)]
    names = [name for name in rows[0] if name not in ("scene", along)]
    ((dim, values),) = coordinate.items()
    shape = len(scenes), len(values)
    data = {name: (("scene", dim), np.reshape([r[name] for r in rows], shape)) for name in names}
    return xr.Dataset(data, {"scene": scenes, dim: values})


def figures(kept):
    """Both figures of a kept measurement, by file name."""
    rungs = table(kept["ladder"], "rtol", tolerance=kept["tolerances"])
    rungs["reference_uncertainty"] = "scene", [*kept["references_apart"].values()]
    revolutions = next(iter(default_cases().values())).solve.duration_rev
    bound = [allowed_residual(rtol, revolutions) for rtol in kept["tolerances"]]
    rungs["residual_bound"] = "tolerance", bound
    clearances = [*dict.fromkeys(row["clearance"] for row in kept["limit"])]
    vanishing = table(kept["limit"], "clearance", clearance=clearances)
    return {
        "ladders.svg": draw_tolerance_ladder(rungs),
        "limit.svg": draw_scaled_limit(vanishing),
    }


def main(target):
    rows, apart = ladder()
    vanishing = limit()
    kept = {
        **provenance("make ladders"),
        "reference": f"{REFERENCES[0]} at 1e-12, {REFERENCES[1]} at 1e-12 beside it",
        "tolerances": TOLERANCES,
        "references_apart": apart,
        "ladder": rows,
        "limit": vanishing,
        "slopes": slopes(vanishing),
    }
    keep(target, kept)
    for name, drawing in figures(kept).items():
        Path(target).with_name(name).write_bytes(render(drawing, "svg"))
    print(json.dumps({"slopes": kept["slopes"], "references_apart": apart}, indent=1))


if __name__ == "__main__":
    main(sys.argv[1])
