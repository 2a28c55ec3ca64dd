"""Have the equations compiled once on a machine, and loaded before anything is timed.

Machine code is kept by a hash of the sources of the physics and the versions of the libraries: a
change of either compiles it again, once. It has several parts; a run compiles those that it
needs. Within a part numba stores each function as soon as it is compiled, so that what was compiled
before a Ctrl-C is not compiled again.
"""

import hashlib
import os
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from compressor.cases import Case
from compressor.program import COMPILED, library_versions, machine_code_folder
from compressor.store import StoreError
from compressor.sweep.speed import slowness

SECONDS_TO_REMARK = 2.0  # s of compiling before a remark on it
COMPILING = (
    "compiling the equations, part {number} of {count}: {what}, about {seconds} s; "
    "each part once for each version of the program, and a stop loses nothing"
)
METHOD = "one method"  # a part that adds only a few functions
WHAT = {
    "auto": ("dry joints", 26),
    METHOD: ("solve.method {}", 1),
    "laws": ("oil, cards and other laws", 28),
    "features": ("mechanisms with features, such as play in the guide or an elastic rod", 50),
}  # by part: what it is, and the seconds that it takes speed.REFERENCE
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
    def parts(self) -> "dict[str, Needs]":
        """Return the parts of the equations that are needed, by name, each as needs of its own."""
        found: dict[str, Needs] = {}
        if self.plain:
            found |= {method: Needs((method,), plain=True) for method in self.methods}
        found |= {"laws": Needs(self.methods, laws=True)} if self.laws else {}
        found |= {"features": Needs(self.methods, features=True)} if self.features else {}
        return found

    @property
    def uncompiled(self) -> "dict[str, Needs]":
        """Return those of the parts that this machine has not compiled before."""
        return {part: alone for part, alone in self.parts.items() if not marker(part).exists()}


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


def load_with_remark(needs: Needs, text: str, remark: Callable[[str], None]) -> None:
    """Load as `load` does; remark on what takes long, in these words."""
    timer = threading.Timer(SECONDS_TO_REMARK, remark, [text])
    timer.daemon = True
    timer.start()
    began = time.monotonic()
    try:
        load(needs)
    finally:
        timer.cancel()
        timer.join()
    seconds = time.monotonic() - began
    if seconds > SECONDS_TO_REMARK:
        remark(f"compiled in {seconds:.0f} s")


def name_part(part: str) -> tuple[str, int]:
    """Return what a part of the equations is, in words, and the seconds of compiling it here."""
    what, seconds = WHAT.get(part, WHAT[METHOD])
    return what.format(part), max(1, round(seconds * slowness()))


def compile_seconds(needs: Needs) -> int:
    """Return seconds of compiling that are ahead of a run with these needs, on this machine."""
    return sum(name_part(part)[1] for part in needs.uncompiled)


def marker(part: str) -> Path:
    """Return the file that says that a part of the equations has been compiled on this machine."""
    # numba keeps machine code by the path of its sources: a copied folder brings none of use
    what = f"{library_versions(*LIBRARIES)} {COMPILED}"
    known = hashlib.sha256(what.encode()).hexdigest()[:8]
    return machine_code_folder() / f"compiled-{known}-{part}"


def is_interpreted() -> bool:
    """Return whether numba is told to compile nothing, as for debugging."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0").strip() not in ("", "0")


def compile_once(needs: Needs, remark: Callable[[str], None]) -> None:
    """Compile here what this machine has not compiled before, so that workers need but load it.

    Part by part: those that are finished when the program is stopped are not compiled again.
    Raises StoreError where machine code cannot be written.
    """
    if is_interpreted():
        remark("NUMBA_DISABLE_JIT is set: nothing is compiled, and runs take tens of times as long")
    ahead = needs.uncompiled
    for number, (part, alone) in enumerate(ahead.items(), 1):
        what, seconds = name_part(part)
        text = COMPILING.format(number=number, count=len(ahead), what=what, seconds=seconds)
        try:
            load_with_remark(alone, text, remark)
            path = marker(part)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        except OSError as error:
            remedy = "free some space there, or set NUMBA_CACHE_DIR to another folder"
            problem = f"machine code cannot be kept here: {error.strerror or error}"
            raise StoreError(machine_code_folder(), problem, remedy) from error
