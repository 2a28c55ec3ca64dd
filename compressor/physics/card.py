"""The load of measured indicator cards: the force of the gas over the crank's angle, from a table.

Between samples a card is Akima's curve (J. ACM 17, 1970), closed to a period, and the table holds
its values and slopes at 1440 angles. Errors of a card that is sampled from the ideal cycle of the
head end, with its corners in pressure, in per cent of the discharge pressure (greatest, and rms;
the worse of two shifts of the samples):

| step      | Akima        | cubic spline | PCHIP        | straight lines |
|-----------|--------------|--------------|--------------|----------------|
| 0.25 deg  | 0.08, 0.0014 | 0.10, 0.0016 | 0.12, 0.0019 | 0.15, 0.0025   |
| 0.5 deg   | 0.07, 0.0016 | 0.14, 0.0034 | 0.17, 0.0050 | 0.22, 0.0050   |
| 1 deg     | 0.24, 0.006  | 0.37, 0.011  | 0.35, 0.014  | 0.57, 0.018    |
| 2 deg     | 0.75, 0.027  | 0.95, 0.040  | 0.88, 0.040  | 1.37, 0.063    |
| 5 deg     | 1.52, 0.100  | 1.54, 0.115  | 1.99, 0.161  | 2.34, 0.189    |
"""

import math

from compressor.physics._jit import dispatch_on_record, inline_llvm
from compressor.physics.record import CARD_NODES, CHOSEN_FORCES, Load

CARD = int(Load.CARD)
PER_NODE = 2.0 * math.pi / CARD_NODES  # rad


@inline_llvm
def card_force(cos_theta, sin_theta, p):
    """Return the force (N) of the gas, less the back pressure's, at a crank angle."""
    place = math.atan2(sin_theta, cos_theta) / PER_NODE
    if place < 0.0:
        place += CARD_NODES
    node = int(place)
    s = place - node
    node %= CARD_NODES
    after = (node + 1) % CARD_NODES
    rise = p.card[after, 0] - p.card[node, 0]
    here, there = p.card[node, 1], p.card[after, 1]
    bend = (1.0 - s) * (here - rise) + s * (rise - there)
    return p.card[node, 0] + s * (rise + (1.0 - s) * bend)


@inline_llvm
def force_of_card(cos_theta, sin_theta, p):
    """Return `card_force` of a load that was measured, 0 of any other."""
    return card_force(cos_theta, sin_theta, p) if p.load == CARD else 0.0


@inline_llvm
def no_card(cos_theta, sin_theta, p):
    """Return 0: records of the default forces have no card."""
    return 0.0


measured_force = dispatch_on_record(CHOSEN_FORCES, force_of_card, no_card)
