"""Keys of cases and what is said of mistakes, as they were before the cases were rewritten.

`python tests/cases/test_frozen.py` writes frozen.json anew, where they are meant to change.
"""

import hashlib
import json
import random
import sys
from pathlib import Path

import pytest

from compressor.cases.case import Case, CaseError
from compressor.cases.checks import row_of
from compressor.cases.load import CaseFileError, load_studies
from compressor.cases.table import outside_identity, parts_by_key, table

ROOT = Path(__file__).parents[2]
KEPT = Path(__file__).with_name("frozen.json")
FILES = [*(ROOT / "configs").glob("*.yaml"), *(ROOT / "compressor/cases/examples").glob("*.yaml")]
SWEPT = [
    key
    for key in (*table(), *parts_by_key())
    if key not in outside_identity()
    and row_of(key).kind not in ("text", "card")
    and key.rpartition(".")[0] not in parts_by_key()
]
# what a plant engineer writes at first, and the mistakes of a day, each a file
MISTAKES = [
    "load: gas\ngas: {suction_bar: 2}",
    "load: gas\ngas: {suction_MPa: 2 bar}",
    "load: gas\ngas: {suction_barg: 1}",
    "joint: big_end\nclearance_mm: 0.1\nmachine: {crankpin_diameter_mm: 120}",
    "load: gas\ngas: {piston_diameter_mm: 220}",
    "machine: {stroke_mm: 127 mm}",
    "machine: {crank_radius_mm: 127 mm}",
    "joint: big_end\nclearance_mm: 0,05",
    "joint: big_end\nclearance_mm: [0,05]",
    "machine:\n\tspeed_rpm: 700",
    "machine: {suction_MPa: 0.2}",
    "gas: {speed_rpm: 700}",
    "speed_rpm: 700",
    "solve: {timeout_s: [10, 20]}",
    "machine: {crank_radius_mm: 300, rod_length_mm: 250}",
    "joint: top\nclearance: 0.2",
    "joint: big_end",
    "joint: both\nclearance_mm: {big_end: 0.2}",
    "joint: big_end\nclearance_mm: 11",
    "machine:\n  rod_mass: 3\n  speed_rpm: '500 rpm'\nbody: 3\nlaod: none\nname: a/b",
    "machine: 700",
    "friction: true",
    "machine: {rod_mass_kg: }",
    "machine: {rod_mass_kg: 3, rod_mass_kg: 4}",
    "machine: {rod_mass_kg: true}",
    "machine: {rod_mass_kg: -4.7}",
    "machine: {rod_mass_kg: .nan}",
    "solve: {max_steps: 1.5, accuracy: finer}",
    "solve: {accuracy: {peak_aceleration: 0.01}}",
    "solve: {duration_s: 0.48, duration_rev: 4}",
    "machine: {stroke_mm: 200, crank_radius_mm: 100}",
    "machine: {stroke_mm: 0}",
    "machine: {pin_radius_mm: {big_end: 12}}",
    "contact: {materials: [steel]}\njoint: big_end\nclearance_mm: 0.1",
    "load: gas\ngas: {action: double}",
    "load: gas\ngas: {clearance_percent: 0.17}\njoint: big_end\nclearance_mm: 0.4",
    "gas: {piston_radius_mm: 110, suction_MPa: 0.2}",
    "joint: big_end\nclearance_mm: 0.2\ncontact: {law: hertz, damping_N_s_per_mm: 9}",
    "spring: {stroke_mm: 240}",
    "joint: big_end\nclearance_mm: {linspace: [0.1, 0.3]}",
    "joint: big_end\nclearance_mm: {linspac: [0.1, 0.3, 3]}",
    "joint: big_end\nclearance_mm: {linspace: [0.1, 0.1, 5]}",
    "joint: big_end\nclearance_mm: [0.1, 0.1]",
    "joint: big_end\nclearance_mm: []",
    "joint: big_end\nclearance_mm: [0.1, big]",
    "joint: big_end\nclearance_mm: [0.1, 11, 12]",
    "joint: big_end\nclearance_mm: {random: [0.1, 0.3]}",
    "joint: big_end\nclearance_mm: {lhs: {normal: {mean: 0.2}}}\nsample: {n: 4}",
    "joint: big_end\nclearance_mm: [0.1, 0.2]\nzip: [[clearance_mm, machine.speed_rpm]]",
    "joint: big_end\nclearance_mm: [0.1, 0.2]\nmachine: {speed_rpm: [300, 400, 500]}\n"
    "zip: [[clearance_mm, machine.speed_rpm]]",
    "joint: big_end\nclearance_mm: [0.1, 0.2]\nexclude: clearance > 0.1",
    "joint: big_end\nclearance_mm: [0.1, 0.2]\nexclude: clearance_mm > 0.05",
    "joint: big_end\nclearance_mm: {range: [0.1, 10, 0.0001]}",
    "blocks: 3",
    "blocks: [{name: x}]",
    "sample: {n: 5}",
    "- joint: big_end",
    "joint big_end",
    "joint=big_end",
    "joint: *a",
    "",
]  # fmt: skip


