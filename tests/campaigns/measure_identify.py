"""What `compsim identify` is worth (make identify): other machines, and another friction law.

A study of random machines goes through the store as a user's would. Then records of other machines
with other noise are identified: how often the joint is right, how often the true clearance lies in
its 90 % interval, how wide that is, and how often nothing is said to fit. The same machines again
with other friction show how much worse it becomes where the model is wrong. The method was chosen
on machines of other seeds. Writes a small JSON file.
"""

import copy
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from result_pages import keep, provenance, run_campaign
from scipy.stats import binomtest, qmc

from compressor.cases.case import Case
from compressor.solve.simulate import simulate
from compressor.studies.diagnosis.features import FEATURES, features
from compressor.studies.diagnosis.identify import SIDES, Identifier, read_library

STUDY, SEED, JUDGE = 3000, 2103, 2104  # machines of the study; seeds of it and of the judged
JUDGED = 200
CLEARANCE, ROD, MASS, SPEED = (0.05, 0.5), (2, 8), (4, 25), (300, 700)  # mm, log-uniform; kg; rpm
LOADS, JOINTS = ("spring", "gas"), ("none", "big_end", "small_end", "both")
FIXED = {
    "body": {"mass_kg": 500, "frequency_x_Hz": 30, "frequency_y_Hz": 30},
    "sensor": {
        "place": "guide", "direction": "y", "length_rev": 11, "speed_jitter": 0.002,
        "noise_m_per_s2": 0.05,
    },
    "solve": {"output_step_deg": 3.6, "error_bars": False},
}  # fmt: skip
OTHERS = {  # what records come from, beside the study's own model
    "the study's own": {},
    "no friction": {"friction": False},
    "flat: static = dynamic = 0.15": {"friction": {"static": 0.15, "dynamic": 0.15}},
    "slow: transitions at 1 and 2 m/s": {
        "friction": {"stiction_velocity_mm_per_s": 1000, "friction_velocity_mm_per_s": 2000}
    },
}


def short(value):
    """A number to four digits, so that a case can be written into a file."""
    return float(f"{value:.4g}")


def machines(count, seed):
    """Machines of a Latin hypercube, equally many of each joint, as values of a case file."""
    drawn = qmc.LatinHypercube(6, seed=seed).random(count)
    rng = np.random.default_rng(seed)
    joints = rng.permutation(np.arange(count) % len(JOINTS))
    found = []
    for (rod, mass, speed, big, small, load), number in zip(drawn, joints, strict=True):
        joint, (low, high) = JOINTS[number], CLEARANCE
        ends = [short(low * (high / low) ** share) for share in (big, small)]
        sides = {
            side: end for side, end in zip(SIDES, ends, strict=True) if joint in (side, "both")
        }
        found.append({
            "load": LOADS[int(len(LOADS) * load)], "joint": joint, "clearance_mm": sides,
            "machine": {
                "rod_mass_kg": short(ROD[0] + (ROD[1] - ROD[0]) * rod),
                "reciprocating_mass_kg": short(MASS[0] + (MASS[1] - MASS[0]) * mass),
                "speed_rpm": short(SPEED[0] + (SPEED[1] - SPEED[0]) * speed),
            },
            "sensor": {"seed": int(rng.integers(2**31))},
        })  # fmt: skip
    return found


def case_file(drawn):
    """A case file with these machines as its jobs, all keys advancing together."""
    values = copy.deepcopy(FIXED)
    values |= {name: [one[name] for one in drawn] for name in ("load", "joint")}
    values["clearance_mm"] = {
        side: [one["clearance_mm"].get(side, 0) for one in drawn] for side in SIDES
    }
    values["machine"] = {
        name: [one["machine"][name] for one in drawn] for name in drawn[0]["machine"]
    }
    values["sensor"]["seed"] = [one["sensor"]["seed"] for one in drawn]
    together = [f"clearance_mm.{side}" for side in SIDES]
    together += [f"machine.{name}" for name in values["machine"]]
    values["zip"] = [["load", "joint", *together, "sensor.seed"]]
    return values | {"output": {"precision": "single"}}


