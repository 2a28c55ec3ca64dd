"""`compsim export`: results as netCDF or CSV, and sensors' records, for other programs."""

import os

import click

from compressor.digits import plural
from compsim import options, screen


@click.command()
@click.argument("names", nargs=-1, metavar="[STUDY]...|JOB")
@options.results
@options.output(
    "Write this file: .nc or .csv, or .wav or .mat for a record.",
    required=True,
    metavar="FILE",
    type=options.FILE,
)
@click.option("--force", is_flag=True, help="Replace a file that exists.")
@options.units("SI")
def export(names, folder, output, force, units) -> int:
    """Write results as a file that other programs read.

    \b
    compsim export wear -o wear.csv
    compsim export 3fa9c2 -o job.wav

    A STUDY becomes a table of its jobs, failed and missing ones included; several, and all
    without a name, become one table. A JOB, named by the beginning of its key, becomes a table of
    samples, in CSV with its sensor's record; as .wav or .mat it becomes that record alone:
    acceleration in m/s2 and a tacho (a .wav has 32-bit floats; 1.0 is 1 m/s2). --units is of CSV
    alone: other files and records are in SI.
    """
    from compressor.store import export as write
    from compressor.store import writable_folder

    writable_folder(os.path.dirname(output) or os.curdir, make=False)
    rows, what = write(folder, names, output, force, units or "si")
    size = screen.size(os.path.getsize(output))
    screen.print_text(f"{output}  {plural(rows, what)}, {size}")
    if str(output).endswith(".wav"):
        screen.say("a .wav names no channels: read it by --channel 1 --unit m/s2 --tacho 2")
    return screen.DONE
