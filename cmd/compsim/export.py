"""`compsim export`: results as CSV, for other programs."""

import os

import click

from compressor.digits import plural
from compsim import options, screen


@click.command()
@click.argument("names", nargs=-1, metavar="[STUDY]...|JOB")
@options.results
@options.output("Write this file, a .csv.", required=True, metavar="FILE", type=options.FILE)
@click.option("--force", is_flag=True, help="Replace a file that exists.")
def export(names, folder, output, force) -> int:
    """Write results as a CSV file, which other programs read.

    \b
    compsim export wear -o wear.csv
    compsim export 3fa9c2 -o job.csv

    A STUDY becomes a table of its jobs, failed and missing ones included; several, and all
    without a name, become one table. A JOB, named by the beginning of its key, becomes a table of
    samples, with its sensor's record beside. They begin with the start-up, which metrics leave out.
    Numbers are in SI.
    """
    from compressor.store import export as write
    from compressor.store import writable_folder

    writable_folder(os.path.dirname(output) or os.curdir, make=False)
    rows, what = write(folder, names, output, force)
    size = screen.size(os.path.getsize(output))
    screen.print_text(f"{output}  {plural(rows, what)}, {size}")
    return screen.DONE
