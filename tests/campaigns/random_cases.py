"""Cases drawn at random: the ground on which tolerances and error bars are judged.

A Sobol sequence with a fixed seed over clearance 0.01-1 mm (log-uniform), rod 2-8 kg,
reciprocating mass 4-25 kg, 100-1500 rpm, all loads and all scenes with clearance; friction is on,
all else as by default.
"""

from scipy.stats import qmc

SEED = 2021
LOADS = ("design", "typical", "none")
JOINTS = ("big_end", "small_end", "both")


def rounded(value):
    """Four digits, so that a case can be written into a file."""
    return float(f"{value:.4g}")


def random_cases(count=200):
    """The first cases of the sequence, as values of a case file without `solve`."""
    points = qmc.Sobol(6, seed=SEED).random(256)[:count]
    return [
        {
            "load": LOADS[int(3 * load)],
            "joint": JOINTS[int(3 * joint)],
            "clearance_mm": rounded(10 ** (2 * clearance - 2)),
            "machine": {
                "rod_mass_kg": rounded(2 + 6 * rod),
                "reciprocating_mass_kg": rounded(4 + 21 * mass),
                "speed_rpm": rounded(100 + 1400 * speed),
            },
        }
        for clearance, rod, mass, speed, load, joint in points
    ]
