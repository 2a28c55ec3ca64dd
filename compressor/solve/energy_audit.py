"""The energy audit: whether a run's energy balances as well as its tolerance lets one expect.

The flows (work of crank and load, losses of the contacts) are integrated beside the motion, so
that what they miss of the energy's change is error of the run itself, whatever its cause.
"""

import numpy as np

PER_TURN = 10.0  # of rtol: the residual that a revolution may leave
ROUNDING = 1e-9  # a residual below it says nothing of a run
GREATEST = 0.05  # a residual above it is too large at any tolerance
RUNGS = 2  # by tens of the tolerance, for a run that fails its audit to be repeated at


def energy_residual(tally: np.record) -> float:
    """Return the worst imbalance relative to the contact's losses, floored at 1e-3 of the
    kinetic energy.
    """
    lost = tally["damping_loss"] + tally["friction_loss"]
    return float(tally["worst_imbalance"] / max(lost, 1e-3 * tally["peak_kinetic"]))


def allowed(rtol: float, revolutions: float) -> float:
    """Return the greatest energy residual of a run that can be trusted at a tolerance.

    The 200 random cases of tests/random_cases.py leave a quarter of it at most at rtol 1e-4, a
    tenth at tighter ones (tests/results/accuracy.json). Runs beyond it, of extremes of stiffness,
    stiction and mass ratio, mostly keep it at a tenth of the tolerance; those that never do are
    far off (mu 0.5 at rtol 2e-8: 1.6e-4 of the acceleration).
    """
    return min(max(PER_TURN * rtol * max(revolutions, 1.0), ROUNDING), GREATEST)
