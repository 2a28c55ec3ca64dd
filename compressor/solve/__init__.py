"""A case -> its outcome: motion, metrics, error bars, reasons."""

from compressor.solve.request import Metrics, Request, Trajectory, revolutions
from compressor.solve.run import compile_parts, integrate, run_at_tolerance
from compressor.solve.run_metrics import (
    allowed_residual,
    average_bar,
    energy_residual,
    mean_bar,
    metrics,
    next_audit_rtol,
    parts,
    standard_error,
    statistics,
    sure,
)
from compressor.solve.search import find_repetition, least_promise, steady, with_settle_rev
from compressor.solve.series import SIGNALS, signals_of_scene
from compressor.solve.si_record import gas_nodes, natural_sizes, record, stiffness_of
from compressor.solve.simulate import measure, observe, simulate
