"""What runs mean, and what the paper says of them."""

from compressor.analysis.cam import (
    BASE_RADIUS,
    cam_profile,
    comparisons,
    contour,
    printed_corners_of_gas,
    printed_profile,
)
from compressor.analysis.claims import (
    CLEARANCES,
    FAULTS,
    SPOKEN,
    case_of,
    claims,
    force_relation,
    label,
    paper_cases,
    settled,
)
