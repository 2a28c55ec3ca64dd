"""Rod load of random machines against a fine series: reversal, share, both peaks, and bars.

Machines of other nameplates than any page's: double- or single-acting, or the crank end alone, with
gas or with measured cards that ripple, worn in one joint or both or in none, dry or oiled. What is
right comes of the samples of a run at `RTOL`: every `STEP_DEG`, on both sides of the load's
corners, and `FINER` times as many where the load changes its side or is greatest. Nothing of the
tally takes part. From the root of the project:

    PYTHONPATH=tests .venv/bin/python tests/campaigns/measure_rod_load.py --seed 49 --count 60
"""

import argparse
import math
import tempfile
from pathlib import Path

import numpy as np

from compressor.cases.case import Case
from compressor.physics import exact_motion, segments
from compressor.physics.tally import ROD_LOAD
from compressor.solve.dense_tally import closed_form
from compressor.solve.request import Request
from compressor.solve.run import integrate
from compressor.solve.series import rows_of
from compressor.solve.si_record import initial_state, is_ideal, record
from compressor.solve.simulate import measure

RTOL = 1e-11
STEP_DEG = 0.02
FINER = 400
RESOLUTION = 1e-6  # of a number: as well as the samples tell what is right
TURN = {"duration_rev": 3, "settle_rev": 2, "output_step_deg": 1.0}
NAMES = (
    "rod_load_reversal_angle", "rod_load_reversal_share",
    "peak_rod_load_tension", "peak_rod_load_compression",
)  # fmt: skip


def write_card(path, rng, gas, machine, crank):
    """Write a card of one end: its cycle by degrees, with valves that flutter and three digits."""
    theta = np.radians(np.arange(360.0))
    radius, length = machine["stroke_mm"] / 2e3, machine["rod_length_mm"] / 1e3
    x, _, _ = exact_motion(theta, radius, length, 1.0)
    gap = x - (length - radius) if crank else length + radius - x
    clearance = 2.0 * radius * rng.uniform(0.08, 0.2)
    grows = np.sin(theta) * (-1.0 if crank else 1.0) > 0.0
    low, high, power = gas["suction_MPa"], gas["discharge_MPa"], gas["exponent"]
    expanded = np.maximum(low, high * (clearance / (gap + clearance)) ** power)
    full = low * ((clearance + 2.0 * radius) / (gap + clearance)) ** power
    pressure = np.where(grows, expanded, np.minimum(high, full))
    waves = rng.integers(8, 30)
    pressure *= 1.0 + 0.02 * np.sin(waves * theta + rng.uniform(0.0, math.tau))
    lines = [f"{angle},{value:.5f}" for angle, value in enumerate(pressure)]
    path.write_text("crank_angle_deg,pressure_MPa\n" + "\n".join(lines) + "\n")
    return str(path)


def draw_machine(rng, folder):
    """Return the values of a random machine, as a case file has them; cards are written there."""
    stroke = rng.uniform(100.0, 250.0)
    machine = {
        "stroke_mm": stroke, "rod_length_mm": stroke * rng.uniform(2.2, 3.2),
        "speed_rpm": rng.uniform(300.0, 900.0), "pin_radius_mm": rng.uniform(30.0, 60.0),
        "rod_mass_kg": rng.uniform(10.0, 40.0), "reciprocating_mass_kg": rng.uniform(14.0, 60.0),
    }  # fmt: skip
    action = str(rng.choice(["double", "single", "crank_end"]))
    suction = rng.uniform(0.1, 0.4)
    gas = {
        "bore_mm": rng.uniform(150.0, 280.0), "back_pressure_MPa": 0.1, "suction_MPa": suction,
        "discharge_MPa": suction * rng.uniform(1.8, 4.0), "exponent": rng.uniform(1.15, 1.35),
    }  # fmt: skip
    ends = {"double": ("head", "crank"), "single": ("head",), "crank_end": ("crank",)}[action]
    if action != "single":
        gas |= {"action": action, "rod_diameter_mm": rng.uniform(30.0, 70.0)}
    if rng.random() < 0.3:
        cards = {
            end: write_card(folder / f"{rng.integers(1 << 40)}.csv", rng, gas, machine,
                            end == "crank") for end in ends
        }  # fmt: skip
        for name in ("suction_MPa", "discharge_MPa", "exponent"):
            del gas[name]
        gas["indicator"] = cards
    else:
        gas["clearance_percent"] = {end: rng.uniform(8.0, 20.0) for end in ends}
        if action == "single":
            gas["switching"] = "exact"
    values = {
        "machine": machine, "load": "gas", "gas": gas, "solve": TURN, "output": {"signals": True},
        "joint": str(rng.choice(["big_end", "small_end", "both", "both", "none"])),
        "friction": {"static": 0.08, "dynamic": 0.05},
    }  # fmt: skip
    if values["joint"] == "none":
        del values["friction"], machine["pin_radius_mm"]
        return values
    values["clearance_mm"] = rng.uniform(0.03, 0.3)
    if rng.random() < 0.5:
        values["lubricant"] = {"viscosity_mPa_s": rng.uniform(20.0, 150.0)}
    return values


