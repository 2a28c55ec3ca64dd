"""Inject faults, many of each kind, and count what did not survive: the campaigns of chaos/.

    python tests/campaigns/measure_chaos.py [--sample] [--only NAME]... OUT.json        (make chaos)

Each campaign's result takes its place in the file as soon as it ends; the others stay, so that
campaigns can be repeated one by one. Exit code 1 if anything failed. The power cuts need root.
"""

import argparse
import importlib
import json
import shutil
import sys
import tempfile
from pathlib import Path

from measure_accuracy import provenance

SEED = 1
FAST = Path("/dev/shm")  # in memory, where there is one: what is tried is not the disk
CAMPAIGNS = {  # name: (module of chaos/, trials, trials of a sample)
    "kill": ("kill", 300, 5),
    "power": ("power", 100, 1),
    "faults": ("faults", 200, 1),
    "poison": ("poison", 200, 4),
    "flips": ("flips", 3000, 5),
    "concurrent": ("concurrent", 100, 3),
}


def run(name, sample, seed=SEED):
    """A campaign's result, in a folder that is gone afterwards."""
    module, full, few = CAMPAIGNS[name]
    campaign = importlib.import_module(f"chaos.{module}").campaign
    place = tempfile.mkdtemp(prefix="chaos-", dir=FAST if FAST.is_dir() else None)
    try:
        return campaign(few if sample else full, seed, Path(place))
    finally:
        shutil.rmtree(place, ignore_errors=True)


def kept(path):
    """What an earlier call left in the file."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {"campaigns": {}}


def main(target, names, sample):
    failed = 0
    for name in names:
        print(f"{name} ...", file=sys.stderr, flush=True)
        made = provenance(f"make chaos, or python tests/campaigns/measure_chaos.py --only {name}")
        found = {**run(name, sample), "sample": sample, "seed": SEED, **made}
        others = kept(target)["campaigns"] | {name: found}
        ordered = {n: others[n] for n in CAMPAIGNS if n in others}
        target.write_text(json.dumps({"campaigns": ordered}, indent=1) + "\n", encoding="utf-8")
        print(f"{name}: {found['failed']} of {found['trials']} failed, {found['seconds']} s")
        for text in found["failures"]:
            print(text)
        failed += found["failed"]
    return 1 if failed else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", type=Path, help="file to write")
    parser.add_argument("--only", action="append", choices=CAMPAIGNS, help="a campaign")
    parser.add_argument("--sample", action="store_true", help="some trials of each")
    asked = parser.parse_args()
    sys.exit(main(asked.target, asked.only or [*CAMPAIGNS], asked.sample))
