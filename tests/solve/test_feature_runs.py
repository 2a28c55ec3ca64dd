"""Runs with features, oil and other laws: integrators agree, energy closes, limits are kept."""

import math

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.solve import measure, simulate

BIG_END, SMALL_END, BOTH = (
    {"joint": joint, "clearance_mm": 0.2} for joint in ("big_end", "small_end", "both")
)
PIN = {"length_mm": 20, "materials": ["steel", "copper"]}
GUIDE, RUBBING = {"guide": {"clearance_mm": 0.1}}, {"friction": {"ideal_joints": True}}
COMBINATIONS = {
    "play": {**GUIDE, **RUBBING},
    "speed": {**BIG_END, "drive": True, "load": "gas", **RUBBING},
    "oil": {"joint": "both", "clearance_mm": 0.05, "lubricant": True},
    "elastic": {**SMALL_END, "rod": {"damping_ratio": 0.05}},
    "all": {
        **BOTH, "drive": {"flywheel_kg_m2": 1}, **GUIDE,
        "rod": {"damping_ratio": 0.05}, "machine": {"gravity_m_per_s2": 9.81},
    },
    "johnson": {**BOTH, "contact": {"law": "johnson", **PIN}},
    "liu": {**BOTH, "contact": {"law": "liu", **PIN}},
    "lugre": {**BOTH, "friction": {"law": "lugre"}},
    "ambrosio": {**BIG_END, "friction": {"law": "ambrosio"}},
    "lankarani": {**BOTH, "contact": {"law": "lankarani_nikravesh", "restitution": 0.6}},
    "flores": {**SMALL_END, "contact": {"law": "flores", "restitution": 0.6}},
}  # fmt: skip
SHORT = "oil", "lugre"  # SciPy's steps in Python are many
UNDAMPED = "johnson", "liu"  # but for friction


def run(values, **solve):
    how = {"duration_rev": 0.5, "settle_rev": 0, "error_bars": False, **solve}
    found = simulate(Case.from_values({**values, "solve": how}))
    assert found.status == "ok", found.attrs.get("detail")
    return found


def apart(one, other, name="acceleration"):
    a, b = one[name].values, other[name].values
    return float(np.linalg.norm(a - b) / np.linalg.norm(a))


@pytest.mark.parametrize("name", COMBINATIONS)
def test_three_integrators_agree(name):
    """Explicit steps, stiff ones and SciPy's DOP853 share the equations alone."""
    how, bound = {"duration_rev": 0.06 if name in SHORT else 0.25, "rtol": 1e-8}, 2e-4
    if name in UNDAMPED:
        how, bound = {"duration_rev": 0.06, "rtol": 1e-10}, 1e-3
    runs = [run(COMBINATIONS[name], method=one, **how) for one in ("TSIT5", "RODAS", "DOP853")]
    for one in runs:
        assert float(one.energy_residual) < 1e-5
    for other in runs[1:]:
        assert apart(runs[0], other) < bound
        assert apart(runs[0], other, "contact_force") < bound
        assert (other.impact_count == runs[0].impact_count).all()


def test_an_accuracy_is_kept():
    """What `standard` promises, against a tighter run."""
    case = Case.from_values({**COMBINATIONS["all"], "solve": {"duration_rev": 2}})
    found = simulate(case)
    assert found.attrs["promise"] == "kept"
    exact = run(COMBINATIONS["all"], duration_rev=2, settle_rev=1, rtol=1e-9)
    settled = found.crank_angle > 2 * math.pi
    a, b = (one.acceleration.values[settled] for one in (found, exact))
    assert np.linalg.norm(a - b) / np.linalg.norm(b) < 5e-3


def test_a_heavy_flywheel_turns_steadily():
    """Towards the steady crank as 1 / J."""
    steady = run(BIG_END, rtol=1e-8)
    far = []
    for inertia in (1e3, 1e4):
        driven = run({**BIG_END, "drive": {"flywheel_kg_m2": inertia}}, rtol=1e-8)
        far.append(apart(steady, driven))
        assert np.ptp(driven.crank_speed.values) > 0.0
    assert far[0] / far[1] == pytest.approx(10.0, rel=0.2)
    assert far[1] < 1e-3


