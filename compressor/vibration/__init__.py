"""What a frame does with the forces on it, and how its signals are read."""

from compressor.vibration.accelerometer import USABLE, Record, analogue_rate, noisy
from compressor.vibration.body import Forces
from compressor.vibration.monitor import Monitored, measure_record, segment_levels, shake_body
from compressor.vibration.record_files import read_record, record_columns
from compressor.vibration.spectra import (
    RecordError,
    band_signal,
    energy_angle,
    envelope_spectrum,
    high_pass_orders,
    line_amplitudes,
    resample_angle,
    shape,
)
from compressor.vibration.tacho import (
    MIN_REVOLUTIONS,
    Revolutions,
    by_revolutions,
    check_record,
    cut_windows,
    turns_at,
)
