"""Have the equations compiled once on a machine, and loaded before anything is timed.

Machine code is kept by a hash of the sources of the physics and the versions of the libraries: a
change of either compiles it again, once. It has several parts; a run compiles those that it
needs. Within a part numba stores each function as soon as it is compiled, so that what was compiled
before a Ctrl-C is not compiled again.
"""

import hashlib
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from compressor.cases import Case
from compressor.program import COMPILED, library_versions, machine_code_folder
from compressor.store import StoreError

COMPILING = (
    "compiling the equations, for about {seconds} s, or longer on a slow or busy machine; once for "
    "each version of the program, and a stop loses nothing"
)
SECONDS = {"auto": 26, "laws": 28, "features": 50}  # of compiling, on an idle cloud core of 2026
LIBRARIES = ("numba", "llvmlite", "numpy")  # machine code is theirs


class Needs(NamedTuple):
    """The parts of the equations that some cases need.

    methods: of integration; plain: the default forces alone; laws: others beside them; features: a
    mechanism with any.
    """

    methods: tuple[str, ...] = ()
    plain: bool = False
    laws: bool = False
    features: bool = False

    @classmethod
    def of(cls, cases: Iterable[Case]) -> "Needs":
        methods, plain, laws, features = {"auto"}, False, False, False
        for case in cases:  # which may be made one by one
            methods.add(case.solve.method)
            features = features or case.needs_mechanism
            laws = laws or (case.chooses_forces and not case.needs_mechanism)
            plain = plain or not (case.chooses_forces or case.needs_mechanism)
        return cls(tuple(sorted(methods)), plain, laws, features)

    @property
    def uncompiled(self) -> "dict[str, Needs]":
        """Return the needed parts that this machine has not compiled before, as needs of theirs."""
        found = {m: Needs((m,), plain=True) for m in self.methods if self.plain}
        found |= {"laws": Needs(self.methods, laws=True)} if self.laws else {}
        found |= {"features": Needs(self.methods, features=True)} if self.features else {}
        return {part: alone for part, alone in found.items() if not marker(part).exists()}


def load(needs: Needs) -> None:
    """Load the equations, or compile them, by runs that are as short as can be."""
    from compressor.solve import measure  # needs numba: only where something is simulated

    solve = {"duration_rev": 0.01, "settle_rev": 0, "output_step_deg": 0.36}
    measure(Case.from_values({"solve": solve}))
    values: dict[str, object] = {"joint": "both", "clearance_mm": 0.1}
    kinds: list[dict[str, object]] = [{}] if needs.plain else []
    if needs.laws:
        kinds.append({"contact": {"law": "hertz"}})
    if needs.features:
        kinds.append({"guide": True})
    for kind in kinds:
        for method in needs.methods:
            measure(Case.from_values({**values, **kind, "solve": {**solve, "method": method}}))


def compile_seconds(needs: Needs) -> int:
    """Return seconds of compiling that are ahead of a run with these needs, about."""
    return sum(SECONDS.get(part, 1) for part in needs.uncompiled)


def marker(part: str) -> Path:
    """Return the file that says that a part of the equations has been compiled on this machine."""
    # numba keeps machine code by the path of its sources: a copied folder brings none of use
    what = f"{library_versions(*LIBRARIES)} {COMPILED}"
    known = hashlib.sha256(what.encode()).hexdigest()[:8]
    return machine_code_folder() / f"compiled-{known}-{part}"


def compile_once(needs: Needs, remark: Callable[[str], None]) -> None:
    """Compile here what this machine has not compiled before, so that workers need but load it.

    Part by part: those that are finished when the program is stopped are not compiled again.
    Raises StoreError where machine code cannot be written.
    """
    if os.environ.get("NUMBA_DISABLE_JIT", "0").strip() not in ("", "0"):
        remark("NUMBA_DISABLE_JIT is set: nothing is compiled, and runs take tens of times as long")
    if ahead := needs.uncompiled:
        remark(COMPILING.format(seconds=compile_seconds(needs)))
    try:
        for part, alone in ahead.items():
            load(alone)
            marker(part).parent.mkdir(parents=True, exist_ok=True)
            marker(part).touch()
    except OSError as error:
        remedy = "free some space there, or set NUMBA_CACHE_DIR to another folder"
        problem = f"machine code cannot be kept here: {error.strerror or error}"
        raise StoreError(machine_code_folder(), problem, remedy) from error
