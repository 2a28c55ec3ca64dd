"""What a store holds, to be compared with what another holds, and what is wrong with it."""

import hashlib

import numpy as np

from compressor.store.files import StoreError
from compressor.store.status import verify
from compressor.store.stored import read_store

TIMED = "seconds"


def contents(folder, foreign=()):
    """Key -> a digest of all that is stored of a job but the seconds that it took.

    foreign: attributes that do not count.
    """
    stored, found = read_store(folder), {}
    for position in np.argsort(stored.places[1]):  # a batch at a time, which stays in memory
        key, one = stored.columns["job"][position], stored.outcome(position)
        parts = [one.status, one.reason]
        parts += [one.numbers[name].tobytes() for name in one.numbers.dtype.names if name != TIMED]
        parts += [(name, one.attributes[name]) for name in one.attributes if name not in foreign]
        for name, (dims, values, attrs) in stored.series([position])[0].items():
            parts += [name, dims, values.dtype.char, values.tobytes(), attrs]
        found[key.decode()] = hashlib.sha256(repr(parts).encode()).hexdigest()
    return found


def differing(found, expected):
    """The names of what differs, "" where nothing does."""
    names = sorted(found.keys() | expected.keys())
    return ", ".join(name for name in names if found.get(name) != expected.get(name))


def damage(folder):
    """What is wrong with a store, in a line; empty where all is well, or nothing was stored."""
    try:
        return "; ".join(map(str, verify(folder)))
    except StoreError as error:
        return "" if not list(folder.glob("batches/*.h5")) else str(error)
