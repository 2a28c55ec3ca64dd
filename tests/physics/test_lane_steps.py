"""Loops over lanes: that they are vector code."""

import os
import re
import subprocess
import sys

import pytest

pytestmark = pytest.mark.compiled

LOOK = """
from compressor.physics import lane_steps
W, k = lane_steps.new_lanes(), lane_steps.LANES
lane_steps.move_cranks(W, k, 0.5)
lane_steps.stage_rates((0, 0, 0), W, k, 1)
lane_steps.last_stage((0, 0, 0), W, k)
lane_steps.observe_node((0, 0, 0), W, k, 1)
for name in ("move_cranks", "stage_rates", "last_stage", "observe_node"):
    target = getattr(lane_steps, name).target
    print(*target.inspect_asm().values() if not target.stats.cache_hits else ["from the disk"])
"""


def test_loops_over_lanes_are_vector_code(tmp_path):
    """Square roots and divisions of several lanes at once, where the processor is known.

    Only what was just compiled shows its assembly. On a fresh clone it is compiled here, first, and
    kept for all other tests; where it is on the disk, it is compiled once more, in another folder.
    """
    for place in ({}, {"NUMBA_CACHE_DIR": str(tmp_path)}):
        seen = subprocess.run(
            [sys.executable, "-c", LOOK],
            env=os.environ | place, capture_output=True, text=True, check=True,
        )  # fmt: skip
        if "from the disk" not in seen.stdout:
            break
    functions = seen.stdout.split(".Lfunc_end")
    if not re.search(r"\b[xyz]mm\d", seen.stdout):
        pytest.skip("no x86 machine code to look at")
    for name in ("move_cranks", "stage_rates", "last_stage", "observe_node"):
        (code,) = (f for f in functions if re.search(rf"^_ZN10compressor\S*{name}\S*:$", f, re.M))
        assert re.search(r"v?sqrtpd", code), name
        assert re.search(r"v?divpd", code), name
