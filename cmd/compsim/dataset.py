"""`compsim dataset`: labelled windows of a sensor's records, to learn diagnosis from."""

import os

import click

from compsim import options, screen
from compsim.progress import ProgressReporter


@click.command()
@click.argument("study", metavar="STUDY")
@options.results
@options.output("Write the data set into this folder.", required=True)
@click.option("--revolutions", default=5, help="Cut windows of so many whole revolutions.")
@click.option(
    "--hop", type=int, show_default="as many", help="Begin a window after so many revolutions."
)
@options.noise("Add white noise of this rms, m/s2, with features at each level.")
@click.option("--test-share", default=0.3, help="Set this share of the machines aside for tests.")
@click.option("--seed", type=options.NUMBER, default=1, help="Draw noise and split by this seed.")
@click.option("--no-signals", is_flag=True, help="Write features and labels, without samples.")
@options.quiet
def dataset(study, folder, output, no_signals, quiet, **how) -> int:
    """Make labelled windows of a study's sensor records.

    \b
    compsim dataset diagnosis -o windows --noise 0,0.5

    The windows have features, and are split by machine. Writes windows.nc, features.parquet and
    README.md, a card of what was simulated and what is not in it, and replaces those of an earlier
    data set. The study needs a body and a sensor.
    """
    from compressor.studies.diagnosis.data_set import DataSetOptions
    from compressor.studies.diagnosis.record_files import build_data_set
    from compressor.studies.diagnosis.words import list_windows

    options = DataSetOptions(signals=not no_signals, **how)
    with ProgressReporter(quiet) as progress:
        data_set, written = build_data_set(folder, study, output, options, progress)
    screen.print_text(*list_windows(data_set))
    for name, count in written.files.items():
        screen.print_text(f"{os.path.join(output, name)}  {screen.size(count)}")
    if written.remark:
        screen.say_wrapped(written.remark)
    if not quiet:
        card = os.path.join(output, "README.md")
        screen.say(f"next: read {card}, then open windows.nc in xarray")
    return screen.DONE
