"""A case -> its outcome: motion, metrics, error bars, reasons."""

from compressor.solve.attempts import Solution, run_at_tolerance
from compressor.solve.cautions import JointScales, cautions, expected_cost, joint_scales
from compressor.solve.error_bars import energy_residual
from compressor.solve.horizon import predictability_horizon
from compressor.solve.legs import (
    Leg,
    Rubbed,
    Stretch,
    follow_revolutions,
    settle_motion,
    wear_bores,
    with_samples,
)
from compressor.solve.lyapunov import largest_exponent
from compressor.solve.march_driver import COMPILED
from compressor.solve.run_metrics import mean_bar, sure
from compressor.solve.scipy_driver import LOCAL
from compressor.solve.series import SIGNALS, signals_of_scene
from compressor.solve.si_record import record, stiffness_of
from compressor.solve.simulate import measure, observe, simulate
from compressor.solve.solution import side_by_side, solve
