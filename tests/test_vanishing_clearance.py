"""As the clearance vanishes, and the contact with it, the motion goes to the ideal one."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.cases.groups import Contact
from compressor.solve.simulate import measure, simulate

CLEARANCES = (1.0, 1e-2, 1e-4, 1e-6)  # mm: down to 1 nm
PAPER = 0.1  # mm: the clearance at which the contact is the paper's
AUDIT = 10  # rtol a revolution: the bound of the energy residual
JOINTS = ("big_end", "small_end", "both")


def displacement(joint, clearance):
    """The crosshead's displacement in a revolution, the contact scaled to its clearance (mm).

    So that compliance shrinks as the clearance does.
    """
    ratio, paper = clearance / PAPER, Contact()
    contact = {
        "stiffness_N_per_mm15": paper.stiffness_N_per_mm15 * ratio**-1.5,
        "full_damping_mm": paper.full_damping_mm * ratio,
        "damping_N_s_per_mm": paper.damping_N_s_per_mm * ratio**-0.5,
    }
    values = {"joint": joint, "contact": contact, "solve": {
        "duration_rev": 1, "settle_rev": 0, "error_bars": False}}  # fmt: skip
    values |= {"clearance_mm": clearance} if joint != "none" else {}
    run = simulate(Case.from_values(values))
    assert run.attrs["complete"], run["reason"].item()
    return run["displacement"].values


@pytest.mark.parametrize("joint", JOINTS)
def test_the_deviation_from_the_ideal_motion_is_in_proportion_to_the_clearance(joint):
    ideal = displacement("none", PAPER)
    away = [np.abs(displacement(joint, one) - ideal).max() for one in CLEARANCES]
    slopes = np.diff(np.log10(away)) / np.diff(np.log10(CLEARANCES))
    assert slopes == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize("clearance", [1e-6, 1.0])
def test_a_nanometre_and_a_millimetre_pass_the_audit(joint, clearance):
    """The paper's contact; in mm."""
    solve = {"duration_rev": 2, "error_bars": False}
    case = Case.from_values({"joint": joint, "clearance_mm": clearance, "solve": solve})
    found = measure(case)
    assert (found.status, found.reason) == ("ok", "")
    assert 0 < found.numbers["energy_residual"] < AUDIT * case.rtol * 2
