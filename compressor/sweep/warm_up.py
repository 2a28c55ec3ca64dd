"""Have the equations compiled once on a machine, and loaded before anything is timed.

Machine code is kept by a hash of the sources of the physics and the versions of the libraries: a
change of either compiles anew, once.
"""

import hashlib
import threading
import time
from collections.abc import Callable, Iterable
from typing import NamedTuple

from compressor.cases import Case
from compressor.program import COMPILED, library_versions, machine_code_folder

PATIENCE = 2.0  # s of compiling before a remark on it
COMPILING = "compiling the equations, about a minute: once for each version of the program"
LIBRARIES = ("numba", "llvmlite", "numpy")  # machine code is theirs


class Needs(NamedTuple):
    """What some cases need of the equations: methods, and twins for a horizon."""

    methods: tuple[str, ...] = ()
    horizon: bool = False

    @classmethod
    def of(cls, cases: Iterable[Case]) -> "Needs":
        solves = [case.solve for case in cases]
        methods = tuple(sorted({"auto"} | {solve.method for solve in solves}))
        return cls(methods, any(solve.horizon is True for solve in solves))


def load(needs: Needs) -> None:
    """Load the equations, or compile them, by runs that are as short as can be."""
    from compressor.solve import measure  # needs numba: only where something is simulated

    solve = {"duration_rev": 0.01, "settle_rev": 0, "output_step_deg": 0.36}
    measure(Case.from_values({"solve": solve}))
    hows: list[dict[str, object]] = [{"method": method} for method in needs.methods]
    if needs.horizon:
        hows.append({"horizon": True})
    for how in hows:
        values = {"joint": "both", "clearance_mm": 0.1, "solve": solve | how}
        measure(Case.from_values(values))


def load_telling(needs: Needs, remark: Callable[[str], None]) -> None:
    """`load`; what takes long is told."""
    timer = threading.Timer(PATIENCE, remark, [COMPILING])
    timer.daemon = True
    timer.start()
    began = time.monotonic()
    try:
        load(needs)
    finally:
        timer.cancel()
        timer.join()
    seconds = time.monotonic() - began
    if seconds > PATIENCE:
        remark(f"compiled in {seconds:.0f} s")


def compile_once(needs: Needs, remark: Callable[[str], None]) -> None:
    """Compile here what this machine has not compiled before, so that workers need but load it."""
    # numba keeps machine code by the path of its sources: a copied folder brings none of use
    what = f"{library_versions(*LIBRARIES)} {COMPILED}"
    known = hashlib.sha256(what.encode()).hexdigest()[:8]
    parts = [*needs.methods, *(["horizon"] if needs.horizon else [])]
    compiled = [machine_code_folder() / f"compiled-{known}-{part}" for part in parts]
    if not all(path.exists() for path in compiled):
        load_telling(needs, remark)
        for path in compiled:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
