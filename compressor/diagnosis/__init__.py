"""Which joint is worn, as a sensor's record tells it."""

from compressor.diagnosis.data_card import counts
from compressor.diagnosis.data_files import refuse_foreign, write_data_set
from compressor.diagnosis.data_set import DataSetOptions, make_data_set
