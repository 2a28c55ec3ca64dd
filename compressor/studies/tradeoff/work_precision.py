"""Work and precision: what each method and tolerance costs, and how far it is from the truth.

The truth is a reference run at 1e-12 by a method other than the one that is judged; how far two
references of different families lie apart says below which error nothing can be known.
"""

import itertools
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from compressor.analysis import FAULTS, label, paper_cases, settled_part
from compressor.cases import ACCURACY, METHODS, Case, Output, load_studies, points
from compressor.metrics import JOINTS
from compressor.program import PROGRAM, CompsimError, Progress, no_progress
from compressor.reasons import Reason
from compressor.solve import LOCAL, simulate

MEASURED_METHODS = tuple(method for method in METHODS if method != "TSIT5")  # which auto steps by
# those behind the words of `accuracy`, and some between
WORDS = {tier.rtol for tier in ACCURACY.values()}
TOLERANCES = tuple(sorted(WORDS | {1e-3, 2e-4, 1e-6}, reverse=True))
REFERENCES = ("DOP853", "RODAS")  # SciPy's explicit one, our implicit one that lands on onsets
REFERENCE_RTOL = 1e-12
PAPER_METHOD, PAPER_RTOL = "BDF", 1e-5  # ADAMS's GSTIFF is a BDF code; its error tolerance
SLOW_SECONDS = 0.25  # s: a longer point is timed once
POINT_SECONDS = 4.0  # s, of a point
DECADES = tuple(10.0**-k for k in range(1, 10))

# name: what it is the relative error of
ERRORS = {
    "acceleration": "acceleration, L2 over the output grid",
    "peak_acceleration": "peak acceleration",
    "rms_acceleration": "rms acceleration",
    "peak_contact_force": "peak contact force, worst joint with clearance",
}
COUNTS = ("steps", "evaluations", "rejected")

Point = tuple[int, int, int]  # scene, method, tolerance


class ReferenceFailed(CompsimError):
    """A case whose reference run does not reach its end, so that nothing can be judged."""

    exit_code = 3


def default_cases() -> dict[str, Case]:
    """Return the paper's three faults at 0.2 mm, by label."""
    cases = paper_cases()
    return {label(fault, 0.2): cases[label(fault, 0.2)] for fault in FAULTS}


class NothingIntegrated(CompsimError):
    """A case without clearance, whose motion is known in closed form."""

    exit_code = 2


def format_swept(value: object) -> str:
    """Return a swept value in few characters."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def cases_of_files(configs: Sequence[str], overrides: Sequence[str]) -> dict[str, Case]:
    """Return the cases to be studied, by label; each needs a joint with clearance."""
    cases = {}
    for study in load_studies(*configs, overrides=overrides):
        for point, case in zip(points(study), study.cases, strict=True):
            name = " ".join([study.name, *(format_swept(value) for value in point.values())])
            if not faulty(case):
                raise NothingIntegrated(
                    f"{study.path}: {name} has no joint with clearance, so nothing is integrated: "
                    "set joint and clearance_mm"
                )
            cases[name] = case
    return cases


def solve_by_method(case: Case, method: str, rtol: float, timeout: float | None = None) -> Case:
    """Return a case by another method and tolerance: series kept, no error bars, no horizon."""
    solve = replace(
        case.solve, method=method, rtol=rtol, accuracy="standard", error_bars=False, horizon=False
    )
    if timeout is not None:
        solve = replace(solve, timeout_s=timeout)
    return replace(case, solve=solve, output=Output())


def pin_span(case: Case, run: xr.Dataset) -> Case:
    """Return a case over as many revolutions as a whole run of it has, in place of `auto`.

    What is compared with that run is then as long, however long it would take to settle itself.
    """
    if "auto" not in spans_given(case) or not complete(run):
        return case
    spans = run["time"].values[-1] / case.turn, run.attrs["settle"] / case.turn
    duration, settle = (round(span, 6) for span in spans)  # whole ones, where they were `auto`
    return replace(case, solve=replace(case.solve, duration_rev=duration, settle_rev=settle))


def settle_span(case: Case) -> Case:
    """Return a case over the revolutions that it needs to settle, in place of `auto`."""
    if "auto" not in spans_given(case):
        return case
    return pin_span(case, simulate(replace(case, output=Output())))


def spans_given(case: Case) -> tuple[float | str | None, float | str]:
    """Return how long a case is to run and to settle: revolutions, or `auto`."""
    return case.solve.duration_rev, case.solve.settle_rev


def complete(run: xr.Dataset) -> bool:
    """Return whether a run reached its end."""
    return bool(run.attrs["complete"])


def faulty(case: Case) -> list[str]:
    """Return the joints of a case that have clearance."""
    return [joint for joint in JOINTS if getattr(case.clearance_mm, joint) > 0]


def stored_values(run: xr.Dataset, joints: Sequence[str]) -> dict[str, np.ndarray]:
    """Return the values whose errors are taken, as the run has stored them.

    The acceleration, (m,), and metrics of the dense solution.
    """
    forces = run["peak_contact_force"].sel(joint=list(joints)).values
    scalars = {name: run[name].values for name in ("peak_acceleration", "rms_acceleration")}
    return {"acceleration": run["acceleration"].values, **scalars, "peak_contact_force": forces}


def grid_values(run: xr.Dataset, joints: Sequence[str]) -> dict[str, np.ndarray]:
    """Return `stored_values` as the output grid has them, which hides peaks between samples.

    Includes the acceleration over the whole run; peaks and rms are those after `settle_rev`.
    """
    settled = settled_part(run)
    a = settled["acceleration"].values
    sizes = np.hypot(
        *settled["contact_force"].sel(joint=list(joints)).transpose("axis", ...).values
    )
    return {
        "acceleration": run["acceleration"].values,
        "peak_acceleration": np.abs(a).max(),
        "rms_acceleration": np.sqrt(np.mean(a**2)),
        "peak_contact_force": sizes.max(axis=0),
    }


def errors(found: Mapping[str, np.ndarray], truth: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Return the relative errors by the names of `ERRORS`."""
    a, true_a = found["acceleration"], truth["acceleration"]
    relative = {"acceleration": float(np.linalg.norm(a - true_a) / np.linalg.norm(true_a))}
    for name in list(ERRORS)[1:]:
        relative[name] = float(np.max(np.abs(found[name] / truth[name] - 1)))
    return relative


