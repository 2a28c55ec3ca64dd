"""Each key of the table: where it is read it changes what is stored, elsewhere it is refused."""

import copy
import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from compressor.cases.case import Case
from compressor.cases.checks import value_of
from compressor.cases.load import CaseFileError, load_cases
from compressor.cases.parameter import CaseError
from compressor.cases.table import parts_by_key, table
from compressor.solve.simulate import observe
from compressor.store.batch import encode_batch
from compressor.studies.wear import Worn, life

SHORT = {"duration_rev": 1, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 5,
         "error_bars": False, "horizon": False}  # fmt: skip
IDEAL = {"solve": SHORT, "output": {"signals": True}}
WORN = IDEAL | {"joint": "both", "clearance_mm": {"big_end": 0.2, "small_end": 0.2}}
BIG = WORN | {"joint": "big_end", "clearance_mm": {"big_end": 0.2}}
SMALL = WORN | {"joint": "small_end", "clearance_mm": {"small_end": 0.2}}
FREE = WORN | {"load": "none"}
GAS = WORN | {"load": "gas", "gas": {"switching": "exact", "back_pressure_MPa": 0.1}}
DOUBLE = WORN | {"load": "gas", "gas": {"action": "double", "rod_diameter_mm": 30}}
PERCENT = WORN | {"load": "gas", "gas": DOUBLE["gas"] | {"clearance_percent": 14}}
CRANK_END = WORN | {"load": "gas", "gas": {"action": "crank_end", "rod_diameter_mm": 30,
                                           "clearance_percent": {"crank": 12}}}  # fmt: skip
SINGLE = WORN | {"load": "gas", "gas": {"action": "single"}}
CRANK_ALONE = WORN | {"load": "gas", "gas": {"action": "crank_end", "rod_diameter_mm": 30}}
CARD, GAUGE = (str(Path(__file__).parent / name) for name in ("card.csv", "gauge_card.csv"))
MEASURED = WORN | {"load": "gas", "gas": {"indicator": GAUGE}}
HERTZ = WORN | {"contact": {"law": "hertz"}}
DAMPED = WORN | {"contact": {"law": "hunt_crossley", "restitution": 0.5}}
PIN = {"law": "johnson", "length_mm": 20, "modulus_GPa": 100}
JOHNSON = WORN | {"contact": PIN}
COPPER = WORN | {"contact": {"materials": ["steel", "copper"]}}
BIG_COPPER = BIG | {"contact": {"materials": ["steel", "copper"]}}
BIG_JOHNSON = BIG | {"contact": PIN}
TANH = WORN | {"friction": {"law": "coulomb_tanh"}}
LUGRE = WORN | {"friction": {"law": "lugre"}}
OIL = WORN | {"lubricant": True}
BIG_OIL = BIG | {"lubricant": True}
SLIDING = IDEAL | {"guide": True}
PLAYING = IDEAL | {"guide": {"clearance_mm": 0.1}}
SMOOTH = IDEAL | {"guide": {"clearance_mm": 0.1, "friction": 0}}
DRIVEN = IDEAL | {"drive": {"torque_N_m": 10}, "machine": {"gravity_m_per_s2": 9.81}}
ELASTIC = IDEAL | {"rod": True}
WEARING = BIG | {"wear": {"limit_mm": 0.205}}
FAST = {"machine": {"speed_rpm": 2000}}  # so that samples are few
HEARD = IDEAL | FAST | {"body": {"freedoms": "xy_rocking"}, "sensor": True}
COUNTED = HEARD | {"sensor": {"threshold_m_per_s2": 1}}
FLAT = HEARD | {"body": {"freedoms": "xy"}}
STARTED = HEARD | {"body": {"start": "rest"}}
CENTRAL = HEARD | {"sensor": {"place": "body"}}
BARE = HEARD | {"body": {"casing": False}}
QUIET = HEARD | {"sensor": {"noise_m_per_s2": 0}}
SIDEWAYS = HEARD | {"sensor": {"place": "guide", "direction": "x"}}
OWN_CORNER = IDEAL | {"guide": {"clearance_mm": 0.1, "damping_N_s_per_mm": 9, "exponent": 1.4,
                                "full_damping_mm": 0.01}}  # fmt: skip
