"""A chain: values one after the other, each from the last one's end, in a file that can go on.

    RESULTS/regimes/STUDY/CHAIN.nc    the values that are finished, in the order of their running

CHAIN is a hash of all that decides the numbers. The file is rewritten every few seconds and is
whole or absent; a chain that was interrupted goes on from the last value in it, and ends in the
same numbers to the bit.
"""

import hashlib
import itertools
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from compressor.analysis import MODES
from compressor.cases import MODEL_VERSION, Case
from compressor.metrics import JOINTS
from compressor.program import PROGRAM
from compressor.store import Folder, StoreError, read_dataset, write_dataset
from compressor.studies.regimes.group import Regimes
from compressor.studies.regimes.values import COORDINATES, NUMBERS, TEXTS, Row, empty, run_value

FOLDER = "regimes"
SECONDS_BETWEEN_WRITES = 2.0  # s between two writings of what is finished
REMEDY = "delete it: the same command makes it again"
SCHEMA = 2  # of a chain's numbers: a change of what they mean makes chains again


@dataclass(frozen=True)
class Chain:
    """One machine followed one way: its cases in the order of their running."""

    study: str
    request: Regimes
    direction: str
    cases: tuple[Case, ...]

    @classmethod
    def of(cls, study: str, request: Regimes, direction: str, cases: Sequence[Case]) -> "Chain":
        """Return the chain of cases that are given going up."""
        ordered = cases if direction == "up" else cases[::-1]
        return cls(study, request, direction, tuple(ordered))

    @property
    def values(self) -> list[float]:
        """Return the values of the followed key, in the order of running."""
        up = self.request.values
        return up if self.direction == "up" else up[::-1]

    @cached_property
    def key(self) -> str:
        """Return the hash of what decides the numbers: cases, start, request."""
        identity = [case.key for case in self.cases], self.request.plain(), self.direction
        text = json.dumps([identity, SCHEMA], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:20]

    def path(self, folder: Folder) -> Path:
        """Return the path of its file."""
        return Path(folder) / FOLDER / self.study / f"{self.key}.nc"


class ChainTask(NamedTuple):
    """A chain to be run in a folder of results; `rerun`: from its first failed value on."""

    folder: str
    chain: Chain
    rerun: bool = False


class ChainEnd(NamedTuple):
    """How a chain ended: how many values it has, and the failed ones with reason and detail."""

    values: int
    failed: tuple[tuple[float, str, str], ...]


def run_chain(task: ChainTask) -> ChainEnd | StoreError:
    """Run what a chain's file does not hold yet, in a worker.

    A StoreError is returned: it ends the run, while an exception is a failure of the chain.
    """
    chain, path = task.chain, task.chain.path(task.folder)
    try:
        rows = read_kept_rows(chain, path)
        if task.rerun:
            rows = [*itertools.takewhile(lambda row: row["status"] == "ok", rows)]
        written, stored = time.monotonic(), len(rows)
        for case in chain.cases[len(rows) :]:
            rows.append(run_value(case, last_state(rows), chain.request))
            if time.monotonic() - written > SECONDS_BETWEEN_WRITES:
                write_dataset(path, chain_dataset(chain, rows))
                written, stored = time.monotonic(), len(rows)
        if stored < len(rows) or task.rerun:
            write_dataset(path, chain_dataset(chain, rows))
    except StoreError as error:
        return error
    return chain_end(chain, rows)


def chain_end(chain: Chain, rows: Sequence[Row]) -> ChainEnd:
    """Return the numbers of a chain's values, and its failed ones."""
    paired = zip(chain.values, rows, strict=False)
    bad = [(v, row["reason"], row["detail"]) for v, row in paired if row["status"] != "ok"]
    return ChainEnd(len(rows), tuple(bad))


def last_state(rows: Sequence[Row]) -> np.ndarray | None:
    """Return the state that the next value begins from; None: from its own start."""
    state = rows[-1]["end_state"] if rows else None
    return None if state is None or np.isnan(state).any() else state


def chain_dataset(chain: Chain, rows: Sequence[Row]) -> xr.Dataset:
    """Return the rows of a chain, with the dimension `value` in the order of running."""
    found: dict[str, tuple] = {}
    for name, phrase in TEXTS.items():
        texts = np.array([row[name] for row in rows], object)
        found[name] = ("value",), texts, {"long_name": phrase}
    for name, (dims, unit, phrase) in NUMBERS.items():
        shape = np.shape(empty(chain.request, chain.cases[0])[name])
        numbers = np.array([row[name] for row in rows], float).reshape(len(rows), *shape)
        found[name] = ("value", *dims), numbers, {"units": unit, "long_name": phrase}
    units = {"units": chain.request.unit, "long_name": chain.request.over}
    value = np.array(chain.values[: len(rows)], float)
    attrs: dict[str, Any] = {
        "key": chain.key,
        "study": chain.study,
        "direction": chain.direction,
        "regimes": json.dumps(chain.request.plain()),
        "case": chain.cases[0].attributes()["case"],
        "program": PROGRAM,
        "model_version": MODEL_VERSION,
    }
    return xr.Dataset(found, {"value": ("value", value, units), **labels()}, attrs)


def labels() -> dict[str, tuple]:
    """Return the coordinates of the dimensions that every chain has."""
    return {
        "joint": ("joint", list(JOINTS), {"long_name": "joint of the rod"}),
        "coordinate": (
            "coordinate",
            list(COORDINATES),
            {"long_name": "coordinate of a Poincaré point"},
        ),
        "mode": ("mode", list(MODES), {"long_name": "contact mode"}),
    }


def read_chain(chain_path: Path) -> xr.Dataset:
    """Return a stored chain. Raises StoreError where the file is none."""
    return read_dataset(chain_path, REMEDY)


def read_kept_rows(chain: Chain, path: Path) -> list[Row]:
    """Return the rows of an earlier run, none where there is no file. Raises StoreError."""
    if not path.exists():
        return []
    found = read_chain(path)
    names = [*TEXTS, *NUMBERS]
    if found.attrs.get("key") != chain.key or not {*names} <= {*found.variables}:
        raise StoreError(path, "is not the chain that its name says", REMEDY)
    columns = {name: found[name].values for name in names}
    return [
        {name: str(column[n]) if name in TEXTS else column[n] for name, column in columns.items()}
        for n in range(found.sizes["value"])
    ]
