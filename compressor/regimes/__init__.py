"""One machine followed along a parameter: its regimes, Poincaré points and second attractors."""

from compressor.regimes.dataset import followed_studies, open_regimes
from compressor.regimes.run import RegimesSummary, Standing, run_regimes, standing
