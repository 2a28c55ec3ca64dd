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
@click.option("--log", is_flag=True, help="Space points evenly in the logarithm.")
@options.units("si")
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
        --first 'peak_contact_force.small_end > 166 kN' --units plant

    VALUE of --first is in SI, or has a unit. CONFIG must give one case with the key set. The answer
    of --first is an interval: the comparison is false at its lower end and true at its upper end.
    The answer of --greatest and --least is the best point looked at. Each point has a row: yes or
    no, or how it compares with the best.
    Points that error bars cannot decide, or whose jobs failed, are open, inside the interval. Only
    the first change is narrowed down; the scan misses two changes between two of its points.
    For a chaotic motion the mean of a peak over revolutions counts.

    Each point is a stored job of the study CONFIG-find-KEY; another question over this key takes
    the study's place, and the jobs stay stored. --json has all numbers in SI. Exit
    code 3 if the job of any point failed.
    """
    options.check_json_units(as_json, units)
    given = [(kind, text) for kind in KINDS if (text := asked.pop(kind)) is not None]
    if len(given) != 1:
        raise click.UsageError("give one of --first, --greatest and --least")
    from compressor.studies.find import Question, comparison, goal_of, jsonable_answer, list_answer
    from compressor.studies.find import find as search
    from compressor.studies.frame import read_range
    from compressor.sweep import cores

    ((kind, goal),) = given
    sought = comparison(goal) if kind == "first" else goal_of(goal, kind)
    span = read_range("--over", over, log=asked.pop("log"))
    question = Question(config, span, sought, **asked)
    study = question.load_first()
    if not quiet:
        screen.caution([study])
    with ProgressReporter(quiet, "points") as progress:
        answer = search(question, folder, jobs or cores(), progress)
    if as_json:
        screen.print_json(jsonable_answer(question, answer))
    else:
        screen.print_lines(list_answer(question, answer, folder, units or "si"))
    failed = any(point.failed for point in answer.points)
    return screen.SOME_FAILED if failed else screen.DONE
