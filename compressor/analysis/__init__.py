"""What runs mean, and what the paper says of them."""

from compressor.analysis.cam import Cam, comparisons
from compressor.analysis.captions import caption
from compressor.analysis.claims import claims
from compressor.analysis.paper_cases import CLEARANCES, FAULTS, SPOKEN, label, paper_cases
from compressor.analysis.runs import case_of, force_relation, load_phases, settled
