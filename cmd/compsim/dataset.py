"""`compsim dataset`: labelled windows of a sensor's records, to learn diagnosis from."""

import json
import os

import click

from compsim import options, screen
from compsim.progress import ProgressReporter

SHARE = click.FloatRange(0.0, 1.0, min_open=True, max_open=True)


@click.command()
@click.argument("study", metavar="STUDY")
@options.results
@options.output("Write the data set into this folder.", required=True)
@options.revolutions
@click.option(
    "--hop", type=options.COUNT, show_default="as many", help="Begin a window after so many."
)
@options.noise("Add white noise of this rms, m/s2, with features at each level.")
@click.option(
    "--test-share", type=SHARE, default=0.3, help="Set this share of the machines aside for tests."
)
@click.option("--seed", type=options.NUMBER, default=1, help="Draw noise and split by this seed.")
@click.option("--no-signals", is_flag=True, help="Write features and labels, without samples.")
@options.quiet
def dataset(study, folder, output, hop, no_signals, quiet, **how) -> int:
    """Make labelled windows of a study's sensor records.

    \b
    compsim dataset diagnosis -o windows --noise 0,0.5

    The windows have features, and are split by machine. Writes windows.nc, features.parquet and
    README.md, a card of what was simulated and what is not in it, and replaces those of an earlier
    data set. The study needs a body and a sensor.
    """
    from compressor.digits import align_columns
    from compressor.store import writable_folder
    from compressor.studies.diagnosis import dataset as data_sets

    data_sets.check_folder(output)
    writable_folder(output, make=False)
    with ProgressReporter(quiet) as progress:
        found = data_sets.make_data_set(
            folder, study, hop=hop or 0, signals=not no_signals, progress=progress, **how
        )
    paths = data_sets.write_data_set(output, found)
    head = ("joint", "split", "machines", "windows")
    rows = [
        (joint, split, f"{m:,}", f"{n:,}") for joint, split, m, n in data_sets.count_windows(found)
    ]
    screen.print_text(*align_columns([head, *rows], "<<>>"))
    for reason, count in json.loads(found.attrs["left_out"]).items():
        screen.print_text(f"left out: {count:,} {reason}")
    for path in paths:
        screen.print_text(f"{os.path.join(output, path.name)}  {screen.size(path.stat().st_size)}")
    for text in data_sets.list_warnings(found):
        screen.say_wrapped(f"warning: {text}")
    if len(paths) < 3:
        screen.say_wrapped(data_sets.NO_PARQUET)
    if not quiet:
        card = os.path.join(output, data_sets.CARD_FILE)
        screen.say(f"next: read {card}, then open {data_sets.WINDOWS} in xarray")
    return screen.DONE
