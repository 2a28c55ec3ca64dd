"""Jobs that crash, leave, hang, stand still or eat memory, among good ones, in a real sweep.

Every good job must be done, as in a sweep without bad ones; every bad one must be stored, and named
by the command, with its reason; and nothing of the sweep may run on five seconds later.
"""

import itertools
import random
import re
from functools import cache, partial

from sweep.bad_jobs import LEAST, POISON

from chaos.common import FOREIGN, MASSES, SWEEP, Tally, contents, damage, fresh, rods_file
from chaos.processes import Run, undisturbed
from compressor.cases.load import load_studies
from compressor.store.stored import read_store
from compressor.sweep import pool

WHAT = "jobs that crash, leave, hang, stand still or eat memory, among good ones"
MAX_BAD = 5
SECONDS = 0.3  # that a job which never ends may take
SOME_FAILED = 3


KINDS = {name: POISON[name] for name in ("crash", "killed", "leave", "hang", "stop", "bomb")}
ENDLESS = {name for name, (_, reason, _) in KINDS.items() if reason == "budget_seconds"}


def poisoned(kinds):
    """Returns what makes a fork's jobs of some keys do harm."""

    def prepare():
        SWEEP.run_job = partial(harmful, kinds)
        SWEEP.GRACE = 0.2
        pool.memory_share = lambda count: LEAST

    return prepare


def harmful(kinds, case):
    """Run a case, unless it is one that does harm: in a worker."""
    if case.key in kinds:
        KINDS[kinds[case.key]][0]()
    return SWEEP.run_job(case)


def mixed(folder, draw):
    """Case files with good and bad jobs in any order, which keep time series or not.

    Returns the files' names, what they keep, the keys of good jobs, the kinds of bad ones by key.
    """
    keep = draw.choice(["metrics", "series"])
    jobs = [(mass, "") for mass in draw.sample(MASSES, draw.randint(1, len(MASSES)))]
    kinds = [draw.choice(list(KINDS)) for _ in range(draw.randint(1, MAX_BAD))]
    jobs += [(5 + n / 100, kind) for n, kind in enumerate(kinds)]
    draw.shuffle(jobs)
    names, good, bad = [], set(), {}
    for endless, part in itertools.groupby(jobs, key=lambda job: job[1] in ENDLESS):
        masses, kinds = zip(*part, strict=True)
        solve = {"timeout_s": SECONDS if endless else 600}
        path = rods_file(folder, f"part-{len(names)}", masses, keep, solve=solve)
        names.append(path.name)
        (study,) = load_studies(path)
        bad |= {key: kind for key, kind in zip(study.keys, kinds, strict=True) if kind}
        good |= set(study.keys) - bad.keys()
    return names, keep, good, bad


def trial(folder, expected, draw, counts):
    """Run one mix; what went wrong, in a line.

    `expected`: what is to be stored of good jobs by key, for a keep.
    """
    names, keep, good, bad = mixed(folder, draw)
    workers = str(draw.randint(1, 3))
    run = Run(["run", *names, "-r", "out", "-j", workers], folder, prepare=poisoned(bad))
    code = run.finish()
    problems = [f"exit code {code}: {run.text()[-500:]}"] if code != SOME_FAILED else []
    found = contents(folder / "out", FOREIGN)
    problems += [f"job {key} is lost" for key in good - found.keys()]
    problems += [
        f"job {key} differs" for key in good & found.keys() if found[key] != expected(keep)[key]
    ]
    stored = read_store(folder / "out")
    for key, kind in bad.items():
        (_, reason, detail), position = KINDS[kind], stored.position(key)
        end = None if position is None else stored.outcome(position)
        if not end or (end.status, end.reason) != ("failed", reason) or detail not in end.detail:
            problems.append(f"{kind}, job {key}: {end}")
        if not re.search(rf": {reason}: .*; job {key}\n", run.text()):
            problems.append(f"{kind}, job {key}: not named on the terminal")
    problems += [text for text in [damage(folder / "out")] if text]
    counts.update(bad.values())
    counts["good jobs"] += len(good)
    return "; ".join(problems)


def campaign(trials, seed, folder):
    """Run `trials` mixes of one to five bad jobs and up to forty good ones."""
    tally, expected = Tally(WHAT, seed), cache(partial(undisturbed, folder))
    for own in range(seed, seed + trials):
        with fresh(folder) as place:
            tally.note(f"trial {own}", trial(place, expected, random.Random(own), tally.counts))
    return tally.result()
