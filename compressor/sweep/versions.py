"""The programs that decide the bits of a result, and where those of two machines differ."""

import functools
import os
import platform
import sys

from compressor.cases import MODEL_VERSION
from compressor.program import COMPILED, VERSION, library_versions, sources_hash

LIBRARIES = ("numpy", "scipy", "numba", "llvmlite")
REMEDY = "have the same programs on all machines, then start the cluster's workers again"


@functools.cache
def versions() -> dict[str, str]:
    """Return what decides the bits of a result: the programs here, and their versions."""
    return {
        "compsim": VERSION,
        "model": MODEL_VERSION,
        "sources of compsim": sources_hash(COMPILED.parent),
        "Python": f"{sys.version_info[0]}.{sys.version_info[1]}",
        "machine": platform.machine(),
        "C library": " ".join(platform.libc_ver()),
        "COMPSIM_JIT": os.environ.get("COMPSIM_JIT", "1"),
    } | library_versions(*LIBRARIES)


def differences(ours: dict[str, str], theirs: dict[str, str]) -> str:
    """Return where versions differ, and what to do about it; empty if they agree."""
    different = ", ".join(
        f"{name} {theirs.get(name, 'unknown')} in place of {ours.get(name, 'unknown')}"
        for name in ours | theirs
        if ours.get(name) != theirs.get(name)
    )
    return f"has {different}; {REMEDY}" if different else ""
