"""Run the extreme cases of `compsim init extremes`, and let other integrators judge them.

Jobs are kept in a folder of results, from which the same command goes on. Writes a small JSON file
for the pages.
"""

from collections import Counter
from pathlib import Path

import numpy as np
from compsim import cli
from compsim.screen import DONE, SOME_FAILED
from result_pages import keep, provenance, run_campaign

from compressor.cases.examples import example
from compressor.cases.load import load_studies
from compressor.store.reader import read_store
from compressor.studies.judge import FOLDER, count_ends, judge, rank

STUDY = "extremes"
WORST = 10
# what each block of the file draws: numbers in the supported ranges or in wider ones; more besides
BLOCKS = ("supported", "whole", "supported", "laws", "supported", *["features"] * 6)


def kinds(overrides):
    """The kind of each job, by key."""
    (study,) = load_studies(example(STUDY), overrides=overrides)
    sizes = [len(block.numbers) for block in study.cases.blocks]
    each = [kind for kind, size in zip(BLOCKS, sizes, strict=True) for _ in range(size)]
    return dict(zip(study.keys, each, strict=True))


def shown(job):
    """A job's verdict, and the metric that is farthest from its judge's."""
    vote = job.deciding
    return {
        "job": job.key, "verdict": job.verdict, "worst_metric": vote.metric,
        "excess": vote.ratio, "error": vote.error, "bar": vote.bar,
        "judges": [one.method for one in job.votes],
    }  # fmt: skip


def group(jobs):
    """What is kept of jobs of a kind."""
    wrong = [shown(job) for job in jobs if job.verdict == "silent_wrong"]
    return {"scenes": len(jobs), "ends": count_ends(jobs), "silent_wrong": wrong}


def seconds(folder):
    """The wall time of all jobs of a folder of results, and of the longest one."""
    stored = read_store(folder)
    taken = stored.numbers(np.arange(len(stored)), ["seconds"])["seconds"]
    return float(taken.sum()), float(taken.max())


def main(target, folder="stress", workers=2, overrides=()):
    settings = [word for text in overrides for word in ("--set", text)]
    code = cli.main(["run", str(example(STUDY)), "-r", folder, "-j", str(workers), *settings])
    if code not in (DONE, SOME_FAILED):
        raise SystemExit(code)
    jobs, of = judge(folder, STUDY, workers), kinds(overrides)
    by_kind = {name: [job for job in jobs if of[job.key] == name] for name in dict.fromkeys(BLOCKS)}
    drawn = [*by_kind["supported"], *by_kind["whole"]]
    ok = [job for job in drawn if job.verdict == "ok"]
    (own, slowest), (judging, _) = seconds(folder), seconds(Path(folder, FOLDER))
    found = {
        **provenance("make stress"), "workers": workers, "work_s": own + judging,
        "scenes": len(drawn), "silent_wrong": Counter(j.verdict for j in drawn)["silent_wrong"],
        "at_most": 3.0 / len(drawn),  # 95 % bound where none was found
        "ends": {name: count_ends(by_kind[name]) for name in ("supported", "whole")},
        "unforeseeable": sum(job.is_chaotic for job in ok),
        "worst": [shown(job) for job in rank(drawn)[:WORST]],
        "slowest_s": slowest,
        "fresh": [{"drawn": name, **group(by_kind[name])} for name in ("laws", "features")],
    }  # fmt: skip
    keep(target, found, 3)


if __name__ == "__main__":
    run_campaign(main)
