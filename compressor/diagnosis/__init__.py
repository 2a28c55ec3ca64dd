"""Which joint is worn, as a sensor's record tells it."""

from compressor.diagnosis.data_card import counts
from compressor.diagnosis.data_files import build_data_set
from compressor.diagnosis.data_set import DataSetOptions
from compressor.diagnosis.identify import (
    Answer,
    Identifier,
    explain_record,
    find_record,
)
from compressor.diagnosis.record_file import SteadySpeed
