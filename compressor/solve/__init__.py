"""A case -> its outcome: motion, metrics, error bars, reasons."""

from compressor.solve.attempts import Solution, attempt
from compressor.solve.cautions import cautions
from compressor.solve.energy_audit import energy_residual
from compressor.solve.horizon import predictability_horizon
from compressor.solve.legs import Leg, Stretch, follow, settle, with_samples
from compressor.solve.lyapunov import largest_exponent
from compressor.solve.marching import COMPILED
from compressor.solve.scales import JointScales, expected_cost, joint_scales
from compressor.solve.scipy_driver import LOCAL
from compressor.solve.si_record import record, stiffness_of
from compressor.solve.side_by_side import side_by_side
from compressor.solve.signals import SIGNALS, signals_of_scene
from compressor.solve.simulate import measure, observe, simulate
from compressor.solve.solution import solve
from compressor.solve.statistics import mean_bar, sure
from compressor.solve.wearing import Rubbed, rub
