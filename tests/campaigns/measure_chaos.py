"""Inject faults, many of each kind, and count what did not survive: the campaigns of chaos/.

    python tests/campaigns/measure_chaos.py [--only NAME ...] OUT.json        (make chaos)

Each campaign's result takes its place in the file as soon as it ends; the others stay, so that
campaigns can be repeated one by one. Exit code 1 if anything failed. The power cuts need root.
"""

import importlib
import json
import random
import sys
import time
from collections import Counter
from pathlib import Path

from chaos.common import fresh
from result_pages import keep, provenance, run_campaign

SEED = 1
FAST = Path("/dev/shm")  # in memory, where there is one: what is tried is not the disk
CAMPAIGNS = {  # module of chaos/: trials
    "kill": 300, "power": 100, "faults": 136, "poison": 200, "flips": 3000, "concurrent": 100,
}  # fmt: skip


def run(name, trials):
    """A campaign's result, in a folder that is gone afterwards."""
    campaign = importlib.import_module(f"chaos.{name}")
    counts, failures, began = Counter(), [], time.monotonic()
    with fresh(FAST if FAST.is_dir() else None) as folder:
        if hasattr(campaign, "unable") and (reason := campaign.unable(folder)):
            return {"what": campaign.WHAT, "trials": 0, "failed": 0, "skipped": reason}
        for number in range(SEED, SEED + trials):
            with fresh(folder) as place:
                draw = random.Random(f"{name} {number}")
                if problem := campaign.trial(place, draw, number, counts):
                    failures.append(f"trial {number}: {problem[-1500:]}")
    return {
        "what": campaign.WHAT, "trials": trials, "failed": len(failures), "counts": dict(counts),
        "seconds": round(time.monotonic() - began, 1), "failures": failures,
    }  # fmt: skip


def main(target, only=()):
    failed, path = 0, Path(target)
    for name in only or CAMPAIGNS:
        print(f"{name} ...", file=sys.stderr, flush=True)
        made = provenance(f"make chaos, or python tests/campaigns/measure_chaos.py --only {name}")
        found = {**run(name, CAMPAIGNS[name]), "seed": SEED, **made}
        earlier = json.loads(path.read_text("utf-8"))["campaigns"] if path.exists() else {}
        others = earlier | {name: found}
        keep(target, {"campaigns": {one: others[one] for one in CAMPAIGNS if one in others}})
        print(name, json.dumps(found, indent=1))
        failed += found["failed"]
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    run_campaign(main)