def reference(name: str, case: Case, method: str) -> dict[str, np.ndarray]:
    """Return the values of a reference run. Raises ReferenceFailed."""
    run = simulate(solve_by_method(case, method, REFERENCE_RTOL))
    if not complete(run):
        reason = f"{run['reason'].item()}: {run.attrs['detail']}"
        raise ReferenceFailed(
            f"{name}: the reference, {method} at {REFERENCE_RTOL:g}, ends with {reason}; "
            "shorten solve.duration_rev or raise solve.timeout_s"
        )
    return stored_values(run, faulty(case))


def work_precision(
    cases: Mapping[str, Case],
    methods: Sequence[str] = MEASURED_METHODS,
    tolerances: Sequence[float] = TOLERANCES,
    repeats: int = 3,
    budget: float = POINT_SECONDS,
    progress: Progress = no_progress,
) -> xr.Dataset:
    """Run every case by every method at every tolerance; dims (scene, method, tolerance).

    (`Dataset.sel` has arguments of these names: select by `study.sel({"method": "auto"})`.)

    A point that fails stays, with nan errors and its reason. One that runs out of `budget` (s)
    ends its method's row: tighter tolerances are "missing". `seconds` is the best of `repeats`
    rounds over all points; points above SLOW are timed once. Each case needs a joint with
    clearance, or ValueError is raised; raises ReferenceFailed.
    """
    for name, case in cases.items():
        if not faulty(case):
            raise ValueError(f"{name} has no joint with clearance: nothing is integrated")
    tolerances = sorted(tolerances, reverse=True)
    cases = {name: settle_span(case) for name, case in cases.items()}
    study = empty(list(cases), methods, tolerances)
    first = solve_by_method(next(iter(cases.values())), "auto", tolerances[0])
    study["seconds_compile"] = (), seconds_compile(first), {"units": "s", "long_name": COMPILE}
    total = len(cases) * (len(methods) * len(tolerances) * repeats + 3)
    done = itertools.count(1)
    truths: dict[str, dict[str, Mapping]] = {name: {} for name in cases}
    for name, case in cases.items():
        for method in REFERENCES:
            truths[name][method] = reference(name, case, method)
            progress(next(done), total, f"{name}, reference by {method}")
        apart = errors(truths[name][REFERENCES[1]], truths[name][REFERENCES[0]])
        study["reference_uncertainty"].loc[name] = [apart[quantity] for quantity in ERRORS]
        judge_paper(study, name, case, truths[name])
        progress(next(done), total, f"{name}, the paper's numerics")
    jobs = list(cases.items())
    for _ in range(repeats):
        for point in np.ndindex(study["status"].shape):
            name, case = jobs[point[0]]
            measure(study, point, case, truths[name], budget)
            progress(next(done), total, "")
    study.attrs = {
        "title": "work and precision of integration methods",
        "program": PROGRAM,
        "references": f"{', '.join(REFERENCES)} at {REFERENCE_RTOL:g}",
        "repeats": repeats,
        "budget_seconds": budget,
    }
    return study


COMPILE = "what the first call of the compiled solver takes beyond a second: compiling or loading"


def seconds_compile(case: Case) -> float:
    """Return the compile time (s) of the compiled solver in this process.

    It is what the first call takes beyond the second.
    """
    began = time.perf_counter()
    simulate(case)
    middle = time.perf_counter()
    simulate(case)
    return max(0.0, 2 * middle - began - time.perf_counter())


