"""What runs mean, and what the paper says of them."""

from compressor.analysis.cam import BASE_RADIUS, Cam
from compressor.analysis.cautions import cautions
from compressor.analysis.claims import RULES, Claim, claim_margins, claims
from compressor.analysis.contacts import impacts, joints_with_clearance
from compressor.analysis.cycle import Cycle, read_cycle
from compressor.analysis.cylinder import end_states
from compressor.analysis.effects import (
    Effects,
    correlate_ranks,
    grid_effects,
    saltelli_design,
    sampled_effects,
)
from compressor.analysis.machine_numbers import (
    MachineDescription,
    describe_machine,
    draw_jobs,
    machine_numbers,
)
from compressor.analysis.margins import mean_peak
from compressor.analysis.runs import (
    CLEARANCES,
    FAULTS,
    LOADS,
    SPOKEN,
    case_of,
    cases_of,
    faulty_joints,
    force_relation,
    ideal_motion,
    label,
    paper_cases,
    record_of,
    settled_part,
    settled_revolutions,
)
from compressor.analysis.shaking import (
    ORDER,
    NoSeriesError,
    Spectrum,
    frame_forces,
    healthy_twin,
    last_revolution,
    shaking,
)
from compressor.analysis.wear import interpolate_hours, rubbing_work
