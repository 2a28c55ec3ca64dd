"""`compsim export`: results as netCDF or CSV, and sensors' records, for other programs."""

import dataclasses
import itertools
import json
import os
from typing import TYPE_CHECKING

import click

from compressor.digits import plural
from compsim import options, screen
from compsim.progress import ProgressReporter

if TYPE_CHECKING:
    from compressor.store import Exported
    from compressor.units import Units


@click.command()
@click.argument("names", nargs=-1, metavar="[STUDY|JOB]...")
@options.results
@click.option("-o", "--output", required=True, metavar="FILE|FOLDER", type=options.FILE,
              help="Write this file: .nc or .csv, or .wav, .mat or .uff for a record; or into a "
              "folder.")  # fmt: skip
@click.option("--format", "form", type=click.Choice(["netcdf", "csv", "wav", "mat", "uff"]),
              help="Write the files of a folder in this format; netcdf by default.")  # fmt: skip
@click.option("--series", is_flag=True, help="Also write the time series of the studies' jobs.")
@click.option("--force", is_flag=True, help="Replace files that exist.")
@options.units("SI")
@click.option("--json", "as_json", is_flag=True, help="Print the list of the files as JSON.")
@options.quiet
def export(
    names: tuple[str, ...],
    folder: str,
    output: str,
    form: str | None,
    series: bool,
    force: bool,
    units: "Units | None",
    as_json: bool,
    quiet: bool,
) -> int:
    """Write results as files that other programs read.

    \b
    compsim export wear -o wear.csv
    compsim export 3fa9c2 -o job.wav

    A STUDY becomes one table of its jobs, failed and missing ones included; a JOB, named by its key
    or the beginning of it, a table of samples, in CSV with its sensor's record as identify reads
    it. As .wav, .mat or .uff a job becomes that record alone: acceleration in m/s2 and a tacho;
    a .wav has 32-bit floats; 1.0 is 1 m/s2. Without either, all studies. Several studies
    go into one FILE together, or into a FOLDER with a file each: a name without suffix, or with a
    slash at its end. --units is of CSV alone: other files are in SI, as are records.
    """
    from compressor.store import ExportOptions, writable_folder
    from compressor.store import export as write

    writable_folder(os.path.dirname(output) or os.curdir, make=False)
    how = ExportOptions(form, series, force, units or "si")
    with ProgressReporter(quiet, "files") as progress:
        found, damaged = write(folder, names, output, how, progress)
    if as_json:
        screen.print_text(json.dumps([dataclasses.asdict(one) for one in found], indent=1))
    else:
        for line in list_exported(found, output):
            screen.print_text(line)
    for damage in damaged:
        screen.say(f"{damage}: left out")
    return screen.STORE if damaged else screen.DONE


def list_exported(found: "list[Exported]", output: str) -> list[str]:
    """Return what was written, a line a file; files in a folder of the output share one."""
    lines = []
    for (place, _), group in itertools.groupby(found, key=lambda one: _line_of(one, output)):
        files = [*group]
        rows, count = sum(one.rows for one in files), sum(one.bytes for one in files)
        what = plural(rows, "job" if files[0].kind == "metrics" else "sample")
        if len(files) > 1 or place != files[0].path:
            what = f"{plural(len(files), 'job')}, {what}"
        lines.append(f"{place}  {what}, {screen.size(count)}")
    return lines


def _line_of(one: "Exported", output: str) -> tuple[str, str]:
    """Return the path in the line of a file, and the file's kind."""
    above = os.path.dirname(one.path)
    return (one.path if above in ("", os.path.normpath(output)) or one.path == output else above,
            one.kind)  # fmt: skip
