"""Runs with an oil film in the joints: energy, three integrators, and what the film does."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.solve import simulate

pytestmark = pytest.mark.compiled
JOINTS = ("big_end", "small_end", "both")


def run(joint, lubricant=True, clearance=0.05, **solve):
    values = {"joint": joint, "clearance_mm": clearance, "solve": solve}
    found = simulate(Case.from_values(values | ({"lubricant": lubricant} if lubricant else {})))
    assert found.status == "ok", found.attrs.get("detail")
    return found


@pytest.mark.parametrize("joint", JOINTS)
def test_the_film_s_loss_closes_the_energy(joint):
    found = run(joint, duration_rev=2)
    assert float(found.energy_residual) < 1e-4
    assert float(found.contact_damping_loss) > 0.0
    assert found.attrs["promise"] == "kept"


def test_a_thick_film_keeps_the_bodies_apart():
    """A hundredfold viscosity bears the load: the dry contact never touches."""
    thick = {"viscosity_mPa_s": 3000}
    found = run("big_end", thick, duration_rev=3, settle_rev=1)
    assert float(found.contact_loss_fraction.sel(joint="big_end")) == 1.0
    assert float(found.max_penetration.sel(joint="big_end")) < 0.0
    thin = run("big_end", {"viscosity_mPa_s": 1}, duration_rev=3, settle_rev=1)
    assert float(thin.contact_loss_fraction.sel(joint="big_end")) < 0.5


def test_without_viscosity_the_joint_is_dry():
    """The limit of no film, as the viscosity goes to zero."""
    short = {"duration_rev": 0.5, "settle_rev": 0, "rtol": 1e-8, "error_bars": False}
    dry = run("small_end", None, **short).acceleration.values
    far = []
    for viscosity in (1e-3, 1e-4):
        film = {"viscosity_mPa_s": viscosity}
        found = run("small_end", film, **short).acceleration.values
        far.append(np.linalg.norm(found - dry) / np.linalg.norm(dry))
    assert far[0] / far[1] == pytest.approx(10.0, rel=0.3)
    assert far[1] < 5e-3
