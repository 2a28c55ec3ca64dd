"""What runs mean, and what the paper says of them."""

from compressor.analysis.cam import Cam, comparisons
from compressor.analysis.captions import caption, diagnosis_caption
from compressor.analysis.claims import RULES, Claim, claim_margins, claims
from compressor.analysis.contacts import (
    MODES,
    OILED_MODES,
    angle_modes,
    impacts,
    joints_with_clearance,
)
from compressor.analysis.cycle import read_cycle, read_loads
from compressor.analysis.cylinder import cylinder_words, end_states
from compressor.analysis.effects import (
    Effects,
    grid_effects,
    saltelli_design,
    sampled_effects,
)
from compressor.analysis.machine_numbers import describe_cases, describe_machine
from compressor.analysis.margins import mean_peak
from compressor.analysis.plot_captions import (
    PLOT_CAPTIONS,
    SweptRow,
    row_modes_words,
    rows_modes,
)
from compressor.analysis.runs import (
    CLEARANCES,
    FAULTS,
    LOADS,
    SPOKEN,
    case_of,
    cases_of,
    force_relation,
    label,
    load_phases,
    paper_cases,
    settled_part,
    settled_revolutions,
)
from compressor.analysis.shaking import (
    ORDER,
    NoSeriesError,
    Shaking,
    deviation_spectrum,
    frame_forces,
    healthy_body_velocity_rms,
    healthy_twin,
    last_revolution,
    sensor_envelope,
    shaking,
)
from compressor.analysis.wear import interpolate_hours, rubbing_work
