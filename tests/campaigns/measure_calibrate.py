"""What `compsim calibrate` is worth (make calibrate): known machines, and others than the model.

Records of simulated sound machines with noise and a speed that jitters, whose masses and foundation
are then fitted, as a user would: the command's own call, with its store. Counted are the keys whose
true value lies in its 95 % interval, how wide the intervals are, and how often it is said that the
machine does not fit. The same with a machine that has what the model
does not: pins that rub, another exponent of the gas. The constants of the fit were chosen on
machines of another seed. Writes a small JSON file.
"""

import json
import math
import tempfile
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from result_pages import keep, provenance, run_campaign

from compressor.cases.case import Case
from compressor.solve.simulate import simulate
from compressor.studies.calibrate import POOR_FIT, calibrate
from compressor.studies.frame import KeySpan
from compressor.vibration import Record

SEED, MACHINES = 3101, 34
RANGES = {
    "machine.reciprocating_mass_kg": (10.0, 20.0), "machine.rod_mass_kg": (3.0, 8.0),
    "body.mass_kg": (300.0, 800.0), "body.frequency_y_Hz": (26.0, 40.0),
    "body.damping_ratio": (0.01, 0.08),
}  # fmt: skip
FIXED = {
    "load": "gas",
    "gas": {"switching": "exact"},
    "body": {"freedoms": "y"},
    "sensor": {"rate_Hz": 2560, "mounting_Hz": 2500, "length_rev": 20},
    "solve": {"duration_rev": 2, "output_step_deg": 1, "error_bars": False},
}  # fmt: skip
OTHERS = {  # what the machine has, and the model does not
    "nothing": {},
    "pins that rub": {"friction": {"ideal_joints": True, "static": 0.15, "dynamic": 0.1}},
    "a gas with exponent 1.25": {"gas": {"exponent": 1.25}},
}


def merge(values, more):
    """Nested values with others over them."""
    return {
        key: {**values.get(key, {}), **more[key]}
        if isinstance(more.get(key), dict)
        else more.get(key, values.get(key))
        for key in [*values, *(key for key in more if key not in values)]
    }


def machine(rng):
    """A random machine: its true values by key, and those of the case file that are not fitted."""
    truth = {key: float(f"{rng.uniform(*span):.4g}") for key, span in RANGES.items()}
    known = {
        "machine": {"speed_rpm": float(f"{rng.uniform(400, 600):.4g}")},
        "sensor": {
            "noise_m_per_s2": float(f"{10 ** rng.uniform(-3, -1.7):.3g}"),
            "speed_jitter": float(f"{rng.uniform(0, 2e-3):.3g}"), "seed": int(rng.integers(2**31)),
        },
    }  # fmt: skip
    return truth, known


def fit(truth, known, other):
    """What is said of a machine by its record: interval and truth by key, and the misfit."""
    values = merge(FIXED, known)
    for key, value in truth.items():
        group, _, name = key.partition(".")
        values = merge(values, {group: {name: value}})
    run = simulate(Case.from_values(merge(values, other)))
    assert run.status == "ok", run.attrs["detail"]
    names = ("sensor_time", "sensor_acceleration", "tacho_time")
    record = Record(*(run[name].values for name in names), math.nan)
    unknowns = [KeySpan(key, *span) for key, span in RANGES.items()]
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, "machine.yaml")
        path.write_text(json.dumps(merge(FIXED, known)))
        found = calibrate(record, str(path), unknowns, Path(place, "results"), workers=1)
    rows = {}
    for key, one in found.keys.items():
        rows[key] = {"truth": truth[key], "low": one.low, "high": one.high}
    return rows, found.fit.misfit


def judge(fits):
    """What is counted over some machines."""
    keys = {}
    for key, (low, high) in RANGES.items():
        rows = [rows[key] for rows, _ in fits]
        hits = sum(row["low"] <= row["truth"] <= row["high"] for row in rows)
        widths = [(row["high"] - row["low"]) / (high - low) for row in rows]
        keys[key] = {"inside": hits, "width": float(f"{np.median(widths):.3g}")}
    poor = sum(misfit >= POOR_FIT for _, misfit in fits)
    return {"machines": len(fits), "keys": keys, "said_not_to_fit": int(poor)}


def main(target, machines=MACHINES, seed=SEED, jobs=2):
    kept = {}
    with Parallel(n_jobs=jobs) as parallel:
        for name, other in OTHERS.items():
            rng = np.random.default_rng(seed)  # the same machines each time
            drawn = [machine(rng) for _ in range(machines)]
            kept[name] = judge(parallel(delayed(fit)(*one, other) for one in drawn))
    result = {
        **provenance("make calibrate"), "seed": seed, "ranges": RANGES, "fixed": FIXED,
        "others": kept,
    }  # fmt: skip
    keep(target, result)


if __name__ == "__main__":
    run_campaign(main)
