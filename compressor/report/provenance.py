"""Where a report comes from: the program, the machine, the store and its studies."""

import datetime
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from compressor.cases import MODEL
from compressor.program import PROGRAM, library_versions
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
    """Return what made this page now, and the studies it is about."""
    versions = library_versions(*LIBRARIES)
    content = Provenance(
        program=f"{PROGRAM}, model {MODEL}",
        libraries=", ".join(f"{name} {version}" for name, version in versions.items()),
        platform=f"Python {platform.python_version()}, {platform.platform()}",
        results=Path(results).absolute(),
        command=command,
        written=datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        studies=studies,
    )
    return Section("provenance", "Where this comes from", "provenance.html", content)
