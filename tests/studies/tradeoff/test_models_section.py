"""Changes by choices of the model: what is beyond the error bars, and the words beside it."""

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from compressor.cases.study import Axis
from compressor.metrics import JOINTS, METRICS
from compressor.report.page import document
from compressor.store.files import StoreWarning
from compressor.store.netcdf import write_dataset
from compressor.store.studies import StoredStudy
from compressor.studies.tradeoff.page import (
    add,
    headline,
    model_table,
    models_file,
    page_table,
    place_text,
    read_models,
)

AXIS = Axis("clearance_mm", (0.1, 0.2, 0.3))
STUDY = StoredStudy("worn", "worn.yaml", (AXIS,), ("0" * 20, "1" * 20, "2" * 20), {}, "", {}, "")
NAMES = ["the case itself", "softer", "oil", "other law", "broken", "impossible"]
PEAK = [100.0, 193.0, 34.0, 500.0, math.nan, math.nan]  # m/s2
PEAK_BAR = [0.01, 1.0, 1.0, math.inf, math.nan, math.nan]
RMS = [50.0, 50.4, 60.0, 75.0, math.nan, math.nan]
RMS_BAR = [0.1, 0.4, 0.1, 5.0, math.nan, math.nan]
LOSS = [0.01, 0.05, 1.0, 0.02, math.nan, math.nan]
DEPTH = [20e-6, 30e-6, -5e-6, 90e-6, math.nan, math.nan]


def made(**more):
    """A table of choices with these numbers, of a worn big end."""
    shape = (len(NAMES), len(JOINTS))
    given = {
        "peak_acceleration": (PEAK, PEAK_BAR),
        "rms_acceleration": (RMS, RMS_BAR),
        "contact_loss_fraction": (LOSS, [1e-3] * len(NAMES)),
        "max_penetration": (DEPTH, [1e-9] * len(NAMES)),
    } | more
    variables = {}
    for name, pair in given.items():
        for end, values in zip(("", "_error"), pair, strict=True):
            values = np.array(values, float)
            dims = ("choice", *METRICS[name].dims)
            if len(dims) == 2:  # the small end is ideal
                values = np.where([True, False], values[:, None], 0.0 * np.ones(shape))
            variables[name + end] = dims, values
    words = {
        "status": ["ok", "ok", "ok", "ok", "failed", "missing"],
        "reason": ["", "", "", "", "budget_steps", ""],
        "regime": ["periodic", "periodic", "periodic", "chaotic", "", ""],
        "note": ["", "K 1", "", "", "", "needs more"],
        "varied": ["", "", "", "", "", ""],
    }
    variables |= {name: ("choice", np.array(values, object)) for name, values in words.items()}
    variables["seconds"] = "choice", np.array([1, 2, 3, 4, 5, math.nan], float)
    coordinates = {"choice": np.array(NAMES, object), "joint": list(JOINTS)}
    attrs = {"study": "worn", "key": STUDY.keys[2]}
    return xr.Dataset(variables, coordinates, attrs)


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
    assert table.span_texts == ("-66 to +93 %", "0 to +50 %", "0 to +350 %", "0 to +99 points")
    assert [row.note for row in table.rows] == ["K 1", "", "", "failed: budget_steps", "needs more"]
    assert table.rows[1].time_ratio == 3.0


def test_the_page_shows_line_table_and_what_is_assumed(tmp_path):
    data = made()
    write_dataset(models_file(tmp_path, "worn", STUDY.keys[2]), data)
    (one,) = add(tmp_path, [STUDY])
    text = document([one.section] * 2)
    assert one.line == f"What moves its numbers: {headline(model_table(data))}"
    assert text.count(f"<p>{headline(model_table(data))}.</p>") == 2
    assert "The table is of worn at clearance_mm = 0.3, one of 3 jobs: its" in text
    alone = replace(STUDY, axes=(), keys=("a",))
    assert place_text(alone, "a") == "worn, the only job"
    table = page_table(model_table(data))
    assert [row.cells[0].text for row in table.rows] == [*NAMES, "all of them"]
    assert [cell.text for cell in table.rows[1].cells][-1] == "K 1"
    assert {len(row.cells) for row in table.rows} == {len(table.head)}


def test_choices_are_read_where_they_are_of_a_job_of_the_study(tmp_path):
    study = STUDY
    assert read_models(tmp_path, study) == []
    first, second = made().assign_attrs(key=study.keys[0]), made()
    path = write_dataset(models_file(tmp_path, "worn", study.keys[0]), first)
    write_dataset(models_file(tmp_path, "worn", study.keys[2]), second)
    write_dataset(tmp_path / "models" / "worn-out.nc", second)  # of another study
    found = [one.attrs["key"] for one in read_models(tmp_path, study)]
    assert sorted(found) == [study.keys[0], study.keys[2]]
    first, second = add(tmp_path, [study])
    assert (bool(second.line), second.anchor) == (False, "models-worn-2")
    assert [first.title, second.title] == [
        f"What moves the numbers of study worn at clearance_mm = {value}" for value in (0.1, 0.3)
    ]
    with pytest.warns(StoreWarning, match=r"worn-2{8}\.nc: is not shown, as worn has no"):
        assert len(read_models(tmp_path, replace(study, keys=study.keys[:2]))) == 1
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.warns(StoreWarning, match=r"worn-0{8}\.nc.*compsim explain --models"):
        assert len(read_models(tmp_path, study)) == 1
    write_dataset(path, xr.Dataset({"a": 1.0}))
    with pytest.warns(StoreWarning, match="is not shown, as worn has no such job"):
        assert len(read_models(tmp_path, study)) == 1
