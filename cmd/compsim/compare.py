"""`compsim compare`: a measured record beside simulated ones."""

import dataclasses
import json
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from compsim.options import FILE, json_option, quiet_option, results_option
from compsim.progress import ProgressReporter
from compsim.records import record_options
from compsim.screen import DONE, jsonable, plural, print_text, say

if TYPE_CHECKING:
    from compressor.report import Drawing
    from compressor.studies.compare.comparison import Compared, Comparison
    from compressor.studies.compare.likeness import Measured

MOST = 20  # jobs that are listed
KINDS = (".png", ".svg", ".csv")
COLUMNS = ("difference, dB", "correlation", "envelope", "rms ratio", "distance, dB")


@click.command()
@click.argument("record", type=FILE)
@click.argument("names", nargs=-1, required=True, metavar="JOB|STUDY...")
@results_option
@record_options
@click.option("-o", "--output", metavar="FILE", type=FILE,
              help="Draw this figure, .png or .svg, or write its numbers as .csv.")  # fmt: skip
@json_option
@quiet_option
def compare(
    record: str,
    names: tuple[str, ...],
    folder: str,
    hints: dict[str, Any],
    output: str | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Compare a record with the sensor's records of stored jobs.

    \b
    compsim compare record.csv machines -o beside.png
    compsim compare record.csv 3fa9c2 81e6f8

    RECORD is a file, as of compsim identify, or a job; after it come jobs, by the beginnings of
    their keys, and studies, which stand for all their jobs. The most alike job comes first: the one
    of the least difference.

    \b
    difference   of all numbers together, without white noise: orders of
                 all revolutions and of the mean one, both correlations
                 where they fit best within 5 degrees, and the level
    correlation  of the mean revolutions: 1 is the same shape at the same
                 crank angles, whatever the size; -1 the opposite sign
    envelope     correlation of the envelopes above order 12: 1 is the
                 same bursts at the same angles, whatever rings in them
    rms ratio    of the record over the job: 1 is as strong
    distance     of the spectra in third octaves of orders, scaled to one
                 level, in dB: 0 is the same, 3 a factor of two in the
                 power of a band, 60 at most

    A number's error, behind +-, is the standard error by the record's revolutions; it
    needs at least three. What does not fit (speed, sampling rate, length, unit, crank angle) is
    said below the table; a file does not say where its sensor was.
    """
    kind = os.path.splitext(output or "")[1]
    if output and kind not in KINDS:
        raise click.UsageError(f"-o {output}: end the name in {', '.join(KINDS)}")
    from compressor.store import writable_folder
    from compressor.studies.compare.comparison import compare_record

    if output:
        writable_folder(os.path.dirname(output) or os.curdir, make=False)
    with ProgressReporter(quiet) as progress:
        found = compare_record(record, names, folder, hints, progress)
    if as_json:
        print_text(json.dumps(jsonable_comparison(found), indent=1))
    else:
        for line in list_comparison(found):
            print_text(line)
    if output:
        from compressor.studies.compare.figures import caption, draw_comparison

        write_figure(draw_comparison(found), output, kind)
        say(output) if as_json else print_text(f"{output}\n  {caption(found)}")
    return DONE


def write_figure(drawing: "Drawing", output: str, kind: str) -> None:
    """Write a figure as a picture, or its numbers as CSV."""
    from pathlib import Path

    from compressor.report import as_csv, render
    from compressor.store import publish

    data = as_csv(drawing).encode() if kind == ".csv" else render(drawing, kind[1:])
    publish(Path(output), data)


def list_comparison(found: "Comparison") -> Iterator[str]:
    """Yield the record, the table of jobs, and what does not fit."""
    mine = found.turned
    rms = (found.curves.spectrum**2).sum() ** 0.5
    yield (f"{found.name}: {plural(len(mine.spectra), 'revolution')} at {mine.rpm:.4g} rpm, "
           f"{mine.rate:.6g} Hz, {rms:.4g} m/s2 rms up to order {found.orders}")  # fmt: skip
    yield from (f"read: {text}" for text in found.remarks)
    width = max(len("what it is"), *(len(job.what) for job in found.jobs[:MOST]))
    yield f"{'job':<12}{'what it is':<{width}}" + "".join(f"{one:>18}" for one in COLUMNS)
    for job in found.jobs[:MOST]:
        yield job_line(job, width)
    if len(found.jobs) > MOST:
        yield f"and {len(found.jobs) - MOST} less alike, which --json lists"
    if found.left_out:
        yield f"left out: {plural(found.left_out)} without a sensor's record of two revolutions"
    if found.inside == found.inside:
        yield (f"envelope: inside the range of the {len(found.jobs)} jobs at {found.inside:.0%} of "
               "crank angles")  # fmt: skip
    for text in found.misfits:
        yield f"does not fit: {text}"


def job_line(job: "Compared", width: int) -> str:
    """Return a job's joint, clearance and swept values, padded to a width, and its numbers."""
    like = job.likeness
    numbers = (
        like.difference, like.correlation, like.envelope, like.rms_ratio, like.spectral_distance,
    )  # fmt: skip
    columns = "".join(f"{number(one):>18}" for one in numbers)
    return f"{job.key[:10]:<12}{job.what:<{width}}{columns}"


def number(found: "Measured") -> str:
    """Return a number with its standard error, where it has one."""
    error = f" +- {found.error:.2g}" if found.error == found.error else ""
    return f"{found.value:.3f}{error}"


def jsonable_comparison(found: "Comparison") -> dict[str, Any]:
    """Return a comparison as JSON says it."""
    mine = found.turned
    return jsonable({
        "record": found.name, "revolutions": len(mine.spectra), "rpm": mine.rpm,
        "rate_Hz": mine.rate, "orders": found.orders, "left_out": found.left_out,
        "remarks": list(found.remarks),
        "envelope_inside": found.inside, "misfits": list(found.misfits),
        "peak_m_per_s2": found.curves.peak.tolist(), "rms_m_per_s2": found.curves.rms.tolist(),
        "jobs": [
            {
                "key": job.key, "what": job.what, "rpm": job.rpm, "orders": job.orders,
                "sensor": job.sensor,
                **dataclasses.asdict(job.likeness),
                "peak_m_per_s2": job.curves.peak.tolist(),
                "rms_m_per_s2": job.curves.rms.tolist(),
            }
            for job in found.jobs
        ],
    })  # fmt: skip
