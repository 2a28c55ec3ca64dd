"""Changes by choices of the model: what is beyond the error bars, and the words beside it."""

import math

import numpy as np
import xarray as xr

from compressor.metrics import JOINTS, METRICS
from compressor.studies.tradeoff.changes import list_changes, model_table

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
    return xr.Dataset(variables, coordinates)


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
