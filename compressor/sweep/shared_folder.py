"""Time series of jobs that run on other machines: stored there if the folder is ours, or here."""

import contextlib
import os
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from compressor.cases import Case
from compressor.outcome import Outcome
from compressor.store import StoreError, publish, store_series
from compressor.sweep.run_job import Carried, run_job


def run_near(place: Path, token: Path, text: str, case: Case) -> Outcome | Carried | StoreError:
    """Run a case and store its time series in a place, if that is the same folder here."""
    return run_job(place if case.output.keep == "series" and sees(token, text) else None, case)


def sees(token: Path, text: str) -> bool:
    """Return whether a file of the run's is there, and others may be written beside it."""
    try:
        return token.read_text() == text and os.access(token.parent, os.W_OK)
    except OSError:
        return False


@contextlib.contextmanager
def visible(place: Path) -> Iterator[tuple[Path, str]]:
    """A file, and its text, by which a worker knows a place for ours, not one of the same name."""
    text = uuid.uuid4().hex
    token = place / "jobs" / f".{text}.tmp"
    publish(token, text.encode())
    try:
        yield token, text
    finally:
        with contextlib.suppress(OSError):
            token.unlink()


def received(place: Path, result: Any) -> Any:
    """Return a result from a worker, its time series stored if they came with it."""
    if not isinstance(result, Carried):
        return result
    outcome, data = result
    assert outcome.series is not None
    try:
        store_series(place, outcome.key, outcome.series, data)
    except StoreError as error:
        return error
    return outcome
