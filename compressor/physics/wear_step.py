"""What sliding wears off a bore in a step of the march; nothing where no bore can wear."""

from compressor.physics._jit import by_kind, jit
from compressor.physics.kinematics import ideal_after
from compressor.physics.mechanism_rows import wear_at
from compressor.physics.record import MECHANISM
from compressor.physics.runge_kutta import combine, interpolate
from compressor.physics.walker import NODE_WEIGHTS, NODES, WEIGHTS


@jit
def nothing_worn(w, base, h, z, work, phase, p, tally):
    """What sliding wears off where no bore can."""


@jit
def wear_by_step(w, base, h, z, work, phase, p, tally):
    """Add to the tally what sliding wears off in the step just taken, by its nodes."""
    if not p.sectors or w.t < w.settle:
        return
    n = work.y.size
    for i in range(NODES.size):
        for j in range(n):
            work.y[j] = z[j] if i == 0 else work.new[j]
        if 0 < i < NODES.size - 1:
            if w.stiff:
                interpolate(NODES[i], work.dense, work.y)
            else:
                combine(NODE_WEIGHTS[w.pair, i], h, z, work.k, work.y)
        wear_at(ideal_after(base, NODES[i] * h, p), work.y, phase, WEIGHTS[i] * h, p, tally)


wear_step = by_kind(MECHANISM, wear_by_step, nothing_worn)
