"""Jobs that crash, leave, hang, stand still or eat memory, among good ones, in a real sweep.

Every good job must be done, as in a sweep without bad ones; every bad one must be stored, and named
by the command, with its reason; and nothing of the sweep may run on five seconds later.
"""

import itertools
import re
from functools import partial

from stores_compared import contents, damage
from sweep.bad_jobs import LEAST, POISON

from chaos.common import FOREIGN, SWEEP, rods_file
from chaos.processes import MASSES, Run, undisturbed
from compressor.cases.load import load_studies
from compressor.store.stored import read_store
from compressor.sweep import pool

WHAT = "jobs that crash, leave, hang, stand still or eat memory, among good ones"
MAX_BAD = 5
SECONDS = 0.3  # that a job which never ends may take
SOME_FAILED = 3
KINDS = {name: POISON[name] for name in ("crash", "killed", "leave", "hang", "stop", "bomb")}
ENDLESS = {name for name, (_, reason, _) in KINDS.items() if reason == "budget_seconds"}


def poison(kinds):
    """Have a fork's jobs of some keys do harm."""
    SWEEP.run_job = partial(harmful, kinds)
    SWEEP.GRACE = 0.2
    pool.memory_share = lambda count: LEAST


def harmful(kinds, case):
    """Run a case, unless it is one that does harm: in a worker."""
    if case.key in kinds:
        KINDS[kinds[case.key]][0]()
    return SWEEP.run_job(case)


def mixed(folder, keep, draw):
    """Names of case files of jobs in any order, keys of good ones, kinds of bad ones by key."""
    jobs = [(mass, "") for mass in draw.sample(MASSES, draw.randint(1, len(MASSES)))]
    kinds = [draw.choice(list(KINDS)) for _ in range(draw.randint(1, MAX_BAD))]
    jobs += [(5 + n / 100, kind) for n, kind in enumerate(kinds)]
    draw.shuffle(jobs)
    names, good, bad = [], set(), {}
    for endless, part in itertools.groupby(jobs, key=lambda job: job[1] in ENDLESS):
        masses, kinds = zip(*part, strict=True)
        timeout = SECONDS if endless else 600
        path = rods_file(folder, f"part-{len(names)}", masses, keep, timeout_s=timeout)
        names.append(path.name)
        (study,) = load_studies(path)
        bad |= {key: kind for key, kind in zip(study.keys, kinds, strict=True) if kind}
        good |= set(study.keys) - bad.keys()
    return names, good, bad


def trial(place, draw, number, counts):
    """Run one to five bad jobs and some good ones."""
    keep = draw.choice(["metrics", "series"])
    expected = undisturbed(place.parent, keep)[1]
    names, good, bad = mixed(place, keep, draw)
    words = ["run", *names, "-r", "out", "-j", str(draw.randint(1, 3))]
    run = Run(words, place, prepare=partial(poison, bad))
    code = run.finish()
    problems = [f"exit code {code}: {run.text()[-500:]}"] if code != SOME_FAILED else []
    found = contents(place / "out", FOREIGN)
    problems += [f"job {key} is lost" for key in good - found.keys()]
    problems += [f"job {key} differs" for key in good & found.keys() if found[key] != expected[key]]
    stored = read_store(place / "out")
    for key, kind in bad.items():
        (_, reason, detail), position = KINDS[kind], stored.position(key)
        end = None if position is None else stored.outcome(position)
        if not end or (end.status, end.reason) != ("failed", reason) or detail not in end.detail:
            problems.append(f"{kind}, job {key}: {end}")
        if not re.search(rf": {reason}: .*; job {key}\n", run.text()):
            problems.append(f"{kind}, job {key}: not named on the terminal")
    problems += filter(None, [damage(place / "out")])
    counts.update(bad.values())
    counts["good jobs"] += len(good)
    return "; ".join(problems)
