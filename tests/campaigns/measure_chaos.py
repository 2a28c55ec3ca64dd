"""Inject faults, many of each kind, and count what did not survive: the campaigns of chaos/.

    python tests/campaigns/measure_chaos.py [--only NAME ...] OUT.json        (make chaos)

Each campaign's result takes its place in the file as soon as it ends; the others stay, so that
campaigns can be repeated one by one. Exit code 1 if anything failed. The power cuts need root.
"""

import importlib
import json
import shutil
import sys
import tempfile
from pathlib import Path

from result_pages import keep, provenance, run_campaign

SEED = 1
FAST = Path("/dev/shm")  # in memory, where there is one: what is tried is not the disk
CAMPAIGNS = {  # module of chaos/: trials
    "kill": 300, "power": 100, "faults": 200, "poison": 200, "flips": 3000, "concurrent": 100,
}  # fmt: skip


def run(name, trials):
    """A campaign's result, in a folder that is gone afterwards."""
    campaign = importlib.import_module(f"chaos.{name}").campaign
    place = tempfile.mkdtemp(prefix="chaos-", dir=FAST if FAST.is_dir() else None)
    try:
        return campaign(trials, SEED, Path(place))
    finally:
        shutil.rmtree(place, ignore_errors=True)


def main(target, only=()):
    failed, path = 0, Path(target)
    for name in only or CAMPAIGNS:
        print(f"{name} ...", file=sys.stderr, flush=True)
        made = provenance(f"make chaos, or python tests/campaigns/measure_chaos.py --only {name}")
        found = {**run(name, CAMPAIGNS[name]), "seed": SEED, **made}
        earlier = json.loads(path.read_text("utf-8"))["campaigns"] if path.exists() else {}
        others = earlier | {name: found}
        keep(target, {"campaigns": {one: others[one] for one in CAMPAIGNS if one in others}})
        print(f"{name}: {found['failed']} of {found['trials']} failed, {found['seconds']} s")
        print(*found["failures"], sep="\n")
        failed += found["failed"]
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    run_campaign(main)
