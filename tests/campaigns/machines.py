"""A population of machines for diagnosis: one case file, every machine with its own noise.

Joints and loads have as many machines each, in blocks with seeds of their own, so that no two
machines share a value that was drawn. The body's natural frequencies, 30 Hz, are 2.6 to 6 times
the speed, so that orders 1 and 2 stay below them. The record repeats the four settled revolutions,
each at its own pace, with noise of its own, eleven in all. Jobs run at `standard` with error bars:
these take less time than the record, and without them no regime is told.
"""

import json

JOINTS = ("none", "big_end", "small_end", "both")
LOADS = ("spring", "gas")
CLEARANCE_MM = (0.05, 0.5)
MACHINE = {
    "rod_mass_kg": {"random": [2, 8]},
    "reciprocating_mass_kg": {"random": [4, 25]},
    "speed_rpm": {"random": [300, 700]},
}
BODY = {"mass_kg": 500, "frequency_x_Hz": 30, "frequency_y_Hz": 30}
SENSOR = {
    "place": "guide", "direction": "y", "length_rev": 11, "speed_jitter": 0.002,
    "noise_m_per_s2": 0.0015, "seed": {"random": [1, 2_000_000_000]},
}  # fmt: skip
SOLVE = {"duration_rev": 6, "settle_rev": 2, "output_step_deg": 3.6}
OUTPUT = {"precision": "single"}


def machines(count, seed):
    """The text of a case file with `count` machines, a multiple of 8; YAML, written as JSON."""
    each, rest = divmod(count, len(JOINTS) * len(LOADS))
    assert not rest, f"{count} machines cannot be shared evenly"
    clearance = {"random": [*CLEARANCE_MM], "log": True}
    of_joint = {
        "none": {},
        "big_end": {"clearance_mm": {"big_end": clearance}},
        "small_end": {"clearance_mm": {"small_end": clearance}},
        "both": {"clearance_mm": {"big_end": clearance, "small_end": clearance}},
    }
    blocks = [
        {
            "joint": joint, "load": load, **of_joint[joint],
            "sample": {"n": each, "seed": 100 * seed + 10 * j + k},
        }
        for j, joint in enumerate(JOINTS)
        for k, load in enumerate(LOADS)
    ]  # fmt: skip
    values = {
        "name": "machines", "machine": MACHINE, "body": BODY, "sensor": SENSOR, "solve": SOLVE,
        "output": OUTPUT, "blocks": blocks,
    }  # fmt: skip
    return json.dumps(values, indent=1) + "\n"
