"""A sample of `measure_rod_load.py`: a worn machine with a card, and a sound one with gas."""

from itertools import islice

import numpy as np
import pytest
from measure_rod_load import NAMES, draw_machine, judge_machine


@pytest.mark.parametrize("number", [5, 7])
def test_sides_and_peaks_are_those_of_a_fine_series(number, tmp_path):
    rng = np.random.default_rng(49)
    drawn = (draw_machine(rng, tmp_path) for _ in iter(int, 1))
    ratios = judge_machine(next(islice(drawn, number, None)))
    assert ratios.keys() == {*NAMES}
    assert all(ratio <= 1.0 for ratio in ratios.values()), ratios
