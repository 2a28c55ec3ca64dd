"""`compsim dataset`: labelled windows of a sensor's records, to learn diagnosis from."""

import json
import os
from typing import Any

import click

from compsim import options, screen
from compsim.progress import ProgressReporter
from compsim.records import read_levels, record_options


@click.command()
@click.argument("study", metavar="STUDY")
@options.results
@click.option("-o", "--output", required=True, metavar="FOLDER", type=options.FOLDER,
              help="Write the data set into this folder.")  # fmt: skip
@click.option("--revolutions", type=click.IntRange(min=2), default=5, show_default=True,
              help="Cut windows of so many whole revolutions.")  # fmt: skip
@click.option("--hop", type=click.IntRange(min=1), show_default="as many",
              help="Begin a window so many revolutions after the last one began.")  # fmt: skip
@click.option("--noise", default="0", show_default=True, callback=read_levels, metavar="RMS,...",
              help="Add white noise of this rms, m/s2, with features at each level.")  # fmt: skip
@click.option("--test-share", type=click.FloatRange(0, 1, min_open=True, max_open=True),
              default=0.3, show_default=True,
              help="Set this share of the machines aside for tests.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True,
              help="Draw noise and split by this seed.")  # fmt: skip
@click.option("--no-signals", is_flag=True, help="Write features and labels, without samples.")
@options.quiet
def dataset(
    study: str,
    folder: str,
    output: str,
    revolutions: int,
    hop: int | None,
    noise: tuple[float, ...],
    test_share: float,
    seed: int,
    no_signals: bool,
    quiet: bool,
) -> int:
    """Make labelled windows of a study's sensor records.

    \b
    compsim dataset diagnosis -o windows --noise 0,0.5

    The windows have features, and are split by machine. Writes windows.nc, features.parquet and
    README.md, a card of what was simulated and what is not in it, and replaces those of an earlier
    data set. The study needs a body and a sensor.
    """
    from compressor.studies.diagnosis.data_set import DataSetOptions
    from compressor.studies.diagnosis.record_files import build_data_set
    from compressor.studies.diagnosis.words import describe_dataset

    how = DataSetOptions(revolutions, hop, noise, test_share, seed, not no_signals)
    with ProgressReporter(quiet) as progress:
        data_set, written = build_data_set(folder, study, output, how, progress)
    for line in describe_dataset(data_set):
        screen.print_text(line)
    for name, count in written.files.items():
        screen.print_text(f"{os.path.join(output, name)}  {screen.size(count)}")
    if written.remark:
        screen.say_wrapped(written.remark)
    if not quiet:
        screen.say(
            f"next: read {os.path.join(output, 'README.md')}, then open windows.nc in xarray"
        )
    return screen.DONE


@click.command()
@click.argument("record", metavar="RECORD|JOB", type=options.FILE)
@options.results
@click.option("--study", required=True,
              help="Explain the record by the jobs of this stored study.")  # fmt: skip
@record_options
@options.as_json
@options.quiet
def identify(
    record: str,
    study: str,
    folder: str,
    hints: dict[str, Any],
    as_json: bool,
    quiet: bool,
) -> int:
    """Name the joint and clearance that explain a sensor's record.

    \b
    compsim identify record.csv --study machines
    compsim identify record.wav --study machines --channel 1 --unit g --tacho 2

    The record is a file, .csv, .wav, .mat or .uff. The simplest is a CSV file with the
    columns time_s, acceleration_m_per_s2 and tacho, a signal that rises at each top dead centre;
    or without tacho, with --rpm and --tdc. Text as analysers write it is read, too, with
    decimal commas and titles such as Acc [g]. What a file does not say, options do. Or it is a
    stored job with a sensor's record, named by its key or the beginning of it; it is then left out
    of the study. Joints are ranked by probability, where the study's shares of them are the prior,
    and each clearance has a 90 % interval. Where no joint of the study fits, that is said first.

    Exit code 0 also where nothing fits: that is an answer.
    """
    screen.one_thread_each()  # before numpy loads
    from compressor.store import find_record
    from compressor.studies.diagnosis.identify import explain_record
    from compressor.studies.diagnosis.words import grounds, jsonable_record, ranking, verdict

    key, found = find_record(record, folder, hints)
    with ProgressReporter(quiet) as progress:
        fitted, answer = explain_record(found, folder, study, key, progress)
    if as_json:
        screen.print_text(json.dumps(jsonable_record(record, fitted, answer), indent=1))
        return screen.DONE
    pulses = found.tacho
    mean_rpm = 60.0 * (len(pulses) - 1) / (pulses[-1] - pulses[0])
    rate = found.rate
    screen.print_text(
        f"{record}: {len(pulses) - 1} revolutions at {mean_rpm:.4g} rpm, {rate:.6g} Hz"
    )
    for text in found.remarks:
        screen.print_text(f"read: {text}")
    for line in (*verdict(answer), *ranking(answer), *grounds(fitted, answer, folder)):
        screen.print_text(line)
    return screen.DONE
