"""A tally cut into revolutions, and put together again."""

import numpy as np
import pytest

from compressor.cases.case import Case
from compressor.metrics import METRICS
from compressor.solve.request import revolutions
from compressor.solve.run import run_at_tolerance
from compressor.solve.run_metrics import metrics


def case(joint, method, **solve):
    solve = {"duration_rev": 2.2, "settle_rev": 0.1, "method": method, "error_bars": False} | solve
    return Case.from_values({"joint": joint, "clearance_mm": 0.2, "solve": solve})


def run(of, cuts=(), enough=None):
    rtol = 1e-7 if of.solve.method == "DOP853" else 1e-9  # which steps in Python
    return run_at_tolerance(of, rtol, 60.0, False, cuts=cuts, enough=enough)


def ends(of):
    return revolutions(of.settle, of.duration, of.turn)


@pytest.mark.parametrize(
    ("joint", "method"), [("big_end", "DOP853"), ("both", "auto"), ("both", "RODAS")]
)
def test_revolutions_add_up_to_the_whole_run(joint, method):
    of = case(joint, method)
    whole, parted = run(of), run(of, ends(of))
    assert len(parted.trajectory.turns) == 2
    for turn in parted.trajectory.turns:
        assert turn["seconds"] == pytest.approx(of.turn, rel=1e-9)
    tally = parted.trajectory.tally
    assert tally["seconds"] == pytest.approx(of.duration - of.settle, rel=1e-9)
    for name in METRICS:
        np.testing.assert_allclose(parted.metrics[name], whole.metrics[name], rtol=1e-4, atol=1e-9)
    for name in ("crank_work", "contact_work", "energy", "peak_kinetic"):
        assert tally[name] == pytest.approx(whole.trajectory.tally[name], rel=1e-5)


def test_a_revolution_has_its_own_peaks():
    """The start-up's are greater than those of a settled one."""
    of = case("big_end", "auto", settle_rev=0)
    each = [metrics(run(of).p, turn) for turn in run(of, ends(of)).trajectory.turns]
    assert each[0]["peak_acceleration"] > 1.01 * each[1]["peak_acceleration"]
    alone = run(case("big_end", "auto", settle_rev=1, duration_rev=2))
    for name in METRICS:
        np.testing.assert_allclose(each[1][name], alone.metrics[name], rtol=1e-4, atol=1e-9)