def case_of(machine, other):
    """A machine's case; `other`: what of the model is changed."""
    values = {**copy.deepcopy(FIXED), **copy.deepcopy(machine)}
    values["sensor"] = FIXED["sensor"] | machine["sensor"]
    if values["clearance_mm"]:  # ideal joints have no friction to change
        values |= other
    else:
        del values["clearance_mm"]
    return Case.from_values(values)


def row_of(machine, other):
    """The features of a machine's record; `other`: what of the model is changed."""
    run = simulate(case_of(machine, other))
    times, heard, tacho = (
        run[name].values for name in ("sensor_time", "sensor_acceleration", "tacho_time")
    )
    found = features(times, heard, tacho)
    return np.array([found[name] for name in FEATURES])


def share(held, of):
    """A share with Wilson's 95 % interval."""
    if not of:
        return {"share": None, "of": 0}
    low, high = binomtest(int(held), int(of)).proportion_ci(method="wilson")
    return {"share": short(held / of), "of": int(of), "low": short(low), "high": short(high)}


def judged(identifier, drawn, rows):
    """How answers compare with what machines are.

    `covered`: of the clearances of joints that were told right; `covered_all`: of all, in the
    intervals of the joint that is worn, whatever is ranked first; `factor`: upper over lower end.
    """
    right, said, false, missed, told, always, factors = [], [], [], [], [], [], []
    confused = {joint: dict.fromkeys(JOINTS, 0) for joint in JOINTS}
    for machine, row in zip(drawn, rows, strict=True):
        answer, joint = identifier.identify(row), machine["joint"]
        first = answer.candidates[0].joint
        right.append(first == joint)
        said.append(not answer.fits)
        confused[joint][first] += 1
        (false if joint == "none" else missed).append((first != "none") == (joint == "none"))
        own = next(one for one in answer.candidates if one.joint == joint)
        for side, interval in own.clearances.items():
            held = interval.low <= machine["clearance_mm"][side] <= interval.high
            always.append(held)
            if first == joint:
                told.append(held)
                factors.append(interval.high / interval.low)
    worn = np.array([machine["joint"] != "none" for machine in drawn])
    return {
        "records": len(drawn),
        "right": share(sum(right), len(right)),
        "right_where_worn": share(np.sum(np.array(right)[worn]), worn.sum()),
        "covered": share(sum(told), len(told)),
        "covered_all": share(sum(always), len(always)),
        "factor": [short(value) for value in np.percentile(factors, (25, 50, 75))],
        "nothing_fits": share(sum(said), len(said)),
        "nothing_fits_where_worn": share(np.sum(np.array(said)[worn]), worn.sum()),
        "false_alarms": share(sum(false), len(false)),
        "missed": share(sum(missed), len(missed)),
        "confused": confused,
    }


def studied(folder, count, seed, jobs):
    """An identifier of a study that was run, by the command line, into a folder."""
    path = Path(folder, "machines.yaml")
    path.write_text(json.dumps(case_file(machines(count, seed))), encoding="utf-8")
    code = "import sys; from compsim.cli import main; sys.exit(main())"
    results = os.path.join(folder, "results")
    words = ["run", os.fspath(path), "-r", results, "-j", str(jobs), "--quiet"]
    subprocess.run([sys.executable, "-c", code, *words], check=True)
    return Identifier.fit(read_library(results, "machines"))


def main(target, folder="identify", count=STUDY, many=JUDGED, seeds=(SEED, JUDGE), jobs=2):
    identifier = studied(folder, count, seeds[0], jobs)
    drawn = machines(many, seeds[1])
    kept = {}
    with Parallel(n_jobs=jobs) as parallel:
        for name, other in OTHERS.items():
            rows = parallel(delayed(row_of)(machine, other) for machine in drawn)
            kept[name] = judged(identifier, drawn, rows)
    result = {
        **provenance("make identify"),
        "seeds": list(seeds),
        "ranges": {"clearance_mm": CLEARANCE, "rod_mass_kg": ROD, "reciprocating_mass_kg": MASS,
                   "speed_rpm": SPEED},
        "fixed": FIXED,
        "study": {"jobs": len(identifier.library.keys), "of": count,
                  "right": short(identifier.right)},
        "models": kept,
    }  # fmt: skip
    keep(target, result)
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    run_campaign(main)
