"""`compsim run`: simulate what case files ask for, and store it."""

import os
import shlex
from collections import Counter
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from compressor.digits import plural
from compressor.program import duration, printable
from compsim import options, screen
from compsim.progress import ProgressReporter

if TYPE_CHECKING:
    from compressor.cases import Study
    from compressor.sweep import Options, Summary

MAX_FAILURES = 20  # listed one by one


class ShardType(click.ParamType):
    """I/N with 1 <= I <= N."""

    name = "I/N"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[int, int]:
        """Return (I, N). Raises a usage error for other text."""
        number, _, of = str(value).partition("/")
        if not (number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of)):
            self.fail(f"{value!r} is no I/N with 1 <= I <= N, such as 2/8", param, ctx)
        return int(number), int(of)


@click.command()
@options.configs
@options.results
@options.jobs()
@options.set_keys
@options.only
@options.max_jobs
@click.option("--rerun", type=click.Choice(["failed"]), help="Run stored jobs that failed again.")
@click.option("--shard", "part", type=ShardType(), metavar="I/N",
              help="Run part I of N, where several computers share the folder.")  # fmt: skip
@click.option("--backend", type=click.Choice(["local", "dask"]), default="local",
              show_default=True, help="Run jobs here, or on a dask cluster.")  # fmt: skip
@click.option("--scheduler", metavar="ADDRESS",
              help="Find the dask cluster at this address, such as tcp://host:8786.")  # fmt: skip
@click.option("--wait", is_flag=True, help="Wait for another run on the folder to end.")
@options.quiet
@click.pass_context
def run(
    context: click.Context,
    configs: tuple[str, ...],
    folder: str,
    jobs: int | None,
    overrides: tuple[str, ...],
    only: str,
    max_jobs: int,
    rerun: str | None,
    part: tuple[int, int] | None,
    backend: str,
    scheduler: str | None,
    wait: bool,
    quiet: bool,
) -> int:
    """Simulate what case files ask for, and store the results.

    \b
    compsim run machine.yaml
    compsim run wear.yaml --set machine.speed_rpm=300 -r results-300

    Jobs that are stored already are not run again, so a run that was interrupted goes on where it
    ended. A summary line for each study goes to stdout.
    """
    check_backend(backend, scheduler, jobs)
    screen.one_thread_each()  # before numpy loads
    from compressor.cases import load_studies
    from compressor.sweep import Options, cores

    with ProgressReporter(quiet, "cases read") as progress:
        studies = load_studies(
            *configs, overrides=overrides, max_jobs=max_jobs, only=only, progress=progress
        )
    if only and not quiet:
        selected = sum(len(study.selected) for study in studies)
        screen.say(f"--only selects {selected} of {plural(sum(study.jobs for study in studies))}")
    screen.caution(studies)
    how = Options(context.obj, bool(rerun), part, wait=wait)
    return run_jobs(studies, folder, jobs or cores(), how, scheduler, quiet)


def run_jobs(
    studies: "list[Study]", folder: str, workers: int, how: "Options", scheduler: str | None,
    quiet: bool,
) -> int:  # fmt: skip
    """Run studies of jobs, and return the exit code."""
    screen.report_changes(studies, folder)
    from compressor.sweep import Cluster, sweep

    cluster: Any = Cluster(scheduler) if scheduler else nullcontext()
    opening = partial(screen.report_machines, studies)  # where there are jobs to run
    with ProgressReporter(quiet, "jobs", folder, opening) as progress, cluster as elsewhere:
        how = replace(how, backend=elsewhere, failed=progress.count_failed)
        summary = sweep(studies, folder, workers, progress, how)
    report_run(summary, folder, quiet)
    return screen.SOME_FAILED if summary.failed else screen.DONE


def check_backend(backend: str, scheduler: str | None, jobs: int | None) -> None:
    """Raise UsageError for options that do not go together."""
    if backend == "dask" and not scheduler:
        raise click.UsageError(
            "--backend dask needs --scheduler ADDRESS, such as tcp://host:8786: "
            "what `dask scheduler` prints when it starts"
        )
    if backend == "dask" and jobs:
        raise click.UsageError("-j counts processes here; a dask cluster uses all its workers")
    if backend == "local" and scheduler:
        raise click.UsageError("--scheduler goes with --backend dask")


def report_run(summary: "Summary", folder: str, quiet: bool) -> None:
    """Report what a run did, what failed and what to do next."""
    width = max(len(count.study) for count in summary.counts)
    for count in summary.counts:
        where = os.path.join(folder, "studies", f"{count.study}.json")
        good = count.jobs - count.failed
        with screen.unread():
            screen.print_text(
                f"{count.study:<{width}}  {plural(count.jobs):>9}  {good:>4} ok  "
                f"{count.failed:>4} failed  {where}"
            )
    if not quiet:
        if not summary.run_now:
            screen.say(screen.all_stored(summary.total, folder))
        else:
            again = screen.stored_before(summary.done_before)
            screen.say(f"{plural(summary.run_now)} run in {duration(summary.seconds)}{again}")
    report_failures(summary)
    if not quiet:
        report_caveats([count.study for count in summary.counts], folder)
        screen.say(f"next: compsim report -r {shlex.quote(folder)}")


def report_caveats(names: list[str], folder: str) -> None:
    """Report the caveats that only runs show of their numbers; `caution` reports the rest."""
    from compressor.store import read_store, read_studies, run_caveats

    rows = read_store(folder).rows
    for study in read_studies(folder):
        for text in run_caveats(rows, study) if study.name in names else ():
            screen.say_wrapped(f"{study.name}: {text}")


def report_failures(summary: "Summary") -> None:
    """Report failed jobs, and what to do about each kind of failure."""
    failures = summary.failed
    if not failures:
        return
    from compressor.reasons import remedy

    screen.say(f"{plural(len({failure.key for failure in failures}))} failed:")
    for failure in failures[:MAX_FAILURES]:
        point = "".join(f" {key}={value}" for key, value in failure.coordinates.items())
        # one line each, for who searches a log
        screen.say(f"  {failure.study}{point}: {failure.reason}: {printable(failure.detail)}")
        screen.say(f"    job {failure.key}")
    if len(failures) > MAX_FAILURES:
        screen.say(f"  and {len(failures) - MAX_FAILURES} more")
    screen.say("what to do:")
    for reason, number in Counter(failure.reason for failure in failures).items():
        screen.say_wrapped(f"{reason} ({number}): {remedy(reason)}", 2)
    screen.say("--rerun failed runs failed jobs again; a changed case file makes new jobs.")
