"""The jobs of a study along one swept axis: what each does to its frame, and its contact modes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from compressor.analysis.contact_modes import UNKNOWN
from compressor.analysis.shaking import Shaking
from compressor.metrics import JOINTS


@dataclass(frozen=True)
class SweptRow:
    """One job: its value on the axis in words, and what its series tell.

    `shaking` is None, and `problem` says why, where the job has none. `modes`: as `angle_modes`
    gives them, None of ideal joints. `chaotic`: single lines hold for this course of the motion
    only. `lubricated`: its joints have oil.
    """

    value: str
    shaking: Shaking | None = None
    modes: xr.Dataset | None = None
    problem: str = ""
    chaotic: bool = False
    lubricated: bool = False


def rows_modes(rows: Sequence[SweptRow]) -> dict[str, np.ndarray]:
    """Return the most frequent modes by joint that has clearance anywhere, (rows, bins of the
    angle).

    Integers, -1 where nothing is known; {} where no joint has clearance.
    """
    known = [row.modes for row in rows if row.modes is not None]
    found = {}
    for joint in (one for one in JOINTS if any(one in modes["joint"] for modes in known)):
        table = np.full((len(rows), known[0].sizes["angle"]), UNKNOWN)
        for number, row in enumerate(rows):
            if row.modes is not None and joint in row.modes["joint"]:
                table[number] = row.modes["majority"].sel(joint=joint).values
        found[joint] = table
    return found
