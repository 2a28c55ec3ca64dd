"""Bit flips, truncations and zeroed blocks in the files of a store.

Each trial damages one file, other than the lock, which holds no data. `verify` must find it and
name it; every reader must give what the undamaged store gives, or say by an error or a warning that
it does not; the run that made the store must mend it. Nothing may crash.
"""

import random
import re
import shutil
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from chaos.common import (
    TIMINGS,
    case_files,
    command,
    complete_store,
    contents,
    forked,
    fresh,
    undrawn,
)
from chaos.tally import Tally
from compressor.store import writer
from compressor.store.files import StoreError, StoreWarning
from compressor.store.reader import open_study, read_store

READERS = ("status", "status --json", "show", "show --json", "report")
PROVENANCE = re.compile(r"<dl>.*?</dl>", re.DOTALL)  # when a page was written, of what
MEND_EVERY = 5  # trials


def damage(data: bytes, rng: random.Random) -> tuple[str, bytes]:
    """What is done to a file's bytes, and what they become; never the same."""
    while True:
        new = bytearray(data)
        at = rng.randrange(len(new))
        how = rng.choice(("bits", "truncated", "zeroed", "zeroed end", "swapped", "grown"))
        if how == "bits":
            for place in {at, *(rng.randrange(len(new)) for _ in range(rng.choice((0, 0, 1, 9))))}:
                new[place] ^= 1 << rng.randrange(8)
        elif how == "truncated":
            del new[rng.choice((at, 0, len(new) - 1)) :]
        elif how == "zeroed":
            block = rng.choice((1, 16, 512, 4096))
            at -= at % block
            new[at : at + block] = bytes(len(new[at : at + block]))
        elif how == "zeroed end":
            new[at:] = bytes(len(new) - at)
        elif how == "swapped":
            other = rng.randrange(len(new))
            size = min(512, len(new) - max(at, other))
            new[at : at + size], new[other : other + size] = (
                new[other : other + size],
                new[at : at + size],
            )
        else:
            new += rng.randbytes(rng.choice((1, 100)))
        if bytes(new) != data and len(new) <= len(data) + 100:
            return f"{how} at {at}", bytes(new)


class Campaign:
    """The trials of `campaign`: an undamaged store and what it gives."""

    def __init__(self, tally: Tally, folder: Path):
        self.tally, self.folder = tally, folder
        self.complete = complete_store(folder)
        self.cases = case_files(folder / "cases")
        self.files = sorted(
            path.relative_to(self.complete)
            for path in self.complete.rglob("*")
            if path.is_file() and path.name != writer.LOCK_NAME
        )
        self.whole = contents(self.complete)
        self.keys = sorted(read_store(self.complete).keys())
        self.said: dict[tuple[str, str], Any] = {}

    def undamaged(self, reader: str, key: str) -> Any:
        """What a command says of the undamaged store; it is called once."""
        if (reader, key) not in self.said:
            self.said[reader, key] = forked(lambda: self.say(reader, self.complete, key)).result
            assert self.said[reader, key] is not None
        return self.said[reader, key]

    def say(self, reader: str, store: Path, key: str) -> Any:
        """What a command says of a store, and of the job of a key."""
        undrawn()
        words = reader.split()
        if words[0] == "show":
            words.insert(1, key)
        if words[0] != "report":
            said = command(*words, "-r", store)
            return said._replace(out=said.out.replace(str(store), "STORE"))
        page = store.parent / "page"
        said = command(*words, "-r", store, "-o", page)
        text = (page / "index.html").read_text(encoding="utf-8") if said.code == 0 else ""
        shutil.rmtree(page, ignore_errors=True)
        return said._replace(out=PROVENANCE.sub("", text.replace(str(store), "STORE")))

    def trial(self, number: int, rng: random.Random) -> None:
        """Damage a file, and have all look at it."""
        kind = rng.choice(sorted({path.parent.name for path in self.files}))
        file = rng.choice([path for path in self.files if path.parent.name == kind])
        how, data = damage((self.complete / file).read_bytes(), rng)
        label = f"trial {number}, {file} {how}"
        with fresh(self.folder, "trial") as place:
            store = place / "store"
            shutil.copytree(self.complete, store)
            (store / file).write_bytes(data)
            self.tally.counts[f"in {kind}"] += 1
            reader, key = rng.choice(READERS), rng.choice(self.keys)
            was = self.undamaged(reader, key)
            mend = number % MEND_EVERY == 0
            self.tally.counts["mended"] += mend

            def looked_at() -> str:
                return (
                    self.verified(store, file)
                    or self.told(was, self.say(reader, store, key))
                    or self.opened(store)
                    or (self.mended(store) if mend else "")
                )

            ended = forked(looked_at)
            if ended.death or ended.result:
                self.tally.fail(label, ended.death or ended.result)
        self.tally.trials += 1

    def verified(self, store: Path, file: Path) -> str:
        """What is wrong with what `compsim verify` says, or ""."""
        said = command("verify", "-r", store)
        if said.code != 5 or str(store / file) not in said.out:
            return f"not found: {said}"
        if file.parent.name != "studies" and "  job " not in said.out:
            return f"no job is named: {said}"
        return ""

    def told(self, was: Any, said: Any) -> str:
        """What is wrong with what a reader says, who said something else before, or ""."""
        if said.code not in (0, 5) or "Traceback" in said.err:
            return str(said)
        silent_about_it = said.code == 0 and "damaged" not in said.err
        if silent_about_it and said.out != was.out:
            return f"a silent difference: {said} was {was}"
        return ""

    def opened(self, store: Path) -> str:
        """What differs in `open_study` without an error or a warning, or ""."""
        for study in ("series", "metrics", "failing"):
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("error", UserWarning)
                    data = open_study(store, study).load()
            except (StoreError, StoreWarning):
                continue
            for name in {n.partition("/")[2] for n in self.whole if n.startswith(f"{study}/")}:
                values = data[name].values if name in data.variables else np.zeros(0)
                plain = values.tolist() if values.dtype.kind in "OU" else values.tobytes()
                if name not in TIMINGS and plain != self.whole[f"{study}/{name}"][2]:
                    return f"silent: {name} of {study}"
        return ""

    def mended(self, store: Path) -> str:
        """What a run of the case files leaves damaged, or ""."""
        said = command("run", *self.cases, "-r", store, "-j", 1)
        if said.code != 3:  # one job is meant to fail
            return str(said)
        found = contents(store)
        return str([name for name in self.whole if found.get(name) != self.whole[name]] or "")


def campaign(trials: int, seed: int, folder: Path) -> dict[str, Any]:
    """Damage as many files, one a trial."""
    what = "bit flips, truncations, zeroed blocks in stored files"
    tally = Tally(what, seed, ("mended",))
    tried = Campaign(tally, folder)
    for number in range(trials):
        tried.trial(number, random.Random(f"{seed} {number}"))
    return tally.result()
