"""`compsim compare`: a measured record beside simulated ones."""

import os
from pathlib import Path

import click

from compsim import options, screen
from compsim.progress import ProgressReporter

KINDS = (".png", ".csv")


@click.command()
@click.argument("record", type=options.FILE)
@click.argument("names", nargs=-1, required=True, metavar="JOB|STUDY...")
@options.results
@options.record
@options.output("Draw this figure, .png, or write its numbers as .csv.", type=options.FILE)
@options.as_json
@options.quiet
def compare(record, names, folder, hints, output, as_json, quiet) -> int:
    """Compare a record with the sensor's records of stored jobs.

    \b
    compsim compare record.csv machines -o beside.png
    compsim compare record.csv 3fa9c2 81e6f8

    RECORD is a file, as of compsim identify, or a job; after it come jobs, by the beginnings of
    their keys, and studies, which stand for all their jobs. The most alike job comes first: the one
    of the least difference.

    \b
    difference   of all numbers together, in dB, without white noise
    correlation  of the mean revolutions: 1 is the same shape at the same
                 crank angles, whatever the size; -1 the opposite sign
    envelope     correlation of the envelopes above order 12: 1 is the
                 same bursts at the same angles
    rms ratio    of the record over the job: 1 is as strong

    A number's error, behind +-, is the standard error by the record's revolutions; it needs at
    least three. A unit or a speed perhaps mistaken in a file is named. A file does not say where
    its sensor was; --json has the jobs' places.
    """
    if output and Path(output).suffix not in KINDS:
        raise click.UsageError(f"-o {output}: end the name in {', '.join(KINDS)}")
    from compressor.report import write_figure
    from compressor.store import writable_folder
    from compressor.studies.compare import (
        CAPTION,
        compare_record,
        draw_comparison,
        jsonable_comparison,
        list_comparison,
    )

    if output:
        writable_folder(os.path.dirname(output) or os.curdir, make=False)
    with ProgressReporter(quiet) as progress:
        found = compare_record(record, names, folder, hints, progress)
    if as_json:
        screen.print_json(jsonable_comparison(found))
    else:
        screen.print_text(*list_comparison(found))
    if output:
        write_figure(Path(output), draw_comparison(found))
        screen.say(output) if as_json else screen.print_text(output, f"  {CAPTION}")
    return screen.DONE