LONG_SERIES = IDEAL | {"solve": SHORT | {"output_step_deg": 0.2}}  # short ones are not compressed
SMALL_FILES = IDEAL | {"output": {"keep": "metrics"}}


class Entry(NamedTuple):
    """A key's value, a machine that reads it, and some that do not."""

    value: object
    where: dict
    unread: tuple[dict, ...] = ()


def entries(where: dict, *unread: dict, **values) -> dict[str, Entry]:
    """Return an entry for each key of a group, which the same machines read."""
    return {name.replace("__", "."): Entry(value, where, unread) for name, value in values.items()}


ENTRIES = {
    "name": Entry("other", IDEAL),
    "load": Entry("none", IDEAL),
    "joint": Entry("both", BIG | {"clearance_mm": 0.2}),
    "clearance_mm.big_end": Entry(0.25, WORN, (SMALL, IDEAL)),
    "clearance_mm.small_end": Entry(0.25, WORN, (BIG, IDEAL)),
    "healthy_clearance_mm.big_end": Entry(0.25, WORN),
    "healthy_clearance_mm.small_end": Entry(0.25, WORN),
    **entries(BIG, SMALL, IDEAL, initial_offset_mm__big_end_x=0.1,
              initial_offset_mm__big_end_y=0.1),
    **entries(SMALL, BIG, IDEAL, initial_offset_mm__small_end_x=0.1,
              initial_offset_mm__small_end_y=0.1),
    **entries(
        WORN, machine__crank_radius_mm=100, machine__rod_length_mm=550, machine__speed_rpm=550,
        machine__rod_mass_kg=5, machine__rod_centre_mm=280, machine__rod_inertia_kg_m2=0.2,
        machine__reciprocating_mass_kg=15, machine__gravity_m_per_s2=9.81,
        machine__counterweight_kg_mm=500,
    ),
    "machine.balance.rotating": Entry(0.5, WORN),
    "machine.balance.reciprocating": Entry(0.25, IDEAL | {"machine": {"balance": 0.5}}),
    "machine.pin_radius_mm.big_end": Entry(12, WORN, (IDEAL, SMALL)),
    "machine.pin_radius_mm.small_end": Entry(12, WORN, (IDEAL, BIG)),
    **entries(
        GAS, WORN, FREE, gas__piston_radius_mm=60, gas__back_pressure_MPa=0.2,
        gas__valve_loss_percent__suction=5, gas__valve_loss_percent__discharge=5,
        gas__unloaded="head",
    ),
    **entries(
        GAS, WORN, FREE, MEASURED, gas__suction_MPa=0.11, gas__discharge_MPa=0.5, gas__exponent=1.3
    ),
    "gas.head_clearance_mm": Entry(25, GAS, (WORN, FREE, CRANK_END)),
    "gas.action": Entry("crank_end", DOUBLE, (WORN, FREE)),
    "gas.clearance_percent.head": Entry(10, PERCENT, (WORN, CRANK_END)),
    "gas.indicator.head": Entry(CARD, SINGLE, (WORN, FREE)),
    "gas.indicator.crank": Entry(CARD, CRANK_ALONE, (WORN, GAS)),
    **entries(
        DOUBLE, GAS, SINGLE, WORN, gas__rod_diameter_mm=40, gas__clearance_percent__crank=12
    ),
    **entries(MEASURED, GAS, WORN, gas__ambient_MPa=0.09, gas__smooth_deg=30),
    "gas.switching": Entry("exact", WORN | {"load": "gas"}, (WORN, FREE)),
    **entries(
        WORN, GAS, FREE, spring__stiffness_N_per_mm=30, spring__damping_N_s_per_mm=0.1,
        spring__preload_N=700, spring__stroke_mm=110,
    ),
    "contact.law": Entry("hertz", WORN, (IDEAL, PLAYING)),
    "contact.stiffness_N_per_mm15": Entry(4e5, WORN, (IDEAL, JOHNSON)),
    "contact.materials.big_end": Entry(["steel", "copper"], WORN, (IDEAL,)),
    "contact.materials.small_end": Entry(["steel", "steel"], COPPER, (BIG_COPPER, IDEAL)),
    "contact.length_mm.small_end": Entry(15, JOHNSON, (WORN, BIG_JOHNSON)),
    "lubricant.bearing_length_mm.small_end": Entry(15, OIL, (BIG_OIL, IDEAL)),
    "contact.geometry": Entry("internal", COPPER, (WORN, JOHNSON)),
    "contact.exponent": Entry(1.4, WORN, (IDEAL, JOHNSON, OWN_CORNER)),
    **entries(
        WORN, IDEAL, HERTZ, OWN_CORNER, contact__damping_N_s_per_mm=300,
        contact__full_damping_mm=0.01,
    ),
    "contact.restitution": Entry(0.8, DAMPED, (WORN, HERTZ)),
    "contact.least_approach_mm_per_s": Entry(500, DAMPED, (WORN, HERTZ, JOHNSON)),
    "contact.length_mm.big_end": Entry(30, JOHNSON, (WORN, IDEAL)),
    "contact.modulus_GPa": Entry(90, JOHNSON, (WORN, IDEAL)),
    "friction.static": Entry(0.3, WORN, (IDEAL, TANH)),
    "friction.dynamic": Entry(0.1, WORN, (IDEAL,)),
    "friction.stiction_velocity_mm_per_s": Entry(20, WORN, (IDEAL,)),
    "friction.friction_velocity_mm_per_s": Entry(200, WORN, (IDEAL, TANH, LUGRE)),
    "friction.law": Entry("threlfall", WORN, (IDEAL,)),
    **entries(
        LUGRE, WORN, friction__bristle_stiffness_per_mm=50, friction__bristle_damping_s_per_mm=0.1,
        friction__viscous_s_per_mm=1e-3,
    ),
    "friction.ideal_joints": Entry(True, BIG, (WORN,)),
    **entries(
        OIL, IDEAL, lubricant__viscosity_mPa_s=50, lubricant__bearing_length_mm__big_end=15,
        lubricant__last_share=0.1,
    ),
    "guide.clearance_mm": Entry(0.1, SLIDING),
    "guide.friction": Entry(0.1, SLIDING),
    "guide.stiction_velocity_mm_per_s": Entry(50, SLIDING, (SMOOTH,)),
    **entries(
        PLAYING, SLIDING, guide__crosshead_length_mm=100, guide__crosshead_height_mm=70,
        guide__crosshead_inertia_kg_m2=0.05, guide__stiffness_N_per_mm15=2e5,
        guide__exponent=1.4, guide__damping_N_s_per_mm=9, guide__full_damping_mm=0.01,
    ),
    **entries(
        DRIVEN, drive__flywheel_kg_m2=2, drive__torque_N_m=50, drive__slope_N_m_s=50,
        drive__unbalance_kg_mm=800,
    ),
    **entries(
        ELASTIC, rod__youngs_modulus_GPa=150, rod__depth_mm=50, rod__width_mm=30,
        rod__damping_ratio=0.05,
    ),
    **entries(
        WEARING, IDEAL, wear__coefficient_mm3_per_N_m=1e-7, wear__coefficient_factor=3,
        wear__limit_mm=0.206, wear__hours=1, wear__step_mm=0.03, wear__bore_length_mm=15,
    ),
    **entries(
        HEARD, body__freedoms="xy", body__mass_kg=600, body__damping_ratio=0.1, body__start="rest",
        body__frequency_x_Hz=30, body__frequency_y_Hz=30, body__band_low_Hz=50,
        body__band_high_Hz=60,
    ),
    **entries(
        HEARD, FLAT, body__inertia_kg_m2=50, body__centre_x_mm=200, body__centre_y_mm=-100,
        body__frequency_rocking_Hz=30,
    ),
    "body.frequency_x_Hz": Entry(30, HEARD, (IDEAL | {"body": {"freedoms": "y"}},)),
    "body.frequency_y_Hz": Entry(30, HEARD, (IDEAL | {"body": {"freedoms": "x"}},)),
    "body.casing": Entry(False, HEARD, (CENTRAL, SIDEWAYS, IDEAL | {"body": True})),
    **entries(
        HEARD, CENTRAL, BARE, SIDEWAYS, body__casing_mass_kg=30, body__casing_frequency_Hz=1500,
        body__casing_damping_ratio=0.05,
    ),
    **entries(
        HEARD, IDEAL, sensor__place="bearing", sensor__direction="x", sensor__rate_Hz=20000,
        sensor__low_pass_Hz=5000, sensor__mounting_Hz=20000, sensor__mounting_damping_ratio=0.1,
        sensor__range_m_per_s2=1, sensor__noise_m_per_s2=0.1, sensor__threshold_m_per_s2=1,
    ),
    "sensor.second_threshold_m_per_s2": Entry(2, COUNTED, (HEARD, IDEAL)),
    "sensor.seed": Entry(2, HEARD, (QUIET, IDEAL)),
    **entries(HEARD, STARTED, IDEAL, sensor__speed_jitter=0.01, sensor__length_rev=3),
    **entries(
        WORN, solve__duration_rev=2, solve__duration_s=0.24, solve__settle_rev=0.5,
        solve__output_step_deg=10, solve__output_step_s=0.001, solve__accuracy="fine",
        solve__rtol=1e-7, solve__error_bars=True, solve__horizon=True, solve__method="RODAS",
        solve__max_steps=5, solve__timeout_s=1e-9,
    ),
    "output.keep": Entry("metrics", IDEAL | {"output": {}}),
    **entries(LONG_SERIES, SMALL_FILES, output__precision="single"),
    "output.signals": Entry(True, SMALL_FILES),
}  # fmt: skip
RIVALS = {"solve.duration_s": "duration_rev", "solve.output_step_s": "output_step_deg",
          "solve.rtol": "accuracy"}  # fmt: skip
