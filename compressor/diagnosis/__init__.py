"""Which joint is worn, as a sensor's record tells it."""

from compressor.diagnosis.data_card import counts
from compressor.diagnosis.data_files import refuse_foreign, write_data_set
from compressor.diagnosis.data_set import DataSetOptions, make_data_set
from compressor.diagnosis.identify import Answer, Candidate, Identifier
from compressor.diagnosis.library import open_library, stored_record, vector
from compressor.diagnosis.record_file import SteadySpeed, read_record
