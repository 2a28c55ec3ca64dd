"""Run the jobs that are missing."""

from compressor.sweep.cluster import Cluster
from compressor.sweep.execution import cores, run_batches
from compressor.sweep.plan import forecast
from compressor.sweep.sweep import Backend, Failure, Options, Progress, Summary, sweep
from compressor.sweep.warm_up import Needs, compile_once, load
from compressor.sweep.worker import Done, Lost, Workers
