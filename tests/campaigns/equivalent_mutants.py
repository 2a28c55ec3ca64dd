"""Drawn mutants that change nothing, by identity, with the reason: never a place for escapes.

`measure_mutants` tries each of them all the same, and stops where a test catches one.
"""

EQUIVALENT: dict[str, str] = {
    "march.py, march: w.h < LEAST_STEP * (w.t + 1.0 / p.omega)"
    " -> w.h <= LEAST_STEP * (w.t + 1.0 / p.omega)":
        "differs only for a step that is refused at the limit to the last bit",
    "runge_kutta.py, error_norm: a += weight * k[j, i] -> a -= weight * k[j, i]":
        "the whole sum changes its sign, and only its square is used",
    "runge_kutta.py, take_step: stage < STAGES - 1 -> stage > STAGES - 1":
        "every stage is gauged, where the last is asked for, with the last word: the same "
        "numbers to the bit, later",
}  # fmt: skip
