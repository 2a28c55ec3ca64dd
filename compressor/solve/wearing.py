"""How a machine wears its bores in some revolutions, out of round as they are."""

import time
from typing import NamedTuple

import numpy as np

from compressor.cases import TIGHTEST, Case
from compressor.metrics import JOINTS
from compressor.reasons import Reason
from compressor.solve.attempts import request, times_of
from compressor.solve.energy_audit import RUNGS, allowed, energy_residual
from compressor.solve.error_bars import Metrics
from compressor.solve.integrate import integrate
from compressor.solve.si_record import record
from compressor.solve.signals import passed
from compressor.solve.tallied import metrics
from compressor.solve.turns import Cuts, merged, revolutions


class Rubbed(NamedTuple):
    """A motion on bores that are given.

    `work`: pressing times sliding, J a revolution, by joint and node of the bore; `spread`: its
    standard deviation over the revolutions, by joint; `turn`: time of a revolution, s; `state`: the
    motion at the end; `reason`, `detail`: why it stopped early, empty if it did not.
    """

    work: np.ndarray
    spread: np.ndarray
    turn: float
    metrics: Metrics
    state: np.ndarray
    reason: str = ""
    detail: str = ""


def rub(case: Case, worn: np.ndarray, state: np.ndarray | None) -> Rubbed:
    """Follow a case over its span on worn bores, and measure what rubs after it has settled.

    worn: (joint, sector), m; state: the motion to begin with, at top dead centre, or None for the
    case's own. The span is in whole revolutions. A run whose energy does not balance is run again
    at a tenth of the tolerance, as any other.
    """
    deadline, rtol = time.monotonic() + case.solve.timeout_s, case.rtol
    ends = revolutions(case.settle, case.duration, case.turn)
    for rung in range(RUNGS + 1):
        p = record(case, worn)
        asked = request(case, rtol, p, times_of(case, False), state)
        cuts = Cuts(ends)
        asked.timeout, asked.cuts = max(deadline - time.monotonic(), 0.0), cuts
        run = integrate(asked)
        residual = energy_residual(run.tally)
        most = allowed(case.rtol, case.duration / case.turn)
        if run.reason or residual <= most:
            break
        if rung == RUNGS or rtol < 9.9 * TIGHTEST:
            run.reason = Reason.ENERGY_AUDIT_FAILED
            run.detail = f"energy residual {residual:.2g}, more than {most:.2g}, at rtol {rtol:.2g}"
            break
        rtol /= 10.0
    turns = cuts.turns
    if run.reason or not turns:
        nothing = np.full((len(JOINTS), worn.shape[1]), np.nan)
        return Rubbed(nothing, nothing[:, 0], np.nan, {}, asked.start, run.reason, run.detail)
    slid = np.array([turn["slid"] for turn in turns])
    whole = merged(turns)
    work = whole["worn"][:, : worn.shape[1]] / len(turns)
    began, ended = passed(p, run.times, run.states)[[0, -1]]
    turn = case.turn * float(ended - began) / case.duration
    return Rubbed(work, slid.std(axis=0), turn, metrics(p, whole), run.states[-1])
