"""Drawn mutants that change nothing, by identity, with the reason: never a place for escapes.

`measure_mutants` tries each of them all the same, and stops where a test catches one.
"""

EQUIVALENT: dict[str, str] = {
    "contact_laws.py, solve_rising: rising(middle) < value -> rising(middle) <= value": (
        "where a middle has the value itself, both ends close in on it"
    ),
}
