"""How continuously a joint hits: measures of the literature, beside the paper's words."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.analysis.contact_modes import FOLLOWING, contact_modes
from compressor.analysis.frame_forces import whole_revolutions
from compressor.analysis.impacts import impacts
from compressor.analysis.shaking import ORDER, evenly

WINDOW = 10.0  # degrees of crank angle that count as hit by one impact or more
SLOWEST = 0.01  # m/s: approach speed from which on a contact after flight counts as an impact
ENERGY = 0.9  # share of the energy whose angle is told


@dataclass(frozen=True)
class Continuity:
    """How a joint's contact is spread over whole revolutions; all are shares, 0 to 1.

    `apart`: of crank angle in flight or impact (`contact_modes`). `hit`: of windows of `WINDOW`
    degrees that an impact faster than `SLOWEST` falls into. `energy_angle`: of crank angle that
    holds `ENERGY` of the energy of the horizontal joint force above `ORDER`, large where it rings
    all around. `gini`: index of that force's magnitudes, large where it is concentrated (Hurley and
    Rickard 2009).
    """

    apart: float
    hit: float
    energy_angle: float
    gini: float


def continuity(run: xr.Dataset, joint: str, start_up: bool = False) -> Continuity:
    """The `Continuity` of a joint with clearance, over settled whole revolutions of a run.

    `start_up`: over whole revolutions from the run's begin. Raises NoSeriesError where there is
    none, ValueError where the joint has no clearance.
    """
    from compressor.vibration import energy_angle, high_pass_orders, shape

    run = run.assign_attrs(settle=0.0) if start_up else run
    kept, revolutions = whole_revolutions(run)
    force = kept["contact_force"].sel(joint=joint, axis="x").values
    even, a_turn = evenly(kept, revolutions, force)
    high = high_pass_orders(even, a_turn, ORDER)
    modes = contact_modes(kept)["mode"].sel(joint=joint).values[:-1]
    return Continuity(
        float((modes != FOLLOWING).mean()),
        hit_share(impacts(kept), joint, revolutions),
        energy_angle(high, ENERGY),
        shape(high).gini,
    )


def compared(big: Continuity, small: Continuity) -> str:
    """The measures of a big end beside those of a small end, in words."""
    return (
        f"flight and impact {big.apart:.1%} and {small.apart:.1%} of the angle; "
        f"{WINDOW:g}° windows hit {big.hit:.1%} and {small.hit:.1%}; {ENERGY:.0%} of the energy of "
        f"F_x above order {ORDER} in {big.energy_angle:.0%} and {small.energy_angle:.0%} of the "
        f"angle; Gini index {big.gini:.2f} and {small.gini:.2f}"
    )


def more_continuous(big: Continuity, small: Continuity) -> bool:
    """Whether a big end hits more continuously than a small end by all three shares of angle."""
    return big.apart > small.apart and big.hit > small.hit and big.energy_angle > small.energy_angle


def hit_share(table: xr.Dataset, joint: str, revolutions: int) -> float:
    """The share of windows of `WINDOW` degrees, over the revolutions, that a joint hits in."""
    counts = (table["joint"].values == joint) & (table["approach_speed"].values > SLOWEST)
    angle = 360.0 * table["revolution"].values[counts] + table["crank_angle"].values[counts]
    return np.unique(angle // WINDOW).size * WINDOW / (360.0 * revolutions)
