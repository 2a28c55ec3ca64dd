"""Time other tools and ours in turn on one problem, at equal or better error (make peers).

Writes a small JSON file. All run on one core, in rounds: each tool, then ours at the loosest
tolerance whose error is no greater than that tool's. Nothing here has threads or waits, so that
CPU time is the wall time of a core without other work, and says more on a busy machine. A call
starts from the problem's numbers and ends with the crosshead's acceleration on the output grid of
0.1 ms; ours is the whole `simulate(case)`, with all its series, metrics and energy balance, the
kernel's own seconds beside it. Errors are against the reference of reference.py. What is not
installed, or fails, is a row with its reason. At last one evaluation of the equations is timed
(peers/evaluation.py).
"""

import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from statistics import median
from typing import NamedTuple

import reference
from peers import evaluation, multibody, notebook, soda
from peers.mechanism import DURATION, SCENES, case_values, error, loosest, output_grid, params
from result_pages import keep, provenance, run_campaign

from compressor.cases.case import Case
from compressor.solve.simulate import simulate

LADDER = (1e-3, 5e-4, 3e-4, 2e-4, 1e-4, 7e-5, 5e-5, 3e-5, 2e-5, 1.4e-5, 1e-5, 7e-6, 5e-6, 2e-6,
          1e-6)  # fmt: skip
ROUNDS = 5
LEAST_CPU = 0.2  # s of a contest's round: one call of some milliseconds says little
TIGHT = 1e-9  # tolerance of Exudyn's run that verifies ours


class Peer(NamedTuple):
    """A tool with its settings; `run(scene)` gives the crosshead's acceleration."""

    tool: str
    settings: str
    run: Callable


PEERS = (
    Peer("SciPy LSODA, plain Python", "rtol 1e-5",
         partial(notebook.acceleration, rtol=1e-5)),
    Peer("Exudyn DOPRI5, symbolic functions", "rtol 1e-6",
         partial(multibody.acceleration, rtol=1e-6)),
    Peer("Exudyn generalised-alpha", "h = 1e-5 s", partial(multibody.acceleration, step=1e-5)),
    Peer("LSODA in C++ (numbalsoda), numba", "rtol 1e-6", partial(soda.acceleration, rtol=1e-6)),
)  # fmt: skip


def timed(call):
    """What a call returns, its CPU time and its wall time (s)."""
    wall, cpu = time.perf_counter(), time.process_time()
    return call(), time.process_time() - cpu, time.perf_counter() - wall


def ours(scene, rtol):
    """Our run of a scene, the `Case` made anew."""
    return simulate(Case.from_values(case_values(scene, rtol=rtol, error_bars=False)))


def first_call(peer, scene, truth):
    """The error of a peer's first run of a scene, or the reason why there is none."""
    try:
        return error(peer.run(scene), truth)
    except Exception as fault:  # any failure of a foreign tool is a row
        return f"{type(fault).__name__}: {fault}"


@dataclass
class Contest:
    """A peer and ours in one scene, and the CPU and wall seconds of each round."""

    peer: Peer
    scene: str
    error: float
    rtol: float | None  # ours
    theirs: list[tuple] = field(default_factory=list)
    ours: list[float] = field(default_factory=list)
    kernel: list[float] = field(default_factory=list)  # wall seconds of our solver alone

    def round(self):
        """Time both, the first one by turns; short calls again until they took LEAST_CPU."""
        began = time.process_time()
        while True:
            for one in (self.time_peer, self.time_ours)[:: -1 if len(self.theirs) % 2 else 1]:
                one()
            if time.process_time() - began > LEAST_CPU:
                break

    def time_peer(self):
        self.theirs.append(timed(lambda: self.peer.run(self.scene))[1:])

    def time_ours(self):
        if self.rtol is not None:
            found, cpu, _ = timed(lambda: ours(self.scene, self.rtol))
            self.ours.append(cpu)
            self.kernel.append(float(found["seconds"]))

    def row(self, our_errors):
        """Medians and ratios."""
        cpu, wall = map(median, zip(*self.theirs, strict=True))
        found = {"seconds": cpu, "error": self.error}
        if self.rtol is None:
            return found | {"reason": "none of our tolerances is as exact"}
        our_cpu = median(self.ours)
        return found | {
            "our_rtol": self.rtol,
            "our_error": our_errors[self.rtol],
            "our_seconds": our_cpu,
            "ratio": cpu / our_cpu,
            "kernel_wall_ratio": wall / median(self.kernel),
        }


def agreement(scene, truth):
    """How far ours at 1e-11 lies from the reference, and Exudyn at TIGHT from ours."""
    best = ours(scene, 1e-11)["acceleration"].values
    found = {"scene": scene, "ours_to_reference": error(best, truth)}
    try:
        tight = multibody.acceleration(scene, rtol=TIGHT)
    except Exception as fault:
        return found | {"reason": f"{type(fault).__name__}: {fault}"}
    return found | {"exudyn_rtol": TIGHT, "exudyn_to_ours": error(tight, best)}


def contests(scene, truth, our_errors):
    """The scene's contests, and the rows of the peers that cannot take part."""
    taking_part, rows = [], []
    for peer in PEERS:
        tried = first_call(peer, scene, truth)
        if isinstance(tried, str):
            print(f"{scene}: {peer.tool}: {tried}", file=sys.stderr)
            rows.append({"tool": peer.tool, "settings": peer.settings, "scene": scene,
                         "reason": tried})  # fmt: skip
            continue
        taking_part.append(Contest(peer, scene, tried, loosest(our_errors, tried)))
    return taking_part, rows


def main(target):
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    errors, contestants, rows, checks = {}, [], [], []
    for scene in SCENES:
        print(f"{scene}: reference, errors", file=sys.stderr)
        truth = reference.reference_solution(params(scene), scene, output_grid(DURATION))
        errors[scene] = {
            rtol: error(ours(scene, rtol)["acceleration"].values, truth) for rtol in LADDER
        }
        taking_part, absent = contests(scene, truth, errors[scene])
        contestants, rows = contestants + taking_part, rows + absent
        checks.append(agreement(scene, truth))  # after the first calls, whose setup is timed
    for number in range(ROUNDS):
        print(f"round {number + 1} of {ROUNDS}", file=sys.stderr)
        for contest in contestants:
            contest.round()
    for contest in contestants:
        about = {"tool": contest.peer.tool, "settings": contest.peer.settings}
        rows.append({**about, "scene": contest.scene, **contest.row(errors[contest.scene])})
    order = [peer.tool for peer in PEERS]
    rows.sort(key=lambda row: (order.index(row["tool"]), SCENES.index(row["scene"])))
    kept = provenance("make peers", "exudyn", "numbalsoda")
    timed_alone = {"scenes": [evaluation.beside_transcription(scene) for scene in SCENES]}
    kept |= {"rounds": ROUNDS, "agreement": checks, "rows": rows, "evaluations": timed_alone}
    keep(target, kept, 3)


if __name__ == "__main__":
    run_campaign(main)
