"""What a store holds, apart from timings, to be compared to the bit; and whether it is whole."""

import hashlib
import json

import numpy as np

from compressor.store import hdf5
from compressor.store.files import StoreError
from compressor.store.hdf5 import DamagedJob, open_file
from compressor.store.reader import places, read_store
from compressor.store.series_file import intact
from compressor.store.status import verify
from compressor.store.studies import study_paths

TIMED = "seconds"
LEAN = {  # of a quick job
    "duration_rev": 0.25, "settle_rev": 0, "accuracy": "draft", "output_step_deg": 0.9,
    "error_bars": False,
}  # fmt: skip


def case_file(folder, name, masses, keep="metrics", **more):
    """A study of quick big-end jobs, one a rod mass (kg): the path of its case file."""
    values = {
        "joint": "big_end",
        "clearance_mm": 0.1,
        "machine": {"rod_mass_kg": list(masses)},
        "output": {"keep": keep},
        "solve": LEAN,
    }
    path = folder / f"{name}.yaml"
    path.write_text(json.dumps(values | more), encoding="utf-8")
    return path


def contents(folder, foreign=()):
    """Key -> a digest of all that is stored of a job but the seconds that it took.

    foreign: attributes that depend on which of several studies ran it.
    """
    stored, found = read_store(folder), {}
    names = [name for name in stored.rows.numbers.dtype.names if name != TIMED]
    columns = stored.rows.columns
    for position in np.argsort(stored.rows.source, kind="stable"):  # segment by segment: quicker
        parts = [stored.rows.numbers[name][position].tobytes() for name in names]
        parts += [bytes(columns[name][position]) for name in ("status", "reason", "precision")]
        parts += [columns[name][position].tobytes() for name in ("samples", "end")]
        attributes = stored.rows.attributes(position)
        if path := stored.rows.path(position):
            data = path.read_bytes()
            with open_file(data, path) as file:
                held = hdf5.variables(file, data)
                attributes |= hdf5.attributes(file)
            for name in sorted(set(held) - {TIMED}):
                values = np.asarray(held[name][1])
                text = repr(values.tolist()).encode()  # of an object, bytes are an address
                parts += [name.encode(), text if values.dtype == object else values.tobytes()]
        for name in sorted(set(attributes) - set(foreign)):
            parts += [name.encode(), repr(attributes[name]).encode()]
        found[columns["key"][position].decode()] = hashlib.sha256(b"\0".join(parts)).hexdigest()
    return found


def rows(folder):
    """Key -> a stored job's numbers, seconds too, as bytes: they change when it runs again."""
    found = read_store(folder).rows
    keys = (key.decode() for key in found.columns["key"])
    return dict(zip(keys, (row.tobytes() for row in found.numbers), strict=True))


def torn(folder):
    """Files of a store that are under their names, but not whole; those of no row, too.

    Not a study with jobs that have not run yet.
    """
    found = []
    for place in places(folder):
        found += [path for path in place.glob("jobs/*.h5") if not intact(path)]
    stored = read_store(folder, DamagedJob)
    if stored.segments or stored.damaged or study_paths(folder):
        found += [one.path for one in verify(folder) if not one.problem.endswith("or gone")]
    return [*dict.fromkeys(str(path) for path in found)]


def unfinished(folder):
    """Temporary files that a killed writer has left."""
    return [str(path) for path in folder.glob("**/.*.tmp")]


def damage(folder):
    """What is wrong with a store, in a line; empty where all is well."""
    try:
        files = torn(folder)
    except StoreError as error:
        return str(error)
    return f"torn: {', '.join(files)}" if files else ""
