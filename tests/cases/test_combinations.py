"""The jobs of a sweep are what each is by itself."""

import itertools
import json
import random
import re

from compressor.cases.case import Case
from compressor.cases.checks import row_of
from compressor.cases.conflicts import reads
from compressor.cases.load import CaseFileError, load_studies
from compressor.cases.parameter import CaseError
from compressor.cases.table import outside_identity, parts_by_key, table


def drawn(row, draw):
    """A few values of a key of the table: usual ones, and some that may fit nothing."""
    if row.kind in ("choice", "boolean"):
        words = list(row.choices) or [True, False]
        return draw.sample(words, min(len(words), 2))
    if row.kind == "accuracy":
        return ["draft", "fine", {"peak_acceleration": 0.01}][: draw.randint(2, 3)]
    if row.kind == "materials":
        return [["steel", "steel"], ["steel", "copper"]]
    middle = row.default if isinstance(row.default, float) and row.default else 1.0
    spans = [draw.choice([0.5, 1, 1, 2, 100]) * draw.uniform(0.7, 1.4) for _ in range(3)]
    values = {float(f"{min(max(middle * span, row.low), row.high):.3g}") for span in spans}
    if row.kind == "integer":
        return sorted({int(min(10 + int(span * 1000), row.high)) for span in spans})
    return sorted(values - {row.low}) + [word for word in row.choices if draw.random() < 0.2]


WORN = Case.from_values({"joint": "both", "clearance_mm": 0.2, "guide": True})
SWEPT = [
    key
    for key in (*table(), *parts_by_key())
    if key not in outside_identity()
    and reads(WORN, key)  # else most are refused, which test_unread.py has
    and row_of(key).kind not in ("text", "card")
    and key.rpartition(".")[0] not in parts_by_key()
]


def random_file(seed):
    """A case file that sweeps some keys, as nested values."""
    draw = random.Random(seed)
    found = {"joint": draw.choice(["big_end", "small_end", "both"]), "clearance_mm": 0.2}
    if draw.random() < 0.3:
        found["joint"] = ["none", "both"]
    for key in draw.sample(SWEPT, draw.randint(2, 4)):
        values = drawn(row_of(key), draw)
        group, _, name = key.rpartition(".")
        if not values or key == "clearance_mm":
            found["clearance_mm"] = [0.1, 0.25]
        elif not group:
            found[name] = values
        elif isinstance(found.setdefault(group, {}), dict):
            found[group][name] = values
    return {key: value for key, value in found.items() if value != {}}


def combinations(found):
    """The values of each job of a file without blocks, written out."""
    axes = []
    for key, value in found.items():
        if isinstance(value, list):
            axes.append([(key, "", one) for one in value])
        elif isinstance(value, dict):
            axes += [[(key, name, one) for one in many] for name, many in value.items()]
    for chosen in itertools.product(*axes):
        values = {key: value for key, value in found.items() if not isinstance(value, list | dict)}
        for group, name, value in chosen:
            if name:
                values.setdefault(group, {})[name] = value
            else:
                values[group] = value
        if values["joint"] == "none":
            values.pop("clearance_mm")
        yield values


def test_random_sweeps_are_what_their_jobs_are(tmp_path):
    path, planned, conflicts = tmp_path / "case.yaml", 0, 0
    for seed in range(45):
        found = random_file(seed)
        path.write_text(json.dumps(found))
        keys, problems = [], set()
        for values in combinations(found):
            try:
                keys.append(Case.resolve(values | {"name": "case"}).key)
            except CaseError as error:
                problems |= {problem.message for problem in error.problems}
        try:
            (study,) = load_studies(path, max_jobs=1_000_000)
        except CaseFileError as error:
            told = {one.message for one in error.problems}
            told = {one for one in told if not re.search("between swept|nothing reads this", one)}
            assert told <= problems, seed  # of each value one
            assert bool(told) == bool(problems), seed
            conflicts += bool(told)
        else:
            assert list(study.keys) == keys == [case.key for case in study.cases], seed
            assert not problems, seed
            planned += 1
    assert planned >= 20
    assert conflicts >= 20
