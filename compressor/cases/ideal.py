"""The machine of a case with ideal joints: what runs with clearance are compared with."""

from dataclasses import replace

from compressor.cases.case import Case


def with_ideal_joints(case: Case) -> Case:
    """Return the case without clearance, and without oil and wear, which only a clearance can
    have.
    """
    return replace(case, joint="none", lubricant=None, wear=None)
