"""What `compsim identify` is worth (make identify): other machines, and another friction law.

A study of random machines is run as a user's would be. Then records of other machines with other
noise, studies too, are identified: how often the joint is right, how often the true clearance lies
in its 90 % interval, how wide that is, and how often nothing is said to fit. The same machines
again with other friction show how much worse it becomes where the model is wrong. The method was
chosen on machines of other seeds. Writes a small JSON file.
"""

import itertools
import json
from pathlib import Path

import numpy as np
from compsim import cli
from compsim.screen import DONE, SOME_FAILED
from result_pages import keep, provenance, run_campaign
from scipy.stats import binomtest

from compressor.metrics import JOINTS as SIDES
from compressor.studies.diagnosis.identify import Identifier, read_library

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


def case_text(name, count, seed, other):
    """A case file of random machines, equally many of each joint and load; other: than FIXED."""
    spans = {"rod_mass_kg": ROD, "reciprocating_mass_kg": MASS, "speed_rpm": SPEED}
    blocks = []
    for number, (load, joint) in enumerate(itertools.product(LOADS, JOINTS)):
        sample = {"n": count // (len(LOADS) * len(JOINTS)), "seed": seed + number}
        block = {"load": load, "joint": joint, "sample": sample}
        if joint != "none":  # ideal joints have no friction to change
            worn = [side for side in SIDES if joint in (side, "both")]
            block |= {"clearance_mm": {side: {"lhs": CLEARANCE, "log": True} for side in worn}}
            block |= other
        blocks.append(block)
    return json.dumps(FIXED | {
        "name": name, "machine": {key: {"lhs": span} for key, span in spans.items()},
        "sensor": FIXED["sensor"] | {"seed": {"lhs": [0, 2**31 - 1]}},
        "output": {"precision": "single"}, "blocks": blocks,
    })  # fmt: skip


def read_records(folder, name, text, jobs):
    """The library of a study that is run, by the command line, into a folder."""
    path = Path(folder, f"{name}.yaml")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    words = ["run", str(path), "-r", f"{folder}/results", "-j", str(jobs), "--max-jobs", "100000"]
    assert cli.main([*words, "--quiet"]) in (DONE, SOME_FAILED)
    return read_library(f"{folder}/results", name)


def share(held, of):
    """A share with Wilson's 95 % interval."""
    if not of:
        return {"share": None, "of": 0}
    low, high = binomtest(int(held), int(of)).proportion_ci(method="wilson")
    return {"share": held / of, "of": int(of), "low": low, "high": high}


def judged(identifier, records):
    """How answers compare with what the machines of a library are.

    `covered`: of the clearances of joints that were told right; `covered_all`: of all, in the
    intervals of the joint that is worn, whatever is ranked first; `factor`: upper over lower end.
    """
    right, said, false, missed, told, always, factors = [], [], [], [], [], [], []
    for joint, opened, row in zip(
        records.joints, records.clearances, records.features, strict=True
    ):
        answer = identifier.identify(row)
        first = answer.candidates[0].joint
        right.append(first == joint)
        said.append(not answer.fits)
        (false if joint == "none" else missed).append((first != "none") == (joint == "none"))
        own = next(one for one in answer.candidates if one.joint == joint)
        for side, interval in own.clearances.items():
            held = interval.low <= opened[SIDES.index(side)] <= interval.high
            always.append(held)
            if first == joint:
                told.append(held)
                factors.append(interval.high / interval.low)
    worn = np.array([joint != "none" for joint in records.joints])
    return {
        "records": len(worn),
        "right": share(sum(right), len(right)),
        "right_where_worn": share(np.sum(np.array(right)[worn]), worn.sum()),
        "covered": share(sum(told), len(told)),
        "covered_all": share(sum(always), len(always)),
        "factor": np.percentile(factors, (25, 50, 75)).tolist(),
        "nothing_fits": share(sum(said), len(said)),
        "nothing_fits_where_worn": share(np.sum(np.array(said)[worn]), worn.sum()),
        "false_alarms": share(sum(false), len(false)),
        "missed": share(sum(missed), len(missed)),
    }


def main(target, folder="identify", count=STUDY, many=JUDGED, seeds=(SEED, JUDGE), jobs=2):
    text = case_text("machines", count, seeds[0], {})
    identifier = Identifier.fit(read_records(folder, "machines", text, jobs))
    kept = {}
    for number, (name, other) in enumerate(OTHERS.items()):
        study = f"records-{number}"
        text = case_text(study, many, seeds[1], other)
        kept[name] = judged(identifier, read_records(folder, study, text, jobs))
    result = {
        **provenance("make identify"),
        "seeds": list(seeds),
        "ranges": {"clearance_mm": CLEARANCE, "rod_mass_kg": ROD, "reciprocating_mass_kg": MASS,
                   "speed_rpm": SPEED},
        "fixed": FIXED,
        "study": {"jobs": len(identifier.library.keys), "of": count,
                  "right": identifier.right},
        "models": kept,
    }  # fmt: skip
    keep(target, result, 4)


if __name__ == "__main__":
    run_campaign(main)
