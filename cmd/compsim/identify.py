"""`compsim identify`: the joint and clearance that explain a sensor's record."""

from importlib.util import find_spec

import click

from compsim import options, screen
from compsim.progress import ProgressReporter


@click.command()
@click.argument("record", metavar="RECORD|JOB", type=options.FILE)
@options.results
@click.option("--study", required=True, help="Explain the record by the jobs of this stored study.")
@options.record
@options.as_json
@options.quiet
def identify(record, study, folder, hints, as_json, quiet) -> int:
    """Name the joint and clearance that explain a sensor's record.

    \b
    compsim identify record.csv --study machines
    compsim identify record.wav --study machines --channel 1 --unit g --tacho 2

    The record is a file, .csv, .wav or .mat. The simplest is a CSV file with the columns
    time_s, acceleration_m_per_s2 and tacho, a signal that rises at each top dead centre; or without
    tacho, with --rpm and --tdc. Text as analysers write it is read, too, with decimal commas and
    titles such as Acc [g]. What a file does not say, options do. Or it is a stored job with a
    sensor's record, named by the beginning of its key; it is then left out of the study. Joints are
    ranked by probability, where the study's shares of them are the prior, and each clearance has a
    90 % interval. Where no joint of the study fits, that is said first.
    Needs scikit-learn: pip install 'compsim[learn]'.

    Exit code 0 also where nothing fits: that is an answer.
    """
    from compressor.store import find_record

    if find_spec("sklearn") is None:
        raise click.UsageError("this needs scikit-learn: pip install 'compsim[learn]'")
    from compressor.studies.diagnosis.identify import explain_record, jsonable_answer, list_joints

    key, found = find_record(record, folder, hints)
    with ProgressReporter(quiet) as progress:
        fitted, answer = explain_record(found, folder, study, key, progress)
    if as_json:
        screen.print_json(jsonable_answer(record, fitted, answer))
        return screen.DONE
    turns = len(found.tacho) - 1
    rpm = 60.0 * turns / (found.tacho[-1] - found.tacho[0])
    screen.print_text(f"{record}: {turns} revolutions at {rpm:.4g} rpm, {found.rate:.6g} Hz")
    screen.print_text(*(f"read: {text}" for text in found.remarks))
    screen.print_text(*list_joints(fitted, answer))
    return screen.DONE
