"""Bit flips, truncations and zeroed blocks in the files of a store.

Each trial damages one file. `verify` must find and name it, or else nothing that is read of the
store may change; every reader must give what the undamaged store gives, or say by an error or a
warning that it does not; the run that made the store must mend it. Nothing may crash or hang.
"""

import random
import shutil
from functools import cache, partial
from pathlib import Path
from typing import Any

from chaos.common import (
    case_files,
    command,
    complete_store,
    contents,
    differing,
    forked,
    fresh,
    run_here,
)
from chaos.tally import Tally
from compressor.store.files import StoreError
from compressor.store.reader import read_store

READERS = ("status", "status --json", "show KEY", "show KEY --json")
MEND_EVERY = 5  # trials


def damage(data: bytes, rng: random.Random) -> tuple[str, bytes]:
    """What is done to a file's bytes, and what they become; never the same."""
    while True:
        new, at = bytearray(data), rng.randrange(len(data))
        how = rng.choice(("bits", "truncated", "zeroed", "zeroed end", "swapped", "grown"))
        block = rng.choice((1, 16, 512, 4096))
        if how == "bits":
            for place in {at, *(rng.randrange(len(new)) for _ in range(rng.choice((0, 0, 1, 9))))}:
                new[place] ^= 1 << rng.randrange(8)
        elif how == "truncated":
            del new[rng.choice((at, 0, len(new) - 1)) :]
        elif how == "zeroed":
            new[at - at % block : at - at % block + block] = bytes(block)
        elif how == "zeroed end":
            new[at:] = bytes(len(new) - at)
        elif how == "swapped":
            one, other = (slice(begin, begin + 512) for begin in (at, rng.randrange(len(new))))
            new[one], new[other] = new[other], new[one]
        else:
            new += rng.randbytes(rng.choice((1, 100)))
        if new != data and len(new) <= len(data) + 100:
            return f"{how} at {at}", bytes(new)


def look(store: Path, file: Path, reader: str, was: Any, whole: dict[str, Any]) -> tuple[str, bool]:
    """What is wrong with what is told of a damaged store, or "", and whether damage is found."""
    told = command("verify", "-r", store)
    is_found = told.code == 5 and str(store / file) in told.out
    if told.code not in (0, 5) or is_found != (told.code == 5):
        return f"not named: {told}", is_found
    if is_found and file.parent.name == "batches" and "  job " not in told.out:
        return f"no job is named: {told}", is_found
    said = command(*reader.split(), "-r", store)
    if said.code not in (0, 5) or "Traceback" in said.err:
        return str(said), is_found
    if said.code == 0 and "damaged" not in said.err and said.out != was.out:
        return f"a silent difference: {said} was {was}", is_found
    try:
        found = contents(store) | {"damage": []}
    except (StoreError, UserWarning):
        return ("" if is_found else "unreadable, and verify finds nothing"), is_found
    different = differing(found, whole)
    return (f"silent: {different}" if different else ""), is_found


def mend(store: Path, cases: list[Path], whole: dict[str, Any]) -> str:
    """What a run of the case files leaves damaged, or ""."""
    run_here()
    said = command("run", *cases, "-r", store, "-j", 1)
    return differing(contents(store), whole) if said.code == 3 else str(said)  # one is to fail


def campaign(trials: int, seed: int, folder: Path) -> dict[str, Any]:
    """Damage as many files, one a trial."""
    names = ("mended", "no reader is touched")
    tally = Tally("bit flips, truncations, zeroed blocks in stored files", seed, names)
    complete = complete_store(folder)
    cases, whole = case_files(folder / "cases"), contents(complete)
    keys = sorted(read_store(complete).keys())

    @cache
    def undamaged(reader: str) -> Any:
        said = forked(lambda: command(*reader.split(), "-r", store)).result
        assert said.code == 0, said
        return said

    with fresh(folder) as place:
        store = place / "store"
        for number in range(trials):
            rng = random.Random(f"{seed} {number}")
            shutil.rmtree(store, ignore_errors=True)
            shutil.copytree(complete, store)
            kind = rng.choice(("batches", "studies"))
            file = rng.choice(sorted((complete / kind).iterdir())).relative_to(complete)
            reader = rng.choice(READERS).replace("KEY", rng.choice(keys))
            was = undamaged(reader)
            how, data = damage((complete / file).read_bytes(), rng)
            (store / file).write_bytes(data)
            ended = forked(partial(look, store, file, reader, was, whole))
            problem, is_found = ended.result or (ended.death, True)
            if number % MEND_EVERY == 0 and not problem:
                tally.counts["mended"] += 1
                ended = forked(partial(mend, store, cases, whole))
                problem = ended.death or ended.result
            tally.counts[f"in {kind}"] += 1
            tally.counts["no reader is touched"] += not is_found
            tally.trials += 1
            if problem:
                tally.fail(f"trial {number}, {file} {how}", problem)
    return tally.result()
