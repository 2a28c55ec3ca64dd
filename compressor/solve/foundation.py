"""A run's forces on the frame, as what moves a body on its foundation and its sensor."""

import math
from typing import TYPE_CHECKING

import numpy as np

from compressor.cases import Case, back_action
from compressor.solve.attempts import Solution
from compressor.solve.series import finer
from compressor.solve.signals import signals

if TYPE_CHECKING:
    from compressor.vibration import Record

Variables = dict[str, tuple]  # as xarray has them

BODY = {  # over time and these dimensions: (dimensions, unit, long name)
    "body_displacement": (("axis",), "m", "displacement of the body's mass centre"),
    "body_velocity": (("axis",), "m/s", "velocity of the body's mass centre"),
    "body_acceleration": (("axis",), "m/s2", "acceleration of the body's mass centre"),
    "body_rocking": ((), "rad", "rotation of the body, counter-clockwise"),
}


def foundation(case: Case, solution: Solution, rows: np.ndarray) -> Variables:
    """Return the body's motion on the output grid, and the sensor's record in time of its own.

    rows: observed at the grid that is `finer`, (m, COLUMNS). A steady body is nan before the
    machine has settled; all is nan, and there is no record, of a run that did not reach its end.
    `one_way_error`: bound of the relative L2 error of the body's velocity by leaving out what its
    motion does to the machine: of the order m / M away from resonances. A journal's chatter may
    come at other moments on a body that gives way, so that no bound is stated of accelerations.
    """
    from compressor.vibration import Forces, body_motion, listen

    body, each = case.body, finer(case)
    assert body is not None
    step = solution.trajectory.times[1]
    steady, whole = body.start == "steady", not solution.trajectory.reason
    begin = round(solution.settle / step) if steady else 0
    known = {name: one[begin:] for name, one in signals(solution.p, rows).items()}
    forces = Forces(
        step, known["shaking_force"], known["guide_moment"],
        np.stack([np.zeros(len(rows) - begin), known["guide_force"]], axis=1),
        known["bearing_force"],
    )  # fmt: skip
    found: Variables = {}
    samples = (len(rows) - 1) // each + 1
    values = {name: np.full((samples, 2)[: 1 + len(BODY[name][0])], math.nan) for name in BODY}
    if whole:
        motion = body_motion(body, forces, steady)
        kept = slice(-begin % each, None, each)
        for name, source in (("displacement", 0), ("velocity", 1), ("acceleration", 2)):
            both = np.stack([motion.x[source], motion.y[source]], axis=1)
            values[f"body_{name}"][-len(both[kept]) :] = both[kept]
        values["body_rocking"][-len(motion.x[0][kept]) :] = motion.rocking.displacement[kept]
    for name, (dims, unit, phrase) in BODY.items():
        found[name] = (("time", *dims), values[name], {"units": unit, "long_name": phrase})
    if whole:
        spectra = motion.x.velocity[:-1], motion.y.velocity[:-1]
        phrase = "bound of the relative error of the body's velocity: it is driven one way"
        attrs = {"units": "1", "long_name": phrase}
        found["one_way_error"] = (("axis",), one_way_errors(case, spectra, step), attrs)
    if whole and case.sensor is not None:
        guide = case.machine.rod_length_mm / 1e3
        record = listen(body, case.sensor, forces, case.turn, guide, motion)
        found |= sensor_variables(record)
    return found


def sensor_variables(record: "Record") -> Variables:
    """Return a sensor's record: its samples and the tacho's pulses, each with a dimension of its
    own.
    """
    since = "time since the record's begin"
    return {
        "sensor_time": (("sensor_time",), record.times, {"units": "s", "long_name": since}),
        "sensor_acceleration": (
            ("sensor_time",), record.values,
            {"units": "m/s2", "long_name": "samples of the accelerometer"},
        ),
        "tacho_time": (
            ("pulse",), record.tacho,
            {"units": "s", "long_name": "times at which the crank passes top dead centre"},
        ),
        "clipped_share": (
            (), record.clipped, {"units": "1", "long_name": "former name of clipped_fraction"}
        ),
    }  # fmt: skip


def one_way_errors(case: Case, velocities: tuple, step: float) -> list[float]:
    """Return the bound by axis, from the spectrum of each velocity at equal steps (s)."""
    from compressor.vibration import line_amplitudes

    found = []
    for axis, values in zip(("x", "y"), velocities, strict=True):
        if not values.any():
            found.append(0.0)
            continue
        amplitudes = line_amplitudes(values, values.size, "rectangular", True)
        frequencies = np.arange(amplitudes.size) / (values.size * step)
        back = np.abs(back_action(case, axis, frequencies))
        error = np.where(back < 1.0, back / np.maximum(1.0 - back, 1e-12), np.inf)
        shares = amplitudes**2 / (amplitudes**2).sum()
        found.append(float(np.sqrt((shares * error**2).sum())))
    return found