class NoTruth(Exception):
    """A run at `RTOL` has not reached its end."""


def follow(case, more=()):
    """Return times (s) and rod load (N) of a case's settled part.

    more: times that are sampled as well. Raises NoTruth.
    """
    p, beside = record(case), 1e-9 * case.turn
    edges, _ = segments(p, case.duration)
    count = round(360.0 * case.duration / case.turn / STEP_DEG)
    times = np.linspace(0.0, case.duration, count + 1)
    ends = [case.settle, case.duration]  # or a rounded one would leave out the first sample
    times = np.unique(np.concatenate([times, ends, edges - beside, edges + beside, more]))
    times = times[(times >= 0.0) & (times <= case.duration)]
    if is_ideal(case):
        run = closed_form(p, times, case.settle, 8)
    else:
        run = integrate(Request(p, initial_state(case, p), times, case.settle, RTOL))
        if run.reason:
            raise NoTruth(run.detail)
    settled = times >= case.settle
    return times[settled], rows_of(p, run)[settled, ROD_LOAD]


def side_share(times, load):
    """Return the share of time in which a load is positive, by lines; from and to 0 by halves."""
    before, after = load[:-1], load[1:]
    part = 0.5 * (before > 0.0) + 0.5 * (after > 0.0)
    crosses = before * after < 0.0
    inside = np.maximum(before, 0.0) + np.maximum(after, 0.0)
    np.divide(inside, np.abs(after - before), out=part, where=crosses)
    return part @ np.diff(times) / (times[-1] - times[0])


def read_truth(case):
    """Return what is right of a case, by name."""
    times, load = follow(case)
    changes = np.flatnonzero(np.sign(load[:-1]) != np.sign(load[1:]))
    places = [*(times[i : i + 2] for i in changes)]
    for i in (load.argmax(), load.argmin()):
        places.append((times[max(i - 1, 0)], times[min(i + 1, len(times) - 1)]))
    times, load = follow(case, np.concatenate([np.linspace(*ends, FINER + 1) for ends in places]))
    pull, push = max(load.max(), 0.0), max(-load.min(), 0.0)
    angle = math.tau * min(side_share(times, sign * load) for sign in (1.0, -1.0))
    numbers = angle, min(pull, push) / max(pull, push, 1e-300), pull, push
    return dict(zip(NAMES, numbers, strict=True))


def judge_machine(values):
    """Return the errors over their bars by name; {} where a bar is not known."""
    case = Case.from_values(values)
    numbers = measure(case).numbers
    bars = {name: float(numbers[f"{name}_error"]) for name in NAMES}
    if not all(math.isfinite(bar) for bar in bars.values()):
        return {}
    truth = read_truth(case)
    greater = max(truth[name] for name in NAMES[2:])
    return {
        name: abs(float(numbers[name]) - truth[name])
        / (bars[name] + RESOLUTION * (greater if name in NAMES[2:] else 1.0))
        for name in NAMES
    }


def main():
    """Print each machine's worst error over its bar, and the worst of all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=49)
    parser.add_argument("--count", type=int, default=60)
    given = parser.parse_args()
    rng, worst, judged = np.random.default_rng(given.seed), dict.fromkeys(NAMES, 0.0), 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(given.count):
            values = draw_machine(rng, Path(folder))
            try:
                ratios = judge_machine(values)
            except NoTruth as none:
                print(number, "not judged:", none, flush=True)
                continue
            judged += bool(ratios)
            oil = "oil" if "lubricant" in values else "dry"
            kind = values["gas"].get("action", "single"), values["joint"], oil
            card = "card" if any("indicator" in key for key in values["gas"]) else "gas"
            print(number, *kind, card, *(f"{ratio:.3f}" for ratio in ratios.values()), flush=True)
            for name, ratio in ratios.items():
                worst[name] = max(worst[name], ratio)
    print(f"{judged} of {given.count} judged; worst error over bar:", worst)


if __name__ == "__main__":
    main()
