"""Where a report comes from: the program, the machine, the store and its studies."""

import datetime
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import compressor
from compressor.cases import MODEL_VERSION
from compressor.report.page import Section
from compressor.store import Folder, StoredStudy

LIBRARIES = ("numpy", "scipy", "numba", "xarray", "h5py", "matplotlib")


@dataclass(frozen=True)
class Provenance:
    """What made a page, and the studies it is about; `written` is in UTC."""

    program: str
    libraries: str
    platform: str
    results: Path
    command: str
    written: str
    studies: Sequence[StoredStudy]


def provenance_section(studies: Sequence[StoredStudy], results: Folder, command: str) -> Section:
    """What made this page now, and the studies it is about."""
    content = Provenance(
        program=f"compsim {compressor.__version__}, model {MODEL_VERSION}",
        libraries=", ".join(f"{name} {metadata.version(name)}" for name in LIBRARIES),
        platform=f"Python {platform.python_version()}, {platform.platform()}",
        results=Path(results).absolute(),
        command=command,
        written=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        studies=studies,
    )
    return Section("provenance", "Where this comes from", "provenance.html", content)
