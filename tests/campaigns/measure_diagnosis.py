"""Which faults a plain classifier tells apart, on machines that it never saw (make diagnosis).

Simulates a population of machines (machines.py) by `compsim run`, makes a data set of them as
`compsim dataset` does, and trains at each noise level a random forest that names the joint with
clearance, and one for each joint that tells the logarithm of its clearance, given that it is worn.
Defaults of scikit-learn but for the number of trees; nothing was tuned. Scores are of the windows
of test machines. Writes a small JSON file.
"""

import argparse
import importlib.metadata
import itertools
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from compsim import cli
from machines import BODY, CLEARANCE_MM, JOINTS, SENSOR, machines
from measure_accuracy import provenance
from sklearn.dummy import DummyClassifier
from sklearn.ensemble import RandomForestClassifier, RandomForestRegressor
from sklearn.metrics import balanced_accuracy_score, confusion_matrix, r2_score

from compressor.studies.diagnosis.dataset import make_data_set

MACHINES, SEED = 2000, 1
NOISE = (0.0, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0)  # m/s2 rms, beside the sensor's own
TREES, STATE = 300, 1
BINS = (0.05, 0.1, 0.2, 0.5)  # mm: edges of clearances that recall is told by
CONFUSED = 0.1  # share of a joint's windows that are told as another, from which on it is listed
LEVEL = "level"  # the one feature that knows m/s2
ENDS = ("big_end", "small_end")


def population(folder, count=MACHINES, seed=SEED, more=()):
    """Run the machines that are not stored yet; their data set at every noise level."""
    case_file = Path(folder, "machines.yaml")
    case_file.write_text(machines(count, seed), encoding="utf-8")
    results = str(Path(folder, "results"))
    sets = [word for text in more for word in ("--set", text)]
    code = cli.main(["run", str(case_file), "-r", results, "--quiet", *sets])
    if code not in (0, 3):  # 3: some failed, which the data set counts
        sys.exit(code)
    return make_data_set(results, "machines", noise=NOISE, signals=False)


def short(value):
    """A number to three digits."""
    return float(f"{value:.3g}")


def plain(joints):
    """The joints of windows as numbers, in the order of JOINTS."""
    return np.array([JOINTS.index(joint) for joint in joints])


def classifier():
    return RandomForestClassifier(TREES, random_state=STATE, n_jobs=2)


def by_machine(right, machine):
    """Standard error of a share of windows, (n,): those of a machine are not independent."""
    means = [right[machine == one].mean() for one in np.unique(machine)]
    return float(np.std(means, ddof=1) / np.sqrt(len(means)))


def told_apart(found, level):
    """Scores of the classifier at a noise level."""
    train, test = (found["split"].values == name for name in ("train", "test"))
    truth, values = plain(found["joint"].values), found["features"].values[:, level]
    clean = found["features"].values[:, 0]
    blind = [name != LEVEL for name in found["feature"].values]
    told = classifier().fit(values[train], truth[train]).predict(values[test])
    other = classifier().fit(clean[train], truth[train]).predict(values[test])
    unscaled = classifier().fit(values[train][:, blind], truth[train])
    matrix = confusion_matrix(truth[test], told, labels=range(len(JOINTS)))
    shares = matrix / matrix.sum(axis=1, keepdims=True)
    dummy = DummyClassifier(strategy="most_frequent").fit(values[train], truth[train])
    right = told == truth[test]
    return {
        "accuracy": short(right.mean()),
        "standard_error": short(by_machine(right, found["machine"].values[test])),
        "balanced_accuracy": short(balanced_accuracy_score(truth[test], told)),
        "most_frequent": short(dummy.score(values[test], truth[test])),
        "without_level": short(unscaled.score(values[test][:, blind], truth[test])),
        "trained_without_noise": short(np.mean(other == truth[test])),
        "confusion": matrix.tolist(),
        "recall": {joint: short(shares[k, k]) for k, joint in enumerate(JOINTS)},
        "missed": short(np.mean(told[truth[test] > 0] == 0)),
        "false_alarms": short(np.mean(told[truth[test] == 0] > 0)),
        "confused": [
            {"joint": JOINTS[a], "told": JOINTS[b], "share": short(shares[a, b])}
            for a, b in itertools.product(range(len(JOINTS)), repeat=2)
            if a != b and shares[a, b] > CONFUSED
        ],
        "bins": by_clearance(found, test, right, told),
    }


