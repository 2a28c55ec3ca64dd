"""The cases of the paper: two ideal machines, and nine with clearance."""

import itertools
from dataclasses import replace

from compressor.cases import Case, with_ideal_joints
from compressor.metrics import JOINTS

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

    Its own load, joints and clearances are left aside. The gas load may not fit a machine of
    other lengths: such a case has `problems`, and no run of it is ok.
    """
    ideal = with_ideal_joints(machine)
    cases = {name: replace(ideal, load=load) for name, load in LOADS.items()}
    for fault, c in itertools.product(FAULTS, CLEARANCES):
        sizes = replace(machine.clearance_mm, big_end=c, small_end=c)
        cases[label(fault, c)] = replace(cases["design"], joint=fault, clearance_mm=sizes)
    return cases


FAULT_LABELS = tuple(label(fault, c) for fault in FAULTS for c in CLEARANCES)