def drawn(row, draw):
    """A value of a key of the table."""
    if row.kind in ("choice", "boolean"):
        return draw.choice(list(row.choices) or [True, False])
    if row.kind == "accuracy":
        return draw.choice(["draft", "fine", {"peak_acceleration": 0.01}])
    if row.kind == "materials":
        return draw.choice([["steel", "steel"], ["steel", "copper"]])
    middle = row.default if isinstance(row.default, float) and row.default else 1.0
    value = middle * draw.choice([0.5, 1, 1, 2, 100]) * draw.uniform(0.7, 1.4)
    value = float(f"{min(max(value, row.low), row.high):.3g}")
    return int(min(10 + value * 1000, row.high)) if row.kind == "integer" else value


def random_values(seed):
    """Values of a case that sets a few keys; they may fit nothing."""
    draw = random.Random(seed)
    found = {"joint": draw.choice(["none", "big_end", "small_end", "both"])}
    if found["joint"] != "none":
        found["clearance_mm"] = 0.2
    for key in draw.sample(SWEPT, 4):
        group, _, name = key.rpartition(".")
        if not group:
            found.setdefault(name, drawn(row_of(key), draw))
        elif key != "clearance_mm":
            found.setdefault(group, {})[name] = drawn(row_of(key), draw)
    return found


def kept_of(path):
    """Jobs, axes and keys of a file of ours."""
    (study,) = load_studies(path, max_jobs=10**6)
    keys = hashlib.sha256("".join(study.keys).encode()).hexdigest()[:20]
    return {"axes": {axis.key: len(axis.values) for axis in study.axes},
            "jobs": study.jobs, "keys": keys, "name": study.name}  # fmt: skip


def told(text, folder):
    """What is said of a mistaken file."""
    path = folder / "case.yaml"
    path.write_text(text, encoding="utf-8")
    try:
        load_studies(path)
    except CaseFileError as error:
        return str(error).replace(f"{folder}/", "").split("\n")
    return []


def frozen(folder):
    """Everything that is kept."""
    cases, seed = [], 0
    while len(cases) < 300:
        seed += 1
        try:
            cases.append([values := random_values(seed), Case.resolve(values).key])
        except CaseError:
            continue
    files = {path.name: kept_of(path) for path in sorted(FILES)}
    return {"cases": cases, "files": files,
            "mistakes": [[text, told(text, folder)] for text in MISTAKES]}  # fmt: skip


FROZEN = json.loads(KEPT.read_text("utf-8")) if KEPT.exists() else {}


def test_keys_of_random_cases_are_those_kept():
    assert len(FROZEN["cases"]) == 300
    moved = [values for values, key in FROZEN["cases"] if Case.resolve(values).key != key]
    assert not moved


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_our_files_have_the_jobs_axes_and_keys_kept(path):
    assert kept_of(path) == FROZEN["files"][path.name]


@pytest.mark.parametrize(("text", "lines"), FROZEN.get("mistakes", []))
def test_mistakes_are_answered_with_place_key_and_remedy(text, lines, tmp_path):
    assert told(text, tmp_path) == lines


if __name__ == "__main__":
    rows = frozen(Path(sys.argv[1]))
    parts = [
        f'"{name}": [\n' + ",\n".join(map(json.dumps, part)) + "\n]"
        if isinstance(part, list)
        else f'"{name}": ' + json.dumps(part, indent=0)
        for name, part in rows.items()
    ]
    KEPT.write_text("{" + ",\n".join(parts) + "}\n", encoding="utf-8")
