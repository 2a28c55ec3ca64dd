"""`compsim dataset`: labelled windows of a sensor's records, to learn diagnosis from."""

import json
from pathlib import Path

import click

from compsim import options, screen
from compsim.progress import ProgressReporter


@click.command()
@click.argument("study", metavar="STUDY")
@options.results
@options.output("Write windows.nc into this folder.", required=True)
@options.revolutions
@options.quiet
def dataset(study, folder, output, revolutions, quiet) -> int:
    """Make labelled windows of a study's sensor records.

    \b
    compsim dataset diagnosis -o windows

    The windows have samples, features and labels, and are split by machine. Writes windows.nc,
    which xarray opens; its attributes say what was simulated, and `comment` what is not in it. The
    study needs a body and a sensor.
    """
    from compressor.digits import align_columns
    from compressor.store import writable_folder, write_dataset
    from compressor.studies.diagnosis.dataset import count_windows, list_warnings, make_data_set

    writable_folder(output, make=False)
    with ProgressReporter(quiet) as progress:
        found = make_data_set(folder, study, revolutions, progress)
    path = write_dataset(Path(output, "windows.nc"), found)
    head = ("joint", "split", "machines", "windows")
    rows = [(joint, split, f"{m:,}", f"{n:,}") for joint, split, m, n in count_windows(found)]
    screen.print_text(*align_columns([head, *rows], "<<>>"))
    for reason, count in json.loads(found.attrs["left_out"]).items():
        screen.print_text(f"left out: {count:,} {reason}")
    screen.print_text(f"{path}  {screen.size(path.stat().st_size)}")
    for text in list_warnings(found):
        screen.say_wrapped(f"warning: {text}")
    return screen.DONE
