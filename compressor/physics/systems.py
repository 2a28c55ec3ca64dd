"""What is integrated and observed, by the kind of a record: one of the scenes, or the mechanism.

A scene is the mechanism with clearance at its joints and no other feature, written by hand for
speed; that both agree is a test.
"""

from compressor.physics import mechanism_rows
from compressor.physics._jit import dispatch_on_record, jit
from compressor.physics.motion import contact_at as scene_contact_at
from compressor.physics.motion import derivative as scene_derivative
from compressor.physics.motion import start as scene_start
from compressor.physics.observe import derivative_and_gauge as scene_derivative_and_gauge
from compressor.physics.observe import derivative_with_flows as scene_derivative_with_flows
from compressor.physics.observe import observe_all as scene_observe_all
from compressor.physics.observe import observe_contact as scene_glance
from compressor.physics.observe import observe_with_energy as scene_gauge
from compressor.physics.observe import write_eccentricities as scene_eccentricities
from compressor.physics.observe import write_flowing_derivative as scene_flowing_derivative
from compressor.physics.record import MECHANISM


@jit
def within_model(y, p):
    """Return `mechanism_rows.beyond_model` of a scene, whose depths the tally watches."""
    return 0


beyond_model = dispatch_on_record(MECHANISM, mechanism_rows.beyond_model, within_model)
derivative = dispatch_on_record(MECHANISM, mechanism_rows.derivative, scene_derivative)
derivative_with_flows = dispatch_on_record(
    MECHANISM, mechanism_rows.derivative_with_flows, scene_derivative_with_flows
)
write_flowing_derivative = dispatch_on_record(
    MECHANISM, mechanism_rows.write_flowing_derivative, scene_flowing_derivative
)
derivative_and_gauge = dispatch_on_record(
    MECHANISM, mechanism_rows.derivative_and_gauge, scene_derivative_and_gauge
)
observe_contact = dispatch_on_record(MECHANISM, mechanism_rows.observe_contact, scene_glance)
observe_with_energy = dispatch_on_record(MECHANISM, mechanism_rows.observe_with_energy, scene_gauge)
observe_all = dispatch_on_record(MECHANISM, mechanism_rows.observe_all, scene_observe_all)
contact_at = dispatch_on_record(MECHANISM, mechanism_rows.contact_at, scene_contact_at)
write_eccentricities = dispatch_on_record(
    MECHANISM, mechanism_rows.write_eccentricities, scene_eccentricities
)
start = dispatch_on_record(MECHANISM, mechanism_rows.start, scene_start)
