"""What a frame does with the forces on it, and how its signals are read."""

from compressor.vibration.accelerometer import Record, analogue_rate, find_noise_mistake, noisy
from compressor.vibration.body import Forces, casing_motion
from compressor.vibration.envelope import (
    energy_angle,
    envelope_spectrum,
    high_pass_orders,
    kurtogram,
    shape,
)
from compressor.vibration.monitor import (
    Monitored,
    band_signal,
    measure_record,
    segment_levels,
    shake_body,
)
from compressor.vibration.record_files import RecordError, encode_record, record_columns
from compressor.vibration.record_reader import MIN_REVOLUTIONS, check_record, read_record, turns_at
from compressor.vibration.spectra import line_amplitudes, resample_angle, rms_above
