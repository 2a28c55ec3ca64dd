"""Drawn mutants that change nothing, by identity, with the reason: never a place for escapes.

`measure_mutants` tries each of them all the same, and stops where a test catches one.
"""

EQUIVALENT: dict[str, str] = {
    "march.py, march: w.h < MIN_STEP * (w.t + 1.0 / p.omega)"
    " -> w.h <= MIN_STEP * (w.t + 1.0 / p.omega)":
        "differs only for a step that is refused at the limit to the last bit",
}  # fmt: skip
