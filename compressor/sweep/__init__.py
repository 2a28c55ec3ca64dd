"""Run the jobs that are missing."""

from compressor.sweep.cluster import connect_cluster
from compressor.sweep.plan import Forecast, add_times, forecast
from compressor.sweep.pool import cores
from compressor.sweep.sweep import Summary, in_this_process, run_here, sweep
from compressor.sweep.warm_up import compile_once, needed_parts
from compressor.sweep.worker import End
