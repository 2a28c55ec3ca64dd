"""`compsim tradeoff`: speed against accuracy, and what features of the model do."""

from pathlib import Path

import click

from compsim import options, screen
from compsim.progress import ProgressReporter


@click.command()
@click.argument("configs", nargs=-1, metavar="[CONFIG...]", type=options.FILE)
@options.output("Write the study into this folder.", default="tradeoff")
@click.option(
    "--repeats", type=options.COUNT, default=3, help="Time all points so often; the best counts."
)
@click.option(
    "--budget",
    type=click.FloatRange(min=0, min_open=True),
    default=4.0,
    help="Allow one point so many seconds.",
)
@options.set_keys
@options.quiet
def tradeoff(configs, output, repeats, budget, overrides, quiet) -> int:
    """Measure speed against accuracy, and what model features do.

    \b
    compsim tradeoff machine.yaml --repeats 1 --budget 1

    Every job of the case files, or the paper's three faults at 0.2 mm where there is none (some
    five minutes), by every method at every tolerance. Writes tradeoff.nc and modelling.nc, which
    xarray and h5py read, and the figure tradeoff.png and tradeoff.svg; the fastest methods and
    the effects of the features go to stdout.
    """
    if overrides and not configs:
        raise click.UsageError("--set changes case files: name one, such as configs/both.yaml")
    from compressor.store import writable_folder, write_dataset
    from compressor.studies.tradeoff import work_precision as methods
    from compressor.studies.tradeoff.figures import write_methods
    from compressor.studies.tradeoff.model_choices import trade as feature_trade
    from compressor.studies.tradeoff.words import list_fastest, list_trade

    cases = methods.cases_of_files(configs, overrides) if configs else methods.default_cases()
    folder = Path(output)
    writable_folder(folder)  # minutes before it is needed
    with ProgressReporter(quiet, "points") as progress:
        study = methods.work_precision(cases, repeats=repeats, budget=budget, progress=progress)
        write_methods(folder, study)
    with ProgressReporter(quiet, "changes of the model") as progress:
        trade = feature_trade(cases, repeats=repeats, progress=progress)
    write_dataset(folder / "modelling.nc", trade)
    screen.print_lines([*list_fastest(study), "", *list_trade(trade)])
    if not quiet:
        for name in ("tradeoff.png", "tradeoff.nc", "modelling.nc"):
            screen.say(str(folder / name))
        screen.say("next: compsim explain --models CONFIG does the same for a case, in seconds")
    return screen.DONE
