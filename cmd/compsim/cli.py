"""compsim on the command line: data on stdout, progress and messages on stderr.

Nothing heavy is imported at the top: `compsim --help` answers at once.
"""

import contextlib
import os
import shlex
import signal
import sys
import tempfile
import threading
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import click

import compressor
from compsim import explain, export, plan, schema, status, stress, tradeoff, verify
from compsim.screen import (
    DONE,
    INTERNAL,
    SOME_FAILED,
    STORE,
    USAGE,
    Screen,
    caution,
    configs_argument,
    duration,
    jobs_option,
    limit,
    one_thread_each,
    only_option,
    output_option,
    plural,
    say,
    setting,
)

if TYPE_CHECKING:
    from compressor.sweep import Backend, Failure, Summary

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
MOST_FAILURES = 20  # listed one by one
AGAIN = 0.02  # s until a dropped signal is sent again

# error -> what stands before its text, and the exit code
FORESEEN = {
    "CaseFileError": ("", USAGE),
    "ExportError": ("compsim: ", USAGE),
    "ClusterError": ("compsim: ", USAGE),
    "StoreError": ("compsim: ", STORE),
    "WorkersFailed": ("compsim: ", INTERNAL),
    "ReferenceFailed": ("compsim: ", SOME_FAILED),
}


class Interrupted(BaseException):
    """SIGINT, SIGTERM or SIGHUP has arrived."""

    def __init__(self, number: int):
        self.number = number
        super().__init__(signal.Signals(number).name)


class Part(click.ParamType):
    """I/N with 1 <= I <= N."""

    name = "I/N"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[int, int]:
        """(I, N), or a usage error."""
        number, _, of = str(value).partition("/")
        if not (number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of)):
            self.fail(f"{value!r} is no I/N with 1 <= I <= N, such as 2/8", param, ctx)
        return int(number), int(of)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(compressor.__version__, prog_name="compsim")
def cli() -> None:
    """Sweep a reciprocating compressor over joint clearances, and draw what comes out.

    Exit codes: 0 done, 1 internal error, 2 usage or case file, 3 some jobs failed, 5 store,
    130/143/129 interrupted.
    """


@cli.command()
@configs_argument
@output_option
@jobs_option("Worker processes.")
@setting
@only_option
@limit
@click.option("--rerun", type=click.Choice(["failed"]), help="Run failed jobs again, too.")
@click.option("--shard", "part", type=Part(), metavar="I/N",
              help="Run part I of N: for machines that share the folder.")  # fmt: skip
@click.option("--backend", type=click.Choice(["local", "dask"]), default="local",
              show_default=True, help="Where jobs run: here, or on a dask cluster.")  # fmt: skip
@click.option("--scheduler", metavar="ADDRESS",
              help="Of the dask cluster, such as tcp://host:8786.")  # fmt: skip
