"""The modelling trade: what each feature of the model changes in the answer, and costs in time.

A feature is a row of `compressor.measure.feature_rows`. `trade` quotes them all;
`compressor.measure.explain` those that a case pays for.
"""

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from compressor.cases import ACCURACY, Case, Output
from compressor.measure.feature_rows import FEATURES
from compressor.measure.work_precision import (
    Progress,
    complete,
    faulty,
    grid_values,
    solved,
    stored_values,
)
from compressor.metrics import JOINTS
from compressor.physics import exact_motion, series_motion
from compressor.program import PROGRAM
from compressor.solve import simulate

EXACT = "fine"  # accuracy at which answers are compared


@dataclass(frozen=True)
class Effect:
    """What a change of the model does: relative changes, and the ratio of wall times.

    nan where a number has no meaning; `reason` is that of a run that failed.
    """

    change_peak_acceleration: float = math.nan
    change_peak_contact_force: float = math.nan
    change_acceleration: float = math.nan
    time_ratio: float = math.nan
    reason: str = ""


def comparable(case: Case) -> Case:
    """A case solved so exactly that only its model tells in its answer."""
    return solved(case, "auto", min(case.rtol, ACCURACY[EXACT].rtol))


def compare(base: Case, other: Case, repeats: int, known: xr.Dataset | None = None) -> Effect:
    """What another model changes in the joints that the base has clearance in.

    Answers are compared at `EXACT`; the ratio of times is the median over `repeats` pairs of runs
    in turn, each case by its own method and tolerance. known: the base's run to compare with, where
    it was made before.
    """
    runs = [simulate(comparable(base)) if known is None else known, simulate(comparable(other))]
    # a body moves in time series; it changes neither the run nor the time of its solution
    timed = [
        replace(case, body=None, sensor=None, output=Output("metrics")) for case in (base, other)
    ]
    ratios = []
    for _ in range(repeats):
        ours, others = (simulate(case)["seconds"].item() for case in timed)
        ratios.append(others / ours)
    for run in runs:
        if not complete(run):
            return Effect(reason=run["reason"].item())
    joints = faulty(base) or [*JOINTS]
    peak, force, apart = changes(*[stored_values(run, joints) for run in runs])
    return Effect(peak, force, apart, statistics.median(ratios))


def changes(
    values: Mapping[str, np.ndarray], others: Mapping[str, np.ndarray]
) -> tuple[float, float, float]:
    """Relative changes of peak acceleration and contact force, signed, and L2 of acceleration."""
    peak = others["peak_acceleration"] / values["peak_acceleration"] - 1
    forces = others["peak_contact_force"] / values["peak_contact_force"] - 1
    force = forces[np.abs(forces).argmax()]
    a, b = values["acceleration"], others["acceleration"]
    return float(peak), float(force), float(np.linalg.norm(b - a) / np.linalg.norm(a))


def series_kinematics(case: Case) -> tuple[Effect, float]:
    """The paper's series (Eq. 3-4) in place of the exact ideal motion, and its error of place.

    Never simulated with: the effect is on the ideal machine's acceleration; the second number is
    the greatest error of displacement as a share of the smallest clearance.
    """
    machine = case.machine
    lengths = machine.crank_radius_mm / 1000, machine.rod_length_mm / 1000
    theta = np.linspace(0, 2 * np.pi, 3601)
    x, _, a = exact_motion(theta, *lengths, case.omega)
    series_x, _, series_a = series_motion(theta, *lengths, case.omega)
    peak = np.abs(series_a).max() / np.abs(a).max() - 1
    apart = np.linalg.norm(series_a - a) / np.linalg.norm(a)
    clearance = min(getattr(case.clearance_mm, joint) for joint in faulty(case)) / 1000
    share = float(np.abs(series_x - x).max() / clearance)
    return Effect(float(peak), change_acceleration=float(apart)), share


def output_grid(case: Case) -> Effect:
    """Peaks read from the output grid, 0.1 ms in the paper, in place of the dense solution."""
    run = simulate(comparable(case))
    if not complete(run):
        return Effect(reason=run["reason"].item())
    joints = faulty(case)
    peak, force, _ = changes(stored_values(run, joints), grid_values(run, joints))
    return Effect(peak, force)


def variants(case: Case) -> dict[str, Case]:
    """The models that a case is compared with: features toggled, and the other load, by name."""
    found = {}
    for feature in FEATURES:
        if feature.key == "load":
            continue
        if feature.paid(case):
            found[feature.off] = feature.remove(case)
        elif added := feature.add(case):
            found[feature.on] = added
    other = {"design": "typical", "typical": "design"}.get(case.load)
    if other:
        found[f"{other} load"] = replace(case, load=other)
    return found


SERIES, GRID = "series kinematics (Eq. 3-4)", "peaks from the output grid"


def trade(
    cases: Mapping[str, Case],
    repeats: int = 9,
    progress: Progress = lambda done, total, remark: None,
) -> xr.Dataset:
    """What each change of the model does to each case; dims (scene, change), nan where it cannot.

    `place_error` is that of the series kinematics as a share of the clearance. Each case needs a
    joint with clearance.
    """
    toggled = {name: variants(case) for name, case in cases.items()}
    names = [*dict.fromkeys(change for found in toggled.values() for change in found), GRID, SERIES]
    rows: dict[tuple[str, str], Effect] = {}
    place = []
    total, done = sum(map(len, toggled.values())), 0
    for scene, case in cases.items():
        for change, other in toggled[scene].items():
            rows[scene, change] = compare(case, other, repeats)
            done += 1
            progress(done, total, "")
        rows[scene, GRID] = output_grid(case)
        rows[scene, SERIES], share = series_kinematics(case)
        place.append(share)
    return labelled(list(cases), names, rows, place)


MEANINGS = {
    "change_peak_acceleration": "relative change of peak acceleration",
    "change_peak_contact_force": "relative change of peak contact force where it changes most",
    "change_acceleration": "relative L2 change of acceleration",
    "time_ratio": "wall time over that of the case itself",
}


def labelled(
    scenes: Sequence[str], names: Sequence[str], rows: Mapping, place: Sequence[float]
) -> xr.Dataset:
    """Effects as a Dataset; what does not apply is nan."""
    dims, shape = ("scene", "change"), (len(scenes), len(names))
    variables: dict[str, tuple] = {}
    for field, phrase in MEANINGS.items():
        values = [getattr(rows.get((s, n)), field, np.nan) for s in scenes for n in names]
        attrs = {"units": "1", "long_name": phrase}
        variables[field] = (dims, np.reshape(values, shape), attrs)
    reasons = [getattr(rows.get((s, n)), "reason", "") for s in scenes for n in names]
    attrs = {"long_name": "why a run failed, by a stable name"}
    variables["reason"] = (dims, np.reshape(np.array(reasons, object), shape), attrs)
    phrase = "greatest error of the series' displacement over the smallest clearance"
    variables["place_error"] = ("scene", list(place), {"units": "1", "long_name": phrase})
    coordinates = {
        "scene": ("scene", np.array(scenes, object), {"long_name": "case"}),
        "change": ("change", np.array(names, object), {"long_name": "change of the model"}),
    }
    attrs = {"title": "what the model's features change and cost", "compared_at": EXACT,
             "program": PROGRAM}  # fmt: skip
    return xr.Dataset(variables, coordinates, attrs)
