"""Outcomes on disk, and back."""

from compressor.store.export import ExportOptions, export
from compressor.store.files import (
    Folder,
    StoreError,
    StoreWarning,
    publish,
    sync_later,
    system_error,
    writable_folder,
)
from compressor.store.hdf5 import DamagedJob
from compressor.store.reader import Stored, open_study, read_job, read_store
from compressor.store.sensor_records import find_record, job_record
from compressor.store.series_file import (
    read_dataset,
    series_file,
    store_series,
    write_dataset,
    write_series,
)
from compressor.store.status import (
    JobReport,
    changes,
    report_job,
    run_caveats,
    standings,
    study_caveats,
    verify,
)
from compressor.store.studies import (
    Again,
    StoredStudy,
    coordinate_names,
    find_axis,
    find_job,
    find_study,
    find_value,
    healthy_clearance,
    read_studies,
    swept_column,
    write_study,
)
from compressor.store.writer import Writer
