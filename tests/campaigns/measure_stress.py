"""Keep what `compsim stress` finds, for the README (make stress, within the hour).

Runs the command and writes a small JSON file and, beside it, the map of outcomes. A campaign that
was interrupted goes on from its folder. With --fresh the outcomes of scenes of another seed, which
chose nothing, are kept in the file beside those of the whole campaign; with --drawn those of scenes
with drawn laws, or laws and features.
"""

import argparse
import json
import shutil
from pathlib import Path

import numpy as np
import xarray as xr
from compsim import cli
from compsim.screen import DONE, SOME_FAILED
from measure_accuracy import provenance

from compressor.studies.stress.extremes import SPANS
from compressor.studies.stress.stress import FILE, counts, slowest, worst
from compressor.studies.stress.words import command

WORST = 10
SHOWN = ("verdict", "reason", "joint", "load", "rtol", "judges", "worst_metric", "horizon",
         "judged", "excess", "excess_beyond", "error", "bar", "seconds")  # fmt: skip


def plain(value):
    """A number to three digits, None for nan; text as it is."""
    value = value.item() if isinstance(value, np.generic) else value
    if not isinstance(value, float):
        return value
    return None if value != value else float(f"{value:.3g}")


def described(study, scene):
    """A scene's outcome, and the command that repeats it."""
    return {
        "command": command(scene, study.attrs),
        **{name: plain(scene[name].values[()]) for name in SHOWN},
    }


def ranges():
    """The drawn ranges: unit, whole and supported."""
    return {
        name: {"unit": unit, "whole": whole, "supported": narrow or whole}
        for name, (unit, whole, narrow, _) in SPANS.items()
    }


def found(study):
    """What is kept of a campaign."""
    most = worst(study, WORST)
    wrong = int((study["verdict"].values == "silent_wrong").sum())
    good = study.isel(scene=study["verdict"].values == "ok")
    return {
        "scenes": study.sizes["scene"],
        "seed": int(study.attrs["seed"]),
        "settings": study.attrs["settings"],
        "ranges": ranges(),
        "ends": counts(study),
        "silent_wrong": wrong,
        "at_most": plain(3.0 / study.sizes["scene"]),  # 95 % bound where none was found
        "unforeseeable": int((good["horizon"].values < 1).sum()),
        "judged_whole": int((good["judged"].values == 1).sum()),
        "worst": [described(study, most.isel(scene=i)) for i in range(most.sizes["scene"])],
        "slowest": described(study, slowest(study)),
        "slowest_judging_s": plain(float(study["judging_seconds"].max())),
        "peak_memory_MiB": round(float(study["peak_memory"].max()) / 2**20),
    }


def fresh(study):
    """What is kept of scenes of another seed: how many, how they ended, and which were wrong."""
    wrong = study.isel(scene=study["verdict"].values == "silent_wrong")
    return {
        "seed": int(study.attrs["seed"]),
        "drawn": study.attrs["drawn"],
        "scenes": study.sizes["scene"],
        "ends": counts(study),
        "silent_wrong": [
            described(study, wrong.isel(scene=i)) for i in range(wrong.sizes["scene"])
        ],
    }


def beside(target, made):
    """A campaign's file with fresh scenes in it, in place of earlier ones of their seed."""
    kept = json.loads(target.read_text(encoding="utf-8"))
    others = [one for one in kept.get("fresh", []) if one["seed"] != made["seed"]]
    return kept | {"fresh": sorted([*others, made], key=lambda one: one["seed"])}


def main(target, count, seed, jobs, folder, aside, drawn):
    words = ["stress", "-n", str(count), "--seed", str(seed), "-j", str(jobs), "-o", folder]
    words += [f"--{drawn}"] if drawn else []
    code = cli.main(words)
    if code not in (DONE, SOME_FAILED):
        raise SystemExit(code)
    study = xr.load_dataset(Path(folder, FILE), engine="h5netcdf").isel(scene=slice(count))
    seconds = float(study["judging_seconds"].sum())  # of all runs of the command that it took
    target = Path(target)
    if aside or drawn:
        kept = beside(target, provenance("make stress") | fresh(study))
    else:
        kept = {**provenance("make stress"), "workers": jobs, "work_s": plain(seconds)}
        before = json.loads(target.read_text(encoding="utf-8")) if target.exists() else {}
        kept |= found(study) | {"fresh": before.get("fresh", [])}
        shutil.copyfile(Path(folder, "stress.png"), target.with_suffix(".png"))
    target.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    raise SystemExit(code)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("target", help="file to write")
    parser.add_argument("-n", "--scenes", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-j", "--jobs", type=int, default=2, help="worker processes")
    parser.add_argument("-o", "--output", default="stress", help="folder of the campaign")
    parser.add_argument("--fresh", action="store_true", help="keep them beside the file's own")
    parser.add_argument("--drawn", default="", choices=["", "laws", "features"],
                        help="what is drawn beside numbers; as --fresh")  # fmt: skip
    asked = parser.parse_args()
    main(asked.target, asked.scenes, asked.seed, asked.jobs, asked.output, asked.fresh, asked.drawn)