def by_clearance(found, test, right, told):
    """Accuracy and missed faults by the smallest clearance of a worn joint."""
    both = np.stack([found[f"clearance_mm_{end}"].values[test] for end in ENDS])
    least = np.where(both > 0, both, np.inf).min(axis=0)
    rows = []
    for low, high in itertools.pairwise(BINS):
        inside = (least >= low) & (least < high)  # no draw is as large as the last edge
        rows.append({
            "clearance_mm": [low, high],
            "windows": int(inside.sum()),
            "accuracy": short(right[inside].mean()),
            "missed": short(np.mean(told[inside] == 0)),
        })  # fmt: skip
    return rows


def sized(found, level, end):
    """How far the regressor's clearance of an end is from the true one, by what else is worn."""
    size = found[f"clearance_mm_{end}"].values
    values = found["features"].values[:, level]
    train, test = (found["split"].values == name for name in ("train", "test"))
    train, test = train & (size > 0), test & (size > 0)
    forest = RandomForestRegressor(TREES, random_state=STATE, n_jobs=2)
    forest.fit(values[train], np.log(size[train]))
    usual = np.median(np.log(size[train]))
    rows = {}
    for joint in (end, "both"):
        mine = test & (found["joint"].values == joint)
        truth, told = np.log(size[mine]), forest.predict(values[mine])
        rows[joint] = {
            "windows": int(mine.sum()),
            "median_error": short(np.median(np.abs(np.expm1(told - truth)))),
            "error_90": short(np.percentile(np.abs(np.expm1(told - truth)), 90)),
            "r2_log": short(r2_score(truth, told)),
            "median_error_of_the_median": short(np.median(np.abs(np.expm1(usual - truth)))),
        }
    return rows


def judged(found):
    """The scores at every noise level of the data set."""
    return [
        {
            "noise": float(rms),
            "classifier": told_apart(found, level),
            "regressor": {end: sized(found, level, end) for end in ENDS},
        }
        for level, rms in enumerate(found["noise"].values)
    ]


def typical_rms(found):
    """Quantiles, 10, 50 and 90 %, of the windows' rms (m/s2) without added noise, by joint."""
    rms = 10.0 ** found["features"].sel(feature=LEVEL).values[:, 0]
    joints = found["joint"].values
    return {
        joint: [short(v) for v in np.percentile(rms[joints == joint], (10, 50, 90))]
        for joint in JOINTS
    }


def measured(found, seed):
    """All that is kept of a data set's scores."""
    splits, machine = found["split"].values, found["machine"].values
    return {
        "seed": seed,
        "jobs": found.attrs["jobs"],
        "left_out": json.loads(found.attrs["left_out"]),
        "machines": {n: len({*machine[splits == n].tolist()}) for n in ("train", "test")},
        "windows": {n: int((splits == n).sum()) for n in ("train", "test")},
        "revolutions": int(found.attrs["revolutions"]),
        "features": found.sizes["feature"],
        "clearance_mm": list(CLEARANCE_MM),
        "body": BODY,
        "sensor": SENSOR,
        "trees": TREES,
        "joints": list(JOINTS),
        "confused_from": CONFUSED,
        "rms": typical_rms(found),
        "levels": judged(found),
    }


def main(target, count, seed, folder):
    with tempfile.TemporaryDirectory() as made:
        found = population(folder or made, count, seed)
    kept = {
        **provenance("make diagnosis"),
        "scikit-learn": importlib.metadata.version("scikit-learn"),
        **measured(found, seed),
    }
    text = json.dumps(kept, indent=1)
    Path(target).write_text(text + "\n", encoding="utf-8")
    print(text)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", help="file to write")
    parser.add_argument("--machines", type=int, default=MACHINES)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--folder", help="where machines are kept, to go on there; 1.5 GB")
    asked = parser.parse_args()
    main(asked.target, asked.machines, asked.seed, asked.folder)
