"""What is integrated and observed, by the kind of a record: one of the scenes, or the mechanism.

A scene is the mechanism with clearance at its joints and no other feature, written by hand for
speed; that both agree is a test.
"""

from compressor.physics import mechanism_rows, motion, observe
from compressor.physics._jit import dispatch_on_record, jit
from compressor.physics.loads import CYLINDER, GAS, begin_stroke
from compressor.physics.record import MECHANISM


@jit
def within_model(y, p):
    """Return `mechanism_rows.beyond_model` of a scene, whose depths the tally watches."""
    return 0


beyond_model = dispatch_on_record(MECHANISM, mechanism_rows.beyond_model, within_model)


@jit
def scene_deviation(t, y, p):
    """Return how far (m) the crosshead of a scene is from its ideal place."""
    return y[0]


deviation = dispatch_on_record(MECHANISM, mechanism_rows.deviation, scene_deviation)


@jit
def enter_segment(t, y, i, phases, p):
    """Write what a load's phase of the segment i holds of the state y in which it begins, at t."""
    if p.load == GAS or p.load == CYLINDER:
        begin_stroke(t, deviation(t, y, p), i, phases, p)


derivative = dispatch_on_record(MECHANISM, mechanism_rows.derivative, motion.derivative)
derivative_with_flows = dispatch_on_record(
    MECHANISM, mechanism_rows.derivative_with_flows, observe.derivative_with_flows
)
write_flowing_derivative = dispatch_on_record(
    MECHANISM, mechanism_rows.write_flowing_derivative, observe.write_flowing_derivative
)
derivative_and_columns = dispatch_on_record(
    MECHANISM, mechanism_rows.derivative_and_columns, observe.derivative_and_columns
)
observe_contact = dispatch_on_record(
    MECHANISM, mechanism_rows.observe_contact, observe.observe_contact
)
observe_with_energy = dispatch_on_record(
    MECHANISM, mechanism_rows.observe_with_energy, observe.observe_with_energy
)
observe_all = dispatch_on_record(MECHANISM, mechanism_rows.observe_all, observe.observe_all)
contact_at = dispatch_on_record(MECHANISM, mechanism_rows.contact_at, motion.contact_at)
write_eccentricities = dispatch_on_record(
    MECHANISM, mechanism_rows.write_eccentricities, observe.write_eccentricities
)
start = dispatch_on_record(MECHANISM, mechanism_rows.start, motion.start)