SOLVER = {"solve.accuracy", "solve.rtol", "solve.method", "solve.max_steps"}  # not what a job is
# refused where they cannot do what they say, though they would change numbers or last bits
CONTRADICTING = {
    "contact.least_approach_mm_per_s", "friction.ideal_joints",
    "body.frequency_x_Hz", "body.frequency_y_Hz", "sensor.speed_jitter",
    "sensor.second_threshold_m_per_s2",
}  # fmt: skip
UNREAD = [(key, where) for key, entry in ENTRIES.items() for where in entry.unread]
# of the gas those of a cylinder that is there
OF_ACTION = ("gas.rod_diameter_mm", "gas.clearance_percent.crank")  # which a file has named
UNREAD_FACTS = [
    (key, where) for key, where in UNREAD
    if table()[key].fact
    and (where.get("load") == "gas" or not key.startswith("gas."))
    and (key not in OF_ACTION or "action" in where["gas"])
]  # fmt: skip


def with_value(where: dict, key: str, value: object) -> dict:
    """Return nested values with one more; beside one of a part the others are as they are."""
    values = copy.deepcopy(where)
    whole, _, part = key.rpartition(".")
    if whole in parts_by_key():
        case = Case.from_values(where)
        each = {one: value_of(case, f"{whole}.{one}") for one in parts_by_key()[whole]}
        if whole not in ("gas.indicator", "gas.clearance_percent"):
            each = {one: value if old is None else old for one, old in each.items()}
        value = {one: old for one, old in each.items() if old is not None} | {part: value}
        key = whole
    group, _, name = key.rpartition(".")
    within = values if not group else values.setdefault(group, {})
    if within is True:
        within = values[group] = {}
    within[name] = value
    if key in RIVALS:
        del within[RIVALS[key]]
    return values


