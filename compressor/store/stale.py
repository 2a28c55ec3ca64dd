"""Stored jobs of which this version of the program would tell more, or other numbers.

A key holds the version of the model, and results of one version agree within their error bars but
for what a revision has mended (`compressor.cases.revisions`): a job that another version of the
program has made is not stale for that alone.
"""

import json
from collections.abc import Iterable

import numpy as np

from compressor.cases import SUSPECT, changes_since
from compressor.metrics import METRICS, ROD_LOAD
from compressor.store.rows import Rows
from compressor.store.segment import GIVEN

WORDS = ("promise", "regime")  # that rows of before November 2026 do not have


def stale(rows: Rows, keys: Iterable[str]) -> dict[str, set[str]]:
    """Return the stored jobs, of those with some keys, by what a run of this version would give.

    A job may stand under several metrics. Jobs that this version has made are none of them,
    whatever metric has no value there.
    """
    found: dict[str, set[str]] = {}
    positions = rows.find(list(keys))
    positions = positions[positions >= 0]
    old = positions[rows.columns["given"][positions] != GIVEN.encode()]
    for name, lack in _lacking(rows, old).items() if len(old) else ():
        if lack.any():
            found[name] = {key.decode() for key in rows.columns["key"][old[lack]]}
    for position in old.tolist():
        for what in _changed(rows, position):
            found.setdefault(f"this version's {what}", set()).add(
                rows.columns["key"][position].decode()
            )
    return found


def _changed(rows: Rows, position: int) -> list[str]:
    """Return what a revision of the model has changed since a job was stored."""
    if not SUSPECT.search(rows.text(position)):
        return []
    attributes = rows.attributes(position)
    try:
        values = json.loads(str(attributes.get("case", "")))
        return changes_since(str(attributes.get("model_version", "")), values)
    except (ValueError, KeyError, TypeError, AttributeError):  # of a case that no version has
        return []


def _lacking(rows: Rows, positions: np.ndarray) -> dict[str, np.ndarray]:
    """Return which rows lack what any run of this version gives that ends well, by name."""
    good = rows.words["status"][positions] == "ok"
    signals = rows.words["signals"][positions] == "yes"
    found = {}
    for name in (*METRICS, *ROD_LOAD):
        absent = np.isnan(rows.numbers[name][positions])
        asked = good & signals if name in ROD_LOAD else good
        found[name] = asked & absent.all(axis=tuple(range(1, absent.ndim)))
    return found | {name: good & (rows.words[name][positions] == "") for name in WORDS}
