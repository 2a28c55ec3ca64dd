"""What runs mean, and what the paper says of them."""

from compressor.analysis.cam import (
    BASE_RADIUS,
    cam_profile,
    comparisons,
    contour,
    printed_corners_of_gas,
    printed_profile,
)
from compressor.analysis.claims import claims
from compressor.analysis.paper_cases import CLEARANCES, FAULTS, SPOKEN, label, paper_cases
from compressor.analysis.runs import case_of, force_relation, settled
