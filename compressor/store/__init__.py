"""Outcomes on disk, and back."""

from compressor.store.caveats import run_caveats, study_caveats
from compressor.store.export import RECORD_HEADER, Exported, ExportOptions, export
from compressor.store.files import Folder, StoreError, StoreWarning, publish, writable_folder
from compressor.store.folders import models_file
from compressor.store.hdf5 import DamagedJob
from compressor.store.names import find_job, find_study
from compressor.store.reader import Stored, open_study, read_job, read_store
from compressor.store.series_file import (
    read_dataset,
    series_file,
    store_series,
    write_dataset,
    write_series,
)
from compressor.store.status import JobReport, changes, report_job, standings
from compressor.store.studies import (
    Again,
    StoredStudy,
    coordinate_names,
    read_studies,
    swept_column,
    write_study,
)
from compressor.store.verify import Damage, verify
from compressor.store.writer import Writer