def test_a_hard_rod_is_rigid():
    """The difference falls as 1 / E: the modes follow what moves them."""
    rigid = run({"load": "none"}, rtol=1e-9)
    far = []
    for modulus in (2e3, 2e4):
        hard = {"youngs_modulus_GPa": modulus, "damping_ratio": 0.2}
        elastic = run({"load": "none", "rod": hard}, rtol=1e-9)
        far.append(apart(rigid, elastic))
    assert far[0] / far[1] == pytest.approx(10.0, rel=0.3)


def test_a_narrow_guide_bears_what_an_ideal_one_does():
    """With play of a micrometre the crosshead rings on its guide; over 18 degrees it does not."""
    signals = {"output": {"signals": True}}
    ideal = run(signals, rtol=1e-7, duration_rev=1)
    narrow = {"clearance_mm": 0.001, "friction": 0}
    narrow = run({**signals, "guide": narrow}, rtol=1e-7, duration_rev=1)
    a, b = (one.guide_force.values[1:].reshape(20, 60).mean(axis=1) for one in (ideal, narrow))
    assert np.linalg.norm(a - b) / np.linalg.norm(a) < 0.02
    assert float(abs(narrow.guide_height).max()) < 30e-6


def test_friction_of_ideal_joints_takes_its_work_from_the_crank():
    """Everything else equal: both ends ideal, no load, a turn of steady speed."""
    values = {"load": "none", "solve": {"duration_rev": 1, "settle_rev": 0}}
    without, rubbing = (measure(Case.from_values(values | more)) for more in ({}, RUBBING))
    lost = rubbing.numbers["friction_loss"]
    assert without.numbers["friction_loss"] == 0.0
    assert lost > 1.0
    assert rubbing.numbers["crank_work"] - without.numbers["crank_work"] == pytest.approx(lost)


def test_the_time_of_a_speed_that_gives_way_is_its_own():
    """A crank that is braked needs longer; its speed is the rate of its angle."""
    values = {"load": "none", "friction": {"ideal_joints": True}}
    free = {**values, "drive": {"flywheel_kg_m2": 1, "slope_N_m_s": 0}}
    found = run(free, rtol=1e-9, duration_rev=2)
    t, theta = found.time.values, found.crank_angle.values
    assert t[-1] > Case.from_values(free).turn * 2
    rate = np.gradient(theta, t, edge_order=2)
    assert rate == pytest.approx(found.crank_speed.values, rel=1e-4)


# ---- an oil film


def oiled(joint, viscosity=None, **solve):
    values = {"joint": joint, "clearance_mm": 0.05}
    film = {"viscosity_mPa_s": viscosity} if viscosity else True
    return run(values | {"lubricant": film}, **solve)


@pytest.mark.parametrize("joint", ["big_end", "small_end", "both"])
def test_the_film_s_loss_closes_the_energy(joint):
    found = oiled(joint, duration_rev=2, settle_rev=1, error_bars=True)
    assert float(found.energy_residual) < 1e-4
    assert float(found.contact_damping_loss) > 0.0
    assert found.attrs["promise"] == "kept"


def test_a_thick_film_keeps_the_bodies_apart():
    """A hundredfold viscosity bears the load: the dry contact never touches."""
    thick, thin = (
        oiled("big_end", viscosity, duration_rev=3, settle_rev=1).sel(joint="big_end")
        for viscosity in (3000, 1)
    )
    assert float(thick.contact_loss_fraction) == 1.0
    assert float(thick.max_penetration) < 0.0
    assert float(thin.contact_loss_fraction) < 0.5


def test_without_viscosity_the_joint_is_dry():
    """The limit of no film, as the viscosity goes to zero."""
    dry = run({"joint": "small_end", "clearance_mm": 0.05}, rtol=1e-8)
    far = [apart(dry, oiled("small_end", viscosity, rtol=1e-8)) for viscosity in (1e-3, 1e-4)]
    assert far[0] / far[1] == pytest.approx(10.0, rel=0.3)
    assert far[1] < 5e-3
