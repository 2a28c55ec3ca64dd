"""Have the equations compiled once on a machine, and loaded before anything is timed.

Machine code is kept by a hash of the sources of the physics and the versions of the libraries: a
change of either compiles anew, once.
"""

import hashlib
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from compressor.cases import Case
from compressor.program import COMPILED, library_versions, machine_code_folder

PATIENCE = 2.0  # s of compiling before a remark on it
COMPILING = "compiling the equations, about a minute: once for each version of the program"
LANES = {1: "big_end", 2: "small_end", 3: "both"}  # scenes of which runs march side by side
FEWEST, MANY = 16, 4000  # jobs of a scene that lanes are loaded for, and compiled for
SEEN = 1000  # jobs that are looked at for it
LIBRARIES = ("numba", "llvmlite", "numpy")  # machine code is theirs


class Needs(NamedTuple):
    """What some cases need of the equations: methods, twins for a horizon, scenes in lanes, laws
    other than the default ones, a mechanism with features.
    """

    methods: tuple[str, ...] = ()
    horizon: bool = False
    lanes: tuple[int, ...] = ()
    laws: bool = False
    features: bool = False

    @classmethod
    def of(cls, cases: Iterable[Case]) -> "Needs":
        methods, twins, laws, features = {"auto"}, False, False, False
        for case in cases:  # which may be made one by one
            methods.add(case.solve.method)
            twins = twins or case.solve.horizon is True
            features = features or case.has_features
            laws = laws or (case.chooses_laws and not case.has_features)
        return cls(tuple(sorted(methods)), twins, laws=laws, features=features)

    @property
    def parts(self) -> list[str]:
        """The parts of the equations that are needed, by name."""
        lanes = [f"lanes-{of}" for of in self.lanes]
        twins = ["", *["-horizon"] * self.horizon]
        kinds = [*["laws"] * self.laws, *["features"] * self.features]
        more = [kind + twin for kind in kinds for twin in twins]
        return [*self.methods, *["horizon"] * self.horizon, *lanes, *more]

    def with_lanes(self, cases: Sequence[Case]) -> "Needs":
        """With the scenes of which there are jobs enough to march side by side.

        Results are the same to the bit without: where no lanes have been compiled yet, many more
        jobs are asked for than where they need but be loaded.
        """
        step = max(1, len(cases) // SEEN)
        looked = (cases[i] for i in range(0, len(cases), step))
        seen = Counter(case.joint for case in looked if case.is_plain)
        least = {of: FEWEST if marker(f"lanes-{of}").exists() else MANY for of in LANES}
        many = (of for of, joint in LANES.items() if seen[joint] * step >= least[of])
        return self._replace(lanes=tuple(many))


def load(needs: Needs) -> None:
    """Load the equations, or compile them, by runs that are as short as can be."""
    from compressor.solve import (
        measure,
        side_by_side,
    )  # needs numba: only where something is simulated

    solve = {"duration_rev": 0.01, "settle_rev": 0, "output_step_deg": 0.36}
    measure(Case.from_values({"solve": solve}))
    hows: list[dict[str, object]] = [{"method": method} for method in needs.methods]
    if needs.horizon:
        hows.append({"horizon": True})
    if needs.lanes:
        short = {"clearance_mm": 0.1, "solve": solve}
        cases = [Case.from_values({"joint": joint, **short}) for joint in LANES.values()]
        side_by_side(cases, needs.lanes)
    values: dict[str, object] = {"joint": "both", "clearance_mm": 0.1}
    kinds: list[dict[str, object]] = [{}]
    if needs.laws:
        kinds.append({"contact": {"law": "hertz"}})
    if needs.features:
        kinds.append({"guide": True})
    for kind in kinds:
        for how in hows:
            measure(Case.from_values({**values, **kind, "solve": solve | how}))


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


def marker(part: str) -> Path:
    """The file that says that a part of the equations has been compiled on this machine."""
    # numba keeps machine code by the path of its sources: a copied folder brings none of use
    what = f"{library_versions(*LIBRARIES)} {COMPILED}"
    known = hashlib.sha256(what.encode()).hexdigest()[:8]
    return machine_code_folder() / f"compiled-{known}-{part}"


def compile_once(needs: Needs, remark: Callable[[str], None]) -> None:
    """Compile here what this machine has not compiled before, so that workers need but load it."""
    compiled = [marker(part) for part in needs.parts]
    if not all(path.exists() for path in compiled):
        load_telling(needs, remark)
        for path in compiled:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
