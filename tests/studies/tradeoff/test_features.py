"""The features of the model: which a case pays for, and what leaving them out changes."""

from dataclasses import replace

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.cases.groups import Friction
from compressor.cases.optional_groups import Rod
from compressor.cases.parameter import PerJoint
from compressor.solve.simulate import simulate
from compressor.studies.tradeoff.features import (
    CONTACT_LAWS,
    FEATURES,
    comparable,
    compare,
    read_from_grid,
    series_errors,
    with_contact,
    with_elastic_rod,
)

SHORT = {"duration_rev": 0.25, "settle_rev": 0}
BY_NAME = {feature.name: feature for feature in FEATURES}


def case(**values):
    base = {"joint": "big_end", "clearance_mm": 0.2, "solve": SHORT}
    return Case.from_values({**base, **values})


@pytest.mark.parametrize(
    ("values", "paid"),
    [
        ({}, ["friction", "spring damping", "load"]),
        ({"friction": False, "load": "none"}, []),
        ({"friction": {"static": 0, "dynamic": 0}, "load": "none"}, []),
        ({"load": "gas", "friction": False}, ["load"]),
        ({"load": "gas", "gas": {"back_pressure_MPa": 0.1}, "friction": False},
         ["back pressure", "load"]),
        ({"machine": {"gravity_m_per_s2": 9.81}, "load": "none"}, ["friction", "gravity"]),
        ({"joint": "both", "load": "none", "friction": False},
         ["clearance of the big end", "clearance of the small end"]),
    ],
)  # fmt: skip
def test_what_a_case_pays_for(values, paid):
    assert [feature.name for feature in FEATURES if feature.paid(case(**values))] == paid


@pytest.mark.parametrize("feature", FEATURES, ids=lambda feature: feature.name)
def test_a_feature_that_is_removed_is_no_longer_paid_for(feature):
    rich = case(
        joint="big_end" if feature.key == "friction.ideal_joints" else "both",
        machine={"gravity_m_per_s2": 9.81},
        load="gas" if feature.key.startswith("gas") else "spring",
        gas={"back_pressure_MPa": 0.1} if feature.key.startswith("gas") else {},
    )  # fmt: skip
    rich = rich if feature.paid(rich) else feature.add(rich)
    assert feature.paid(rich)
    assert Case.from_values(rich.values()) == rich
    poor = feature.remove(rich)
    assert not feature.paid(poor)
    assert Case.from_values(poor.values()) == poor  # still a valid case
    added = feature.add(poor)
    assert added is None or feature.paid(added)


def test_a_joint_made_ideal_starts_concentric():
    both = case(joint="both", initial_offset_mm={"big_end_x": 0.1, "small_end_y": 0.1})
    poor = BY_NAME["clearance of the big end"].remove(both)
    assert poor.joint == "small_end"
    assert (poor.initial_offset_mm.big_end_x, poor.initial_offset_mm.small_end_y) == (0, 0.1)


def test_the_same_model_changes_nothing():
    effect = compare(case(), case(), 1)
    assert effect.change_peak_acceleration == 0
    assert effect.change_peak_contact_force == 0
    assert effect.change_acceleration == 0
    assert effect.time_ratio > 0


def test_the_time_of_a_machine_on_a_body_is_measured():
    """A body asks for time series, and what is timed keeps none."""
    moving = case(body={"start": "rest"}, sensor={"place": "guide"})
    assert 0 < compare(moving, replace(moving, friction=None), 1).time_ratio < 100


def test_a_weightless_change_is_small_and_friction_is_not():
    light = case(machine={"gravity_m_per_s2": 1e-9})
    assert compare(case(), light, 1).change_acceleration < 1e-6
    assert compare(case(), replace(case(), friction=None), 1).change_acceleration > 0.01
    more = replace(case(), friction=Friction(static=0.5, dynamic=0.5))
    assert compare(case(), more, 1).change_acceleration > 0.01


def test_a_machine_that_would_settle_later_is_compared_over_the_same_revolutions():
    """Without damping, and with `auto`, this one settles after 10 revolutions and not after 4."""
    span = {"duration_rev": "auto", "settle_rev": "auto", "accuracy": "draft"}
    base = case(joint="small_end", clearance_mm=0.1, machine={"speed_rpm": 1000}, solve=span)
    bouncing = replace(base, contact=replace(base.contact, damping_N_s_per_mm=0.0))
    known = simulate(comparable(base))
    assert simulate(comparable(bouncing))["time"].size > known["time"].size
    effect = compare(base, bouncing, 1, known)
    assert 0.01 < effect.change_acceleration < 10


def test_a_run_that_fails_is_named():
    few = case(solve={**SHORT, "max_steps": 20})
    effect = compare(case(), few, 1)
    assert effect.reason == "budget_steps"
    assert np.isnan(effect.change_peak_acceleration)


def test_the_series_is_off_by_more_than_the_smallest_clearance():
    place, acceleration = series_errors(case(clearance_mm=0.1))
    assert place == pytest.approx(1.2246, abs=1e-3)  # 0.122 mm over 0.1 mm
    assert 1e-3 < acceleration < 1e-2


def test_the_output_grid_hides_peaks():
    run = simulate(case())
    read = read_from_grid(run, run)
    for name in ("peak_acceleration", "peak_contact_force"):
        assert (read[name] < (1 - 1e-4) * run[name]).all()
        assert (read[f"{name}_error"] == 0).all()
    assert read["max_penetration"].isnull().all()


@pytest.mark.parametrize("law", CONTACT_LAWS)
@pytest.mark.parametrize("other", CONTACT_LAWS)
def test_each_contact_law_may_stand_in_place_of_each_other(law, other):
    """With what the case has; what it has not is a default."""
    plain = case(contact={"stiffness_N_per_mm15": 5e5, "damping_N_s_per_mm": 100})
    one = with_contact(plain, law) or plain
    two = with_contact(one, other)
    assert (two is None) == (law == other)
    two = two or one
    assert Case.from_values(two.values()) == two
    assert two.contact.law == other
    if {law, other} <= {"impact", "hertz", "flores", "lankarani_nikravesh"}:
        assert two.contact.stiffness_N_per_mm15 == 5e5


def test_a_law_takes_over_restitution_materials_and_length():
    given = {"law": "flores", "restitution": 0.7, "materials": ["steel", "copper"]}
    contact = with_contact(case(contact=given), "liu").contact
    assert (contact.restitution, contact.materials) == (0.7, PerJoint(*[("steel", "copper")] * 2))
    assert contact.length_mm == PerJoint(20.0, 20.0)  # as long as wide
    oiled = case(contact=given, lubricant={"bearing_length_mm": 15})
    assert with_contact(oiled, "liu").contact.length_mm == PerJoint(15.0, 15.0)


def test_a_modulus_alone_gives_other_laws_the_default_stiffness():
    given = {"law": "johnson", "modulus_GPa": 100, "length_mm": 30}
    assert with_contact(case(contact=given), "liu").contact.modulus_GPa == 100
    assert with_contact(case(contact=given), "hertz").contact.stiffness_N_per_mm15 == 3.36e5


def test_an_elastic_rod_has_the_section_that_its_mass_needs():
    assert with_elastic_rod(case()).rod == Rod()
    heavy = with_elastic_rod(case(machine={"rod_mass_kg": 4 * 4.7, "rod_length_mm": 600})).rod
    assert (heavy.depth_mm, heavy.width_mm) == (80.0, 50.0)
