"""What a store holds, apart from timings, to be compared to the bit; and whether it is whole."""

import hashlib
import json

from compressor.store.files import StoreError
from compressor.store.reader import read_store
from compressor.store.status import verify

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
    for key in sorted(stored.keys()):
        outcome = stored.outcome(position := stored.position(key))
        parts = [outcome.status, outcome.reason]
        parts += [
            outcome.numbers[name].tobytes() for name in outcome.numbers.dtype.names if name != TIMED
        ]
        parts += [(n, outcome.attributes[n]) for n in outcome.attributes if n not in foreign]
        for name, (dims, values, attrs) in stored.series(position).items():
            parts += [name, dims, values.dtype.char, values.tobytes(), attrs]
        found[key] = hashlib.sha256(repr(parts).encode()).hexdigest()
    return found


def seconds(folder):
    """Key -> the seconds that a stored job took: they change when it runs again."""
    stored = read_store(folder)
    numbers = {key: stored.outcome(stored.position(key)).numbers for key in sorted(stored.keys())}
    return {key: float(row[TIMED]) for key, row in numbers.items()}


def unfinished(folder):
    """Temporary files that a killed writer has left."""
    return [str(path) for path in folder.glob("**/.*.tmp")]


def damage(folder):
    """What is wrong with a store, in a line; empty where all is well, or nothing was stored."""
    try:
        found = [str(one) for one in verify(folder) if not one.problem.endswith("or gone")]
    except StoreError as error:
        return "" if not list(folder.glob("batches/*.h5")) else str(error)
    return "; ".join(found)
