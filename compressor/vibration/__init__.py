"""What a frame does with the forces on it, and how its signals are read."""

from compressor.vibration.accelerometer import Record, analogue_rate, listen
from compressor.vibration.body import Forces, body_motion
from compressor.vibration.envelope import (
    energy_angle,
    envelope_spectrum,
    high_pass_orders,
    kurtogram,
    shape,
)
from compressor.vibration.spectra import (
    line_amplitudes,
    resample_angle,
    rms_above,
    smooth_pulses,
)