def empty(scenes: list[str], methods: Sequence[str], tolerances: Sequence[float]) -> xr.Dataset:
    """Return a study without its values: nothing run yet."""
    dims = ("scene", "method", "tolerance")
    shape = (len(scenes), len(methods), len(tolerances))
    text = {"status": "ok, failed, or missing: not run since a looser tolerance took too long",
            "reason": "why a point failed, by a stable name"}  # fmt: skip
    variables: dict[str, tuple] = {
        "status": (dims, np.full(shape, "missing", object), {"long_name": text["status"]}),
        "reason": (dims, np.full(shape, "", object), {"long_name": text["reason"]}),
    }
    for name, phrase in ERRORS.items():
        attrs = {"units": "1", "long_name": f"relative error of {phrase}"}
        variables[f"error_{name}"] = (dims, np.full(shape, np.nan), attrs)
        paper = attrs | {"long_name": f"{attrs['long_name']}, by the paper's numerics"}
        variables[f"paper_error_{name}"] = ("scene", np.full(len(scenes), np.nan), paper)
    seconds = {"units": "s", "long_name": "wall time of the solution, best of the repeats"}
    variables["seconds"] = (dims, np.full(shape, np.nan), seconds)
    about = {"units": "s", "long_name": f"wall time of {PAPER_METHOD} at rtol {PAPER_RTOL:g}"}
    variables["paper_seconds"] = ("scene", np.full(len(scenes), np.nan), about)
    for name in COUNTS:
        variables[name] = (dims, np.zeros(shape, np.int64), {"units": "1", "long_name": name})
    distance = {"units": "1", "long_name": "relative distance of two references"}
    uncertainty = np.full((len(scenes), len(ERRORS)), np.nan)
    variables["reference_uncertainty"] = (("scene", "quantity"), uncertainty, distance)
    coordinates = {
        "scene": ("scene", np.array(scenes, object), {"long_name": "case"}),
        "method": ("method", np.array(methods, object), {"long_name": "solve.method"}),
        "tolerance": ("tolerance", np.array(tolerances), {"units": "1", "long_name": "rtol"}),
        "quantity": ("quantity", np.array(list(ERRORS), object), {"long_name": "what differs"}),
    }
    return xr.Dataset(variables, coordinates)


def judge_paper(study: xr.Dataset, name: str, case: Case, truth: Mapping[str, Mapping]) -> None:
    """Write into a study the errors of the paper's own numerics.

    BDF at 1e-5, read from the output grid (0.1 ms in the paper).
    """
    rtol = PAPER_RTOL / LOCAL.get(PAPER_METHOD, 1.0)  # so that SciPy's own tolerance is 1e-5
    run = simulate(solve_by_method(case, PAPER_METHOD, rtol))
    if complete(run):
        found = errors(grid_values(run, faulty(case)), truth[REFERENCES[0]])
        for quantity, value in found.items():
            study[f"paper_error_{quantity}"].loc[name] = value
    study["paper_seconds"].loc[name] = run["seconds"].item()


def measure(study: xr.Dataset, point: Point, case: Case, truth: Mapping, budget: float) -> None:
    """Run one point and note what it gives; a point that is known to be slow is not run again."""
    method = str(study["method"].values[point[1]])
    seconds = study["seconds"].values
    earlier = point[:2]
    out_of_time = study["reason"].values[earlier][: point[2]] == Reason.BUDGET_SECONDS
    if out_of_time.any() or seconds[point] > SLOW_SECONDS:
        return
    rtol = float(study["tolerance"].values[point[2]])
    run = simulate(solve_by_method(case, method, rtol, budget))
    seconds[point] = np.fmin(seconds[point], run["seconds"].item())
    if study["status"].values[point] != "missing":
        return
    for name in ("status", "reason", *COUNTS):
        study[name].values[point] = run[name].item()
    if complete(run):
        judge = next(other for other in REFERENCES if other != method)
        for quantity, value in errors(stored_values(run, faulty(case)), truth[judge]).items():
            study[f"error_{quantity}"].values[point] = value


def fastest(study: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield the fastest point below each decade of error, for each scene.

    Decades that no point reaches, or that are below what the references know, have no row.
    """
    for name in study["scene"].values:
        one = study.sel(scene=name)
        unknown = float(one["reference_uncertainty"].sel(quantity="acceleration"))
        for decade in DECADES:
            good = one["seconds"].where(one["error_acceleration"] <= decade)
            if decade < unknown or not good.notnull().any():
                continue
            best = one.isel(good.argmin(dim=["method", "tolerance"]))
            yield {
                "scene": str(name),
                "error_below": decade,
                "method": str(best["method"].item()),
                "rtol": best["tolerance"].item(),
                "seconds": best["seconds"].item(),
                "error": best["error_acceleration"].item(),
            }
