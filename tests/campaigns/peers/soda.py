"""The same equations compiled by numba, under LSODA in C++ through numbalsoda."""

from functools import lru_cache

import numpy as np
from numba import carray, cfunc, njit
from peers.mechanism import DURATION, START, big_end, both, load_of, output_grid, pieces, small_end
from peers.mechanism import tolerances as absolute_tolerances


@lru_cache
def compiled(scene):
    """The address of numbalsoda's right-hand side, and (t, y, load) -> crosshead acceleration."""
    from numbalsoda import lsoda_sig

    if scene == "both":

        @njit
        def accelerate(t, y, load):
            return both(t, y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7], load[0], load[1])

    else:
        of_scene = big_end if scene == "big_end" else small_end

        @njit
        def accelerate(t, y, load):
            return of_scene(t, y[0], y[1], y[2], y[3], load[0], load[1])

    n = len(START[scene]) // 2

    @cfunc(lsoda_sig)
    def rates(t, state, out, data):
        y, dy = carray(state, 2 * n), carray(out, 2 * n)
        found = accelerate(t, y, carray(data, 2))
        for i in range(n):
            dy[i] = y[n + i]
            dy[n + i] = found[i]

    @njit
    def crosshead(times, states, load):
        a = np.empty(times.size)
        for i in range(times.size):
            a[i] = accelerate(times[i], states[i], load)[0]
        return a

    return rates, crosshead


def acceleration(scene, rtol, duration=DURATION):
    """Crosshead acceleration (m/s2) on the output grid, restarted at load corners."""
    from numbalsoda import lsoda

    rates, crosshead = compiled(scene)
    a, y = np.empty(output_grid(duration).size), np.array(START[scene])
    atol = float(absolute_tolerances(scene, rtol).min())
    for samples, times, wanted, phase in pieces(duration):
        data = np.array(load_of(phase, y[0]))
        states, success = lsoda(
            rates.address, y, times, data, rtol=rtol, atol=atol, mxstep=1_000_000
        )
        if not success:
            raise RuntimeError("numbalsoda gave up")
        y = states[-1].copy()
        a[samples] = crosshead(times[wanted], states[wanted], data)
    return a
