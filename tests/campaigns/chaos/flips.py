"""Bit flips, truncations and zeroed blocks in the files of a store.

Each trial damages one file. `verify` must find and name it, or else nothing that is read of the
store may change; every reader must give what the undamaged store gives, or say by an error or a
warning that it does not; the run that made the store must mend it. Nothing may crash or hang.
"""

import random
import shutil
from functools import cache, partial

from chaos.common import Tally, command, complete_store, differing, forked, fresh, run_here, whole
from compressor.store.files import StoreError
from compressor.store.stored import read_store

READERS = ("status", "status --json", "show KEY", "show KEY --json")
MEND_EVERY = 5  # trials


def hurt(data, rng):
    """What is done to a file's bytes, and what they become; never the same."""
    while True:
        new, at = bytearray(data), rng.randrange(len(data))
        how, block = rng.choice(("bits", "cut", "zeros", "grown")), rng.choice((1, 16, 512, 4096))
        if how == "bits":
            for place in {at, *(rng.randrange(len(new)) for _ in range(rng.choice((0, 0, 1, 9))))}:
                new[place] ^= 1 << rng.randrange(8)
        elif how == "cut":
            del new[rng.choice((at, 0, len(new) - 1)) :]
        elif how == "zeros":
            end = rng.choice((at + block, len(new)))
            new[at:end] = bytes(len(new[at:end]))
        else:
            new += rng.randbytes(rng.choice((1, 100)))
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


def campaign(trials, seed, folder):
    """Damage as many files, one a trial."""
    names = ("mended", "no reader is touched")
    tally = Tally("bit flips, truncations, zeroed blocks in stored files", seed, names)
    complete, cases = complete_store(folder)
    expected, keys = whole(complete), sorted(read_store(complete).keys())
    with fresh(folder) as place:
        store = place / "store"

        @cache
        def undamaged(reader):
            return forked(lambda: command(*reader.split(), "-r", store)).result

        for number in range(trials):
            rng = random.Random(f"{seed} {number}")
            shutil.rmtree(store, ignore_errors=True)
            shutil.copytree(complete, store)
            kind = rng.choice(("batches", "studies"))
            file = rng.choice(sorted((complete / kind).iterdir())).relative_to(complete)
            reader = rng.choice(READERS).replace("KEY", rng.choice(keys))
            was = undamaged(reader)
            how, data = hurt((complete / file).read_bytes(), rng)
            (store / file).write_bytes(data)
            ended = forked(partial(look, store, file, reader, was, expected))
            problem, is_found = ended.result or (ended.death, True)
            if number % MEND_EVERY == 0 and not problem:
                tally.counts["mended"] += 1
                ended = forked(partial(mend, store, cases, expected))
                problem = ended.death or ended.result
            tally.counts.update([f"in {kind}"] + ["no reader is touched"] * (not is_found))
            tally.note(f"trial {number}, {file} {how}", problem)
    return tally.result()
