"""The paper's cases, and what a stored run says: its case, its load, and how it moves."""

import contextlib
import itertools
import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from compressor.cases import Case, CaseError, with_ideal_joints
from compressor.metrics import JOINTS
from compressor.physics import exact_motion
from compressor.solve import record

if TYPE_CHECKING:
    import xarray as xr

CLEARANCES = (0.1, 0.2, 0.3)
FAULTS = ("big_end", "small_end", "both")
LOADS = {"typical": "gas", "design": "spring"}  # the paper's models, without clearance
SPOKEN = {"big_end": "big end", "small_end": "small end", "both": "both joints"}


def label(fault: str, clearance: float) -> str:
    """Return the name of one of the paper's fault cases, such as `big_end 0.2`."""
    return f"{fault} {clearance:g}"


def faulty_joints(fault: str) -> tuple[str, ...]:
    """Return the joints with clearance of a fault."""
    return JOINTS if fault == "both" else (fault,)


def paper_cases(**machine: float) -> dict[str, Case]:
    """Return the paper's eleven cases by label; `machine` overrides keys such as rod_mass_kg."""
    return cases_of(Case.resolve({"machine": machine}))


def cases_of(machine: Case) -> dict[str, Case]:
    """Return the paper's eleven cases by label, alike in all other assumptions of a case.

    Its own load, joints and clearances are left aside. A load or a clearance that does not fit the
    machine, as the gas load may not fit other lengths, is left out.
    """
    cases, ideal = {}, with_ideal_joints(machine)
    for name, load in LOADS.items():
        with contextlib.suppress(CaseError):
            cases[name] = replace(ideal, load=load)
    for fault, c in itertools.product(FAULTS, CLEARANCES):
        sizes = replace(machine.clearance_mm, big_end=c, small_end=c)
        with contextlib.suppress(CaseError):
            worn = replace(ideal, load=LOADS["design"], joint=fault, clearance_mm=sizes)
            cases[label(fault, c)] = worn
    return cases


FAULT_LABELS = tuple(label(fault, c) for fault in FAULTS for c in CLEARANCES)


def settled_part(run: "xr.Dataset") -> "xr.Dataset":
    """Return the samples from `settle_rev` on, since start-up is not the machine."""
    time, begin = run["time"].values, run.attrs["settle"] * (1 - 1e-12)
    if time[0] >= begin:
        return run
    return run.isel(time=slice(int(np.searchsorted(time, begin)), None))  # views, no copies


def settled_revolutions(run: "xr.Dataset") -> float:
    """Return the number of revolutions over which a run's metrics are taken."""
    return float(np.ptp(settled_part(run)["crank_angle"].values)) / math.tau


@dataclass(frozen=True)
class Relation:
    """Least squares of the horizontal joint force against acceleration: force = slope a + b."""

    slope: float  # kg
    intercept: float  # N
    r2: float


def force_relation(run: "xr.Dataset", joint: str) -> Relation:
    """Return `Relation` of a joint's settled horizontal force (N, on the rod) to acceleration."""
    settled = settled_part(run)
    a = settled["acceleration"].values
    force = settled["contact_force"].sel(joint=joint, axis="x").values
    slope, intercept = np.polyfit(a, force, 1)
    return Relation(float(slope), float(intercept), float(np.corrcoef(a, force)[0, 1] ** 2))


def ideal_motion(run: "xr.Dataset") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return displacement, velocity and acceleration (SI) of the ideal machine.

    (m,) each, at the run's own crank angles, and at its own crank speed where that varies.
    """
    case = case_of(run)
    lengths = case.machine.crank_radius_mm / 1000, case.machine.rod_length_mm / 1000
    x, v, a = exact_motion(run["crank_angle"].values, *lengths, case.omega)
    if "crank_speed" not in run:
        return x, v, a
    speed = run["crank_speed"].values
    share, gain = speed / case.omega, np.gradient(speed, run["time"].values)
    return x, v * share, a * share**2 + v / case.omega * gain


def case_of(run: "xr.Dataset") -> Case:
    """Return the case that a stored run belongs to, from its attributes."""
    return _case(run.attrs["case"])


def record_of(run: "xr.Dataset") -> np.record:
    """Return the record (SI) of the case that a stored run belongs to; not to be written."""
    return _record(run.attrs["case"])


@lru_cache(maxsize=32)
def _case(text: str) -> Case:
    return Case.from_attribute(text)


@lru_cache(maxsize=32)
def _record(text: str) -> np.record:
    return record(_case(text))
