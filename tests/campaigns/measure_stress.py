"""Run the extreme cases of `compsim init extremes`, and let other integrators judge them.

Jobs are kept in a folder of results, from which the same command goes on. Writes a small JSON file
for the pages.
"""

from collections import Counter

from compsim import cli
from compsim.screen import DONE, SOME_FAILED
from result_pages import keep, provenance, run_campaign

from compressor.cases.examples import templates
from compressor.cases.load import load_studies
from compressor.studies.judge import count_ends, judge

STUDY = "extremes"
# what each block of the file draws: numbers in the supported ranges or in wider ones; more besides
BLOCKS = ("supported", "whole", "supported", "laws", "supported", *["features"] * 6)


def kinds(overrides):
    """The kind of each job, by key."""
    (study,) = load_studies(templates()[STUDY].path, overrides=overrides)
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


def main(target, folder="stress", workers=2, overrides=()):
    settings = [word for text in overrides for word in ("--set", text)]
    code = cli.main(
        ["run", str(templates()[STUDY].path), "-r", folder, "-j", str(workers), *settings]
    )
    if code not in (DONE, SOME_FAILED):
        raise SystemExit(code)
    jobs, of = judge(folder, STUDY, workers), kinds(overrides)
    by_kind = {name: [job for job in jobs if of[job.key] == name] for name in dict.fromkeys(BLOCKS)}
    drawn = [*by_kind["supported"], *by_kind["whole"]]
    found = {
        **provenance("make stress"), "scenes": len(drawn),
        "silent_wrong": Counter(job.verdict for job in drawn)["silent_wrong"],
        "ends": {name: count_ends(by_kind[name]) for name in ("supported", "whole")},
        "fresh": [{"drawn": name, **group(by_kind[name])} for name in ("laws", "features")],
    }  # fmt: skip
    keep(target, found, 3)


if __name__ == "__main__":
    run_campaign(main)
