"""`compsim claims`: in which machines the paper's claims hold, and what decides them."""

import shlex
from pathlib import Path

import click

from compressor.digits import align_columns
from compsim import options, screen
from compsim.progress import ProgressReporter


@click.command()
@click.argument("study", required=False)
@options.results
@options.quiet
def claims(study, folder, quiet) -> int:
    """Judge the paper's eight claims on many machines.

    \b
    compsim init claims
    compsim run claims.yaml
    compsim claims claims

    STUDY has the paper's eleven cases of each machine, with time series. Prints, for each claim,
    the machines in which it holds and its margins, 0 at the threshold; for a {saltelli: ...} study
    also the assumption with the largest effect. Writes the margins and a figure into claims/ of the
    folder of results.

    Exit code 3 if a machine has no verdict.
    """
    from compressor.report import write_figure
    from compressor.store import find_study, write_dataset
    from compressor.studies.claims import (
        draw,
        judge_machines,
        list_failed,
        numbers,
        sensitivity,
        table,
    )

    with ProgressReporter(quiet, "machines") as progress:
        found = judge_machines(folder, find_study(folder, study), progress)
    effects = sensitivity(found)
    screen.print_text(*align_columns(table(found, effects), "<<>>>><"), "")
    screen.print_text(*align_columns(numbers(found)))
    path = Path(folder, "claims", f"{found.attrs['study']}.nc")
    screen.print_text(str(write_dataset(path, found)))
    drawn = draw(found, effects)
    if drawn:
        figure, sentence = drawn
        picture = write_figure(path.with_suffix(".png"), figure)
        screen.print_text(f"{picture}: {sentence}")
    failed = [*list_failed(found)]
    if not failed:
        return screen.DONE
    screen.say("without a verdict:")
    for text in failed[: screen.MAX_FAILURES]:  # a line each, for who searches a log
        screen.say(f"  {text}")
    if len(failed) > screen.MAX_FAILURES:
        screen.say(f"  and {len(failed) - screen.MAX_FAILURES} more")
    screen.say_wrapped(
        f"compsim status -r {shlex.quote(folder)} says why jobs failed, and what to do; run the "
        "study again for what is missing or damaged, with output.keep: series for time series"
    )
    return screen.SOME_FAILED
