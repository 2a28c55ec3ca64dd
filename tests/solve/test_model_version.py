"""What a version of the model promises, on numbers that older programs of the same model stored.

`tests/results/model-3.json` holds, for each case, its values, its key, and all metrics with their
error bars as an earlier commit computed them. Keys are the same, and numbers agree within the sum
of both error bars. They are written once for a version of the model.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from compressor.cases.case import MODEL_VERSION, Case
from compressor.solve.simulate import simulate

PATH = Path(__file__).parent.parent / "results" / f"model-{MODEL_VERSION}.json"
STORED = json.loads(PATH.read_text(encoding="utf-8"))
ROUNDING = 1e-14  # relative, of numbers whose error bar is shorter than their last digits


def numbers(value):
    """A stored number, or several; null is none."""
    return np.array(value, dtype=float)


@pytest.mark.compiled
@pytest.mark.parametrize("number", range(len(STORED["cases"])))
def test_numbers_of_an_older_program_lie_within_error_bars(number):
    stored = STORED["cases"][number]
    case = Case.from_values(stored["values"])
    assert case.key == stored["key"]
    run = simulate(case)
    assert run.status == "ok"
    checked, apart = 0, {}
    for name, (value, bar) in stored["numbers"].items():
        old, old_bar = numbers(value), numbers(bar)
        new, new_bar = run[name].values, run[f"{name}_error"].values
        distance = np.abs(new - old)
        allowed = old_bar + new_bar + ROUNDING * np.abs(old)
        told = np.isfinite(old) & np.isfinite(allowed)
        checked += int(told.sum())
        if (told & ~(distance <= allowed)).any():
            apart[name] = distance, allowed
    assert not apart
    assert checked >= 12
