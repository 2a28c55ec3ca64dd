"""`compsim judge`: are the numbers of a stored study right? Other integrators say so."""

import click

from compressor.digits import align_columns
from compsim import options, screen
from compsim.progress import ProgressReporter

WORST = 10  # jobs that are listed


@click.command()
@click.argument("study", required=False)
@options.results
@options.jobs()
@options.as_json
@options.quiet
def judge(study, folder, jobs, as_json, quiet) -> int:
    """Judge a study's numbers by other integrators.

    \b
    compsim init extremes
    compsim run extremes.yaml
    compsim judge extremes

    Runs each job that is ok again by another integrator at a hundredth of its tolerance; if that
    disagrees by a second one, and if these differ by a third. The majority counts. The verdict of a
    job is ok; silent_wrong, if a number is off by more than ten error bars and a thousand times the
    tolerance (5 % at most); or unjudged, with the reason. For a chaotic motion it compares
    averages. Prints counts and the worst jobs; stores the runs in judge/ of the folder of results.
    The same command continues what was interrupted.

    Exit code 3 if a number is wrong without a warning.
    """
    from compressor.studies.judge import judge as judge_study
    from compressor.studies.judge import rank, summarize, table, to_rows
    from compressor.sweep import cores

    with ProgressReporter(quiet, "runs of judges", folder=folder) as progress:
        found = judge_study(folder, study, jobs or cores(), progress)
    if as_json:
        screen.print_json(to_rows(found))
    else:
        worst = table(rank(found)[:WORST])
        screen.print_text(*summarize(found), "", *align_columns(worst, "<<<>>><"))
    wrong = any(job.verdict == "silent_wrong" for job in found)
    return screen.SOME_FAILED if wrong else screen.DONE
