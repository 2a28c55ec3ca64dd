"""What does not fit together in lubricant, guide, drive, rod and the friction of ideal joints."""

from collections.abc import Iterator

from compressor.cases.lubricant import GREATEST_RATIO, LEAST_RATIO
from compressor.cases.parameter import Problem
from compressor.cases.table import Settings
from compressor.metrics import JOINTS

SLIM = 1.0 - 1e-9  # of a uniform bar's inertia, which an elastic rod has at least


def lubricant_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    """Find a bearing for which the film's numbers do not hold."""
    if not case.lubricant:
        return
    for joint in JOINTS:
        width = 2.0 * case.machine.pin_radius(joint)
        ratio = case.lubricant.bearing_length_mm / width
        if case.joint in (joint, "both") and not LEAST_RATIO <= ratio <= GREATEST_RATIO:
            yield Problem(
                "lubricant.bearing_length_mm",
                f"is {ratio:.3g} times the diameter of the pin, {width:g} mm; the film's numbers "
                f"hold from {LEAST_RATIO:g} to {GREATEST_RATIO:g} times",
            )


def wear_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    """Find what a bore that wears cannot have: oil, and a limit that is reached already."""
    if not case.wear:
        return
    if case.lubricant:
        yield Problem(
            "wear", "of a bore that runs dry is known, and the film's numbers are those of a round "
            "one: leave out lubricant or wear",
        )  # fmt: skip
    most = max(case.clearance_mm.big_end, case.clearance_mm.small_end)
    if case.wear.limit_mm is not None and case.wear.limit_mm <= most:
        yield Problem(
            "wear.limit_mm", f"{case.wear.limit_mm:g} mm must be more than the clearance, {most:g} "
            "mm: it is what the clearance grows to",
        )  # fmt: skip


def mechanism_conflicts(case: Settings, given: frozenset[str]) -> Iterator[Problem]:
    """Yield what does not fit together in guide, drive, rod and the friction of ideal joints."""
    machine, friction = case.machine, case.friction
    if case.drive and case.body:
        yield Problem(
            "body", "moves in equal steps of time, which a drive whose speed gives way has not: "
            "leave out body or drive",
        )  # fmt: skip
    if case.rod:
        if machine.rod_centre_mm != machine.rod_length_mm / 2:
            yield Problem(
                "machine.rod_centre_mm", "an elastic rod is a uniform bar: leave the key out"
            )
        least = machine.rod_mass_kg * (machine.rod_length_mm / 1000) ** 2 / 12
        if (machine.rod_inertia_kg_m2 or 0.0) < SLIM * least:
            yield Problem(
                "machine.rod_inertia_kg_m2",
                f"an elastic rod is a uniform bar, which has {least:.4g} kg m2 at least: leave "
                "the key out",
            )
    if friction and friction.ideal_joints and friction.law == "lugre":
        yield Problem(
            "friction.ideal_joints", "have no bristles, as friction.law: lugre needs: choose "
            "another law, or leave the key out",
        )  # fmt: skip
