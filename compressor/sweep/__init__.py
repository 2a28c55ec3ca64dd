"""Run the jobs that are missing."""

from compressor.sweep.plan import forecast
from compressor.sweep.sweep import (
    GRACE,
    Backend,
    Carried,
    Failure,
    Progress,
    Summary,
    as_jobs,
    run_job,
    sweep,
    warm_up,
)
