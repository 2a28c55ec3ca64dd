"""The place where `open_wear` once was: scripts that import it from here go on."""

from compressor.studies.wear.stages import open_wear as open_wear
