"""`compsim dataset`: labelled windows of a sensor's records, to learn diagnosis from."""

import dataclasses
import json
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from compsim.options import FILE, FOLDER, json_option, quiet_option, results_option
from compsim.progress import ProgressReporter
from compsim.records import read_levels, record_options
from compsim.screen import DONE, one_thread_each, plural, print_text, say, say_wrapped, size

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

    from compressor.studies.diagnosis.identify import Identification, Identifier


@click.command()
@click.argument("study", metavar="STUDY")
@results_option
@click.option("-o", "--output", required=True, metavar="FOLDER", type=FOLDER,
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
@quiet_option
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

    options = DataSetOptions(revolutions, hop, noise, test_share, seed, not no_signals)
    with ProgressReporter(quiet) as progress:
        data_set, written = build_data_set(folder, study, output, options, progress)
    for line in describe_dataset(data_set):
        print_text(line)
    for name, count in written.files.items():
        print_text(f"{os.path.join(output, name)}  {size(count)}")
    if written.remark:
        say_wrapped(written.remark)
    if not quiet:
        say(f"next: read {os.path.join(output, 'README.md')}, then open windows.nc in xarray")
    return DONE


def describe_dataset(data_set: "xr.Dataset") -> list[str]:
    """Return the numbers of windows and machines by joint and split, and what was left out."""
    from compressor.studies.diagnosis.data_card import counts

    rows = counts(data_set)
    width = max(len(joint) for joint, *_ in rows)
    lines = [f"{'joint':<{width}}  {'split':<5}  {'machines':>8}  {'windows':>8}"]
    lines += [f"{j:<{width}}  {s:<5}  {m:>8,}  {w:>8,}" for j, s, m, w in rows]
    alone = [joint for joint, split, machines, _ in rows if split == "test" and not machines]
    if alone:
        lines.append(f"too few machines to test on: {', '.join(alone)}")
    for reason, count in json.loads(data_set.attrs["left_out"]).items():
        lines.append(f"left out: {count:,} {reason}")
    return lines


@click.command()
@click.argument("record", metavar="RECORD|JOB", type=FILE)
@results_option
@click.option("--study", required=True,
              help="Explain the record by the jobs of this stored study.")  # fmt: skip
@record_options
@json_option
@quiet_option
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
    one_thread_each()  # before numpy loads
    from compressor.store import find_record
    from compressor.studies.diagnosis.identify import explain_record

    key, found = find_record(record, folder, hints)
    with ProgressReporter(quiet) as progress:
        fitted, answer = explain_record(found, folder, study, key, progress)
    if as_json:
        print_text(json.dumps(jsonable_record(record, fitted, answer), indent=1))
        return DONE
    pulses = found.tacho
    mean_rpm = 60.0 * (len(pulses) - 1) / (pulses[-1] - pulses[0])
    rate = found.rate
    print_text(f"{record}: {len(pulses) - 1} revolutions at {mean_rpm:.4g} rpm, {rate:.6g} Hz")
    for text in found.remarks:
        print_text(f"read: {text}")
    for line in (*verdict(answer), *ranking(answer), *grounds(fitted, answer, folder)):
        print_text(line)
    return DONE


def verdict(answer: "Identification") -> Iterator[str]:
    """Yield that nothing fits, and what may be done; nothing where something does."""
    if answer.fits:
        return
    yield (f"NOTHING IN THIS STUDY FITS: {answer.p_value:.2%} of its own jobs are as strange "
           "(see the distances below)")  # fmt: skip
    odd = ", ".join(f"{name} ({value:+.1f} sd)" for name, value in answer.odd.items())
    yield f"farthest from what other features foretell: {odd}"
    yield ("what to do: first compare noise with the study's sensor.noise_m_per_s2, and "
           "the unit (g read as m/s2 is a factor of 9.8); then check tacho and sensor; then widen "
           "what the study varies (noise, masses, speed, loads, friction, foundation), and run it "
           "again")  # fmt: skip
    yield "the ranking below is what is least far, and is not to be trusted"


def ranking(answer: "Identification") -> Iterator[str]:
    """Yield the table of joints."""
    yield f"{'rank':<5} {'joint':<10} {'probability':>11}  clearance, mm: median [90 % interval]"
    for rank, one in enumerate(answer.candidates, 1):
        yield f"{rank:<5} {one.joint:<10} {one.probability:>11.3f}  {ends(one.clearances)}".rstrip()


def ends(clearances: dict[str, Any]) -> str:
    """Return the clearances with their intervals, by end."""
    return "; ".join(
        f"{side} {found.median:.3f} [{found.low:.3f}, {found.high:.3f}]"
        for side, found in clearances.items()
    )


def grounds(fitted: "Identifier", answer: "Identification", folder: str) -> Iterator[str]:
    """Yield the jobs and distances on which an answer rests, and its cautions."""
    library = fitted.library
    yield (f"rests on {len(library.keys)} of {plural(library.jobs)} of study {library.study} in "
           f"{folder}; the nearest one is {answer.nearest}")  # fmt: skip
    yield (f"distance from the nearest jobs {answer.near.record:.3g} (usual "
           f"{answer.near.usual:.3g}), of features from what others foretell "
           f"{answer.apart.record:.3g} (usual {answer.apart.usual:.3g}); "
           f"as strange are {answer.p_value:.0%} of its own jobs")  # fmt: skip
    shares = [value for ends in fitted.covered.values() for value in ends.values()]
    tail = f", clearance within its interval in {sum(shares) / len(shares):.0%}" if shares else ""
    yield f"on these jobs, each left out in turn: joint right in {fitted.right:.0%}{tail}"
    left = [
        joint for joint in ("none", "big_end", "small_end", "both") if joint not in fitted.joints
    ]
    if left:
        yield f"not identified, since the study has too few jobs of it: {', '.join(left)}"
    if fitted.equal and "both" in fitted.joints:
        yield "the study has equal clearances at both joints, so it covers equal ones only"
    yield "caution: beside the joints, the study varies these alone; all else, such as the laws of"
    yield "contact and friction, the foundation, the sensor and its noise, is as in its case file:"
    for key, values in library.swept.items():
        if key != "sensor.seed":
            yield f"  {key:<28} {span(values)}"


def span(values: "np.ndarray") -> str:
    """Return the reach of a swept key's values."""
    if values.dtype.kind in "iuf":
        return f"{values.min():.4g} to {values.max():.4g}"
    return ", ".join(sorted({str(value) for value in values.tolist()}))


def jsonable_record(record: str, fitted: "Identifier", answer: "Identification") -> dict[str, Any]:
    """Return an answer as JSON says it."""
    library = fitted.library
    return {
        "record": record, "study": library.study, "jobs": len(library.keys),
        "jobs_of_study": library.jobs, **dataclasses.asdict(answer),
        "study_joint_right": fitted.right, "study_intervals_hold": fitted.covered,
        "equal_clearances": fitted.equal, "joints": list(fitted.joints),
    }  # fmt: skip