@cache
def stored(case: Case) -> dict[str, str]:
    """Return what is stored of a case by name; of one with wear, of its first two stages too."""
    run, series = observe(case)
    run.numbers["seconds"] = 0.0
    found = {name: values.tobytes().hex() for name, (_, values, _) in series.items()}
    found |= run.words() | {"numbers": run.numbers.tobytes().hex()}
    found["name"] = run.attributes["name"]
    found["worn"] = Case.from_attribute(run.attributes["case"]).worn_joint
    if series and case.steps > 1000:  # of long ones: the text of the case is longer by the key
        kept = run.with_series(series, case.output.precision)
        found["file"] = str(round(len(encode_batch([kept])) / 10_000))
    if case.wear:
        worn = Worn(case)
        begun = worn.make_row([])
        stages = worn.to_dataset([begun, worn.make_row([begun])])
        found |= {name: repr(item.values.tolist()) for name, item in stages.variables.items()}
        found["life"] = repr((life(worn, stages), worn.limit))
    return found


def test_every_key_of_the_table_has_an_entry():
    assert sorted(ENTRIES) == sorted(table())


@pytest.mark.parametrize("key", ENTRIES)
def test_a_key_changes_what_is_stored_and_the_job_that_the_table_says(key):
    value, where, _ = ENTRIES[key]
    values = with_value(where, key, value)
    case, plain = Case.from_values(values), Case.from_values(where)
    row = table()[key]
    assert (case.key != plain.key) is row.identity
    assert (case.physics_key != plain.physics_key) is (row.identity and key not in SOLVER)
    assert Case.from_values(case.values()) == case
    assert Case.from_attribute(case.attributes()["case"]) == case
    assert stored(case) != stored(plain)


