"""How much a body that is driven one way would change the force that drives it."""

from typing import Any

from compressor.cases.table import Settings


def back_action(case: Settings, axis: str, frequency: Any) -> Any:
    """Return the relative change of the shaking force by the motion of the body it drives, complex.

    A body that accelerates by a takes the moving parts m along, so that the force X on it becomes
    X - m a. With a = -X G / M, G = f^2 / (f_n^2 - f^2 + 2 i zeta f f_n), the change is m G / M of
    the force, and the response of a body coupled both ways is that of one driven one way over
    1 - m G / M. Exact for ideal joints.

    frequency: Hz, a number or an array; axis: x or y.
    """
    body = case.body
    assert body is not None
    natural = getattr(body, f"frequency_{axis}_Hz")
    stiffness = natural**2 - frequency**2 + 2j * body.damping_ratio * frequency * natural
    return moving_mass(case) / body.mass_kg * frequency**2 / stiffness


def moving_mass(case: Settings) -> float:
    """Return the rod and reciprocating parts (kg), which a body takes along in both directions."""
    return case.machine.rod_mass_kg + case.machine.reciprocating_mass_kg
