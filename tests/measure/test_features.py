"""The modelling trade: which features a case pays for, and what leaving them out changes."""

from dataclasses import replace

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.cases.groups import Friction
from compressor.measure.features import (
    FEATURES,
    GRID,
    SERIES,
    compare,
    output_grid,
    series_kinematics,
    trade,
    variants,
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
        ({"load": "typical", "friction": False}, ["load"]),
        ({"load": "typical", "gas": {"back_pressure_MPa": 0.1}, "friction": False},
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
        load="typical" if feature.key.startswith("gas") else "design",
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


def test_a_run_that_fails_is_named():
    few = case(solve={**SHORT, "max_steps": 20})
    effect = compare(case(), few, 1)
    assert effect.reason == "budget_steps"
    assert np.isnan(effect.change_peak_acceleration)
    assert output_grid(few).reason == "budget_steps"


def test_the_series_is_off_by_more_than_the_smallest_clearance():
    effect, share = series_kinematics(case(clearance_mm=0.1))
    assert share == pytest.approx(1.2246, abs=1e-3)  # 0.122 mm over 0.1 mm
    assert 1e-3 < effect.change_acceleration < 1e-2
    assert np.isnan(effect.time_ratio)


def test_the_output_grid_hides_peaks():
    effect = output_grid(case())
    assert effect.change_peak_acceleration < -1e-4
    assert effect.change_peak_contact_force < -1e-4


def test_variants_of_one_faulty_joint_and_of_two():
    one, two = variants(case()), variants(case(joint="both"))
    assert [*one][:4] == ["no friction", "no spring damping", "gravity 9.81 m/s²",
                          "1 µm in the ideal joint"]  # fmt: skip
    assert [*one][-1] == "typical load"
    laws = {"contact law flores", "friction law lugre"}
    assert laws | {"elastic rod", "friction of ideal joints"} < {*one}
    assert "friction of ideal joints" not in two  # both are worn
    assert one["1 µm in the ideal joint"].clearance_mm.small_end == 0.001
    assert {"ideal big end", "ideal small end"} < {*two}
    assert two["ideal big end"].joint == "small_end"


def test_a_trade_has_a_row_for_each_change(monkeypatch):
    few = {
        "friction", "contact law flores", "friction of ideal joints",
        "clearance of the big end", "clearance of the small end",
    }  # fmt: skip
    kept = tuple(feature for feature in FEATURES if feature.name in few)
    monkeypatch.setattr("compressor.measure.features.FEATURES", kept)
    found = trade({"one": case(), "two": case(joint="both")}, repeats=1)
    assert {GRID, SERIES, "typical load", "ideal big end", "contact law flores"} < {
        *found["change"].values
    }
    row = found.sel(scene="one", change="ideal big end")
    assert np.isnan(row["change_peak_acceleration"])  # does not apply
    for scene in ("one", "two"):
        row = found.sel(scene=scene, change="no friction")
        assert abs(row["change_peak_contact_force"]) > 1e-3
        assert row["time_ratio"] > 0
        assert row["reason"].item() == ""
    assert found["place_error"].values == pytest.approx(0.6123, abs=1e-3)
