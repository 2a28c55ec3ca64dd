"""The range that the program was judged on: one source for the table, the draw and the warning."""

import pytest

from compressor.cases.case import Case
from compressor.cases.checks import row_of
from compressor.cases.conflicts import judged_range, outside_judged
from compressor.cases.parameter import parameter_table
from compressor.cases.table import parts_by_key, table
from compressor.studies.stress.extremes import OF_LAWS, PAPER_DAMPING, RANGES, SPANS

LOOSE = {"joint": "both", "clearance_mm": 0.2}


def outside(**values):
    return outside_judged(Case.from_values({**LOOSE, **values}).values())


@pytest.mark.parametrize("joint", ["none", "big_end", "both"])
def test_the_defaults_are_inside(joint):
    groups = dict.fromkeys(("guide", "drive", "rod"), True)
    clearance = {} if joint == "none" else {"clearance_mm": 0.2, "lubricant": True}
    values = {"joint": joint, **groups, **clearance, "guide": {"clearance_mm": 0.1}}
    assert outside_judged(Case.from_values(values).values()) == {}


def test_the_sentence_names_value_and_bounds():
    found = outside(machine={"rod_mass_kg": 262, "reciprocating_mass_kg": 285, "speed_rpm": 740})
    end = "is outside the range that the program was judged on, 0.1 to 200 kg"
    assert found == {
        "machine.rod_mass_kg": f"262 kg {end}",
        "machine.reciprocating_mass_kg": f"285 kg {end}",
    }


def test_the_ends_are_inside():
    for key in ("machine.rod_mass_kg", "machine.speed_rpm", "contact.stiffness_N_per_mm15"):
        group, _, name = key.partition(".")
        for end in judged_range(key):
            assert key not in outside(**{group: {name: end}})
            beyond = end * (0.9 if end == judged_range(key)[0] else 1.1)
            assert key in outside(**{group: {name: beyond}})


def test_what_is_not_read_is_not_outside():
    ideal = {"contact": {"damping_N_s_per_mm": 1e5}, "friction": {"static": 0.9}}
    assert outside_judged(Case.resolve(ideal).values()) == {}
    assert {*outside(**ideal)} == {"contact.damping_N_s_per_mm", "friction.static"}
    other = {"contact": {"exponent": 1.1, "stiffness_N_per_mm15": 100.0}}  # in another unit
    assert outside(**other) == {}


def test_scenes_are_drawn_from_the_judged_ranges():
    drawn = {f"{group}.{name}" for group, keys in RANGES.items() for name in keys}
    drawn |= {key for key, (_, narrow) in OF_LAWS.items() if row_of(key).judged == narrow}
    for key, (_, narrow) in [(k, v) for k, v in OF_LAWS.items() if k in drawn]:
        assert narrow == judged_range(key)
    for key in (key for key in drawn if key not in OF_LAWS):
        group, _, name = key.partition(".")
        assert RANGES[group][name][1] == judged_range(key)
    drawn |= {
        "clearance_mm", "contact.stiffness_N_per_mm15",
        "contact.exponent", "contact.damping_N_s_per_mm", "friction.static", "friction.dynamic",
        "friction.stiction_velocity_mm_per_s", "machine.rod_mass_kg", "machine.speed_rpm",
        "machine.reciprocating_mass_kg", "machine.pin_radius_mm",
    }  # fmt: skip
    judged = {key for key, row in table().items() if row.judged}
    wholes = {key.rpartition(".")[0] for key in judged} & parts_by_key().keys()
    assert {key for key in judged if key.rpartition(".")[0] not in wholes} | wholes == drawn
    assert SPANS["rod_mass"][2] == judged_range("machine.rod_mass_kg")
    most = PAPER_DAMPING * SPANS["damping"][1][1]  # none of it is drawn, too
    assert judged_range("contact.damping_N_s_per_mm") == (0.0, most)
    assert judged_range("friction.dynamic") == judged_range("friction.static")


def test_the_table_shows_the_judged_range():
    row = next(r for r in parameter_table(table().values()).splitlines() if "rod_mass_kg" in r)
    assert "| 0.1 to 200 |" in row
