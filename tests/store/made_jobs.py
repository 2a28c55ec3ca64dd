"""Stores of short runs, and of outcomes that nobody ran."""

import tempfile
from pathlib import Path

import numpy as np
from conftest import SHORT, keep, write_cases

from compressor.cases.load import load_studies
from compressor.cases.study import Axis
from compressor.outcome import ROW, Outcome
from compressor.solve.simulate import simulate
from compressor.store.batch import read_lines, read_tables
from compressor.store.reader import read_store
from compressor.store.studies import StoredStudy, encode, write_study


def study(name, solve=SHORT, **values):
    """A study of given values, lists being swept, by way of a case file (JSON is YAML)."""
    with tempfile.TemporaryDirectory() as folder:
        return load_studies(*write_cases(Path(folder), **{name: {"solve": solve, **values}}))[0]


def fill(folder, *studies, skip=()):
    """Store studies and all their jobs, but for the jobs at some positions."""
    for one in studies:
        write_study(folder, one, "by hand")
        keep(folder, *(simulate(c) for n, c in enumerate(one.cases) if n not in skip))


def key(number):
    return f"{number:020x}"


def made(number, value=None, reason="", samples=0, precision="double", **attributes):
    """An outcome of a job; `value` is its peak acceleration (default: its number).

    samples: of its time series. A job with an odd number has a sensor's record, too.
    """
    numbers = np.full(1, np.nan, ROW)[0]
    numbers["peak_acceleration"] = number if value is None else value
    numbers["peak_contact_force_axis"] = [[number, 2], [3, 4]]
    attributes = {"key": key(number), "case": "{}", **attributes}
    found = Outcome("failed" if reason else "ok", reason, numbers, attributes)
    draw = np.random.default_rng(number)
    series = {
        "time": (("time",), np.arange(samples) / 7, {"units": "s"}),
        "acceleration": (("time",), draw.normal(size=samples), {"units": "m/s2"}),
        "contact_force": (("time", "joint", "axis"), draw.normal(size=(samples, 2, 2)), {}),
    }
    if number % 2:
        series["tacho_time"] = (("pulse",), np.arange(number) / 3, {"units": "s"})
    return found.with_series(series, precision) if samples else found


def plan(folder, count):
    """Store a study `made` of as many made-up jobs, over speeds."""
    axis = Axis("machine.speed_rpm", tuple(range(300, 300 + count)))
    keys = tuple(map(key, range(count)))
    one = StoredStudy("made", "made.yaml", (axis,), keys, {}, "", {}, "")
    (folder / "studies").mkdir(parents=True, exist_ok=True)
    (folder / "studies" / "made.json").write_bytes(encode(one))


def forget():
    """Forget what was read of batches."""
    read_lines.cache_clear()
    read_tables.cache_clear()


def held(stored):
    """Key -> all that a store holds of each job, to the bit."""
    forget()
    found = {}
    for position, name in enumerate(stored.columns["job"]):
        one = stored.outcome(position)
        series = {
            n: (item.dims, item.values.dtype, item.values.tobytes(), item.attrs)
            for n, item in stored.series([position])[0].items()
        }
        numbers, attributes = one.numbers.tobytes(), repr(one.attributes)
        found[name.decode()] = stored.status_at(position), numbers, attributes, series
    return found


def batches(folder):
    return sorted((folder / "batches").glob("*.h5"))


def peaks(folder):
    """Number -> peak acceleration of the made-up jobs in a store."""
    stored = read_store(folder)
    values = stored.numbers(np.arange(len(stored)), ["peak_acceleration"])
    names = (int(name, 16) for name in stored.columns["job"])
    return dict(zip(names, values["peak_acceleration"].tolist(), strict=True))
