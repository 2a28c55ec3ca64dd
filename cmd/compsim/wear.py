"""`compsim wear`: how bores wear over operating hours, and when a joint is worn out."""

import click

from compsim import options, screen
from compsim.progress import ProgressReporter, read_cases


@click.command()
@options.configs
@options.results
@options.jobs()
@options.set_keys
@click.option("--rerun", is_flag=True, help="Go on with machines whose motion failed.")
@options.as_json
@options.quiet
def wear(configs, folder, jobs, rerun, as_json, quiet, **how) -> int:
    """Wear bearings over operating hours, until one is worn out.

    \b
    compsim wear life.yaml

    CONFIG has a group `wear`. Motion and wear take turns: what rubs in a run at the clearances as
    they are opens them evenly, by Archard's law, and stands for all revolutions until one has grown
    by wear.step_mm. One line a machine goes to stdout: the hours until a clearance reaches
    wear.limit_mm, with the least and the greatest coefficient beside them. Clearances and metrics
    of the runs are kept in wear/ of the folder, with a figure; what was interrupted goes on from
    there.
    """
    from compressor.studies.wear.figures import draw_machines
    from compressor.studies.wear.run import check_wear, run_wear
    from compressor.studies.wear.words import jsonable_wear, list_machines
    from compressor.sweep import cores

    studies = read_cases(configs, quiet, **how)
    check_wear(studies)
    with ProgressReporter(quiet, "machines", folder=folder) as progress:
        summary = run_wear(studies, folder, jobs or cores(), progress, rerun)
    if as_json:
        screen.print_json([jsonable_wear(one, folder) for one in summary.machines])
    else:
        screen.print_text(*list_machines(summary.machines))
    drawn = draw_machines(summary, folder, {study.name: study.title for study in studies})
    if not quiet:
        new = len(summary.machines) - summary.done_before
        screen.say_done(new, summary.done_before, summary.seconds, folder, "machine")
        screen.say("\n".join(drawn))
    failed = [
        (one.study + screen.point_text(one.point), one.reason, one.detail) for one in summary.failed
    ]
    if failed:
        screen.say_failures(failed)
        screen.say("--rerun goes on with machines that failed.")
    return screen.SOME_FAILED if failed else screen.DONE
