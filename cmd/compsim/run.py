"""`compsim run`: simulate what case files ask for, and store it."""

import os
import shlex
from collections import Counter
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from compressor.digits import align_columns, plural
from compsim import options, screen
from compsim.progress import ProgressReporter, read_cases

if TYPE_CHECKING:
    from compressor.sweep import Summary


@click.command()
@options.configs
@options.results
@options.jobs()
@options.set_keys
@options.only
@options.max_jobs
@click.option("--rerun", type=click.Choice(["failed"]), help="Run stored jobs that failed again.")
@options.shard
@click.option(
    "--scheduler",
    type=options.TEXT,
    metavar="ADDRESS",
    help="Run on this dask cluster, such as tcp://host:8786.",
)
@options.quiet
@click.pass_obj
def run(command, configs, folder, jobs, rerun, shard, scheduler, quiet, **how) -> int:
    """Simulate the jobs of case files, and store the results.

    \b
    compsim run machine.yaml
    compsim run wear.yaml --set machine.speed_rpm=300 -r results-300

    Stored jobs are not run again, so the same command continues a run that was interrupted. Prints
    a summary line for each study.
    """
    if scheduler and jobs:
        raise click.UsageError("-j counts processes here; a dask cluster uses all its workers")
    from compressor.store import list_orphans
    from compressor.sweep import connect_cluster, cores, sweep

    studies = read_cases(configs, quiet, **how)
    if how["only"] and not quiet:
        selected = sum(len(study.selected) for study in studies)
        screen.say(f"--only selects {selected} of {plural(sum(study.jobs for study in studies))}")
    machines = screen.caution(studies)
    cluster: Any = connect_cluster(scheduler) if scheduler else nullcontext()
    opening = partial(screen.say_machines, machines)  # where there are jobs to run
    with ProgressReporter(quiet, "jobs", folder, opening) as progress, cluster as elsewhere:
        for name, keys in list_orphans(folder, studies).items():
            be = "is" if len(keys) == 1 else "are"
            show = shlex.join(["compsim", "show", keys[0], "-r", folder])
            screen.say(
                f"{name}: its study in {folder} is replaced, and {len(keys)} of its jobs {be} in "
                f"no study now (such as: {show}); another name keeps both"
            )
        studies = [study.shard(*shard) for study in studies] if shard else studies
        summary = sweep(
            studies, folder, jobs or cores(), progress, command, how["overrides"],
            rerun_failed=bool(rerun), backend=elsewhere, failed=progress.count_failed,
        )  # fmt: skip
    report_run(summary, folder, quiet)
    return screen.SOME_FAILED if summary.failed else screen.DONE


def report_run(summary: "Summary", folder: str, quiet: bool) -> None:
    """Report what a run did, what failed and what to do next."""
    lines, failures = [], []
    failed = Counter(lost.study for lost in summary.failed)
    for name, jobs in summary.counts.items():
        ends = f"{jobs - failed[name]} ok", f"{failed[name]} failed"
        where = os.path.join(folder, "studies", f"{name}.json")
        lines.append((name, plural(jobs), *ends, where))
    for lost in summary.failed:
        place = lost.study + screen.point_text(lost.coordinates)
        failures.append((place, lost.reason, f"{lost.detail}; job {lost.key}"))
    with screen.unread():
        screen.print_text(*align_columns(lines, "<>>>"))
    if not quiet:
        screen.say_done(summary.run_now, summary.done_before, summary.seconds, folder)
    if failures:
        screen.say(f"{plural(len({lost.key for lost in summary.failed}))} failed:")
        screen.say_failures(failures)
        screen.say("--rerun failed runs failed jobs again; a changed case file makes new jobs.")
    if quiet:
        return
    from compressor.store import read_store, read_study, run_caveats

    stored = read_store(folder)
    for *_, where in lines:  # what only runs show: `caution` has said the rest
        study = read_study(Path(where))
        for text in run_caveats(stored, study):
            screen.say_wrapped(f"{study.name}: {text}")
    screen.say(f"next: compsim report -r {shlex.quote(folder)}")
