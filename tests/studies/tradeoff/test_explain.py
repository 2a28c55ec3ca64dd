"""What a case models, and which of its features have no effect."""

import json
import math

import pytest
import xarray as xr

from compressor.cases.case import Case
from compressor.metrics import JOINTS
from compressor.program import no_progress
from compressor.solve.simulate import simulate
from compressor.studies.tradeoff.changes import list_changes, model_table
from compressor.studies.tradeoff.explain import advice_row, explain
from compressor.studies.tradeoff.variants import choose_job

SOLVE = {"duration_rev": 0.25, "settle_rev": 0}


@pytest.fixture
def explained(read, tmp_path):
    def made(**values):
        values["solve"] = SOLVE | values.get("solve", {})
        values = {"joint": "big_end", "clearance_mm": 0.2} | values
        study = read(json.dumps(values))
        return explain(study, choose_job(study, tmp_path)[0], 2, no_progress)

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
    values = {"joint": "big_end", "clearance_mm": 0.2, "solve": SOLVE | {"accuracy": "fine"}}
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


NAN = math.nan
TABLE = {  # of a case and of five others in its place: its big end is worn
    "choice": ["the case itself", "softer", "oil", "other law", "broken", "impossible"],
    "peak_acceleration": [100.0, 193.0, 34.0, 500.0, NAN, NAN],  # m/s2
    "peak_acceleration_error": [0.01, 1.0, 1.0, math.inf, NAN, NAN],
    "rms_acceleration": [50.0, 50.4, 60.0, 75.0, NAN, NAN],
    "rms_acceleration_error": [0.1, 0.4, 0.1, 5.0, NAN, NAN],
    "contact_loss_fraction": [0.01, 0.05, 1.0, 0.02, NAN, NAN],
    "contact_loss_fraction_error": [1e-3] * 6,
    "max_penetration": [20e-6, 30e-6, -5e-6, 90e-6, NAN, NAN],
    "max_penetration_error": [1e-9] * 6,
    "status": ["ok", "ok", "ok", "ok", "failed", "missing"],
    "reason": ["", "", "", "", "budget_steps", ""],
    "regime": ["periodic", "periodic", "periodic", "chaotic", "", ""],
    "note": ["", "K 1", "", "", "", "needs more"],
    "varied": [""] * 6,
    "seconds": [1.0, 2.0, 3.0, 4.0, 5.0, NAN],
}


def made():
    data = xr.Dataset({name: ("choice", values) for name, values in TABLE.items()})
    for name in ("contact_loss_fraction", "max_penetration"):
        for one in (name, f"{name}_error"):
            data[one] = data[one] * xr.DataArray([1.0, 0.0], {"joint": [*JOINTS]}, "joint")
    return data


def cells(table):
    titles = [measure.title for measure in table.measures]
    return {row.name: dict(zip(titles, row.cells, strict=True)) for row in table.rows}


def test_a_change_is_what_lies_beyond_both_bars():
    table = model_table(made())
    found = cells(table)
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
    lines = [*list_changes(model_table(made()))]
    first = next(n for n, line in enumerate(lines) if line.startswith("peak acceleration "))
    assert [line.split() for line in lines[first + 1 : first + 3]] == [
        ["softer", "+93", "%"], ["oil", "-66", "%"]
    ]  # fmt: skip
    assert lines[-1].split(maxsplit=1) == ["impossible", "needs more"]
