"""Bores that wear over operating hours, until a joint is worn out."""

from compressor.wear.run import Machine, WearSummary, run_wear
from compressor.wear.stages import open_wear, wear_file
