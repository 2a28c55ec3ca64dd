"""What a choice costs and changes: variants of a case, features without effect, work-precision."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from conftest import write_cases

from compressor.cases import CONTACT_LAWS, PLAUSIBLE, Case, load_studies, row_of
from compressor.metrics import JOINTS, METRICS
from compressor.program import no_progress
from compressor.report.figures.drawing import panels_of
from compressor.solve.simulate import simulate
from compressor.store.reader import read_job
from compressor.studies.tradeoff import variants, work_precision
from compressor.studies.tradeoff.changes import list_changes, model_table
from compressor.studies.tradeoff.explain import advice_row, explain
from compressor.sweep.sweep import in_this_process, sweep

SHORT = {"duration_rev": 0.25, "settle_rev": 0}
THREE = ("contact stiffness × 2", "friction law: threlfall", "contact law: flores")


def case(**values):
    base = {"joint": "big_end", "clearance_mm": 0.2, "solve": SHORT}
    return Case.from_values({**base, **values})


def applied(values, base):
    return values(base) if callable(values) else values


@pytest.fixture
def few(monkeypatch):
    """Of the variants those named, which need no equations of features."""

    def kept(names=THREE):
        for function in (variants.other_models, variants.vary_numbers):
            monkeypatch.setattr(
                variants, function.__name__,
                lambda *of, whole=function: [one for one in whole(*of) if one.name in names],
            )  # fmt: skip

    return kept


@pytest.mark.parametrize("feature", variants.FEATURES, ids=lambda feature: feature.name)
def test_a_feature_that_is_left_out_is_no_longer_paid_for(feature):
    of_gas = feature.key.startswith("gas")
    rich = case(
        joint="big_end" if feature.key == "friction.ideal_joints" else "both",
        machine={"gravity_m_per_s2": 9.81},
        load="gas" if of_gas or feature.word == "spring" else "spring",
        gas={"back_pressure_MPa": 0.1} if of_gas else {},
    )
    rich = rich if feature.is_in(rich) else variants.change(rich, applied(feature.given, rich))
    assert feature.is_in(rich)
    assert Case.from_values(rich.values()) == rich
    if feature.left_out is None:
        return
    poor = variants.change(rich, applied(feature.left_out, rich))
    assert not feature.is_in(poor)
    assert Case.from_values(poor.values()) == poor  # still a valid case
    added = applied(feature.given, poor)
    assert added is None or feature.is_in(variants.change(poor, added))


@pytest.mark.parametrize("law", CONTACT_LAWS)
def test_each_contact_law_may_stand_in_place_of_each_other(law):
    """With what the case has; what it has not is a default."""
    plain = case(contact={"stiffness_N_per_mm15": 5e5, "damping_N_s_per_mm": 100})
    one = variants.change(plain, variants.contact_values(law, plain))
    for other in CONTACT_LAWS:
        two = variants.change(one, variants.contact_values(other, one))
        assert Case.from_values(two.values()) == two
        assert two.contact.law == other
        if {law, other} <= {"impact", "hertz", "flores", "lankarani_nikravesh"}:
            assert two.contact.stiffness_N_per_mm15 == 5e5, other


# ---- numbers in doubt ---------------------------------------------------------------------------

PLANT = """
joint: both
clearance_mm: {big_end: 0.1, small_end: [0.1, 0.3, 0.2]}
load: gas
machine: {rod_mass_kg: 40, rod_centre_mm: 200, pin_radius_mm: {big_end: 60, small_end: 35}}
gas: {action: double, rod_diameter_mm: 20, valve_loss_percent: {suction: 4, discharge: 5}}
lubricant: {viscosity_mPa_s: 40, bearing_length_mm: {big_end: 70, small_end: 50}}
body: {mass_kg: 6000, casing_mass_kg: 60}
sensor: true
output: {signals: true}
"""


def ends(study):
    found = {}
    for one in variants.vary_numbers(study, 1):
        assert one.name.startswith(f"{one.varied} ")
        found.setdefault(one.varied, []).append(float(one.name.removeprefix(one.varied)))
    return found


def test_what_the_file_leaves_out_or_can_only_guess_is_varied(read):
    found = ends(read(PLANT))
    assert found["lubricant.viscosity_mPa_s"] == [20, 80]  # given: a guess all the same
    assert found["lubricant.bearing_length_mm.big_end"] == [35, 87.5]
    assert found["lubricant.bearing_length_mm.small_end"] == [25, 62.5]
    assert found["gas.valve_loss_percent.discharge"] == [0, 8]
    assert found["body.casing_mass_kg"] == [30, 120]
    assert found["machine.rod_centre_mm"] == [180, 220]
    assert found["machine.rod_inertia_kg_m2"] == [3]  # 2.5 times m L^2 / 12, and not less
    assert found["gas.suction_MPa"] == pytest.approx([0.09975, 0.11025], rel=1e-3)
    assert {"gas.exponent", "body.damping_ratio", "sensor.mounting_Hz"} < {*found}
    lacking = {
        "machine.rod_mass_kg", "body.mass_kg", "contact.stiffness_N_per_mm15",
        "guide.friction", "friction.bristle_stiffness_per_mm", "clearance_mm.small_end",
    }  # fmt: skip  # given as known, scaled elsewhere, not read, or swept
    assert not lacking & {*found}


def gas_rows(study):
    return [one for one in variants.vary_numbers(study, 0) if one.varied.startswith("gas.")]


PAPER_RIG = "joint: big_end\nclearance_mm: 0.2\nload: gas\n"


def test_a_varied_number_of_the_gas_leaves_corners_and_back_pressure(read):
    """Else the exponent had a share of what the corners and the atmosphere change."""
    for gas in ("{switching: exact}", "{discharge_MPa: 0.5}", "{action: single}"):
        study = read(f"{PAPER_RIG}gas: {gas}\n")
        rows = gas_rows(study)
        assert {"gas.exponent", "gas.suction_MPa"} < {one.varied for one in rows}
        for one in rows:
            name = one.varied.removeprefix("gas.")
            value = {name: getattr(one.case.gas, name)}
            assert replace(study.cases[0].gas, **value) == one.case.gas, one.name


def test_the_paper_s_corners_are_of_its_own_cylinder(read):
    rows = gas_rows(read(PAPER_RIG))
    names = ["head_clearance_mm", "suction_MPa", "discharge_MPa", "exponent"]
    assert [one.varied for one in rows if not one.case] == [f"gas.{name}" for name in names]
    assert all("cannot be: the paper prints" in one.note for one in rows if not one.case)
    backs = [replace(Case().gas, back_pressure_MPa=back) for back in (0.09, 0.15)]
    assert [one.case.gas for one in rows if one.case] == backs


def test_an_end_that_cannot_be_says_why(read):
    study = read(PLANT.replace("big_end: 70", "big_end: 110"))
    (one,) = (x for x in variants.vary_numbers(study, 1) if x.name.endswith(".big_end 137.5"))
    assert one.case is None
    assert one.note.startswith("cannot be: lubricant.bearing_length_mm.big_end: is 1.15 times")


def test_every_plausible_range_lies_within_what_its_key_allows():
    assert len(PLAUSIBLE) > 40
    for key, doubt in PLAUSIBLE.items():
        row = row_of(key)
        for span in filter(None, doubt[1:]):
            values = span.ends(row.default) if row.default and span.are_factors else span[:2]
            assert not any(row.check(float(value)) for value in values), key
            assert span.low < span.high


def test_the_job_with_the_greatest_stored_force_is_varied(read, tmp_path, in_process):
    values = {"joint": "big_end", "clearance_mm": [0.1, 0.3, 0.2], "solve": SHORT}
    study = read(json.dumps(values))
    assert variants.choose_job(study, tmp_path / "kept")[0] == 1
    sweep([study], tmp_path / "kept")
    forces = [read_job(tmp_path / "kept", key)["peak_contact_force"].max() for key in study.keys]
    job, why = variants.choose_job(study, tmp_path / "kept")
    assert job == int(np.argmax(forces))
    assert why == "the one of 3 jobs with the greatest stored contact force"


def test_rod_load_body_and_sensor_are_compared(few, read):
    few(("body.casing_mass_kg 240",))
    text = "joint: big_end\nclearance_mm: 0.2\noutput: {signals: true}\nbody: {mass_kg: 3000}\n"
    text += "sensor: {noise_m_per_s2: 0}\nsolve: {duration_rev: 2, accuracy: draft}\n"
    data = variants.explain_models(read(text), 0)
    level = data["sensor_rms"].values
    # all that it hears but the body's own motion, which is little, goes as the mode's inverse mass
    assert level[1] / level[0] == pytest.approx(0.5, rel=0.02)
    assert {"peak_rod_load_tension", "body_velocity_rms", "sensor_peak_error"} < {*data}
    assert "time" not in data.dims


def test_the_table_is_that_of_runs_made_by_hand(few, tmp_path):
    few()
    values = {"joint": "big_end", "clearance_mm": [0.1, 0.2], "solve": SHORT,
              "body": {"start": "rest"}}  # fmt: skip
    (study,) = load_studies(*write_cases(tmp_path, worn=values))
    seen = {}
    data = variants.explain_models(study, 0, lambda done, total, _: seen.setdefault(done, total))
    assert {*data["choice"].values} == {variants.ITSELF, *THREE}
    assert seen == dict.fromkeys(range(5), 4)
    by_hand = {
        variants.ITSELF: {},
        "contact stiffness × 2": {"contact": {"stiffness_N_per_mm15": 6.72e5}},
        "friction law: threlfall": {"friction": {"law": "threlfall"}},
        "contact law: flores": {"contact": {"law": "flores", "restitution": 0.9}},
    }
    for name, more in by_hand.items():
        run = simulate(case(clearance_mm=0.1, **more))
        row = data.sel(choice=name)
        for metric in METRICS:
            np.testing.assert_array_equal(row[metric], run[metric])
            np.testing.assert_array_equal(row[f"{metric}_error"], run[f"{metric}_error"])
        assert row["regime"] == run.attrs["regime"]


# ---- what a case models, and which of its features have no effect


@pytest.fixture
def explained(read, tmp_path):
    def made(**values):
        values["solve"] = SHORT | values.get("solve", {})
        values = {"joint": "big_end", "clearance_mm": 0.2} | values
        study = read(json.dumps(values))
        return explain(study, variants.choose_job(study, tmp_path)[0], 2, no_progress)

    return made


def advice(told, name):
    return next(one for one in told["advice"] if one["name"] == name)


def test_friction_that_matters_is_kept(explained):
    """Its change is that of two runs by hand, far tighter; gravity, which is off, costs nothing."""
    told = explained()
    assert [row["name"] for row in told["advice"]] == [
        "no friction", "no spring damping", "no load",
    ]  # fmt: skip
    one = advice(told, "no friction")
    assert "acceleration" in one["needed_for"]
    values = {"joint": "big_end", "clearance_mm": 0.2, "solve": SHORT | {"accuracy": "fine"}}
    runs = [simulate(Case.from_values(values | more)) for more in ({}, {"friction": False})]
    peaks = [float(run["peak_acceleration"]) for run in runs]
    assert one["changes"]["acceleration"] == pytest.approx(peaks[1] / peaks[0] - 1, abs=1e-3)
    forces = [float(run["peak_contact_force"].sel(joint="big_end")) for run in runs]
    assert one["changes"]["force"] == pytest.approx(forces[1] / forces[0] - 1, abs=1e-3)


@pytest.mark.parametrize(("size", "told"), [(-0.3, "needed"), (1e-5, "joint: small_end"),
                                            (float("nan"), "failed: budget_steps")])  # fmt: skip
def test_a_note_hides_no_known_verdict(size, told):
    """Two worn joints of unlike clearance had `clearance_mm 0.3` in place of `needed`."""
    needed = ["force"] if abs(size) >= 5e-3 else []
    note = "failed: budget_steps" if size != size else "clearance_mm 0.3"
    row = {"name": "ideal big end", "changes": {"force": size}, "time_ratio": 0.5, "note": note,
           "needed_for": needed, "left_out": "joint: small_end"}  # fmt: skip
    assert advice_row(row)[-1] == told


def test_a_tighter_promise_keeps_what_a_looser_one_drops(explained):
    weak = {"spring": {"damping_N_s_per_mm": 1e-3}}
    name = "no spring damping"
    assert not advice(explained(**weak, solve={"accuracy": "draft"}), name)["needed_for"]
    assert advice(explained(**weak, solve={"accuracy": "reference"}), name)["needed_for"]


def test_a_job_without_steps_and_one_that_fails_have_no_advice(explained):
    told = explained(clearance_mm=0)
    assert (told["steps"], [*told["advice"]], told["reason"]) == (0, [], "")
    told = explained(solve={"max_steps": 20})
    assert (told["reason"], told["detail"]) == ("budget_steps", "more than 20 steps")
    assert [*told["advice"]] == []


# ---- changes by choices of the model: what is beyond the error bars


TABLE = {  # of a case and of five others in its place: its big end is worn
    "choice": ["the case itself", "softer", "oil", "other law", "broken", "impossible"],
    "peak_acceleration": [100.0, 193.0, 34.0, 500.0, math.nan, math.nan],  # m/s2
    "peak_acceleration_error": [0.01, 1.0, 1.0, math.inf, math.nan, math.nan],
    "rms_acceleration": [50.0, 50.4, 60.0, 75.0, math.nan, math.nan],
    "rms_acceleration_error": [0.1, 0.4, 0.1, 5.0, math.nan, math.nan],
    "contact_loss_fraction": [0.01, 0.05, 1.0, 0.02, math.nan, math.nan],
    "contact_loss_fraction_error": [1e-3] * 6,
    "max_penetration": [20e-6, 30e-6, -5e-6, 90e-6, math.nan, math.nan],
    "max_penetration_error": [1e-9] * 6,
    "status": ["ok", "ok", "ok", "ok", "failed", "missing"],
    "reason": ["", "", "", "", "budget_steps", ""],
    "regime": ["periodic", "periodic", "periodic", "chaotic", "", ""],
    "note": ["", "K 1", "", "", "", "needs more"],
    "varied": [""] * 6,
    "seconds": [1.0, 2.0, 3.0, 4.0, 5.0, math.nan],
}


def model_changes():
    data = xr.Dataset({name: ("choice", values) for name, values in TABLE.items()})
    for name in ("contact_loss_fraction", "max_penetration"):
        for one in (name, f"{name}_error"):
            data[one] = data[one] * xr.DataArray([1.0, 0.0], {"joint": [*JOINTS]}, "joint")
    return data


def test_a_change_is_what_lies_beyond_both_bars():
    table = model_table(model_changes())
    titles = [measure.title for measure in table.measures]
    found = {row.name: dict(zip(titles, row.cells, strict=True)) for row in table.rows}
    peak, rms = "peak acceleration", "rms acceleration"
    depth, loss = "max penetration, big end", "time without dry contact, big end"
    assert [*found["softer"]] == [peak, rms, depth, loss]
    assert found["softer"] == {peak: "+93 %", rms: "none seen", depth: "+50 %",
                               loss: "+4 points"}  # fmt: skip
    assert found["oil"] == {peak: "-66 %", rms: "+20 %", depth: "no contact", loss: "+99 points"}
    assert found["other law"] == {peak: "chaotic", rms: "+50 %", depth: "+350 %",
                                  loss: "+1 points"}  # fmt: skip
    assert {*found["broken"].values()} == {"failed"}
    assert {*found["impossible"].values()} == {"–"}
    assert [row.note for row in table.rows] == ["K 1", "", "", "failed: budget_steps", "needs more"]
    assert table.rows[1].time_ratio == 3.0


def test_what_moves_a_metric_most_is_listed_first():
    lines = [*list_changes(model_table(model_changes()))]
    first = next(n for n, line in enumerate(lines) if line.startswith("peak acceleration "))
    assert [line.split() for line in lines[first + 1 : first + 3]] == [
        ["softer", "+93", "%"], ["oil", "-66", "%"]
    ]  # fmt: skip
    assert lines[-1].split(maxsplit=1) == ["impossible", "needs more"]


# ---- work and precision: errors that fall, failures that stay, references that know their limits


METHODS = ("auto", "RODAS", "LSODA")
SOME = ["solve.method=[auto, RODAS, LSODA]", "solve.rtol=[1.0e-3, 1.0e-7, 1.0e-5, 1.0e-12]"]


def made(place, *overrides, **values):
    values = {"joint": "big_end", "clearance_mm": 0.2, "solve": SHORT} | values
    (path,) = write_cases(place, worn=values)
    study, texts = work_precision.load_methods(str(path), overrides, place / "kept")
    sweep([study], place / "kept", 1, no_progress, "", texts, backend=in_this_process)
    return work_precision.work_precision(place / "kept", study), study, place / "kept"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return made(tmp_path_factory.mktemp("methods"), *SOME, "solve.timeout_s=600")


def test_errors_fall_with_the_tolerance(whole):
    study = whole[0]
    assert study["rtol"].values.tolist() == [1e-3, 1e-5, 1e-7, 1e-12]
    assert (study["error_acceleration"].sel(rtol=1e-7) < 1e-5).all()
    compared = study["error_acceleration"].sel(rtol=[1e-3, 1e-5, 1e-7])
    assert (compared.diff("rtol") < 0).all()
    # none is judged by itself: RODAS at 1e-12 is the truth of others, the tightest other one its
    apart = study["reference_uncertainty"].item()
    rodas = study["error_acceleration"].sel({"method": "RODAS", "rtol": 1e-12}).item()
    assert 0 < apart == rodas < 1e-8
    assert compared.min() > apart


def test_errors_are_those_of_runs_made_by_hand(whole):
    found, study, _ = whole
    cases = {(one.solve.method, one.rtol): one for one in study.cases}
    run, truth = (simulate(cases[which]) for which in (("auto", 1e-5), ("RODAS", 1e-12)))
    a, b = (one["acceleration"].values for one in (run, truth))
    one = found.sel({"method": "auto", "rtol": 1e-5}).squeeze()
    assert one["error_acceleration"] == np.linalg.norm(a - b) / np.linalg.norm(b)


def test_a_job_that_fails_has_no_error(tmp_path):
    found = made(tmp_path, "solve.method=[auto, RODAS]", "solve.max_steps=900")[0]
    failed = found["status"] == "failed"
    assert (found["error_acceleration"].isnull() == failed).all()
    assert {*found["reason"].values.ravel()} == {"", "budget_steps"}


def test_a_run_that_finds_its_own_length_gives_it_to_all(tmp_path, in_process):
    """A draft of this one settles after one revolution."""
    solve = {"duration_rev": "auto", "settle_rev": "auto", "accuracy": "draft"}
    (path,) = write_cases(tmp_path, auto={"joint": "big_end", "clearance_mm": 0.2, "solve": solve})
    study, texts = work_precision.load_methods(str(path), SOME, tmp_path)
    assert {(one.solve.duration_rev, one.solve.settle_rev) for one in study.cases} == {(4.0, 1.0)}
    assert "solve.settle_rev=1.0" in texts


def synthetic(errors, seconds, unknown):
    rows = [
        {"scene": "s", "method": method, "rtol": rtol, "error_acceleration": errors[m][n],
         "seconds": seconds[m][n], "reference_uncertainty": unknown}
        for m, method in enumerate("ab") for n, rtol in enumerate((1e-2, 1e-5))
    ]  # fmt: skip
    return work_precision.tabulate(rows)


def test_the_fastest_of_each_decade():
    data = synthetic([[0.05, 2e-5], [0.5, 1e-4]], [[1.0, 9.0], [0.1, 3.0]], 1e-12)
    rows = work_precision.fastest(data)
    found = {row["error_below"]: (row["method"], row["seconds"]) for row in rows}
    assert found == {0.1: ("a", 1.0), 0.01: ("b", 3.0), 1e-3: ("b", 3.0), 1e-4: ("b", 3.0)}
    # nothing is fastest below what the references know
    data = synthetic([[0.05, 1e-9], [np.nan, np.nan]], [[1.0, 9.0], [np.nan, 4.0]], 5e-5)
    assert [row["error_below"] for row in work_precision.fastest(data)] == [0.1, 0.01, 1e-3, 1e-4]


def test_the_figure_draws_what_is_there(whole):
    study = whole[0]
    (panel,) = panels_of(work_precision.draw_work_precision(study))
    assert panel.x.type == panel.y.type == "log"
    lines = [trace.y for trace in panel.traces if trace.y.size == 4 and trace.name]
    assert len(lines) == len(METHODS)
    first = study["error_acceleration"].values[0, 0]
    assert any(line == pytest.approx(first) for line in lines)
