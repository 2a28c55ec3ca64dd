"""`compsim export`: results as netCDF or CSV, and sensors' records, for other programs."""

import os

import click

from compressor.digits import plural
from compsim import options, screen
from compsim.progress import ProgressReporter


@click.command()
@click.argument("names", nargs=-1, metavar="[STUDY|JOB]...")
@options.results
@options.output(
    "Write this file: .nc or .csv, or .wav or .mat for a record; or into a folder.",
    required=True,
    metavar="FILE|FOLDER",
    type=options.FILE,
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["netcdf", "csv", "wav", "mat"]),
    help="Write the files of a folder in this format; netcdf by default.",
)
@click.option("--series", is_flag=True, help="Also write the time series of the studies' jobs.")
@click.option("--force", is_flag=True, help="Replace files that exist.")
@options.units("SI")
@options.quiet
def export(names, folder, output, form, series, force, units, quiet) -> int:
    """Write results as files that other programs read.

    \b
    compsim export wear -o wear.csv
    compsim export 3fa9c2 -o job.wav

    A STUDY becomes a table of its jobs, failed and missing ones included. A JOB, named by the
    beginning of its key, becomes a table of samples, in CSV with its sensor's record; as .wav
    or .mat it becomes that record alone: acceleration in m/s2 and a tacho (a .wav has 32-bit
    floats; 1.0 is 1 m/s2). Without either, all studies are written. Several studies go into one
    FILE together, or into a FOLDER with a file each: a name without suffix, or with a slash at its
    end. --units is of CSV alone: other files and records are in SI.
    """
    from compressor.store import ExportOptions, writable_folder
    from compressor.store import export as write

    writable_folder(os.path.dirname(output) or os.curdir, make=False)
    how = ExportOptions(form, series, force, units or "si")
    with ProgressReporter(quiet, "files") as progress:
        found, damaged = write(folder, names, output, how, progress)
    for one in found:
        rows = plural(one.rows, "job" if one.kind == "metrics" else "sample")
        screen.print_text(f"{one.path}  {rows}, {screen.size(one.bytes)}")
    for damage in damaged:
        screen.say(f"{damage}: left out")
    return screen.STORE if damaged else screen.DONE
