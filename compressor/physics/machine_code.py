"""Where machine code is kept on disk, in a folder named by a hash of all sources here.

Apart from `_jit`, so that it can be asked for without loading numba.
"""

import hashlib
import os
import shutil
from pathlib import Path

HERE = Path(__file__).parent


def sources_hash() -> str:
    """Hash of the compiled modules' sources."""
    digest = hashlib.sha256()
    for path in sorted(HERE.glob("*.py")):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Where machine code is kept: beside the sources, or under the user's cache folder."""
    beside = HERE / "__pycache__"
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "compsim"
    base = beside if os.access(beside if beside.exists() else HERE, os.W_OK) else user
    return base / f"numba-{sources_hash()}"


def discard_old(folder: Path) -> None:
    """Remove the machine code of other sources, when that of the present ones is first made."""
    if not folder.exists():
        for old in folder.parent.glob("numba-*"):
            shutil.rmtree(old, ignore_errors=True)
