"""`compsim wear`: how bores wear over operating hours, and when a joint is worn out."""

from pathlib import Path

import click

from compressor.digits import align_columns
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

    CONFIG has a group `wear`. Motion and wear take turns: one run at the present clearances gives
    the wear of all revolutions, by Archard's law, until a clearance has grown by wear.step_mm.
    Prints a line for each machine: the hours until a clearance reaches wear.limit_mm, also with the
    least and the greatest coefficient. Writes clearances, metrics and a figure of each study into
    wear/ of the folder of results. The same command continues what was interrupted.
    """
    from compressor.report import title_figure, write_figure
    from compressor.studies.wear import check_wear, draw_wear, run_wear, table, to_row
    from compressor.sweep import cores

    studies = read_cases(configs, quiet, **how)
    check_wear(studies)
    screen.caution(studies, ignored="wear")  # a run leaves wear out, this does not
    with ProgressReporter(quiet, "machines", folder=folder) as progress:
        machines, before = run_wear(studies, folder, jobs or cores(), progress, rerun)
    if as_json:
        screen.print_json([to_row(one, folder) for one in machines])
    else:
        screen.print_text(*align_columns(table(machines), "<>><"))
    if not quiet:
        screen.say_done(len(machines) - before, before, progress.seconds, folder, "machine")
    for study in studies:
        mine = [one for one in machines if one.study == study.name]
        if any(one.life for one in mine):
            title = title_figure(study.title or study.name, "wear of the bores")
            path = write_figure(Path(folder, "wear", f"{study.name}.png"), draw_wear(mine, title))
            if not quiet:
                screen.say(str(path))
    failed = [
        (one.study + screen.point_text(one.point), one.reason, one.detail)
        for one in machines
        if one.reason
    ]
    if failed:
        screen.say_failures(failed)
        screen.say("--rerun goes on with machines that failed.")
    return screen.SOME_FAILED if failed else screen.DONE
