"""Cases drawn at random: the ground on which promises and error bars are judged.

Clearance 0.01-1 mm, rod 2-8 kg, reciprocating mass 4-25 kg, 100-1500 rpm, all loads and all scenes
with clearance; friction is on, all else as by default. Clearance and speed are even in logarithms.
"""

from functools import cache

import numpy as np

from compressor.cases.case import Case
from compressor.solve.simulate import simulate

LOADS = ("spring", "gas", "none")
JOINTS = ("big_end", "small_end", "both")


def rounded(value):
    """Four digits, so that a case can be written into a file."""
    return float(f"{value:.4g}")


def drawn(load, joint, clearance, rod, mass, rpm):
    """A case, as values of a case file without `solve`, from numbers in [0, 1) and a speed."""
    return {
        "load": LOADS[int(3 * load)],
        "joint": JOINTS[int(3 * joint)],
        "clearance_mm": rounded(10 ** (2 * clearance - 2)),
        "machine": {
            "rod_mass_kg": rounded(2 + 6 * rod),
            "reciprocating_mass_kg": rounded(4 + 21 * mass),
            "speed_rpm": rounded(rpm),
        },
    }


def strangers(seed, count):
    """Cases as a stranger would draw them."""
    return [
        drawn(*numbers, 100 * 15**speed)
        for *numbers, speed in np.random.default_rng(seed).random((count, 6))
    ]


@cache
def load_equations():
    """Load once in a process what would else count for its first cases."""
    for how in ({}, {"method": "RODAS"}, {"horizon": True}):
        solve = {"duration_rev": 0.01, "settle_rev": 0, "output_step_deg": 0.36, **how}
        simulate(Case.from_values({"joint": "both", "clearance_mm": 0.1, "solve": solve}))
