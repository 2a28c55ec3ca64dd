"""Bit flips, truncations and zeroed blocks in the files of a store.

`verify` must find and name the file, or nothing that is read of the store may change; every reader
must give what the undamaged store gives, or say that it does not; the run that made the store must
mend it. Nothing may crash or hang.
"""

import shutil
from functools import partial

from stores_compared import differing

from chaos.common import command, complete_store, forked, run_here, whole
from compressor.store.files import StoreError
from compressor.store.stored import read_store

WHAT = "bit flips, truncations, zeroed blocks in stored files"
READERS = ("status", "status --json", "show KEY", "show KEY --json")
MEND_EVERY = 5  # trials


def hurt(data, draw):
    """What is done to a file's bytes, and what they become; never the same."""
    while True:
        new, at = bytearray(data), draw.randrange(len(data))
        how, block = draw.choice(("bits", "cut", "zeros", "grown")), draw.choice((1, 16, 512, 4096))
        if how == "bits":
            for place in draw.sample(range(len(new)), draw.choice((1, 1, 2, 10))):
                new[place] ^= 1 << draw.randrange(8)
        elif how == "cut":
            del new[draw.choice((at, 0, len(new) - 1)) :]
        elif how == "zeros":
            end = draw.choice((at + block, len(new)))
            new[at:end] = bytes(len(new[at:end]))
        else:
            new += draw.randbytes(draw.choice((1, 100)))
        if new != data:
            return f"{how} at {at}", bytes(new)


def look(store, file, reader, was, expected):
    """What is wrong with what is told of a damaged store, or "", and whether damage is found."""
    said = command(*reader.split(), "-r", store)
    try:
        problem = (different := differing(whole(store), expected)) and f"silent: {different}"
        unreadable = False
    except StoreError:
        problem, unreadable = "", True
    told = command("verify", "-r", store)  # last: it sets the file aside
    is_found = told.code == 5 and str(store / file) in told.out
    if told.code not in (0, 5) or is_found != (told.code == 5):
        problem = f"not named: {told}"
    elif is_found and file.parent.name == "batches" and "  job " not in told.out:
        problem = f"no job is named: {told}"
    elif said.code not in (0, 5) or "Traceback" in said.err:
        problem = str(said)
    elif said.code == 0 and "damaged" not in said.err and said.out != was.out:
        problem = f"a silent difference: {said} was {was}"
    elif unreadable and not is_found:
        problem = "unreadable, and verify finds nothing"
    return problem, is_found


def mend(store, cases, expected):
    """What a run of the case files leaves damaged, or ""."""
    run_here()
    said = command("run", *cases, "-r", store, "-j", 1)
    return differing(whole(store), expected) if said.code == 3 else str(said)  # one is to fail


def trial(place, draw, number, counts):
    """Damage a file."""
    complete, cases, expected = complete_store(place.parent)
    store = shutil.copytree(complete, place / "store")
    kind = draw.choice(("batches", "studies"))
    file = draw.choice(sorted((complete / kind).iterdir())).relative_to(complete)
    reader = draw.choice(READERS).replace("KEY", draw.choice(sorted(read_store(complete).keys())))
    was = forked(lambda: command(*reader.split(), "-r", store)).result
    how, data = hurt((complete / file).read_bytes(), draw)
    (store / file).write_bytes(data)
    ended = forked(partial(look, store, file, reader, was, expected))
    problem, is_found = ended.result or (ended.death, True)
    if number % MEND_EVERY == 0 and not problem:
        counts["mended"] += 1
        ended = forked(partial(mend, store, cases, expected))
        problem = ended.death or ended.result
    counts.update([f"in {kind}"] + ["no reader is touched"] * (not is_found))
    return problem and f"{file} {how}: {problem}"
