"""Write what the program computes of many cases, to the last bit (make oracle), and compare two.

A change of the source that is to change no number is judged by it: `write_oracle.py NEW.json
--against OLD.json` prints what differs and ends with 1 if anything does. With `--within`, a number
that has an error bar differs only where it lies farther than both bars from the old one; numbers
without a bar, series, keys and figures are then not compared. Of each case: its keys, every number
and word of its row (numbers as hex, times that the machine took left out) and a digest of its
series; of the report over configs/, a digest of the CSV of each figure. The results are of one
machine and its libraries, which the file names. A file whose name ends with .xz is packed.
"""

import argparse
import hashlib
import json
import lzma
import math
import platform
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from compsim import cli
from compsim.screen import one_thread_each

one_thread_each()  # before numpy loads: last bits of SciPy's methods depend on it
import numpy as np
from joblib import Parallel, delayed
from random_cases import strangers

from compressor.cases.case import Case
from compressor.cases.load import load_studies
from compressor.program import ignore_warnings
from compressor.solve.simulate import simulate

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "tests/results/oracle.json.xz"
SEED = 33
LEFT_OUT = {"assumptions.yaml", "extremes.yaml"}  # examples that came after the kept file
# machines of the example `claims` as they were: ideal ones of a finer map
OVERRIDES = {
    "claims.yaml": (
        "blocks=[{}]", "output={keep: series}", "machine.rod_mass_kg={linspace: [1.5, 9.3, 40]}",
        "machine.reciprocating_mass_kg={linspace: [2.5, 29.8, 40]}",
    ),
}  # fmt: skip
SCIPY_METHODS = ("DOP853", "RK45", "Radau", "LSODA")
TIMINGS = ("seconds", "written", "versions", "host")  # parts of names of what differs by the run
WORDS = ("status", "reason", "promise", "regime")  # of a row, that `--within` compares
PATIENCE = 600.0  # s of wall time for a case: a busy machine is to change no result
JOBS_OF_A_STUDY = 12  # the first ones of an example


def cases_by_name():
    """Return the cases whose numbers are compared, by name."""
    found = {}
    paths = [*ROOT.glob("configs/*.yaml"), *ROOT.glob("compressor/cases/examples/*.yaml")]
    for path in sorted(paths):
        for study in (
            []
            if path.name in LEFT_OUT
            else load_studies(path, overrides=OVERRIDES.get(path.name, ()))
        ):
            for number in range(min(study.jobs, JOBS_OF_A_STUDY)):
                found[f"{path.name} {number}"] = study.cases[number]
    for number, drawn in enumerate(strangers(SEED, 300)):
        found[f"plain {number}"] = Case.from_values(drawn)
    for name, row in load(KEPT).items():  # extreme scenes with other laws and features
        if name.startswith(("laws ", "features ")):
            found[name] = Case.from_attribute(row["attribute case"][0])
    for number, drawn in enumerate(strangers(SEED + 1, 20)):
        solve = {"method": SCIPY_METHODS[number % len(SCIPY_METHODS)], "duration_rev": 1,
                 "settle_rev": 0, "accuracy": "draft"}  # fmt: skip
        found[f"scipy {number}"] = Case.from_values({**drawn, "solve": solve})
    return found


def exact(value):
    """Return a value as JSON holds it without loss: numbers as hex, arrays by shape and digest."""
    array = np.asarray(value)
    if array.dtype.kind in "fiub":
        if array.size > 16:
            data = np.ascontiguousarray(array)
            return [*map(str, array.shape), hashlib.sha256(data.tobytes()).hexdigest()[:16]]
        return [one.hex() if isinstance(one, float) else one for one in array.ravel().tolist()]
    return [str(one) for one in array.ravel().tolist()]


def outcome(case):
    """Return everything that a run of a case gives, by name, but what differs from run to run."""
    patient = replace(case, solve=replace(case.solve, timeout_s=PATIENCE))
    with ignore_warnings():
        run = simulate(patient)
    found = {name: exact(variable.values) for name, variable in run.variables.items()}
    found |= {f"attribute {name}": exact(value) for name, value in run.attrs.items()}
    return {
        name: value for name, value in found.items() if not any(word in name for word in TIMINGS)
    }


