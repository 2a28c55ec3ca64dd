"""The place where `open_regimes` once was: scripts that import it from here go on."""

from compressor.studies.regimes.dataset import open_regimes as open_regimes
