"""Outcomes on disk, and back."""

from compressor.store.batch import encode_batch, make_batches, publish_batch
from compressor.store.caveats import CLIPPED, run_caveats, study_caveats
from compressor.store.export import export
from compressor.store.files import (
    Folder,
    FolderLost,
    StoreError,
    StoreWarning,
    publish,
    system_error,
    writable_folder,
)
from compressor.store.merge import merge_batches
from compressor.store.netcdf import DamagedFile, read_dataset, write_dataset
from compressor.store.reader import find_record, job_record, label_studies, open_study, read_job
from compressor.store.status import JobReport, list_orphans, report_job, standings, verify
from compressor.store.stored import Stored, read_store, serving_both
from compressor.store.studies import (
    Again,
    StoredStudy,
    coordinate_names,
    find_axis,
    find_job,
    find_study,
    find_value,
    read_studies,
    read_study,
    swept_column,
    write_study,
)
