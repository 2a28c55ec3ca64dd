"""Have the equations compiled once on a machine, and loaded before anything is timed.

Machine code is kept by a hash of the sources of the physics and the versions of the libraries: a
change of either compiles it again, once. It has several parts; a run compiles those that it
needs. Within a part numba stores each function as soon as it is compiled, so that what was compiled
before a Ctrl-C is not compiled again.
"""

import contextlib
import hashlib
import os
import signal
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

from compressor.cases import Case
from compressor.program import COMPILED, copy_beside, library_versions, machine_code_folder
from compressor.store import StoreError
from compressor.sweep.pool import cores
from compressor.sweep.worker import settle

COMPILING = (
    "compiling the equations, for about {seconds} s, or longer on a slow or busy machine; once for "
    "each version of the program, and a stop loses nothing"
)
# of compiling by two processes, on an idle cloud machine of 2026; by one half as much again
SECONDS = {"plain": 17, "laws": 20, "features": 34}
NO_JIT = os.environ.get("NUMBA_DISABLE_JIT", "0").strip() not in ("", "0")
LIBRARIES = ("numba", "llvmlite", "numpy")  # machine code is theirs
# what a case has that needs a part: the default forces alone; others; a mechanism with any feature
KINDS: dict[str, dict[str, Any]] = {
    "plain": {}, "laws": {"contact": {"law": "hertz"}}, "features": {"guide": True}
}  # fmt: skip


class Part(NamedTuple):
    """A part of the equations: one of `KINDS`, a method of integration, with the body or without.

    The body has no equations to compile, but it needs libraries that take long to load.
    """

    kind: str
    method: str = "auto"
    body: bool = False


def needed_parts(cases: Iterable[Case]) -> tuple[Part, ...]:
    """Return the parts of the equations that some cases need."""
    found: set[Part] = set()
    for case in cases:  # which may be made one by one
        others = "laws" if case.chooses_forces else "plain"
        kind = "features" if case.needs_mechanism else others
        found |= {Part(kind, method, bool(case.body)) for method in ("auto", case.solve.method)}
    return tuple(sorted(found))


def uncompiled(parts: Iterable[Part]) -> list[Part]:
    """Return those of some parts that this machine has not compiled before.

    None where compiling is switched off.
    """
    is_off = NO_JIT or os.environ.get("COMPSIM_JIT") == "0"
    return [part for part in parts if not (is_off or marker(part).exists())]


def load(parts: Iterable[Part], beside: bool = False) -> None:
    """Load the equations, or compile them, by runs that are as short as can be.

    beside: a copy of this process compiles a part of them meanwhile. One that waits for a lock of a
    thread that is not in it does no harm: all that it has not finished is compiled here.
    """
    from compressor.solve import measure  # needs numba: only where something is simulated

    solve = {"duration_rev": 0.01, "settle_rev": 0, "output_step_deg": 0.36}
    cases = [Case.from_values({"solve": solve})] + [
        Case.from_values(
            {"joint": "both", "clearance_mm": 0.1, "solve": {**solve, "method": method}}
            | KINDS[kind]
            | ({"body": {"start": "rest"}} if body else {})
        )
        for kind, method, body in parts
    ]
    with copy_beside(compile_quietly, cases[-1]) if beside else contextlib.nullcontext():
        for case in cases:
            measure(case)


def compile_quietly(case: Case) -> None:
    """Compile parts of the march of a case; what goes wrong the other process meets and tells."""
    from compressor.solve import compile_parts

    settle()
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    with contextlib.suppress(Exception):
        compile_parts(case)


def compile_seconds(parts: Iterable[Part], processes: int) -> int:
    """Return seconds of compiling that are ahead of a run that needs these parts, about."""
    ahead = {part._replace(body=False) for part in uncompiled(parts)}
    seconds = sum(SECONDS[part.kind] if part.method == "auto" else 1 for part in ahead)
    return seconds if processes > 1 else round(1.5 * seconds)


def marker(part: Part) -> Path:
    """Return the file that says that a part of the equations has been compiled on this machine."""
    # numba keeps machine code by the path of its sources: a copied folder brings none of use
    what = f"{library_versions(*LIBRARIES)} {COMPILED}"
    known = hashlib.sha256(what.encode()).hexdigest()[:8]
    return machine_code_folder() / f"compiled-{known}-{part.kind}-{part.method}"


def compile_once(parts: Iterable[Part], remark: Callable[[str], None], processes: int = 1) -> None:
    """Compile here what this machine has not compiled before, so that workers need but load it.

    Part by part: those that are finished when the program is stopped are not compiled again.
    processes: how many may compile. Raises StoreError where machine code cannot be written.
    """
    if NO_JIT:
        remark("NUMBA_DISABLE_JIT is set: nothing is compiled, and runs take tens of times as long")
    ahead, processes = uncompiled(parts), min(processes, cores())
    if ahead:
        remark(COMPILING.format(seconds=compile_seconds(ahead, processes)))
    try:
        for part in ahead:
            load((part,), processes > 1)
            marker(part).parent.mkdir(parents=True, exist_ok=True)
            marker(part).touch()
    except OSError as error:
        remedy = "free some space there, or set NUMBA_CACHE_DIR to another folder"
        problem = f"machine code cannot be kept here: {error.strerror or error}"
        raise StoreError(machine_code_folder(), problem, remedy) from error