def figures():
    """Return a digest of each CSV that the report over configs/ writes."""
    with tempfile.TemporaryDirectory() as place:
        results, report = f"{place}/results", f"{place}/report"
        configs = [str(path) for path in sorted(ROOT.glob("configs/*.yaml"))]
        for words in (["run", *configs, "-r", results], ["report", "-r", results, "-o", report]):
            if code := cli.main(words):
                sys.exit(code)
        return {
            str(path.relative_to(report)): hashlib.sha256(path.read_bytes()).hexdigest()[:16]
            for path in sorted(Path(report).rglob("*.csv"))
        }


def machine():
    """Return processor and libraries, which the last bits depend on."""
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.partition(":")[2].strip() for line in file if line.startswith("model name")]
    return {"processor": names[:1], "python": platform.python_version()}


def differences(new, old):
    """Return a line for each thing that differs between two files of this script."""
    lines = []
    for name in sorted(new.keys() | old.keys()):
        one, other = new.get(name), old.get(name)
        if one is None or other is None:
            lines.append(f"{name}: only in the {'new' if other is None else 'old'} file")
        elif isinstance(one, dict):
            lines += [f"{name}: {line}" for line in differences(one, other)]
        elif one != other:
            lines.append(f"{name}: {other} was, {one} is")
    return lines


def beyond_bars(new, old):
    """Return a line for each case that is only in one file, or whose words or numbers differ.

    Numbers differ where they are farther apart than the sum of both error bars.
    """
    lines = []
    for name in sorted((new.keys() | old.keys()) - {"figures", "machine"}):
        if name not in new or name not in old:
            lines.append(f"{name}: only in the {'new' if name in new else 'old'} file")
            continue
        now, then = new[name], old[name]
        lines += [
            f"{name}: {word}: {then.get(word)} was, {now.get(word)} is"
            for word in WORDS
            if now.get(word) != then.get(word)
        ]
        for number in then:
            bar = f"{number}_error"
            each = [one.get(name) for one in (now, then) for name in (number, bar)]
            if None not in each and len({*map(len, each)}) == 1:
                pairs = zip(*(map(read, one) for one in (now[number], then[number])), strict=True)
                bars = zip(*(map(read, one) for one in (now[bar], then[bar])), strict=True)
                lines += [
                    f"{name}: {number}: {b!r} was, {a!r} is, bars {d:.2g} and {c:.2g}"
                    for (a, b), (c, d) in zip(pairs, bars, strict=True)
                    if abs(a - b) > c + d or math.isnan(a) != math.isnan(b)
                ]
    return lines


def read(text):
    """Return a number that `exact` wrote; what is no number is nan."""
    return float.fromhex(text) if isinstance(text, str) and "x" in text else math.nan


def load(path):
    """Return what a file of this script holds."""
    data = Path(path).read_bytes()
    return json.loads(lzma.decompress(data) if str(path).endswith(".xz") else data)


def save(found, path):
    """Write a file of this script."""
    data = (json.dumps(found, indent=0) + "\n").encode()
    Path(path).write_bytes(lzma.compress(data, preset=9) if str(path).endswith(".xz") else data)


def main(target, jobs, against, within):
    cases = cases_by_name()
    found = Parallel(n_jobs=jobs, verbose=1)(delayed(outcome)(case) for case in cases.values())
    made = dict(zip(cases, found, strict=True)) | {"figures": figures(), "machine": machine()}
    save(made, target)
    if against:
        compare = beyond_bars if within else differences
        lines = compare(made, load(against))
        print("\n".join(lines) or f"{len(made)} entries are equal")
        sys.exit(bool(lines))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", help="file to write")
    parser.add_argument("--jobs", type=int, default=2, help="worker processes")
    parser.add_argument("--against", default="", help="an older file to compare with")
    parser.add_argument("--within", action="store_true", help="compare within both error bars")
    asked = parser.parse_args()
    main(asked.target, asked.jobs, asked.against, asked.within)
