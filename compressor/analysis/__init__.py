"""What runs mean, and what the paper says of them."""

from compressor.analysis.cam import Cam, comparisons
from compressor.analysis.captions import caption
from compressor.analysis.claim_rules import RULES
from compressor.analysis.claims import Claim, claim_margins, claims
from compressor.analysis.contact_modes import MODES, angle_modes, contact_modes, mode_shares
from compressor.analysis.contacts import joints_with_clearance
from compressor.analysis.diagnosis_captions import diagnosis_caption
from compressor.analysis.effects import Effects, grid_effects, sampled_effects, trend
from compressor.analysis.frame_forces import (
    NoSeriesError,
    frame_forces,
    healthy_twin,
    last_revolution,
)
from compressor.analysis.impacts import impacts
from compressor.analysis.paper_cases import (
    CLEARANCES,
    FAULTS,
    LOADS,
    SPOKEN,
    cases_of,
    label,
    paper_cases,
)
from compressor.analysis.plot_captions import PLOT_CAPTIONS
from compressor.analysis.runs import (
    case_of,
    force_relation,
    load_phases,
    settled,
    settled_revolutions,
)
from compressor.analysis.shaking import (
    ORDER,
    Shaking,
    deviation_spectrum,
    sensor_envelope,
    shaking,
)
from compressor.analysis.sobol import saltelli_design
from compressor.analysis.swept_rows import SweptRow, rows_modes
from compressor.analysis.words import plural
