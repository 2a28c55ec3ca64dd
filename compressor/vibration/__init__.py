"""What a frame does with the forces on it, and how its signals are read."""

from compressor.vibration.accelerometer import Record, analogue_rate, listen
from compressor.vibration.body import Forces, body_motion
from compressor.vibration.envelope import envelope_spectrum, kurtogram
from compressor.vibration.indicators import (
    energy_angle,
    high_pass_orders,
    shape,
)
from compressor.vibration.orders import resampled, rms_above
from compressor.vibration.spectra import line_amplitudes
from compressor.vibration.tacho import smooth_pulses
