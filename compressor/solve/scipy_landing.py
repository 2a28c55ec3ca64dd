"""Where journal and bore meet in a step of SciPy's: laws with a restitution need its speed there.

SciPy's methods end no step where contact begins. A step in which a gap closes is forgotten and
taken again up to that moment, by a fresh solver; from there on the joint carries the speed at which
it met, as after a landing of the compiled march (`physics.onset.remember`).
"""

import numpy as np

from compressor.physics import COLUMNS, FLOWS, Column, meeting, observe_all

LOOKS = 17  # times in a step at which gaps are looked at, both ends included
HALVINGS = 50
LANDED = 1e-3  # of a step: a gap that closes nearer to its end closes at its end


def needs_landings(p: np.record) -> bool:
    """Return whether a record's law reads the speed at which bodies met."""
    return bool(p["hysteresis"] != 0.0)


class Landings:
    """What is looked for in each step of a stretch in which the load has one phase."""

    def __init__(self, p: np.record, phase: int):
        self.p, self.phase = p, phase
        self.worn = [joint for joint in range(2) if p["clearance"][joint] > 0.0]
        self.deaf = [-np.inf, -np.inf]  # s up to which a gap's close is one that was landed on

    def depths(self, times: np.ndarray, states: np.ndarray) -> np.ndarray:
        """Return the penetrations (m) of both joints, (m, 2), at times (s) and states (m, n)."""
        rows = np.empty((times.size, COLUMNS))
        observe_all(times, states, np.full(times.size, self.phase), self.p, rows)
        return rows[:, Column.PENETRATION : Column.PENETRATION + 2]

    def within(self, begin: float, end: float, dense) -> float | None:
        """Return when (s) a gap first closes within a step, or None; at its end none does."""

        def depths(times: np.ndarray) -> np.ndarray:
            return self.depths(times, np.ascontiguousarray(dense(times)[:-FLOWS].T))

        times = np.linspace(begin, end, LOOKS)
        seen, first = depths(times), end
        for joint in self.worn:
            closing = (seen[:-1, joint] < 0.0) & (seen[1:, joint] >= 0.0)
            for i in np.flatnonzero(closing & (times[1:] > self.deaf[joint])):
                apart, touching = times[i], times[i + 1]
                for _ in range(HALVINGS):
                    middle = 0.5 * (apart + touching)
                    if depths(np.array([middle]))[0, joint] >= 0.0:
                        touching = middle
                    else:
                        apart = middle
                if touching > self.deaf[joint]:
                    first = min(first, touching)
                    break
        return first if end - first > LANDED * (end - begin) else None

    def land(self, begin: float, end: float, dense, z: np.ndarray) -> None:
        """At the end of a step that began apart: joints whose gaps close there carry their speed.

        z: motion and flows, (n + 4,), written.
        """
        y, rates, before = z[:-FLOWS].copy(), np.empty(z.size - FLOWS), np.empty(z.size - FLOWS)
        apart = self.depths(np.array([begin]), np.ascontiguousarray(dense([begin])[:-FLOWS].T))[0]
        for joint in self.worn:
            depth, speed = meeting(joint, end, y, self.phase, self.p, rates, before)
            if apart[joint] < 0.0 < speed and abs(depth) <= LANDED * (end - begin) * speed:
                place = 2 * self.p["freedoms"] + joint
                z[place] = max(speed, self.p["least_approach"])
                self.deaf[joint] = end + 2.0 * max(0.0, -depth) / speed