def each(pairs):
    """Try a test with each pair of a key and a machine, named by the key."""
    return pytest.mark.parametrize(("key", "where"), pairs, ids=[key for key, _ in pairs])


@each([one for one in UNREAD if one not in UNREAD_FACTS])
def test_a_key_that_nothing_reads_is_refused(key, where):
    """As a file, too: mistakes.json."""
    values = with_value(where, key, ENTRIES[key].value)
    Case.from_values(where)
    with pytest.raises(CaseError) as caught:
        Case.from_values(values)
    (problem,) = caught.value.problems
    assert problem.key in (key, key.partition(".")[0])
    assert "nothing reads this" in problem.message


@each([(key, where) for key, where in UNREAD if key not in CONTRADICTING])
def test_a_key_that_is_refused_would_have_changed_nothing(key, where):
    changed = with_value(where, key, ENTRIES[key].value)
    assert stored(Case.resolve(changed)) == stored(Case.resolve(where))


@each(UNREAD_FACTS)
def test_a_fact_of_the_machine_may_be_given_and_makes_no_other_job(key, where, tmp_path):
    value = ENTRIES[key].value
    values = with_value(where, key, value)
    plain = Case.from_values(where)
    assert Case.from_values(values).key == plain.key
    path = tmp_path / "case.yaml"
    path.write_text(json.dumps(values))
    assert [case.key for case in load_cases(path)] == [plain.key]
    two = [["steel", "steel"], ["copper", "copper"]]
    two = two if isinstance(value, list) else [value, 0.9 * value]
    path.write_text(json.dumps(with_value(where, key, two)))
    with pytest.raises(CaseFileError, match="nothing reads this"):  # swept in vain
        load_cases(path)


@pytest.mark.parametrize(
    ("text", "overrides"),
    [
        ("load: [gas, spring]\ngas: {back_pressure_MPa: 0.1}", []),
        ("gas: {back_pressure_MPa: 0.1}\nblocks: [{load: gas}, {load: none}]", []),
        ("joint: both\nclearance_mm: 0.1\nguide: {friction: [0, 0.1]}", []),
        # what the command line takes the reader from is the file's, and no mistake of it
        ("load: gas\ngas: {back_pressure_MPa: 0.1}", ["load=none"]),
        ("joint: big_end\nclearance_mm: 0.1", ["clearance_mm.big_end=0.2"]),
    ],
)
def test_one_job_that_reads_a_key_is_enough(text, overrides, read):
    """Where none does: mistakes.json."""
    assert read(text, *overrides).jobs


def test_a_job_has_one_key_beside_oil_that_it_has_no_room_for(read):
    dry, oiled = read("lubricant: true\njoint: [none, big_end]\nclearance_mm: 0.1").cases
    assert dry.lubricant is None
    assert dry.key == Case().key
    assert oiled.lubricant is not None