@click.option("--wait", is_flag=True, help="Wait for another run on the folder to end.")
@click.option("--quiet", is_flag=True, help="No progress; errors and failed jobs are still told.")
@click.pass_context
def run(
    context: click.Context,
    configs: tuple[str, ...],
    output: str,
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
    """Simulate what case files ask for, and store it.

    Jobs that are stored already are not run again, so a run that was interrupted goes on where it
    ended. A summary line for each study goes to stdout.
    """
    check_backend(backend, scheduler, jobs)
    one_thread_each()  # before numpy loads
    from compressor.execution import cores
    from compressor.plan import load_studies

    studies = load_studies(*configs, overrides=overrides, max_jobs=max_jobs, only=only)
    if only and not quiet:
        selected = sum(len(study.selected) for study in studies)
        say(f"--only selects {selected} of {plural(sum(study.jobs for study in studies))}")
    caution(studies)
    from compressor.sweep import sweep

    screen = Screen(quiet)
    try:
        with cluster(scheduler) as elsewhere:
            summary = sweep(
                studies, output, jobs or cores(), screen, context.obj, rerun == "failed", part,
                wait, elsewhere,
            )  # fmt: skip
    except BaseException:
        screen.end()
        if screen.total:
            say(f"{screen.done} of {screen.total} jobs are stored in {output}; "
                "the same command goes on from there")  # fmt: skip
        raise
    screen.end()
    report_run(summary, output, quiet)
    return SOME_FAILED if summary.failed else DONE


def check_backend(backend: str, scheduler: str | None, jobs: int | None) -> None:
    """Usage errors of options that do not go together."""
    if backend == "dask" and not scheduler:
        raise click.UsageError(
            "--backend dask needs --scheduler ADDRESS, such as tcp://host:8786: "
            "what `dask scheduler` prints when it starts"
        )
    if backend == "dask" and jobs:
        raise click.UsageError("-j counts processes here; a dask cluster uses all its workers")
    if backend == "local" and scheduler:
        raise click.UsageError("--scheduler goes with --backend dask")


def cluster(scheduler: str | None) -> contextlib.AbstractContextManager["Backend | None"]:
    """The cluster of a scheduler; none where jobs run here."""
    if scheduler is None:
        return contextlib.nullcontext()
    from compressor.cluster import Cluster

    return Cluster(scheduler)


@cli.command()
@click.option("-i", "--input", "results", default="results", show_default=True,
              help="Folder of results.")  # fmt: skip
@click.option("-o", "--output", default="report", show_default=True, help="Folder of the report.")
@click.pass_context
def report(context: click.Context, results: str, output: str) -> int:
    """Draw figures and tables of stored studies; prints the path of the page."""
    from compressor.report import write_report

    click.echo(write_report(results, output, context.obj))
    return DONE


cli.add_command(plan.plan)
cli.add_command(status.status)
cli.add_command(status.show)
cli.add_command(export.export)
cli.add_command(verify.verify)
cli.add_command(schema.schema)
cli.add_command(explain.explain)
cli.add_command(tradeoff.tradeoff)
cli.add_command(stress.stress)


def report_run(summary: "Summary", folder: str, quiet: bool) -> None:
    """Say what a run did, what failed and what to do next."""
    width = max(len(count.study) for count in summary.counts)
    for count in summary.counts:
        where = os.path.join(folder, "studies", f"{count.study}.json")
        good = count.jobs - count.failed
        click.echo(
            f"{count.study:<{width}}  {plural(count.jobs):>9}  {good:>4} ok  "
            f"{count.failed:>4} failed  {where}"
        )
    if not quiet:
        if not summary.run_now:
            say(f"nothing to do: all {plural(summary.total)} are stored in {folder}")
        else:
            again = f", {summary.done_before} were stored before" if summary.done_before else ""
            say(f"{plural(summary.run_now)} run in {duration(summary.seconds)}{again}")
    report_failures(summary.failed)
    if not quiet:
        say(f"next: compsim report -i {shlex.quote(folder)}")


def report_failures(failures: Sequence["Failure"]) -> None:
    """List failed jobs, and what to do about each kind of failure."""
    if not failures:
        return
    from compressor.reading import printable
    from compressor.reasons import remedy

    say(f"{plural(len({failure.key for failure in failures}))} failed:")
    for failure in failures[:MOST_FAILURES]:
        point = "".join(f" {key}={value}" for key, value in failure.coordinates.items())
        say(
            f"  {failure.study}{point}: {failure.reason}: {printable(failure.detail)}\n"
            f"    job {failure.key}"
        )
    if len(failures) > MOST_FAILURES:
        say(f"  and {len(failures) - MOST_FAILURES} more")
    say("what to do:")
    for reason, number in Counter(failure.reason for failure in failures).items():
        say(f"  {reason} ({number}): {remedy(reason)}")
    say("A changed case file runs as a new job; --rerun failed runs failed ones again unchanged.")


@contextlib.contextmanager
def interruptible() -> Iterator[None]:
    """Turn the signals that ask a program to end into Interrupted; a second one ends it at once.

    A signal that comes while a destructor runs, where Python drops every exception, comes again.
    """

    def interrupt(number: int, frame: Any) -> None:
        for other in caught:
            signal.signal(other, signal.SIG_DFL)
        raise Interrupted(number)

    def dropped(what: Any) -> None:
        if not isinstance(what.exc_value, Interrupted):
            hook(what)
            return
        number = what.exc_value.number
        for other in caught:
            signal.signal(other, interrupt)
        again = threading.Timer(AGAIN, signal.pthread_kill, (threading.get_ident(), number))
        again.daemon = True
        again.start()

    caught = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    old = {number: signal.signal(number, interrupt) for number in caught}
    hook, sys.unraisablehook = sys.unraisablehook, dropped
    try:
        yield
    finally:
        sys.unraisablehook = hook
        for number, handler in old.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def warnings_told() -> Iterator[None]:
    """Say the store's warnings, each once, as a user reads them; others stay as they are."""
    show, told = warnings.showwarning, set()

    def say_it(message: Any, category: type[Warning], *where: Any, **more: Any) -> None:
        if category.__name__ != "StoreWarning":  # by name: its module is heavy
            show(message, category, *where, **more)
        elif str(message) not in told:
            told.add(str(message))
            say(f"compsim: {message}")

    with warnings.catch_warnings():
        warnings.showwarning = say_it
        yield


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    command = shlex.join(["compsim", *arguments])
    try:
        with interruptible(), warnings_told():
            return cli.main(arguments, "compsim", standalone_mode=False, obj=command) or DONE
    except Interrupted as signal_sent:
        say(f"interrupted by {signal_sent}")
        return 128 + signal_sent.number
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except Exception as error:
        return told(error)


def told(error: Exception) -> int:
    """Say what went wrong and return the exit code; only what nobody foresaw has a traceback."""
    for family in type(error).__mro__:  # by name: their modules are heavy
        if family.__name__ in FORESEEN:
            prefix, code = FORESEEN[family.__name__]
            say(f"{prefix}{error}")
            return code
    lines = traceback.format_exception(error)
    if os.environ.get("COMPSIM_DEBUG"):
        say("".join(lines), end="")
        return INTERNAL
    with tempfile.NamedTemporaryFile(
        "w", prefix="compsim-", suffix=".txt", delete=False, encoding="utf-8", errors="replace"
    ) as file:
        file.writelines(lines)
    say(f"compsim: internal error: {type(error).__name__}: {error}")
    say(f"please report it, with {file.name}, which holds the traceback")
    return INTERNAL
