"""`compsim wear`: how bores wear over operating hours, and when a joint is worn out."""

import json
from typing import TYPE_CHECKING

import click

from compressor.digits import plural
from compressor.program import duration, printable
from compsim import options, screen
from compsim.progress import ProgressReporter

if TYPE_CHECKING:
    from compressor.studies.wear.run import WearSummary, WornMachine


@click.command()
@options.configs
@options.results
@options.jobs()
@options.set_keys
@click.option("--rerun", is_flag=True, help="Go on with machines whose motion failed.")
@options.as_json
@options.quiet
def wear(
    configs: tuple[str, ...],
    folder: str,
    jobs: int | None,
    overrides: tuple[str, ...],
    rerun: bool,
    as_json: bool,
    quiet: bool,
) -> int:
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
    screen.one_thread_each()  # before numpy loads
    from compressor.cases import load_studies
    from compressor.studies.wear.figures import draw_machines
    from compressor.studies.wear.run import check_wear, run_wear
    from compressor.studies.wear.words import jsonable_wear, table
    from compressor.sweep import cores

    with ProgressReporter(quiet, "cases read") as progress:
        studies = load_studies(*configs, overrides=overrides, progress=progress)
    check_wear(studies)
    with ProgressReporter(quiet, "machines", folder=folder) as progress:
        summary = run_wear(studies, folder, jobs or cores(), progress, rerun)
    if as_json:
        screen.print_text(
            json.dumps([jsonable_wear(one, folder) for one in summary.machines], indent=1)
        )
    else:
        for line in table(summary.machines):
            screen.print_text(line)
    drawn = [*draw_machines(summary, folder, {study.name: study.title for study in studies})]
    if not quiet:
        report_wear(summary, folder, drawn)
    for one in summary.failed:
        fail(one)
    return screen.SOME_FAILED if summary.failed else screen.DONE


def report_wear(summary: "WearSummary", folder: str, drawn: list[str]) -> None:
    """Write what was done, and where figures are."""
    total = len(summary.machines)
    done = f"{plural(total - summary.done_before, 'machine')} in {duration(summary.seconds)}"
    done += screen.stored_before(summary.done_before)
    screen.say(done if summary.done_before < total else screen.all_stored(total, folder, "machine"))
    for path in drawn:
        screen.say(path)


def fail(one: "WornMachine") -> None:
    """Write why a machine ended early, and what to do."""
    from compressor.reasons import remedy

    point = "".join(f" {key}={value}" for key, value in one.point.items())
    screen.say_wrapped(f"{one.study}{point}: {one.reason}: {printable(one.detail)}")
    screen.say_wrapped(f"{remedy(one.reason)}; then: compsim wear --rerun", 2)
