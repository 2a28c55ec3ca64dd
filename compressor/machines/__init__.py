"""In which machines the paper's claims hold: over masses, friction, contact and loads."""

from compressor.machines.findings import (
    change,
    consistency,
    counted,
    deciding,
    flips,
    is_mass_plane,
    spoken,
    summary,
)
from compressor.machines.judged import cases_judged
from compressor.machines.search import least_change
from compressor.machines.sensitivity import sensitivity
from compressor.machines.study import judge_machines, read_machines
