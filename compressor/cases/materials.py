"""Materials of the paper, and the contact stiffness that follows from them; needs no compiler."""

import math

# Table 2 of the paper: density (kg/m^3), Young's modulus (Pa), Poisson's ratio
MATERIALS = {"steel": (7801.0, 2.07e11, 0.29), "copper": (8906.0, 1.19e11, 0.326)}


def contact_stiffness(first, second, journal_radius, bearing_radius, internal=False):
    """Eq. 15's stiffness K (N/m^1.5) of two materials by name and two radii (m).

    The paper adds the radii's curvatures, as of two discs side by side; internal: it takes them
    from each other, as of a pin in a bore (Flores and Lankarani, Contact force models for multibody
    dynamics, 2016, ch. 3), which is stiffer. Raises KeyError for a material that is not in Table 2,
    ZeroDivisionError for internal radii that are alike. Steel on steel with radii 10 and 9.9 mm
    gives Table 3's 3.36e5 N/mm^1.5.
    """
    compliance = 0.0
    for name in (first, second):
        _, modulus, poisson = MATERIALS[name]
        compliance += (1.0 - poisson**2) / (math.pi * modulus)
    sign = -1.0 if internal else 1.0
    radius = journal_radius * bearing_radius / (bearing_radius + sign * journal_radius)
    return 4.0 / (3.0 * math.pi * compliance) * math.sqrt(radius)
