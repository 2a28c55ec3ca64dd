"""`compsim find`: where a metric first passes a value, or is greatest or least, over a key."""

import click

from compsim import options, screen
from compsim.progress import ProgressReporter

KINDS = ("first", "greatest", "least")


@click.command()
@options.config
@click.option(
    "--over", required=True, metavar="KEY=LOW:HIGH", help="Search over this key, in its own unit."
)
@click.option(
    "--first",
    metavar="'METRIC[.JOINT] > VALUE'",
    help="Find where this becomes true going up: > >= < <=.",
)
@click.option("--greatest", metavar="METRIC[.JOINT]", help="Find where the metric is greatest.")
@click.option("--least", metavar="METRIC[.JOINT]", help="Find where the metric is least.")
@click.option(
    "--tolerance",
    type=click.FloatRange(1e-9, 0.5),
    default=1e-3,
    help="Narrow the answer down to this, relative to the range.",
)
@click.option(
    "--scan", type=click.IntRange(3, 1000), default=9, help="Run so many even points first."
)
@click.option("--log", "logarithmic", is_flag=True, help="Space points evenly in the logarithm.")
@options.units("that of VALUE, else SI")
@options.set_keys
@options.results
@options.jobs("Run in this many worker processes, as many points in one step of --first.")
@options.as_json
@options.quiet
def find(config, over, folder, jobs, units, as_json, quiet, **asked) -> int:
    """Find where a metric passes a value, or is greatest or least.

    \b
    compsim find worn.yaml --over clearance_mm=0.01:0.3 \\
        --first 'contact_loss_fraction.small_end > 0.001'
    compsim find worn.yaml --over machine.speed_rpm=200:900 \\
        --greatest peak_acceleration
    compsim find worn.yaml --over clearance_mm=0.08:0.3 \\
        --first 'peak_contact_force.small_end > 1.5 * base' --units plant

    VALUE of --first is in SI, or has its unit, as 166 kN, or is a factor of the metric at LOW, as
    1.5 * base. CONFIG makes one case once the key is given. The answer of --first is an interval:
    at its lower end the comparison does not hold, at its upper end it does. Of --greatest and
    --least it is the best point. Every point has a row: whether the comparison holds there (yes,
    no), or how the point compares with the best (best, as good as far as error bars show, worse);
    what error bars leave open, or whose job failed, is open, and stays inside the interval. A later
    change from yes to no is as wide as the scan shows it; a narrower --over narrows it down.
    Structure that is finer than the scan may be missed. In a chaotic motion a peak stands for its
    mean over revolutions.

    Every point is a job of the study CONFIG-find-KEY in the folder of results: it is stored, and
    not run again. --json has all numbers in SI. Exit code 3 if any point's job failed.
    """
    options.check_json_units(as_json, units)
    given = [(kind, text) for kind in KINDS if (text := asked.pop(kind)) is not None]
    if len(given) != 1:
        raise click.UsageError("give one of --first, --greatest and --least")
    from compressor.studies.find import find as search
    from compressor.studies.find import jsonable_answer, list_answer, read_question
    from compressor.sweep import cores

    ((kind, goal),) = given
    question = read_question(config, over, goal, kind, **asked)
    study = question.checked()
    if not quiet:
        screen.caution([study])
    with ProgressReporter(quiet, "points") as progress:
        question, answer = search(question, folder, jobs or cores(), progress)
    if as_json:
        screen.print_json(jsonable_answer(question, answer))
    else:
        screen.print_lines(list_answer(question, answer, folder, units))
    failed = any(point.failed for point in answer.points)
    return screen.SOME_FAILED if failed else screen.DONE
